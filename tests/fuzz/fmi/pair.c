/* Pairs of instances, what a host may expect of them, and the judgement of what both answer. */
#include "fuzz.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DESCRIBED(name, type, causality, tunable, start) {name, type, causality, tunable, start},
const Described described[MODEL_VARIABLES] = {MODEL_TABLE(DESCRIBED)};
Pair pairs[PAIRS];
size_t state_size;
uint64_t heard;
static long blocks_before, tables_before;

static int begins(const char *name, const char *part)
{
    return strncmp(name, part, strlen(part)) == 0;
}

static Answer least(Answer one, Answer other)
{
    return one < other ? one : other;
}

/* ---- what is expected -------------------------------------------------------------------------------------------- */

/* Columns: model exchange instantiated, in initialization, event and continuous-time mode, terminated; co-simulation
 * instantiated, in initialization mode, between steps, terminated. Where there is a question mark, tables in use differ. */
static Answer allowed(const Twin *twin, const char *modes)
{
    static const int columns[2][UNKNOWN] = {
        {[INSTANTIATED] = 6, [INITIALIZATION] = 7, [STEP] = 8, [TERMINATED] = 9},
        {[INSTANTIATED] = 0, [INITIALIZATION] = 1, [EVENT] = 2, [CONTINUOUS_TIME] = 3, [TERMINATED] = 4}};
    if (twin->mode == UNKNOWN || modes == NULL)
        return modes == NULL ? NO : UNSURE;
    char mark = modes[columns[twin->exchange][twin->mode]];
    return mark == '-' ? NO : mark == '?' ? UNSURE : YES;
}

Twin twin_of(int exchange)
{
    Twin twin = {.exchange = exchange, .mode = INSTANTIATED, .stop_time = INFINITY, .sound = YES};
    for (int i = 0; i < MODEL_VARIABLES; i++)
        twin.value[i] = described[i].start;
    return twin;
}

/* Whether parameters are a spring: sure near their start values and where one alone is absurd. */
static Answer sound(const Twin *twin)
{
    Answer answer = YES;
    for (int i = 0; !OF_SYSTEM && twin->mode != UNKNOWN && i < MODEL_VARIABLES; i++) {
        const char *name = described[i].name;
        double value = twin->value[i], start = described[i].start;
        int free = begins(name, "kE_") || begins(name, "FE_forces") || strcmp(name, "kappa_omega") == 0;
        int absurd = (strcmp(name, "n") == 0 && !(value >= 0.01 && value <= 100.0)) || !(fabs(value) < 1e60) ||
                     (strcmp(name, "kappa_omega") == 0 && !(value >= 1e-15 && value <= 1e15));
        if (described[i].causality == 'p' && absurd)
            return NO;
        if (described[i].causality == 'p' && value != start)
            answer = least(answer, free && fabs(value / start - 1.0) < 0.11 ? YES : UNSURE);
    }
    return twin->mode == UNKNOWN ? UNSURE : answer;
}

/* The largest size of a value. */
static double largest_given(unsigned element)
{
    char causality = described[element].causality;
    return causality == 'p' || OF_SYSTEM ? DBL_MAX : causality == 'i' ? 1e9 : 1e100;
}

Answer may_set(Twin *twin, const List *list)
{
    const Twin before = *twin;
    int early = twin->mode == INSTANTIATED || twin->mode == INITIALIZATION, tunes = 0;
    int closed = OF_SYSTEM || (twin->mode == CONTINUOUS_TIME && !MODEL_STATES);
    Answer answer = YES;
    for (size_t i = 0; i < list->size; i++)
        twin->value[list->two[i]] = list->values2[i]; /* of those that are set twice the last value counts */
    for (size_t i = 0; i < list->size; i++) {
        unsigned element = list->two[i];
        const Described *of = &described[element];
        double value = list->values2[i], old = before.value[element];
        if (strchr(SETTABLE, of->causality) == NULL || !(fabs(value) <= largest_given(element)))
            return NO;
        if (of->causality != 'p') {
            twin->moved = twin->moved && OF_SYSTEM;
            continue;
        }
        tunes = 1;
        if (twin->mode == UNKNOWN || (OF_SYSTEM && early && value != of->start))
            answer = UNSURE;
        else if (!early && (closed || !of->tunable) && memcmp(&old, &value, 8) != 0)
            answer = least(answer, value != old && value == twin->value[element] ? NO : UNSURE);
    }
    twin->sound = sound(twin);
    return early || !tunes || OF_SYSTEM ? answer : least(answer, twin->sound);
}

