/* Pairs of instances, what a host may expect of them, and the judgement of what both answer. */
#include "host.h"

typedef enum { INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS_TIME, STEP, TERMINATED, UNKNOWN } Mode;
typedef enum { NO, UNSURE, YES } Answer;

/* Causalities: i(nput), o(utput), l(ocal) or p(arameter); of the form with states omega is a s(tate), absorbed_energy one
 * that is an O(utput), too, and their derivatives are r(ates). */
static const struct {
    const char *name;
    char type, causality;
    int tunable;
    double start;
} described[MODEL_VARIABLES] = {MODEL_TABLE};
#define SETTABLE "ipsO"
#define READABLE SETTABLE "olr"

enum {
    OF_SYSTEM = MODEL_AMPLIFIER == 0, /* for co-simulation alone, as is the usual form with branches */
    HAS_EXCHANGE = !OF_SYSTEM && (MODEL_STATES || MODEL_BRANCHES == 0),
    INDICATORS = !MODEL_STATES && !OF_SYSTEM,
    /* References of FMI 3.0 are those of FMI 2.0 and 1; the time and the event indicator come last. */
    TIME3 = MODEL_VARIABLES + 1,
    INDICATOR3 = TIME3 + INDICATORS,
    PAIRS = 3,
    MOST_BYTES = 1 << 16, /* of a state */
    NOT_CALLED = -1, DONE2 = 1, DONE3 = 2
};

typedef struct {
    int exchange;
    Mode mode; /* UNKNOWN after a state whose numbers were made up */
    double time, stop_time;
    double value[MODEL_VARIABLES]; /* set last */
    int moved;                     /* inputs follow from their derivatives, so that their values are not known */
    int interpolated;              /* or will, in the next step */
    Answer sound;                  /* YES: the parameters are those of the FMU; UNSURE: others, perhaps of no spring */
} Twin;

typedef struct {
    fmi2Component two; /* NULL while there is no pair */
    fmi3Instance three;
    const char *name;
    Twin twin;
    int logger;          /* whether it hears messages */
    fmi2FMUstate probe2; /* memory for looking at their states */
    fmi3FMUState probe3;
    unsigned char bytes[MOST_BYTES]; /* their state after the last call */
} Pair;

typedef struct Trial Trial;
typedef struct {
    const char *two, *three; /* names of the call; NULL where a version has none */
    const char *modes2, *modes3;
    void (*try)(Trial *trial);
} Row;

struct Trial {
    Pair *pair;
    Twin *twin;
    const Row *row;
    long *counts;       /* how often the call was done, and refused */
    const char *name;
    fmi2Component two; /* at times NULL */
    fmi3Instance three;
    Answer may2, may3, kept; /* whether it is no error, and not discarded */
    int states, looks;       /* states that both allocate if it is done; whether it changes nothing */
    long blocks;             /* before */
};

static Pair pairs[PAIRS];
static size_t state_size;
static uint64_t heard; /* a hash of all that came back */

#define begins(name, part) (strncmp((name), (part), strlen(part)) == 0)
#define same(one, other) (strcmp((one), (other)) == 0)
#define least(one, other) ((one) < (other) ? (one) : (other))

static void must(Trial *trial, Answer condition)
{
    trial->may2 = least(trial->may2, condition);
    trial->may3 = least(trial->may3, condition);
}

#define is(trial, call) same((trial)->name, (call))

/* ---- what is expected -------------------------------------------------------------------------------------------- */

/* Columns: model exchange instantiated, in initialization, event and continuous-time mode, terminated; co-simulation
 * instantiated, in initialization mode, between steps, terminated. Where there is a question mark, tables in use differ. */
