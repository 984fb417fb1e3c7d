/* Pairs of instances, and the judgement of what both answer. */
#include "fuzz.h"

#include <ctype.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

Pair pairs[PAIRS];
size_t state_size;
static long blocks_before, tables_before;

/* ---- their state ------------------------------------------------------------------------------------------------- */

static unsigned char *bytes2(Pair *pair)
{
    CHECK(fmi2GetFMUstate(pair->two, &pair->probe2) == fmi2OK, "a state cannot be taken");
    if (state_size == 0)
        CHECK(fmi2SerializedFMUstateSize(pair->two, pair->probe2, &state_size) == fmi2OK, "a state has no size");
    unsigned char *bytes = allocated(state_size);
    CHECK(fmi2SerializeFMUstate(pair->two, pair->probe2, (fmi2Byte *)bytes, state_size) == fmi2OK,
          "a state cannot be serialized");
    return bytes;
}

static unsigned char *bytes3(Pair *pair)
{
    unsigned char *bytes = allocated(state_size);
    CHECK(fmi3GetFMUState(pair->three, &pair->probe3) == fmi3OK &&
              fmi3SerializeFMUState(pair->three, pair->probe3, bytes, state_size) == fmi3OK,
          "a state cannot be serialized");
    return bytes;
}

void look(Pair *pair)
{
    int before = starving;
    starving = 0;
    free(pair->bytes);
    pair->bytes = bytes2(pair);
    unsigned char *three = bytes3(pair);
    for (size_t i = 0; i < state_size; i++)
        CHECK(three[i] == pair->bytes[i], "the states of FMI 2.0 and FMI 3.0 differ in byte %zu", i);
    free(three);
    starving = before;
}

void join(Pair *pair, int to_three)
{
    trace("    joined");
    statistics.joined++;
    unsigned char *bytes = to_three ? bytes2(pair) : bytes3(pair);
    if (to_three)
        CHECK(fmi3Reset(pair->three) == fmi3OK && /* what the bytes lack would else be there already */
                  fmi3DeserializeFMUState(pair->three, bytes, state_size, &pair->probe3) == fmi3OK &&
                  fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
              "FMI 3.0 does not take a state of FMI 2.0");
    else
        CHECK(fmi2Reset(pair->two) == fmi2OK &&
                  fmi2DeSerializeFMUstate(pair->two, (fmi2Byte *)bytes, state_size, &pair->probe2) == fmi2OK &&
                  fmi2SetFMUstate(pair->two, pair->probe2) == fmi2OK,
              "FMI 2.0 does not take a state of FMI 3.0");
    /* That a wrong velocity has been reported is no part of the bytes; here both forget it. */
    if (MODEL_STATES && to_three)
        CHECK(fmi2Reset(pair->two) == fmi2OK && fmi2SetFMUstate(pair->two, pair->probe2) == fmi2OK,
              "FMI 2.0 does not take its own state");
    else if (MODEL_STATES)
        CHECK(fmi3Reset(pair->three) == fmi3OK && fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
              "FMI 3.0 does not take its own state");
    free(bytes);
}

/* ---- judgement --------------------------------------------------------------------------------------------------- */

Trial trial_of(Pair *pair, int call)
{
    const Row *row = &rows[call];
    Trial trial = {.pair = pair, .call = call, .two = pair->two, .three = pair->three, .kept = YES, .words = 1};
    /* The FMU of a system lacks calls of model exchange in FMI 2.0. */
    trial.has2 = row->two != NULL && !(OF_SYSTEM && row->three != NULL && strcmp(row->modes2 + 6, "----") == 0);
    trial.may2 = row->two == NULL ? NO : allowed(&pair->twin, row->modes2);
    trial.may3 = row->three == NULL ? NO : allowed(&pair->twin, row->modes3);
    trial.warnings = pair->twin.mode == UNKNOWN ? -1 : 0;
    trial.kept = pair->twin.mode == UNKNOWN ? UNSURE : YES;
    if (careless() && chance(10)) {
        trial.two = NULL;
        trial.three = NULL;
        must(&trial, NO);
    }
    trace("%ld: %s in mode %d", (long)(pair - pairs), row->name, (int)pair->twin.mode);
    listen(pair, pair->name);
    blocks_before = blocks;
    tables_before = tables;
    /* The step with a deadline allocates nothing but states. */
    starving = MODEL_REAL_TIME && pair->twin.mode != INSTANTIATED && chance(20);
    return trial;
}

void must(Trial *trial, Answer condition)
{
    trial->may2 = both(trial->may2, condition);
    trial->may3 = both(trial->may3, condition);
}