double usual_value(unsigned element)
{
    const char *name = element < MODEL_VARIABLES ? described[element].name : "";
    /* Never so small that a step of co-simulation takes long. */
    if (strcmp(name, "step") == 0)
        return MODEL_LARGEST_STEP * pow(10.0, uniform(-2.0, 0.2));
    if (element >= MODEL_VARIABLES || careless())
        return awkward();
    double start = described[element].start;
    if (OF_SYSTEM)
        return strcmp(name, "omega_start") == 0  ? below(3) - 1.0
               : begins(name, "gravity_")        ? start * uniform(0.5, 1.5)
                                                 : uniform(-1.0, 1.0) * (begins(name, "load_") ? 1e3 : 1e2);
    if (chance(2)) /* as far as a spring or its motion can go */
        return described[element].causality == 'p' ? start * pow(10.0, uniform(-15.0, 15.0))
                                                   : copysign(largest_given(element), uniform(-1.0, 1.0));
    if (strcmp(name, "displacement") == 0)
        return chance(90) ? uniform(MODEL_LOW, MODEL_HIGH) : uniform(2.0 * MODEL_LOW - MODEL_HIGH, 2.0 * MODEL_HIGH);
    if (described[element].causality != 'p')
        return uniform(-1.0, 1.0) * (MODEL_STATES ? 1.2 : 1.0);
    /* Other values would hardly ever be possible: knots go from one end of the range to the other. */
    if (chance(50) || begins(name, "kA_0") || begins(name, "FE_knots") || (MODEL_KNOTS && begins(name, "displacement_m")))
        return start;
    if (strcmp(name, "input_resolution") == 0)
        return MODEL_HIGH * pow(10.0, uniform(-4.0, 0.0));
    return start == 0.0 ? uniform(-1.0, 1.0) : start * (chance(80) ? uniform(0.9, 1.1) : pow(10.0, uniform(-1.9, 1.9)));
}

/* ---- lists ------------------------------------------------------------------------------------------------------- */

/* The elements of a variable of FMI 3.0, by their references in FMI 2.0. */
static unsigned elements_of(unsigned place, unsigned *count)
{
    static const unsigned arrays[] = {MODEL_ELASTIC, MODEL_KNOTS, MODEL_KNOTS, MODEL_AMPLIFIER};
    unsigned at = FIRST_ARRAY3 - 1, first = at;
    for (int i = 0; i < 4 && place >= at; i++) {
        if (arrays[i] > 0 && at++ == place)
            return *count = arrays[i], first;
        first += arrays[i];
    }
    return *count = 1, place < at ? place : first + (place - at);
}

static int fits(unsigned place, char type, const char *causalities)
{
    unsigned count, first = elements_of(place, &count);
    return described[first].type == type && strchr(causalities, described[first].causality) != NULL;
}