static Answer allowed(const Twin *twin, const char *modes)
{
    static const int columns[2][UNKNOWN] = {{6, 7, 0, 0, 8, 9}, {0, 1, 2, 3, 0, 4}};
    if (twin->mode == UNKNOWN || modes == NULL)
        return modes == NULL ? NO : UNSURE;
    char mark = modes[columns[twin->exchange][twin->mode]];
    return mark == '-' ? NO : mark == '?' ? UNSURE : YES;
}

static Twin twin_of(int exchange)
{
    Twin twin = {.exchange = exchange, .mode = INSTANTIATED, .stop_time = INFINITY, .sound = YES};
    for (int i = 0; i < MODEL_VARIABLES; i++)
        twin.value[i] = described[i].start;
    return twin;
}

/* A value that is possible most often. */
static double usual_value(unsigned element)
{
    const char *name = element < MODEL_VARIABLES ? described[element].name : "";
    /* Never so small that a step of co-simulation takes long. */
    if (same(name, "step"))
        return MODEL_LARGEST_STEP * pow(10.0, uniform(-2.0, 0.2));
    if (element >= MODEL_VARIABLES || careless())
        return awkward();
    double start = described[element].start;
    if (OF_SYSTEM)
        return same(name, "omega_start") ? below(3) - 1.0 : begins(name, "gravity_") ? start : uniform(-1e2, 1e2);
    if (chance(2)) /* as far as a spring or its motion can go */
        return described[element].causality == 'p' ? start * pow(10.0, uniform(-15.0, 15.0)) : uniform(-1e9, 1e9);
    if (same(name, "displacement"))
        return uniform(MODEL_LOW - 0.1 * MODEL_HIGH, 1.1 * MODEL_HIGH);
    if (described[element].causality != 'p')
        return uniform(-1.2, 1.2);
    if (same(name, "input_resolution") && chance(20))
        return MODEL_HIGH * pow(10.0, uniform(-4.0, 0.0));
    return chance(80) ? start : start * (chance(80) ? uniform(0.9, 1.1) : pow(10.0, uniform(-1.9, 1.9)));
}

/* ---- lists ------------------------------------------------------------------------------------------------------- */

/* Some variables, at times the same one twice; all on the heap and of exactly this size. */
typedef struct {
    size_t size;
    fmi3ValueReference *three; /* NULL at times */
    unsigned *two;
    double *values2, *values3; /* NULL at times */
    int sound;                 /* nothing is NULL, and all are of the type asked for */
} List;

static int fits(unsigned place, const char *causalities)
{
    return described[place].type == 'R' && strchr(causalities, described[place].causality) != NULL;
}

/* Numbers of some causalities, or others if the host is careless, with values to set. */
static List drawn(const char *causalities)
{
    enum { MOST = 40 };
    static const unsigned strange2[] = {MODEL_VARIABLES, MODEL_VARIABLES + 1, INT_MAX, UINT_MAX, 1u << 31};
    static const unsigned strange3[] = {INDICATOR3 + 1, INDICATOR3 + 30, INT_MAX, UINT_MAX, 0};
    unsigned two[MOST], three[MOST];
    List list = {.size = (size_t)(chance(60) ? 1 : below(chance(80) ? 6 : MOST)), .sound = 1};
    for (size_t i = 0; i < list.size; i++) {
        int wrong = careless(), number = below(5), absent = wrong && chance(30);
        unsigned place = (unsigned)below(MODEL_VARIABLES);
        while (!wrong && !fits(place, careless() ? READABLE : causalities))
            place = (unsigned)below(MODEL_VARIABLES);
        list.sound = list.sound && !absent && described[place].type == 'R';
        three[i] = absent ? strange3[number] : place + 1;
        two[i] = absent ? strange2[number] : place;
    }
    if (list.size == 0)
        return list;
    int none = careless() && chance(20);
    list.three = none ? NULL : copy(three, list.size * sizeof *three);
    list.two = none ? NULL : copy(two, list.size * sizeof *two);
    list.values2 = elements(list.size, sizeof(double));
    list.values3 = list.values2 == NULL ? NULL : lent(list.size * sizeof(double));
    for (size_t i = 0; list.values2 != NULL && i < list.size; i++) {
        list.values2[i] = list.values3[i] = usual_value(two[i]);
        trace("    %u: %.17g\n", two[i], list.values2[i]);
    }
    list.sound = list.sound && !none && list.values2 != NULL;
    return list;
}