static void check_status(const Trial *trial, int status, Answer may, const char *name)
{
    CHECK(status == fmi2OK || status == fmi2Discard || status == fmi2Error, "the status is %d", status);
    int right = status == fmi2Error ? may != YES : may != NO && trial->kept != (status == fmi2OK ? NO : YES);
    CHECK(right, "%s has the status %d, which is not predicted (%d, %d) in mode %d", name, status, (int)may,
          (int)trial->kept, (int)trial->pair->twin.mode);
}

static void check_messages(const Said *of, int status, int told, int warnings, const char *name)
{
    CHECK(of->errors == (told && status == fmi2Error) && of->discards == (told && status == fmi2Discard),
          "%s gives %d messages of errors and %d of discards with the status %d", name, of->errors, of->discards,
          status);
    CHECK(warnings < 0 || of->warnings == warnings, "%s gives %d warnings where %d are due", name, of->warnings,
          warnings);
}

/* Whether two messages differ in the names of calls only. */
static int same_text(const char *one, const char *other)
{
    if (strstr(one, " must be called ") != NULL && strstr(other, " must be called ") != NULL) {
        one = strstr(one, " must be called ");
        other = strstr(other, " must be called ");
    }
    for (; *one != '\0' && *other != '\0'; one++, other++)
        if (tolower((unsigned char)*one) != tolower((unsigned char)*other) && !(*one == '2' && *other == '3'))
            return 0;
    return *one == *other;
}

static void check_versions(const Trial *trial, int two, int three)
{
    const Pair *pair = trial->pair;
    int same = trial->words && strcmp(rows[trial->call].modes2, rows[trial->call].modes3) == 0;
    if (same && two != NOT_CALLED && two != fmi2OK && three == two && trial->two != NULL && pair->errors2)
        CHECK(same_text(said[0].text, said[1].text), "FMI 2.0 says `%s`, FMI 3.0 `%s`", said[0].text, said[1].text);
    int warnings = !pair->warnings3 || three != fmi3OK        ? 0
                   : two == fmi2OK && pair->warnings2 ? said[0].warnings
                                                      : trial->warnings;
    check_messages(&said[1], three, trial->three != NULL && pair->logger, warnings, rows[trial->call].three);
}

static void check_memory(const Trial *trial, int done)
{
    long instances = 0, expected = trial->states * (!!(done & DONE2) + !!(done & DONE3));
    for (int i = 0; i < PAIRS; i++)
        instances += 2 * (pairs[i].two != NULL);
    long more = blocks - blocks_before + (OF_SYSTEM ? tables - tables_before : 0); /* its states are large */
    CHECK(more == expected, "%s takes %ld blocks of memory, not %ld", rows[trial->call].name, more, expected);
    CHECK(!MODEL_REAL_TIME || tables == tables_before, "%s allocates after instantiation", rows[trial->call].name);
    /* Each a table, and the laws of changed parameters. */
    CHECK(OF_SYSTEM || tables <= 2 * instances, "%ld instances have %ld tables and laws", instances, tables);
}

int judged(Trial *trial, int two, int three)
{
    Pair *pair = trial->pair;
    const Row *row = &rows[trial->call];
    int done = (two == fmi2OK ? DONE2 : 0) | (three == fmi3OK ? DONE3 : 0);
    starving = 0;
    trace("    status %d and %d", two, three);
    statistics.calls++;
    if (two != NOT_CALLED) {
        check_status(trial, two, trial->may2, row->two);
        int warnings = two == fmi2OK && pair->warnings2 ? trial->warnings : 0;
        check_messages(&said[0], two, trial->two != NULL && pair->errors2, warnings, row->two);
    }
    if (three != NOT_CALLED) {
        check_status(trial, three, trial->may3, row->three);
        check_versions(trial, two, three);
    }
    if (two != NOT_CALLED && three != NOT_CALLED && strcmp(row->modes2, row->modes3) == 0)
        CHECK(two == three, "%s has the status %d in FMI 2.0, and %d in FMI 3.0", row->name, two, three);
    check_memory(trial, done);
    unsigned char *before = pair->bytes;
    pair->bytes = NULL;
    if (trial->effect == CHANGES && (done == DONE2 || done == DONE3))
        join(pair, done == DONE2);
    look(pair);
    CHECK((done && trial->effect == CHANGES) || memcmp(before, pair->bytes, state_size) == 0,
          "the state has changed with the status %d and %d of %s", two, three, row->name);
    free(before);
    int status = two == NOT_CALLED ? three : two;
    ++(status == fmi2OK ? statistics.done : status == fmi2Discard ? statistics.discarded : statistics.refused)[trial->call];
    return done;
}