List drawn(char type, const char *causalities)
{
    enum { MOST = 40 };
    static const unsigned strange2[] = {MODEL_VARIABLES, MODEL_VARIABLES + 1, INT_MAX, UINT_MAX, 1u << 31};
    static const unsigned strange3[] = {INDICATOR3 + 1, INDICATOR3 + 30, INT_MAX, UINT_MAX, 0};
    unsigned two[MOST * 32], three[MOST];
    int exists = 0;
    for (unsigned place = 0; place < PLACES; place++)
        exists |= fits(place, type, causalities);
    List list = {.count = !exists && chance(80) ? 0 : (size_t)(chance(60) ? 1 : below(chance(80) ? 6 : MOST)), .sound = 1};
    for (size_t i = 0; i < list.count; i++) {
        int wrong = careless() || !exists, number = below(5);
        unsigned place = (unsigned)below(PLACES), count;
        while (!wrong && !fits(place, type, careless() ? READABLE : causalities))
            place = (unsigned)below(PLACES);
        unsigned first = elements_of(place, &count);
        int absent = wrong && chance(30);
        list.sound = list.sound && !absent && described[first].type == type;
        three[i] = absent ? strange3[number] : place + 1;
        for (unsigned k = 0; k < (absent ? 1 : count); k++)
            two[list.size++] = absent ? strange2[number] : first + k;
    }
    int none = list.count > 0 && careless() && chance(20);
    list.three = none || list.count == 0 ? NULL : memcpy(lent(list.count * 4), three, list.count * 4);
    list.two = none || list.count == 0 ? NULL : memcpy(lent(list.size * 4), two, list.size * 4);
    list.values2 = type == 'R' ? elements(list.size, sizeof(double)) : NULL;
    list.values3 = list.values2 == NULL ? NULL : lent(list.size * sizeof(double));
    for (size_t i = 0; list.values2 != NULL && i < list.size; i++) {
        list.values2[i] = list.values3[i] = usual_value(two[i]);
        trace("    %u: %.17g\n", two[i], list.values2[i]);
    }
    list.sound = list.sound && !none && (type != 'R' || list.size == 0 || list.values2 != NULL);
    return list;
}

int all_have(const List *list, const char *causalities)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strchr(causalities, described[list->two[i]].causality) == NULL)
            return 0;
    return 1;
}

int holds(const List *list, const char *name)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strcmp(described[list->two[i]].name, name) == 0)
            return 1;
    return 0;
}

/* ---- judgement --------------------------------------------------------------------------------------------------- */

void check_equal(const double *three, const double *two, size_t count, const char *of)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &two[i], sizeof bits);
        heard = (heard ^ bits) * 0x100000001b3u;
        CHECK(memcmp(&three[i], &two[i], sizeof *two) == 0, "value %zu of %s is %.17g in FMI 3.0 and %.17g in FMI 2.0",
              i, of, three[i], two[i]);
    }
}

static unsigned char *bytes_of(Pair *pair, int version)
{
    CHECK(fmi2GetFMUstate(pair->two, &pair->probe2) == fmi2OK && fmi3GetFMUState(pair->three, &pair->probe3) == fmi3OK &&
              fmi2SerializedFMUstateSize(pair->two, pair->probe2, &state_size) == fmi2OK,
          "a state cannot be taken");
    unsigned char *bytes = allocated(state_size);
    CHECK(version == 2 ? fmi2SerializeFMUstate(pair->two, pair->probe2, (fmi2Byte *)bytes, state_size) == fmi2OK
                       : fmi3SerializeFMUState(pair->three, pair->probe3, bytes, state_size) == fmi3OK,
          "a state cannot be serialized");
    return bytes;
}

void look(Pair *pair)
{
    free(pair->bytes);
    pair->bytes = bytes_of(pair, 2);
    unsigned char *three = bytes_of(pair, 3);
    for (size_t i = 0; i < state_size; i++)
        CHECK(three[i] == pair->bytes[i], "the states of FMI 2.0 and FMI 3.0 differ in byte %zu", i);
    free(three);
}

/* FMI 3.0 takes the state of FMI 2.0 or the other way; what the bytes lack would else be there already. */
static void join(Pair *pair, int to_three)
{
    trace("    joined\n");
    unsigned char *bytes = bytes_of(pair, to_three ? 2 : 3);
    CHECK(fmi3Reset(pair->three) == fmi3OK &&
              fmi3DeserializeFMUState(pair->three, bytes, state_size, &pair->probe3) == fmi3OK &&
              fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
          "FMI 3.0 does not take a state of FMI %d.0", to_three ? 2 : 3);
    CHECK(fmi2Reset(pair->two) == fmi2OK &&
              fmi2DeSerializeFMUstate(pair->two, (fmi2Byte *)bytes, state_size, &pair->probe2) == fmi2OK &&
              fmi2SetFMUstate(pair->two, pair->probe2) == fmi2OK,
          "FMI 2.0 does not take a state of FMI %d.0", to_three ? 2 : 3);
    free(bytes);
}