static int all_have(const List *list, const char *causalities)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strchr(causalities, described[list->two[i]].causality) == NULL)
            return 0;
    return 1;
}

static int holds(const List *list, const char *name)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strcmp(described[list->two[i]].name, name) == 0)
            return 1;
    return 0;
}

/* ---- judgement --------------------------------------------------------------------------------------------------- */

static void check_equal(const double *three, const double *two, size_t count, const char *of)
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
              fmi2SerializedFMUstateSize(pair->two, pair->probe2, &state_size) == fmi2OK && state_size <= MOST_BYTES,
          "a state cannot be taken");
    unsigned char *bytes = lent(state_size);
    CHECK(version == 2 ? fmi2SerializeFMUstate(pair->two, pair->probe2, (fmi2Byte *)bytes, state_size) == fmi2OK
                       : fmi3SerializeFMUState(pair->three, pair->probe3, bytes, state_size) == fmi3OK,
          "a state cannot be serialized");
    return bytes;
}

static void look(Pair *pair)
{
    const unsigned char *two = bytes_of(pair, 2), *three = bytes_of(pair, 3);
    memcpy(pair->bytes, two, state_size);
    CHECK(memcmp(two, three, state_size) == 0, "the states of FMI 2.0 and FMI 3.0 differ");
}

/* Both versions take the state of bytes; what these lack would else be there already. */
static void put_state(Pair *pair, unsigned char *bytes)
{
    CHECK(fmi2Reset(pair->two) == fmi2OK && fmi3Reset(pair->three) == fmi3OK &&
              fmi2DeSerializeFMUstate(pair->two, (fmi2Byte *)bytes, state_size, &pair->probe2) == fmi2OK &&
              fmi3DeserializeFMUState(pair->three, bytes, state_size, &pair->probe3) == fmi3OK &&
              fmi2SetFMUstate(pair->two, pair->probe2) == fmi2OK && fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
          "a state is not taken");
}

static void check_answer(const Trial *trial, int version, int status)
{
    Answer may = version == 2 ? trial->may2 : trial->may3;
    int errors = said[version - 2].errors, told = trial->two != NULL && trial->pair->logger && status != fmi2OK;
    if (status == NOT_CALLED)
        return;
    heard = (heard ^ (uint64_t)status) * 0x100000001b3u;
    CHECK(status == fmi2OK || status == fmi2Discard || status == fmi2Error, "the status is %d", status);
    CHECK(status == fmi2Error ? may != YES || starved : may != NO && trial->kept != (status == fmi2OK ? NO : YES),
          "%s of FMI %d has the status %d, which is not predicted (%d, %d) in mode %d", trial->name, version, status,
          (int)may, (int)trial->kept, (int)trial->twin->mode);
    CHECK(errors == told && (status == fmi2OK || said[version - 2].warnings == 0),
          "%s gives %d messages of errors with the status %d", trial->name, errors, status);
}

