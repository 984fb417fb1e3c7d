/* The calls by name: where each is legal, its arguments, what makes them wrong, and what must come back. */
#include "fuzz.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

/* Which the FMU of a system does not have in FMI 2.0. */
#pragma weak fmi2EnterEventMode
#pragma weak fmi2NewDiscreteStates
#pragma weak fmi2EnterContinuousTimeMode
#pragma weak fmi2CompletedIntegratorStep
#pragma weak fmi2SetTime
#pragma weak fmi2SetContinuousStates
#pragma weak fmi2GetDerivatives
#pragma weak fmi2GetEventIndicators
#pragma weak fmi2GetContinuousStates
#pragma weak fmi2GetNominalsOfContinuousStates
#define OF_EXCHANGE2(call) (OF_SYSTEM ? NOT_CALLED : (int)(call))

static int is(const Trial *trial, const char *name)
{
    const Row *row = &rows[trial->call];
    return strcmp(row->two ? row->two : row->three, name) == 0;
}

static void must_be_given(Trial *trial, const void *array, size_t count)
{
    must(trial, count == 0 || array != NULL ? YES : NO);
}

/* ---- calls that lead from mode to mode --------------------------------------------------------------------------- */

static int change_mode(Trial *trial, int two, int three, Mode mode)
{
    Twin *twin = &trial->pair->twin;
    int done = judged(trial, two, three);
    if (done && twin->mode != UNKNOWN)
        twin->mode = mode;
    return done;
}