Trial trial_of(Pair *pair, int call)
{
    const Row *row = &rows[call];
    Trial trial = {.pair = pair, .call = call, .two = pair->two, .three = pair->three};
    trial.may2 = allowed(&pair->twin, row->two == NULL ? NULL : row->modes2);
    trial.may3 = allowed(&pair->twin, row->three == NULL ? NULL : row->modes3);
    trial.kept = pair->twin.mode == UNKNOWN ? UNSURE : YES;
    if (careless() && chance(10)) {
        trial.two = NULL;
        trial.three = NULL;
        must(&trial, NO);
    }
    trace("%ld: %s in mode %d\n", (long)(pair - pairs), row->two ? row->two : row->three, (int)pair->twin.mode);
    listen(pair, pair->name);
    blocks_before = blocks;
    tables_before = tables;
    /* The step with a deadline allocates nothing but states. */
    starving = MODEL_REAL_TIME && pair->twin.mode != INSTANTIATED && chance(20);
    return trial;
}

void must(Trial *trial, Answer condition)
{
    trial->may2 = least(trial->may2, condition);
    trial->may3 = least(trial->may3, condition);
}

static void check_answer(const Trial *trial, int version, int status)
{
    Answer may = version == 2 ? trial->may2 : trial->may3;
    const char *name = version == 2 ? rows[trial->call].two : rows[trial->call].three;
    const Said *of = &said[version - 2];
    if (status == NOT_CALLED)
        return;
    heard = (heard ^ (uint64_t)status) * 0x100000001b3u;
    CHECK(status == fmi2OK || status == fmi2Discard || status == fmi2Error, "the status is %d", status);
    CHECK(status == fmi2Error ? may != YES : may != NO && trial->kept != (status == fmi2OK ? NO : YES),
          "%s has the status %d, which is not predicted (%d, %d) in mode %d", name, status, (int)may, (int)trial->kept,
          (int)trial->pair->twin.mode);
    int told = trial->two != NULL && trial->pair->logger;
    CHECK(of->errors == (told && status != fmi2OK) && (status == fmi2OK || of->warnings == 0),
          "%s gives %d messages of errors and %d warnings with the status %d", name, of->errors, of->warnings, status);
}

int judged(Trial *trial, int two, int three)
{
    Pair *pair = trial->pair;
    const Row *row = &rows[trial->call];
    int done = (two == fmi2OK ? DONE2 : 0) | (three == fmi3OK ? DONE3 : 0);
    starving = 0;
    trace("    status %d and %d\n", two, three);
    check_answer(trial, 2, two);
    check_answer(trial, 3, three);
    if (two != NOT_CALLED && three != NOT_CALLED && strcmp(row->modes2, row->modes3) == 0)
        CHECK(two == three, "%s has the status %d in FMI 2.0, and %d in FMI 3.0", row->two, two, three);
    /* That a wrong velocity of the form with states has been reported is no part of its state. */
    CHECK(MODEL_STATES || said[0].warnings == 0 || said[1].warnings == 0 || said[0].warnings == said[1].warnings,
          "%s warns of different things", row->two);
    long expected = trial->states * (!!(done & DONE2) + !!(done & DONE3));
    long more = blocks - blocks_before + (OF_SYSTEM ? tables - tables_before : 0); /* its states are large */
    CHECK(more == expected, "a call takes %ld blocks of memory, not %ld", more, expected);
    CHECK(!MODEL_REAL_TIME || tables == tables_before, "a call allocates after instantiation");
    unsigned char *before = pair->bytes;
    pair->bytes = NULL;
    if (!trial->looks && (done == DONE2 || done == DONE3))
        join(pair, done == DONE2);
    look(pair);
    CHECK((done && !trial->looks) || memcmp(before, pair->bytes, state_size) == 0,
          "the state has changed with the status %d and %d of %s", two, three, row->two ? row->two : row->three);
    free(before);
    counts[trial->call][two == fmi2OK || three == fmi3OK ? 0 : two == fmi2Discard || three == fmi3Discard ? 1 : 2]++;
    return done;
}

