/* Random calls of FMI 2.0 and FMI 3.0 against the sources of an FMU, for the sanitizers to watch.
 *
 * A sequence is the life of a pair: an instance of FMI 2.0 and one of FMI 3.0 of the same spring, or of the same system
 * of bodies on mounts, which are asked for the same. What is judged: the status by the table of calls and modes (below)
 * and by what makes arguments wrong; that both answer alike, statuses, values and serialized states to the bit; that
 * what is refused changes nothing; that a stretch of calls repeated from the same state gives the same bits; and that
 * memory comes back. Where only one version has a call, the other one takes its state from the bytes.
 *
 * What a simulator can know of the FMU comes from fuzz_model.h, which program.py writes from modelDescription.xml;
 * nothing is taken from the headers of the FMU.
 */
#include "states.h"

#define OF_EXCHANGE2(call) (OF_SYSTEM ? NOT_CALLED : (int)(call))

/* ---- calls that lead from mode to mode --------------------------------------------------------------------------- */

static int change_mode(Trial *trial, int two, int three, Mode mode)
{
    int done = judged(trial, two, three);
    if (done && trial->twin->mode != UNKNOWN)
        trial->twin->mode = mode;
    return done;
}

/* FMI 2.0 takes the times by another call. */
static void enter_initialization(Trial *trial)
{
    Twin *twin = trial->twin;
    double start = chance(70) ? 0.0 : uniform(-1e3, 1e3), stop = start + uniform(0.0, OF_SYSTEM ? 1.0 : 10.0);
    int ends = chance(30), tolerance = below(2);
    start = careless() ? awkward() : start;
    stop = careless() ? awkward() : stop;
    must(trial, isfinite(start) && (!ends || stop >= start) ? YES : NO);
    int two = (int)fmi2SetupExperiment(trial->two, tolerance, awkward(), start, ends, stop);
    two = two == fmi2OK ? (int)fmi2EnterInitializationMode(trial->two) : two;
    int three = (int)fmi3EnterInitializationMode(trial->three, tolerance, awkward(), start, ends, stop);
    if (change_mode(trial, two, three, INITIALIZATION)) {
        twin->time = start;
        twin->stop_time = ends ? stop : INFINITY;
    }
}