/* Compares the statuses with what the table says and the versions with each other; which of both was done. */
static int judged(Trial *trial, int two, int three)
{
    Pair *pair = trial->pair;
    int done = (two == fmi2OK ? DONE2 : 0) | (three == fmi3OK ? DONE3 : 0);
    starving = 0;
    trace("    status %d and %d\n", two, three);
    check_answer(trial, 2, two);
    check_answer(trial, 3, three);
    CHECK(two == three || starved || two == NOT_CALLED || three == NOT_CALLED || !same(trial->row->modes2, trial->row->modes3),
          "%s has the status %d in FMI 2.0, and %d in FMI 3.0", trial->name, two, three);
    /* That a wrong velocity of the form with states has been reported is no part of its state. */
    CHECK(MODEL_STATES || said[0].warnings == 0 || said[1].warnings == 0 || said[0].warnings == said[1].warnings,
          "%s warns of different things", trial->name);
    long expected = trial->states * (!!(done & DONE2) + !!(done & DONE3));
    long more = blocks - trial->blocks;
    CHECK(more == expected, "a call takes %ld blocks of memory after instantiation, not %ld", more, expected);
    const unsigned char *before = copy(pair->bytes, state_size);
    if (!trial->looks && (done == DONE2 || done == DONE3))
        put_state(pair, bytes_of(pair, done == DONE2 ? 2 : 3));
    look(pair);
    CHECK((done && !trial->looks) || memcmp(before, pair->bytes, state_size) == 0,
          "the state has changed with the status %d and %d of %s", two, three, trial->name);
    trial->counts[!done]++;
    return done;
}

/* ---- beginning and end ------------------------------------------------------------------------------------------- */

/* A version of the instance; its texts are the host's again after the call. */
static void *instance(Pair *pair, int version)
{
    static const fmi3ValueReference none[1] = {0};
    const char *expected = !careless() ? MODEL_GUID : chance(20) ? NULL : awkward_text();
    char *name = pair->name ? copy(pair->name, strlen(pair->name) + 1) : NULL;
    char *guid = expected ? copy(expected, strlen(expected) + 1) : NULL;
    int exchange = pair->twin.exchange, events = careless() && !exchange, logger = pair->logger, counting = chance(80);
    fmi2CallbackFunctions functions = {logger ? log_two : NULL, counting ? library_calloc : NULL,
                                       counting ? library_free : NULL, NULL, pair};
    fmi3LogMessageCallback log = logger ? log_three : NULL;
    void *made;
    long before = blocks;
    starving = careless() ? 1 + below(5) : 0;
    starved = 0;
    int right = name != NULL && *name != '\0' && guid != NULL && same(guid, MODEL_GUID);
    listen(pair, NULL);
    if (version == 2) {
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
    right = right && !starved;
    CHECK((made != NULL) == right, "an instance is %s", right ? "refused" : "made of wrong arguments");
    CHECK(said[version - 2].errors == (!right && logger) && said[version - 2].warnings == 0,
          "%d messages of errors come with an instance", said[version - 2].errors);
    CHECK(made || blocks == before, "a refused instance keeps memory");
    return made;
}

/* Whether there is a pair now. */
static int begin(Pair *pair)
{
    *pair = (Pair){.twin = twin_of(HAS_EXCHANGE && (MODEL_STATES || below(2))), .logger = chance(90)};
    pair->name = !careless() ? "spring" : chance(20) ? NULL : awkward_text();
    trace("%ld: instantiate, exchange %d\n", (long)(pair - pairs), pair->twin.exchange);
    pair->two = instance(pair, 2);
    pair->three = instance(pair, 3);
    take_back(0);
    if (pair->two != NULL && pair->three != NULL) {
        look(pair);
        return 1;
    }
    fmi2FreeInstance(pair->two);
    fmi3FreeInstance(pair->three);
    pair->two = NULL;
    return 0;
}

static void end(Pair *pair)
{
    trace("%ld: free\n", (long)(pair - pairs));
    listen(pair, pair->name);
    CHECK(fmi2FreeFMUstate(pair->two, &pair->probe2) == fmi2OK && pair->probe2 == NULL &&
              fmi3FreeFMUState(pair->three, &pair->probe3) == fmi3OK && pair->probe3 == NULL,
          "a state is not freed");
    fmi2FreeInstance(pair->two);
    fmi3FreeInstance(pair->three);
    CHECK(said[0].errors + said[1].errors + said[0].warnings + said[1].warnings == 0, "freeing gives messages");
    pair->two = NULL;
}