/* FMI 2.0 takes the times by another call, at times by the last one. */
static void enter_initialization(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    double start = twin->time, stop = twin->stop_time, value = awkward();
    int ends = isfinite(stop), alone = is(trial, "SetupExperiment"), tolerance = below(2), two = fmi2OK;
    if (alone || twin->mode == UNKNOWN || chance(50)) {
        ends = chance(30);
        start = careless() ? awkward() : chance(70) ? 0.0 : uniform(-1e3, 1e3);
        stop = careless() ? awkward() : start + uniform(0.0, OF_SYSTEM ? 1.0 : 10.0);
        must(trial, isfinite(start) && (!ends || stop >= start) ? YES : NO);
        two = (int)fmi2SetupExperiment(trial->two, tolerance, value, start, ends, stop);
    }
    if (!alone && two == fmi2OK)
        two = (int)fmi2EnterInitializationMode(trial->two);
    int three = alone ? NOT_CALLED
                      : (int)fmi3EnterInitializationMode(trial->three, tolerance, value, start, ends, stop);
    if (change_mode(trial, two, three, alone ? twin->mode : INITIALIZATION)) {
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
    Twin *twin = &trial->pair->twin;
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
    must_be_given(trial, two, 1);
    trial->looks = 1;
    if (judged(trial, OF_EXCHANGE2(fmi2NewDiscreteStates(trial->two, two)),
               (int)fmi3UpdateDiscreteStates(trial->three, first, &flags[1], &flags[2], &flags[3], &flags[4], &next)))
        CHECK(!two->newDiscreteStatesNeeded && !two->terminateSimulation && !two->nextEventTimeDefined && !flags[0] &&
                  !flags[1] && !flags[2] && !flags[3] && !flags[4],
              "an event leads to another one");
}

static void completed_integrator_step(Trial *trial)
{
    fmi2Boolean *event = elements(1, sizeof *event), *stops = elements(1, sizeof *stops), kept = below(2);
    fmi3Boolean event3 = 1, stops3 = 1;
    must_be_given(trial, event, 1);
    must_be_given(trial, stops, 1);
    int two = OF_EXCHANGE2(fmi2CompletedIntegratorStep(trial->two, kept, event, stops));
    int three = (int)fmi3CompletedIntegratorStep(trial->three, kept != 0, event == NULL ? NULL : &event3,
                                                 stops == NULL ? NULL : &stops3);
    if (judged(trial, two, three))
        CHECK(*stops == fmi2False && !stops3 && (*event != 0) == (event3 != 0), "the ends of a step differ");
}

static void set_time(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    double time = careless() ? awkward() : twin->time + (chance(90) ? uniform(0.0, 1e-2) : uniform(-1.0, 1.0));
    must(trial, isfinite(time) ? YES : NO);
    if (judged(trial, OF_EXCHANGE2(fmi2SetTime(trial->two, time)), (int)fmi3SetTime(trial->three, time)))
        twin->time = time;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static void get_real(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    List list = drawn('R', READABLE);
    int energy = holds(&list, "absorbed_energy"), settles = OF_SYSTEM && (twin->mode == INITIALIZATION || twin->mode == UNKNOWN);
    must(trial, list.sound && !(MODEL_NO_ENERGY && energy) ? YES : NO);
    /* Bodies may find no rest, and before initialization there is nothing calculated of a system. */
    if (!all_have(&list, "ip"))
        must(trial, OF_SYSTEM && twin->mode == INSTANTIATED ? NO : settles ? UNSURE : twin->sound);
    trial->looks = !energy && !settles; /* energy that has been read is kept account of from now on */
    for (size_t i = 0; list.values2 != NULL && i < list.size; i++)
        list.values2[i] = list.values3[i] = NAN;
    int two = list.size == 0 && OF_SYSTEM ? NOT_CALLED /* which finds the rest of a system, too */
                                          : (int)fmi2GetReal(trial->two, list.two, list.size, list.values2);
    int three = (int)fmi3GetFloat64(trial->three, list.three, list.count, list.values3, list.size);
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < list.size; i++) {
        const Described *of = &described[list.two[i]];
        double value = list.values3[i], expected = twin->value[list.two[i]];
        CHECK(isfinite(value) || (OF_SYSTEM && twin->mode == UNKNOWN) || twin->mode == INSTANTIATED, "%s is %g",
              of->name, value);
        CHECK(strcmp(of->name, "omega") != 0 || MODEL_STATES || fabs(value) <= 1.0, "omega is %g", value);
        CHECK(twin->mode == UNKNOWN || twin->moved || strchr("olr", of->causality) != NULL ||
                  memcmp(&value, &expected, sizeof value) == 0,
              "%s is %.17g, not %.17g", of->name, value, expected);
    }
    if (done == (DONE2 | DONE3))
        check_equal(list.values3, list.values2, list.size, "GetReal");
}

static void set_real(Trial *trial)
{
    Twin *twin = &trial->pair->twin, after = *twin;
    List list = drawn('R', twin->mode <= INITIALIZATION || chance(20) ? SETTABLE : "isO");
    must(trial, list.sound ? may_set(&after, &list) : NO);
    if (judged(trial, (int)fmi2SetReal(trial->two, list.two, list.size, list.values2),
               (int)fmi3SetFloat64(trial->three, list.three, list.count, list.values3, list.size)))
        *twin = after;
}

/* Read only, since none of the Booleans is an input or a parameter. */
static void get_boolean(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    int settles = OF_SYSTEM && (twin->mode == INITIALIZATION || twin->mode == UNKNOWN);
    List list = drawn('B', READABLE);
    fmi2Boolean *values2 = elements(list.size, sizeof *values2);
    fmi3Boolean *values3 = values2 == NULL ? NULL : lent(list.size * sizeof *values3);
    must(trial, list.sound && (list.size == 0 || values2 != NULL) ? YES : NO);
    if (list.size > 0 && OF_SYSTEM)
        must(trial, twin->mode == INSTANTIATED ? NO : settles ? UNSURE : YES);
    trial->looks = !settles;
    int two = list.size == 0 && OF_SYSTEM ? NOT_CALLED
                                          : (int)fmi2GetBoolean(trial->two, list.two, list.size, values2);
    int done = judged(trial, two, (int)fmi3GetBoolean(trial->three, list.three, list.count, values3, list.count));
    for (size_t i = 0; done && i < list.size; i++)
        CHECK(done == DONE3 || values2[i] == values3[i], "extrapolating is %d and %d", values2[i], values3[i]);
}

/* The time, which is a variable of FMI 3.0. */
static void get_time(Trial *trial)
{
    const fmi3ValueReference reference = TIME3;
    double time = NAN;
    trial->looks = 1;
    if (judged(trial, NOT_CALLED, (int)fmi3GetFloat64(trial->three, &reference, 1, &time, 1)))
        CHECK(trial->pair->twin.mode == UNKNOWN || time == trial->pair->twin.time, "the time is %.17g", time);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* The adjoint derivative has the same matrix: one of its rows, summed by the seeds. */
static void compare_transpose(const Trial *trial, const List *unknown, const List *known)
{
    static const double ROUNDING = 1e-12; /* of the sum of the terms' sizes */
    size_t row = (size_t)below((int)unknown->size);
    double *weights = lent(unknown->size * 8), *adjoint = lent(known->size * 8), sum = 0.0, size = 0.0;
    memset(weights, 0, unknown->size * 8);
    weights[row] = 1.0;
    fmi3Status status = fmi3GetAdjointDerivative(trial->three, unknown->three, unknown->count, known->three,
                                                 known->count, weights, unknown->size, adjoint, known->size);
    CHECK(status == fmi3OK, "fmi3GetAdjointDerivative has the status %d", (int)status);
    for (size_t k = 0; k < known->size; k++) {
        sum += adjoint[k] * known->values2[k];
        size += fabs(adjoint[k] * known->values2[k]);
    }
    CHECK(fabs(unknown->values2[row] - sum) <= ROUNDING * size + DBL_MIN, "a derivative is %.17g, and %.17g by its row",
          unknown->values2[row], sum);
}

static void directional_derivative(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    List unknown = drawn('R', "oOr"), known = drawn('R', SETTABLE);
    int energy = holds(&unknown, "absorbed_energy"), plain = known.sound && unknown.size > 0 && known.size > 0;
    must(trial, unknown.sound && known.sound && !(OF_SYSTEM && unknown.size > 0) && !(MODEL_NO_ENERGY && energy) ? YES : NO);
    must(trial, OF_SYSTEM || (all_have(&unknown, "oOr") && all_have(&known, SETTABLE)) ? YES : NO);
    /* Which derivatives by parameters there are depends on the mode, and friction that ignores reversals has none. */
    if (!OF_SYSTEM)
        must(trial, !all_have(&known, "i") || twin->value[MODEL_INPUT_RESOLUTION] > 0.0 ? UNSURE : twin->sound);
    for (size_t i = 0; known.sound && i < known.size; i++) {
        must(trial, OF_SYSTEM || isfinite(known.values2[i]) ? YES : NO);
        if (!(fabs(known.values2[i]) <= 1e50)) /* what it is multiplied with may be infinite */
            trial->kept = UNSURE;
        plain = plain && fabs(known.values2[i]) <= 1e13;
    }
    trial->looks = 1;
    int two = (int)fmi2GetDirectionalDerivative(trial->two, unknown.two, unknown.size, known.two, known.size,
                                                known.values2, unknown.values2);
    int three = OF_SYSTEM && unknown.size == 0
                    ? NOT_CALLED
                    : (int)fmi3GetDirectionalDerivative(trial->three, unknown.three, unknown.count, known.three,
                                                        known.count, known.values2, known.size, unknown.values3,
                                                        unknown.size);
    if (judged(trial, two, three) && three != NOT_CALLED) {
        for (size_t i = 0; i < unknown.size; i++)
            CHECK(isfinite(unknown.values2[i]), "the derivative of %s is not finite", described[unknown.two[i]].name);
        check_equal(unknown.values3, unknown.values2, unknown.size, "GetDirectionalDerivative");
        if (plain && unknown.sound)
            compare_transpose(trial, &unknown, &known);
    }
}

/* By time: of inputs, which FMI 3.0 has not, and of outputs. */
static void rates(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    int sets = is(trial, "SetRealInputDerivatives"), highest = sets && !OF_SYSTEM ? 2 : 1, three = NOT_CALLED;
    const char *causalities = sets ? "i" : "oO";
    List list = drawn('R', causalities);
    int *orders = elements(list.size, sizeof *orders);
    must(trial, list.sound && all_have(&list, causalities) ? YES : NO);
    must_be_given(trial, orders, list.size);
    for (size_t i = 0; i < list.size; i++) {
        int order = careless() ? (int[]){0, -1, 3, INT_MIN}[below(4)] : 1 + below(highest);
        must(trial, order >= 1 && order <= highest ? YES : NO);
        must(trial, !sets || list.values2 == NULL || isfinite(list.values2[i]) ? YES : NO);
        if (orders != NULL)
            orders[i] = order;
    }
    if (list.size > 0)
        must(trial, sets ? (MODEL_BRANCHES ? NO : YES)
                    : OF_SYSTEM || (MODEL_NO_ENERGY && holds(&list, "absorbed_energy")) ? NO : UNSURE);
    trial->looks = !sets;
    trial->kept = sets ? trial->kept : UNSURE; /* after a jump there is no rate */
    int two = sets ? (int)fmi2SetRealInputDerivatives(trial->two, list.two, list.size, orders, list.values2)
                   : (int)fmi2GetRealOutputDerivatives(trial->two, list.two, list.size, orders, list.values2);
    if (!sets)
        three = (int)fmi3GetOutputDerivatives(trial->three, list.three, list.count, orders, list.values3, list.size);
    int done = judged(trial, two, three);
    twin->moved |= OF_SYSTEM && done && sets;
    twin->interpolated |= done && sets && list.size > 0;
    for (size_t i = 0; done && !sets && i < list.size; i++)
        CHECK(isfinite(list.values2[i]), "the rate of %s is not finite", described[list.two[i]].name);
    if (done && !sets)
        check_equal(list.values3, list.values2, list.size, "GetRealOutputDerivatives");
}

/* ---- model exchange ---------------------------------------------------------------------------------------------- */

/* No continuous states and one event indicator, or states, those by their references, and no indicator. */
static void continuous(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    int sets = is(trial, "SetContinuousStates"), two, three;
    size_t expected = is(trial, "GetEventIndicators") ? INDICATORS : MODEL_STATES;
    size_t count = !careless() ? expected : chance(20) ? SIZE_MAX : (size_t)below(8);
    size_t room = count < 5000 ? count : 1;
    double *values2 = elements(room, sizeof *values2);
    double *values3 = values2 == NULL ? NULL : lent(room * sizeof *values3);
    must(trial, count == expected ? YES : NO);
    must_be_given(trial, values2, count);
    for (size_t i = 0; values2 != NULL && i < room; i++) {
        values2[i] = values3[i] = careless() ? awkward() : uniform(-1.2, 1.2);
        must(trial, !sets || fabs(values2[i]) <= 1e100 ? YES : NO);
    }
    if (count > 0 && (is(trial, "GetDerivatives") || is(trial, "GetContinuousStates")))
        must(trial, twin->sound);
    trial->looks = !sets && !is(trial, "GetContinuousStates"); /* reading absorbed_energy leaves a mark */
#define BOTH_OF(two_name, three_name) \
    if (is(trial, #two_name)) { \
        two = OF_EXCHANGE2(fmi2##two_name(trial->two, values2, count)); \
        three = (int)fmi3##three_name(trial->three, values3, count); \
    } else
    BOTH_OF(SetContinuousStates, SetContinuousStates)
    BOTH_OF(GetContinuousStates, GetContinuousStates)
    BOTH_OF(GetDerivatives, GetContinuousStateDerivatives)
    BOTH_OF(GetEventIndicators, GetEventIndicators)
    {
        two = OF_EXCHANGE2(fmi2GetNominalsOfContinuousStates(trial->two, values2, count));
        three = (int)fmi3GetNominalsOfContinuousStates(trial->three, values3, count);
    }
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < expected && twin->sound == YES && twin->mode != UNKNOWN; i++)
        CHECK(isfinite(done & DONE2 ? values2[i] : values3[i]), "%s gives %g", rows[trial->call].two, values2[i]);
    for (unsigned i = 0, k = 0; done && sets && i < MODEL_VARIABLES; i++)
        if (strchr("sO", described[i].causality) != NULL)
            twin->value[i] = values2[k++];
    if (done == (DONE2 | DONE3))
        check_equal(values3, values2, expected, rows[trial->call].two);
}

/* ---- co-simulation ----------------------------------------------------------------------------------------------- */

static void do_step(Trial *trial)
{
    /* A system would take long for other awkward sizes, or for more than some hundred internal steps. */
    static const double quick[] = {NAN, INFINITY, -INFINITY, -1.0, -5e-324, 5e-324, DBL_MAX, 1e18, -0.0};
    Twin *twin = &trial->pair->twin;
    double time = careless() ? awkward() : twin->time, last = NAN, size = chance(10) ? 0.0 : pow(10.0, uniform(-6.0, 1.0));
    if (OF_SYSTEM && size > 0.0)
        size = twin->value[MODEL_STEP] * uniform(0.0, chance(90) ? 8.0 : 100.0);
    if (careless())
        size = OF_SYSTEM ? quick[below(sizeof quick / sizeof *quick)] : awkward();
    double after = time + size, stop = twin->stop_time;
    fmi3Boolean flags[3] = {1, 1, 1}, kept = below(2) != 0;
    trace("    time %.17g, size %.17g\n", time, size);
    must(trial, isfinite(time) && size >= 0.0 && isfinite(after) ? YES : NO);
    /* Times that a host adds up are never exact; a system may diverge, and an input leave where displacements may be. */
    must(trial, after > stop + 1e-6 * fmax(fabs(after), fabs(stop)) ? NO : after > stop ? UNSURE : YES);
    must(trial, OF_SYSTEM || twin->interpolated || twin->mode == UNKNOWN ? UNSURE : YES);
    int two = (int)fmi2DoStep(trial->two, time, size, kept);
    int three = (int)fmi3DoStep(trial->three, time, size, kept, &flags[0], &flags[1], &flags[2], &last);
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

/* Calls by their names in FMI 2.0 and FMI 3.0, and where each is legal (pair.c: `allowed`), by the standards: sections
 * 3.2.3 and 4.2.4 of FMI 2.0; 2.3, 3.2 and 4.2 of FMI 3.0. Beyond them, Terminate does nothing where nothing is to end,
 * and FMI 3.0 answers some calls as FMI 2.0 does. */
#define ANY "xxxxx xxxx"
#define LATE "-xxxx -xxx"
#define EXCHANGE "-xxxx ----"
const Row rows[] = {
    {"SetupExperiment", NULL, "x---- x---", NULL, enter_initialization},
    {"EnterInitializationMode", "EnterInitializationMode", "x---- x---", "x---- x---", enter_initialization},
    {"ExitInitializationMode", "ExitInitializationMode", "-x--- -x--", "-x--- -x--", change},
    {"Terminate", "Terminate", ANY, ANY, change},
    {"Reset", "Reset", ANY, ANY, change},
    {"GetReal", "GetFloat64", LATE, ANY, get_real},
    {"SetReal", "SetFloat64", "xxxx- xxx-", "xxxx- xxx-", set_real},
    {"GetBoolean", "GetBoolean", LATE, ANY, get_boolean},
    {"GetFMUstate", "GetFMUState", ANY, ANY, get_state},
    {"SetFMUstate", "SetFMUState", ANY, ANY, set_state},
    {"FreeFMUstate", "FreeFMUState", ANY, ANY, free_state},
    {"SerializeFMUstate", "SerializeFMUState", ANY, ANY, serialize},
    {"DeSerializeFMUstate", "DeserializeFMUState", ANY, ANY, deserialize},
    {"GetDirectionalDerivative", "GetDirectionalDerivative", LATE, LATE, directional_derivative},
    {"EnterEventMode", "EnterEventMode", "--xx- ----", "--xx- ----", change},
    {NULL, "EvaluateDiscreteStates", NULL, "--x-- ----", change},
    {"NewDiscreteStates", "UpdateDiscreteStates", "--x-- ----", "--x-- ----", new_discrete_states},
    {"EnterContinuousTimeMode", "EnterContinuousTimeMode", "--x-- ----", "--x-- ----", change},
    {"CompletedIntegratorStep", "CompletedIntegratorStep", "---x- ----", "---x- ----", completed_integrator_step},
    {"SetTime", "SetTime", "--xx- ----", "--xx- ----", set_time},
    {"SetContinuousStates", "SetContinuousStates", "---x- ----", "---x- ----", continuous},
    {"GetContinuousStates", "GetContinuousStates", EXCHANGE, EXCHANGE, continuous},
    {"GetDerivatives", "GetContinuousStateDerivatives", "-?xxx ----", EXCHANGE, continuous},
    {"GetEventIndicators", "GetEventIndicators", EXCHANGE, EXCHANGE, continuous},
    {"GetNominalsOfContinuousStates", "GetNominalsOfContinuousStates", "x-xxx ----", EXCHANGE, continuous},
    {NULL, "GetFloat64", NULL, ANY, get_time},
    {"SetRealInputDerivatives", NULL, "----- xxx-", NULL, rates},
    {"GetRealOutputDerivatives", "GetOutputDerivatives", "----- --xx", "----- --xx", rates},
    {"DoStep", "DoStep", "----- --x-", "----- --x-", do_step},
};
const int call_count = sizeof rows / sizeof *rows;
long counts[sizeof rows / sizeof *rows][3];

void try_call(Pair *pair, int call)
{
    int before = loans;
    Trial trial = trial_of(pair, call);
    rows[call].try(&trial);
    take_back(before);
}

/* Often one that leads on from a mode. */
void try_any(Pair *pair, int only_values)
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
    int call = below(call_count);
    for (int i = 0; wanted != NULL && i < call_count; i++)
        if (rows[i].two != NULL && strcmp(rows[i].two, wanted) == 0)
            call = i;
    int of_host = rows[call].two != NULL && strstr(rows[call].two, "FMUstate") != NULL;
    if (!(only_values && of_host))
        try_call(pair, call);
}