#define MOVES(name, two, mode) \
    if (is(trial, #name)) \
        change_mode(trial, (two), (int)fmi3##name(trial->three), (mode));

/* Calls without arguments. */
static void change(Trial *trial)
{
    Twin *twin = trial->twin;
    fmi2Component two = trial->two;
    Mode after_terminate = twin->mode < EVENT ? twin->mode : TERMINATED;
    if (is(trial, "ExitInitializationMode"))
        must(trial, OF_SYSTEM ? UNSURE : twin->sound); /* bodies may find no rest */
    for (int i = 0; MODEL_STATES && twin->mode == INITIALIZATION && i < MODEL_VARIABLES; i++)
        if (described[i].causality == 's' && strstr(described[i].name, "omega") && is(trial, "ExitInitializationMode"))
            must(trial, fabs(twin->value[i]) <= 1.0 ? YES : NO);
    trial->looks = is(trial, "EvaluateDiscreteStates");
    MOVES(ExitInitializationMode, (int)fmi2ExitInitializationMode(two), twin->exchange ? EVENT : STEP)
    MOVES(Terminate, (int)fmi2Terminate(two), after_terminate)
    MOVES(EnterEventMode, OF_EXCHANGE2(fmi2EnterEventMode(two)), EVENT)
    MOVES(EnterContinuousTimeMode, OF_EXCHANGE2(fmi2EnterContinuousTimeMode(two)), CONTINUOUS_TIME)
    MOVES(EvaluateDiscreteStates, NOT_CALLED, twin->mode)
    if (is(trial, "Reset") && judged(trial, (int)fmi2Reset(two), (int)fmi3Reset(trial->three)))
        *twin = twin_of(twin->exchange);
}

static void new_discrete_states(Trial *trial)
{
    fmi2EventInfo *two = elements(1, sizeof *two);
    fmi3Boolean flags[5] = {1, 1, 1, 1, 1}, *first = two == NULL ? NULL : flags;
    double next = NAN;
    must(trial, two != NULL ? YES : NO);
    trial->looks = 1;
    if (judged(trial, OF_EXCHANGE2(fmi2NewDiscreteStates(trial->two, two)),
               (int)fmi3UpdateDiscreteStates(trial->three, first, &flags[1], &flags[2], &flags[3], &flags[4], &next)))
        CHECK(!two->newDiscreteStatesNeeded && !two->terminateSimulation && !two->nextEventTimeDefined &&
                  memcmp(flags, (fmi3Boolean[5]){0}, sizeof flags) == 0,
              "an event leads to another one");
}

static void completed_integrator_step(Trial *trial)
{
    fmi2Boolean *event = elements(1, sizeof *event), *stops = elements(1, sizeof *stops), kept_back = below(2);
    fmi3Boolean event3 = 1, stops3 = 1;
    must(trial, event != NULL && stops != NULL ? YES : NO);
    int two = OF_EXCHANGE2(fmi2CompletedIntegratorStep(trial->two, kept_back, event, stops));
    int three = (int)fmi3CompletedIntegratorStep(trial->three, kept_back != 0, event == NULL ? NULL : &event3,
                                                 stops == NULL ? NULL : &stops3);
    if (judged(trial, two, three))
        CHECK(*stops == fmi2False && !stops3 && (*event != 0) == (event3 != 0), "the ends of a step differ");
}

static void set_time(Trial *trial)
{
    double time = trial->twin->time + (chance(90) ? uniform(0.0, 1e-2) : uniform(-1.0, 1.0));
    time = careless() ? awkward() : time;
    must(trial, isfinite(time) ? YES : NO);
    if (judged(trial, OF_EXCHANGE2(fmi2SetTime(trial->two, time)), (int)fmi3SetTime(trial->three, time)))
        trial->twin->time = time;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static void get_real(Trial *trial)
{
    const Twin *twin = trial->twin;
    int settles = OF_SYSTEM && (twin->mode == INITIALIZATION || twin->mode == UNKNOWN);
    List list = drawn(READABLE);
    int energy = holds(&list, "absorbed_energy");
    must(trial, list.sound ? YES : NO);
    /* Bodies may find no rest, and before initialization there is nothing calculated of a system. */
    if (!all_have(&list, "ip"))
        must(trial, OF_SYSTEM && twin->mode == INSTANTIATED ? NO : settles ? UNSURE : twin->sound);
    trial->looks = !energy && !settles; /* energy that has been read is kept account of from now on */
    int two = list.size == 0 && OF_SYSTEM ? NOT_CALLED /* which finds the rest of a system, too */
                                          : (int)fmi2GetReal(trial->two, list.two, list.size, list.values2);
    int three = (int)fmi3GetFloat64(trial->three, list.three, list.size, list.values3, list.size);
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < list.size; i++) {
        const char *name = described[list.two[i]].name;
        double value = list.values3[i], expected = twin->value[list.two[i]];
        CHECK(isfinite(value) || (OF_SYSTEM && twin->mode == UNKNOWN) || twin->mode == INSTANTIATED, "%s is %g", name,
              value);
        CHECK(!same(name, "omega") || MODEL_STATES || fabs(value) <= 1.0, "omega is %g", value);
        CHECK(twin->mode == UNKNOWN || twin->moved || strchr("olr", described[list.two[i]].causality) != NULL ||
                  memcmp(&value, &expected, sizeof value) == 0,
              "%s is %.17g, not %.17g", name, value, expected);
    }
    if (done == (DONE2 | DONE3))
        check_equal(list.values3, list.values2, list.size, "GetReal");
}

/* Whether values may be set, which it does in the twin. */
static Answer may_set(Twin *twin, const List *list)
{
    int early = twin->mode == INSTANTIATED || twin->mode == INITIALIZATION;
    Answer answer = YES;
    for (size_t i = 0; i < list->size; i++) {
        unsigned element = list->two[i];
        char causality = described[element].causality;
        double value = list->values2[i], largest = OF_SYSTEM || causality == 'p' ? DBL_MAX : causality == 'i' ? 1e9 : 1e100;
        int changes = memcmp(&value, &twin->value[element], sizeof value) != 0;
        if (strchr(SETTABLE, causality) == NULL || !(fabs(value) <= largest))
            return NO;
        if (causality != 'p')
            twin->moved = twin->moved && OF_SYSTEM;
        else if (changes || twin->mode == UNKNOWN || !(early || OF_SYSTEM || twin->sound == YES))
            answer = UNSURE;
        if (causality == 'p' && changes && !OF_SYSTEM)
            twin->sound = UNSURE;
        twin->value[element] = value;
    }
    return answer;
}

static void set_real(Trial *trial)
{
    Twin after = *trial->twin;
    List list = drawn(after.mode <= INITIALIZATION || chance(20) ? SETTABLE : "isO");
    must(trial, list.size == 0 ? YES : list.sound ? may_set(&after, &list) : NO);
    if (judged(trial, (int)fmi2SetReal(trial->two, list.two, list.size, list.values2),
               (int)fmi3SetFloat64(trial->three, list.three, list.size, list.values3, list.size)))
        *trial->twin = after;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

static void directional_derivative(Trial *trial)
{
    List unknown = drawn("oOr"), known = drawn(SETTABLE);
    must(trial, unknown.sound && known.sound && !(OF_SYSTEM && unknown.size > 0) ? YES : NO);
    must(trial, OF_SYSTEM || (all_have(&unknown, "oOr") && all_have(&known, SETTABLE)) ? YES : NO);
    /* Which derivatives by parameters there are depends on the mode, and friction that ignores reversals has none. */
    if (!OF_SYSTEM)
        must(trial, !all_have(&known, "i") || trial->twin->value[MODEL_INPUT_RESOLUTION] > 0.0 ? UNSURE : trial->twin->sound);
    for (size_t i = 0; known.sound && i < known.size; i++) {
        must(trial, OF_SYSTEM || isfinite(known.values2[i]) ? YES : NO);
        if (!(fabs(known.values2[i]) <= 1e50)) /* what it is multiplied with may be infinite */
            trial->kept = UNSURE;
    }
    trial->looks = 1;
    int two = (int)fmi2GetDirectionalDerivative(trial->two, unknown.two, unknown.size, known.two, known.size,
                                                known.values2, unknown.values2);
    int three = OF_SYSTEM && unknown.size == 0
                    ? NOT_CALLED
                    : (int)fmi3GetDirectionalDerivative(trial->three, unknown.three, unknown.size, known.three,
                                                        known.size, known.values2, known.size, unknown.values3,
                                                        unknown.size);
    if (judged(trial, two, three) && three != NOT_CALLED) {
        for (size_t i = 0; i < unknown.size; i++)
            CHECK(isfinite(unknown.values2[i]), "the derivative of %s is not finite", described[unknown.two[i]].name);
        check_equal(unknown.values3, unknown.values2, unknown.size, "GetDirectionalDerivative");
    }
}

/* By time: of inputs, which FMI 3.0 has not, and of outputs. */
static void rates(Trial *trial)
{
    Twin *twin = trial->twin;
    int sets = is(trial, "SetRealInputDerivatives"), highest = sets && !OF_SYSTEM ? 2 : 1, three = NOT_CALLED;
    const char *causalities = sets ? "i" : "oO";
    List list = drawn(causalities);
    int *orders = elements(list.size, sizeof *orders);
    must(trial, list.size == 0 || (list.sound && all_have(&list, causalities) && orders != NULL) ? YES : NO);
    for (size_t i = 0; i < list.size; i++) {
        int order = careless() ? (int[]){0, -1, 3, INT_MIN}[below(4)] : 1 + below(highest);
        must(trial, order >= 1 && order <= highest ? YES : NO);
        must(trial, !sets || list.values2 == NULL || isfinite(list.values2[i]) ? YES : NO);
        if (orders != NULL)
            orders[i] = order;
    }
    if (list.size > 0)
        must(trial, sets ? (MODEL_BRANCHES ? NO : YES) : OF_SYSTEM ? NO : UNSURE);
    trial->looks = !sets;
    trial->kept = sets ? trial->kept : UNSURE; /* after a jump there is no rate */
    int two = sets ? (int)fmi2SetRealInputDerivatives(trial->two, list.two, list.size, orders, list.values2)
                   : (int)fmi2GetRealOutputDerivatives(trial->two, list.two, list.size, orders, list.values2);
    if (!sets)
        three = (int)fmi3GetOutputDerivatives(trial->three, list.three, list.size, orders, list.values3, list.size);
    int done = judged(trial, two, three);
    twin->moved |= OF_SYSTEM && done && sets;
    twin->interpolated |= done && sets && list.size > 0;
    for (size_t i = 0; done && !sets && i < list.size; i++)
        CHECK(isfinite(list.values2[i]), "the rate of %s is not finite", described[list.two[i]].name);
    if (done && !sets)
        check_equal(list.values3, list.values2, list.size, "GetRealOutputDerivatives");
}

/* ---- model exchange and co-simulation ---------------------------------------------------------------------------- */

/* No continuous states and one event indicator, or states, those by their references, and no indicator. */
static void continuous(Trial *trial)
{
    Twin *twin = trial->twin;
    int sets = is(trial, "SetContinuousStates"), gets = is(trial, "GetContinuousStates"), two = NOT_CALLED, three = 0;
    size_t expected = is(trial, "GetEventIndicators") ? INDICATORS : MODEL_STATES;
    size_t count = !careless() ? expected : chance(20) ? SIZE_MAX : (size_t)below(8), room = count < 5000 ? count : 1;
    double *values2 = elements(room, sizeof *values2), *values3 = values2 == NULL ? NULL : lent(room * sizeof *values3);
    must(trial, count == expected && (count == 0 || values2 != NULL) ? YES : NO);
    for (size_t i = 0; values2 != NULL && i < room; i++) {
        values2[i] = values3[i] = careless() ? awkward() : uniform(-1.2, 1.2);
        must(trial, !sets || fabs(values2[i]) <= 1e100 ? YES : NO);
    }
    if (count > 0 && (gets || is(trial, "GetDerivatives")))
        must(trial, twin->sound);
    trial->looks = !sets && !gets; /* reading absorbed_energy leaves a mark */
#define VALUES(two_name, three_name) \
    if (is(trial, #two_name)) { \
        two = OF_EXCHANGE2(fmi2##two_name(trial->two, values2, count)); \
        three = (int)fmi3##three_name(trial->three, values3, count); \
    }
    VALUES(SetContinuousStates, SetContinuousStates)
    VALUES(GetContinuousStates, GetContinuousStates)
    VALUES(GetDerivatives, GetContinuousStateDerivatives)
    VALUES(GetEventIndicators, GetEventIndicators)
    VALUES(GetNominalsOfContinuousStates, GetNominalsOfContinuousStates)
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < expected && twin->sound == YES && twin->mode != UNKNOWN; i++)
        CHECK(isfinite(done & DONE2 ? values2[i] : values3[i]), "%s gives %g", trial->name, values2[i]);
    for (unsigned i = 0, k = 0; done && sets && i < MODEL_VARIABLES; i++)
        if (strchr("sO", described[i].causality) != NULL)
            twin->value[i] = values2[k++];
    if (done == (DONE2 | DONE3))
        check_equal(values3, values2, expected, trial->name);
}

static void do_step(Trial *trial)
{
    /* A system would take long for other awkward sizes, or for more than some hundred internal steps. */
    static const double quick[] = {NAN, INFINITY, -INFINITY, -1.0, -5e-324, 5e-324, DBL_MAX, 1e18, -0.0};
    Twin *twin = trial->twin;
    double time = careless() ? awkward() : twin->time, last = NAN, size = chance(10) ? 0.0 : pow(10.0, uniform(-6.0, 1.0));
    if (OF_SYSTEM && size > 0.0)
        size = twin->value[MODEL_STEP] * uniform(0.0, chance(90) ? 8.0 : 100.0);
    if (careless())
        size = OF_SYSTEM ? quick[below(sizeof quick / sizeof *quick)] : awkward();
    double after = time + size, stop = twin->stop_time;
    fmi3Boolean flags[3] = {1, 1, 1}, kept_back = below(2) != 0;
    trace("    time %.17g, size %.17g\n", time, size);
    must(trial, isfinite(time) && size >= 0.0 && isfinite(after) ? YES : NO);
    /* Times that a host adds up are never exact; a system may diverge, and an input leave where displacements may be. */
    must(trial, after > stop + 1e-6 * fmax(fabs(after), fabs(stop)) ? NO : after > stop ? UNSURE : YES);
    must(trial, OF_SYSTEM || twin->interpolated || twin->mode == UNKNOWN ? UNSURE : YES);
    int two = (int)fmi2DoStep(trial->two, time, size, kept_back);
    int three = (int)fmi3DoStep(trial->three, time, size, kept_back, &flags[0], &flags[1], &flags[2], &last);
    if (judged(trial, two, three)) {
        CHECK(!flags[0] && !flags[1] && !flags[2], "a step ends early");
        check_equal(&last, &after, 1, "lastSuccessfulTime");
        twin->time = after;
        twin->moved |= twin->interpolated;
        twin->interpolated = 0;
    } else if (trial->three != NULL && twin->mode == STEP && !twin->interpolated) {
        check_equal(&last, &twin->time, 1, "lastSuccessfulTime of a refused step");
    }
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

#define CALL(two, three, modes2, modes3, function) {two, three, modes2, modes3, function},
static const Row rows[] = {
#include "calls.inc"
};
enum { CALLS = sizeof rows / sizeof *rows };
static long counts[CALLS][2], repeated, hostile;

static void try_call(Pair *pair, int call)
{
    const Row *row = &rows[call];
    const fmi3ValueReference reference = TIME3;
    int before = loans, nobody = careless() && chance(10);
    double time = NAN;
    Trial trial = {.pair = pair, .twin = &pair->twin, .row = row, .counts = counts[call], .blocks = blocks,
                   .name = row->two ? row->two : row->three, .two = nobody ? NULL : pair->two,
                   .three = nobody ? NULL : pair->three, .kept = pair->twin.mode == UNKNOWN ? UNSURE : YES};
    trial.may2 = nobody ? NO : allowed(&pair->twin, row->two == NULL ? NULL : row->modes2);
    trial.may3 = nobody ? NO : allowed(&pair->twin, row->three == NULL ? NULL : row->modes3);
    trace("%ld: %s in mode %d\n", (long)(pair - pairs), trial.name, (int)pair->twin.mode);
    listen(pair, pair->name);
    starved = 0;
    row->try(&trial);
    CHECK(fmi3GetFloat64(pair->three, &reference, 1, &time, 1) == fmi3OK, "the time, a variable of FMI 3.0, is refused");
    CHECK(pair->twin.mode == UNKNOWN || time == pair->twin.time, "the time is %.17g", time);
    take_back(before);
}

/* Often a call that leads on from a mode. */
static void try_any(Pair *pair, int only_values)
{
    static const char *const forth[][5] = {
        [INSTANTIATED] = {"EnterInitializationMode", "EnterInitializationMode", "SetReal", "SetRealInputDerivatives"},
        [INITIALIZATION] = {"SetReal", "GetReal", "ExitInitializationMode", "ExitInitializationMode"},
        [EVENT] = {"NewDiscreteStates", "EnterContinuousTimeMode", "EnterContinuousTimeMode", "SetReal"},
        [CONTINUOUS_TIME] = {"SetTime", "SetReal", "CompletedIntegratorStep", "GetEventIndicators", "EnterEventMode"},
        [STEP] = {"SetReal", "DoStep", "DoStep", "GetReal", "SetRealInputDerivatives"},
        [TERMINATED] = {"Reset", "Reset", "GetReal", "SetFMUstate"},
        [UNKNOWN] = {"DoStep", "GetReal", "SetReal", "CompletedIntegratorStep", "ExitInitializationMode"},
    };
    const char *wanted = chance(60) ? forth[pair->twin.mode][below(5)] : NULL;
    int call = below(CALLS);
    for (int i = 0; wanted != NULL && i < CALLS; i++)
        if (rows[i].two != NULL && strcmp(rows[i].two, wanted) == 0)
            call = i;
    int of_host = rows[call].two != NULL && strstr(rows[call].two, "FMUstate") != NULL;
    if (only_values && of_host)
        return;
    /* Nothing but states is allocated after instantiation. */
    starving = chance(20);
    try_call(pair, call);
}

/* A stretch of calls, twice from one state. FMI 2.0 goes back by its state, FMI 3.0 by the bytes. */
static void repeat(Pair *pair)
{
    const Twin twin = pair->twin;
    fmi2FMUstate home = NULL;
    unsigned char *before = copy(pair->bytes, state_size), *end = NULL;
    uint64_t begin = random_bits(), first = 0;
    trace("%ld: a stretch of calls, twice\n", (long)(pair - pairs));
    CHECK(fmi2GetFMUstate(pair->two, &home) == fmi2OK, "a state cannot be taken");
    for (int time = 0; time < 2; time++) {
        seed = begin;
        heard = 0;
        for (int k = 2 + below(10); k > 0; k--)
            try_any(pair, 1);
        if (time == 1)
            break;
        first = heard;
        end = copy(pair->bytes, state_size);
        listen(pair, pair->name);
        put_state(pair, before);
        CHECK(fmi2SetFMUstate(pair->two, home) == fmi2OK, "an instance does not go back");
        look(pair);
        CHECK(memcmp(pair->bytes, before, state_size) == 0, "a pair has not gone back");
        pair->twin = twin;
    }
    CHECK(first == heard && memcmp(end, pair->bytes, state_size) == 0, "the same calls give other answers");
    CHECK(fmi2FreeFMUstate(pair->two, &home) == fmi2OK, "a state is not freed");
    repeated++;
}

/* Calls of FMI 3.0 alone that must be refused in every mode: an error, one message, and no byte of the state changed. */
static void be_hostile(Pair *pair)
{
    int without = chance(5), logger = pair->logger && !without;
    fmi3Instance c = without ? NULL : pair->three;
    fmi3ValueReference one = chance(80) ? 1 + (fmi3ValueReference)below(MODEL_VARIABLES) : (fmi3ValueReference)random_bits();
    double number[2] = {0.0};
    uint64_t integer[2] = {0};
    size_t sizes[2] = {1, 1};
    void *pointers[2] = {integer, NULL}, *values = pointers, *integers = integer;
    fmi3IntervalQualifier qualifier;
    fmi3DependencyKind kind;
    const unsigned char *before = copy(pair->bytes, state_size);
    long blocks_before = blocks;
#define REFUSED(call) \
    listen(pair, pair->name); \
    CHECK((call) == fmi3Error && said[1].errors == logger && said[1].warnings == 0, "%s is not refused once", #call);
    /* Types that no variable has, and what an FMU of a spring does not do at all. */
#define ABSENT(type) \
    REFUSED(fmi3Get##type(c, &one, 1, integers, 1)) \
    REFUSED(fmi3Set##type(c, &one, 1, values, 1))
#define ABSENT_INTEGER(size) \
    ABSENT(Int##size) \
    ABSENT(UInt##size)
    ABSENT(Float32)
    ABSENT(String)
    ABSENT_INTEGER(8)
    ABSENT_INTEGER(16)
    ABSENT_INTEGER(32)
    ABSENT_INTEGER(64)
    REFUSED(fmi3GetBinary(c, &one, 1, sizes, values, 1))
    REFUSED(fmi3SetBinary(c, &one, 1, sizes, values, 1))
    REFUSED(fmi3GetClock(c, &one, 1, integers))
    REFUSED(fmi3SetClock(c, &one, 1, integers))
    REFUSED(fmi3GetIntervalDecimal(c, &one, 1, number, &qualifier))
    REFUSED(fmi3SetIntervalDecimal(c, &one, 1, number))
    REFUSED(fmi3GetIntervalFraction(c, &one, 1, integer, integer, &qualifier))
    REFUSED(fmi3SetIntervalFraction(c, &one, 1, integer, integer))
    REFUSED(fmi3GetShiftDecimal(c, &one, 1, number))
    REFUSED(fmi3SetShiftDecimal(c, &one, 1, number))
    REFUSED(fmi3GetShiftFraction(c, &one, 1, integer, integer))
    REFUSED(fmi3SetShiftFraction(c, &one, 1, integer, integer))
    REFUSED(fmi3GetNumberOfVariableDependencies(c, one, sizes))
    REFUSED(fmi3GetVariableDependencies(c, one, sizes, &one, sizes, &kind, 1))
    REFUSED(fmi3GetNumberOfVariableDependencies(c, one, NULL))
    REFUSED(fmi3EnterConfigurationMode(c))
    REFUSED(fmi3ExitConfigurationMode(c))
    REFUSED(fmi3EnterStepMode(c))
    REFUSED(fmi3ActivateModelPartition(c, one, awkward()))
    CHECK(blocks == blocks_before, "refused calls keep or lose %ld blocks of memory", blocks - blocks_before);
    look(pair);
    CHECK(memcmp(before, pair->bytes, state_size) == 0, "the state has changed though calls are refused");
    hostile++;
}

/* ---- the program: fuzz SEED SEQUENCES [trace] -------------------------------------------------------------------- */

/* Several pairs live side by side; each life has some 40 calls. */
static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0; take_back(0)) {
        Pair *pair = &pairs[below(PAIRS)];
        int choice = below(100);
        carelessness = chance(60) ? 0 : 15;
        if (pair->two == NULL) {
            int is_new = begun < sequences && begin(pair);
            begun += is_new;
            alive += is_new;
        } else if (choice < 3) {
            if (alive-- == 1 && begun == sequences)
                forget_states(pair);
            end(pair);
        } else if (choice < 18) {
            (choice < 8 ? repeat : be_hostile)(pair);
        } else {
            try_any(pair, 0);
        }
    }
    CHECK(blocks == 0, "%ld blocks of memory are never returned", blocks);
}

/* Does so many sequences in runs of 50: the first run has the seed, the next one the seed after it. The last seed that is
 * printed is that of a failure: `fuzz SEED 50 trace` prints the calls that lead there. Prints how often each call was
 * done and refused, in JSON. */
int main(int count, char **arguments)
{
    enum { RUN = 50, LONGEST_RUN = 240 /* [s] */ };
    if (count < 3)
        return 2;
    tracing = count > 3;
    unsigned long long next = strtoull(arguments[1], NULL, 10);
    for (long left = atol(arguments[2]); left > 0; left -= RUN, next++) {
        alarm(LONGEST_RUN);
        fprintf(stderr, "seed %llu\n", next);
        seed = next;
        run(left < RUN ? left : RUN);
    }
    for (int i = 0; i < CALLS; i++)
        printf("%s\"%s\": [%ld, %ld]", i ? ", " : "{", rows[i].two ? rows[i].two : rows[i].three, counts[i][0],
               counts[i][1]);
    printf(", \"repeated\": %ld, \"hostile\": %ld, \"made up and taken\": %ld, \"made up and refused\": %ld}\n",
           repeated, hostile, made_up[0], made_up[1]);
    return 0;
}