/* ---- beginning and end ------------------------------------------------------------------------------------------- */

static char *copy_of(const char *text)
{
    return text == NULL ? NULL : exactly(text, strlen(text) + 1);
}

/* A version of the instance; its texts are the host's again after the call. */
static void *instance(Pair *pair, int version, const char *given)
{
    static const fmi3ValueReference none[1] = {0};
    const char *expected = !careless() ? MODEL_GUID : chance(20) ? NULL : awkward_text();
    char *name = copy_of(given), *guid = copy_of(expected);
    int exchange = pair->twin.exchange, events = careless() && !exchange, logger = pair->logger, half = careless();
    fmi2CallbackFunctions functions = callbacks_of(pair, logger, chance(80));
    fmi3LogMessageCallback log = logger ? log_three : NULL;
    void *made;
    starving = careless();
    int right = name != NULL && *name != '\0' && guid != NULL && strcmp(guid, MODEL_GUID) == 0 && !starving;
    listen(pair, NULL);
    blocks_before = blocks;
    if (version == 2) {
        right = right && !(half && functions.freeMemory != NULL);
        functions.freeMemory = half ? NULL : functions.freeMemory;
        made = fmi2Instantiate(name, exchange ? fmi2ModelExchange : fmi2CoSimulation, guid,
                               chance(50) ? NULL : awkward_text(), &functions, below(2), logger);
    } else if (exchange) {
        made = fmi3InstantiateModelExchange(name, guid, NULL, below(2), below(2), pair, log);
    } else {
        right = right && !events;
        made = fmi3InstantiateCoSimulation(name, guid, awkward_text(), below(2), below(2), events, below(2), none,
                                           (size_t)events, pair, log, NULL);
    }
    starving = 0;
    CHECK((made != NULL) == right, "an instance is %s", right ? "refused" : "made of wrong arguments");
    CHECK(said[version - 2].errors == (!right && logger) && said[version - 2].warnings == 0,
          "%d messages of errors come with an instance", said[version - 2].errors);
    CHECK(made || blocks == blocks_before, "a refused instance keeps memory");
    free(name);
    free(guid);
    return made;
}

int begin(Pair *pair)
{
    const char *name = !careless() ? "spring" : chance(20) ? NULL : awkward_text();
    int exchange = HAS_EXCHANGE && (MODEL_STATES || below(2));
    *pair = (Pair){.twin = twin_of(exchange), .logger = chance(90)};
    trace("%ld: instantiate, exchange %d\n", (long)(pair - pairs), exchange);
    pair->two = instance(pair, 2, name);
    pair->three = instance(pair, 3, name);
    if (pair->two == NULL || pair->three == NULL) {
        fmi2FreeInstance(pair->two);
        fmi3FreeInstance(pair->three);
        pair->two = NULL;
        return 0;
    }
    pair->name = copy_of(name);
    look(pair);
    return 1;
}

void end(Pair *pair)
{
    trace("%ld: free\n", (long)(pair - pairs));
    listen(pair, pair->name);
    CHECK(fmi2FreeFMUstate(pair->two, &pair->probe2) == fmi2OK && pair->probe2 == NULL &&
              fmi3FreeFMUState(pair->three, &pair->probe3) == fmi3OK && pair->probe3 == NULL,
          "a state is not freed");
    fmi2FreeInstance(pair->two);
    fmi3FreeInstance(pair->three);
    CHECK(said[0].errors + said[1].errors + said[0].warnings + said[1].warnings == 0, "freeing gives messages");
    free(pair->name);
    free(pair->bytes);
    *pair = (Pair){.two = NULL};
}