/* ---- beginning and end ------------------------------------------------------------------------------------------- */

static char *copy_of(const char *text)
{
    return text == NULL ? NULL : exactly(text, strlen(text) + 1);
}

/* The host may do with its copy what it likes afterwards. */
static void spoil(char *text)
{
    if (text != NULL)
        memset(text, '!', strlen(text));
    free(text);
}

static void check_begun(int made, int right, int errors, const char *call)
{
    CHECK(made == right, "fmi%s: an instance is %s", call, right ? "refused" : "made of wrong arguments");
    CHECK(errors == said[0].errors + said[1].errors && said[0].warnings + said[1].warnings == 0,
          "fmi%s gives %d messages of errors", call, said[0].errors + said[1].errors);
    CHECK(made || blocks == blocks_before, "a refused instance keeps memory");
}

static fmi2Component begin_two(Pair *pair, const char *name)
{
    static const char *const places[] = {NULL, "", "file:///tmp/%s", "\xff", "../.."};
    int usual = pair->twin.exchange ? fmi2ModelExchange : fmi2CoSimulation;
    int other = MODEL_STATES || !HAS_EXCHANGE ? !usual : 2, half = careless();
    int type = careless() ? (int[]){-1, other, INT_MAX, INT_MIN}[below(4)] : usual;
    char *guid = copy_of(!careless() ? MODEL_GUID : chance(20) ? NULL : awkward_text());
    char *own = copy_of(name), *place = copy_of(places[below(5)]);
    int counting = chance(80);
    fmi2CallbackFunctions given = callbacks_of(pair, pair->logger, counting);
    if (half)
        *(chance(50) ? (void **)&given.allocateMemory : (void **)&given.freeMemory) = NULL;
    fmi2CallbackFunctions *functions = careless() && chance(20) ? NULL : exactly(&given, sizeof given);
    starving = careless();
    int right = functions != NULL && name != NULL && *name != '\0' && type == usual && guid != NULL &&
                strcmp(guid, MODEL_GUID) == 0 && !(half && counting) && !starving;
    fmi2Component made = fmi2Instantiate(own, (fmi2Type)type, guid, place, functions, below(2), below(2));
    starving = 0;
    check_begun(made != NULL, right, !right && functions != NULL && pair->logger, "2Instantiate");
    spoil(own);
    spoil(guid);
    spoil(place);
    free(functions);
    return made;
}

static fmi3Instance begin_three(Pair *pair, const char *name)
{
    static const fmi3ValueReference none[1] = {0};
    int usual = !pair->twin.exchange, other = MODEL_STATES || !HAS_EXCHANGE ? !usual : 2;
    int type = careless() ? (chance(50) ? 2 : other) : usual, events = careless(), logging = below(2);
    size_t intermediate = (size_t)careless();
    char *token = copy_of(!careless() ? MODEL_GUID : chance(20) ? NULL : awkward_text()), *own = copy_of(name);
    fmi3LogMessageCallback logger = pair->logger ? log_three : NULL;
    starving = careless();
    int right = name != NULL && *name != '\0' && type == usual && token != NULL && strcmp(token, MODEL_GUID) == 0 &&
                !starving && !(type == 1 && (events || intermediate));
    fmi3Instance made =
        type == 0 ? fmi3InstantiateModelExchange(own, token, NULL, below(2), logging, pair, logger)
        : type == 1
            ? fmi3InstantiateCoSimulation(own, token, awkward_text(), below(2), logging, events, below(2), none,
                                          intermediate, pair, logger, NULL)
            : fmi3InstantiateScheduledExecution(own, token, NULL, below(2), logging, pair, logger, NULL, NULL, NULL);
    starving = 0;
    check_begun(made != NULL, right, !right && pair->logger, "3Instantiate");
    pair->warnings3 = logging && pair->logger;
    spoil(own);
    spoil(token);
    return made;
}

int begin(Pair *pair)
{
    const char *name = !careless() ? "spring" : chance(20) ? NULL : awkward_text();
    int exchange = HAS_EXCHANGE && (MODEL_STATES || below(2)), logger = chance(90);
    *pair = (Pair){.twin = twin_of(exchange), .logger = logger, .errors2 = logger, .warnings2 = logger};
    trace("%ld: instantiate, type %d", (long)(pair - pairs), !exchange);
    blocks_before = blocks;
    listen(pair, NULL);
    pair->two = begin_two(pair, name);
    blocks_before = blocks;
    listen(pair, NULL);
    pair->three = begin_three(pair, name);
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
    trace("%ld: free", (long)(pair - pairs));
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
    statistics.sequences++;
}
