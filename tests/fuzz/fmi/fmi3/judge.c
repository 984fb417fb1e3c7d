#include "pairs.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Pair pairs[PAIRS];
Statistics3 statistics3;

/* What FMI 2.0 and 3.0 have said since `listen`. */
typedef struct {
    Messages count;
    char text[1024];
} Said;
static Said said[2];
static Pair *heard_for;
static long blocks_before, tables_before;
static size_t size_of_states;
static const char *expected_name;

size_t state_size(void)
{
    return size_of_states;
}

double usual_displacement(void)
{
    if (OF_SYSTEM)
        return uniform(-0.05, 0.05);
    double low = described[variable("displacement_min")].start, high = described[variable("displacement_max")].start;
    return low + (high - low) * (chance(90) ? uniform(0.0, 1.0) : uniform(-1.0, 2.0));
}

void listen(Pair *pair)
{
    heard_for = pair;
    said[0] = said[1] = (Said){.count = {0, 0, 0}};
    blocks_before = blocks;
    tables_before = tables;
}

static void hear(int version, const void *environment, int status, const char *category, const char *text)
{
    Messages *count = &said[version - 2].count;
    trace("    FMI %d says: %s", version, text);
    CHECK(environment == heard_for, "a message goes to the environment of another instance");
    CHECK(strcmp(category, status == fmi3Warning ? "logStatusWarning" : "logStatusError") == 0,
          "a message of status %d has the category %s", status, category);
    for (const char *at = text; *at != '\0'; at++)
        CHECK(*at >= ' ' && *at <= '~' && *at != '#', "the message `%s` holds the byte %d", text, (unsigned char)*at);
    CHECK(strlen(text) > 10, "the message `%s` says nothing", text);
    snprintf(said[version - 2].text, sizeof said->text, "%s", text);
    ++*(status == fmi3Warning ? &count->warnings : status == fmi3Discard ? &count->discards : &count->errors);
}

static void log_two(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                    fmi2String format, ...)
{
    char text[1024];
    va_list arguments;
    (void)name;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    hear(2, environment, (int)status, category, text);
}

static void log_three(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text)
{
    hear(3, environment, (int)status, category, text);
}

/* Whether two messages differ in the names of calls only. */
static int same_text(const char *one, const char *other)
{
    for (; *one != '\0' && *other != '\0'; one++, other++)
        if (tolower((unsigned char)*one) != tolower((unsigned char)*other) && !(*one == '2' && *other == '3'))
            return 0;
    return *one == *other;
}

/* As many messages of FMI 3.0 as its status demands. */
static void check_messages(const Pair *pair, const char *call, int status, int warnings)
{
    Messages count = said[1].count;
    int told = pair == NULL || pair->logger;
    CHECK(count.errors == (told && status == fmi3Error) && count.discards == (told && status == fmi3Discard),
          "fmi3%s gives %d messages of errors and %d of discards with the status %d", call, count.errors,
          count.discards, status);
    CHECK(count.warnings == warnings, "fmi3%s gives %d warnings where %d are due", call, count.warnings, warnings);
}

static void check_memory(const char *call, int holds_states)
{
    CHECK(holds_states || blocks == blocks_before, "fmi3%s keeps or loses %ld blocks of memory", call,
          blocks - blocks_before);
    CHECK(!MODEL_REAL_TIME || tables == tables_before, "fmi3%s allocates after instantiation", call);
}

void look_at(Pair *pair)
{
    int before = starving;
    starving = 0;
    CHECK(fmi2GetFMUstate(pair->two, &pair->probe2) == fmi2OK && fmi3GetFMUState(pair->three, &pair->probe3) == fmi3OK,
          "a state cannot be taken");
    if (size_of_states == 0)
        CHECK(fmi3SerializedFMUStateSize(pair->three, pair->probe3, &size_of_states) == fmi3OK, "a state has no size");
    unsigned char *two = allocated(size_of_states);
    free(pair->bytes);
    pair->bytes = allocated(size_of_states);
    CHECK(fmi2SerializeFMUstate(pair->two, pair->probe2, (fmi2Byte *)two, size_of_states) == fmi2OK &&
              fmi3SerializeFMUState(pair->three, pair->probe3, pair->bytes, size_of_states) == fmi3OK,
          "a state cannot be serialized");
    for (size_t i = 0; i < size_of_states; i++)
        CHECK(two[i] == pair->bytes[i], "the states of FMI 2.0 and FMI 3.0 differ in byte %zu", i);
    free(two);
    starving = before;
}

static void look_unchanged(Pair *pair, const char *call, int status)
{
    unsigned char *before = pair->bytes;
    pair->bytes = NULL;
    look_at(pair);
    CHECK(status == fmi3OK || memcmp(before, pair->bytes, size_of_states) == 0,
          "the state has changed though fmi3%s returned the status %d", call, status);
    free(before);
}

int settled(Pair *pair, Call3 call, int status, int expected, int same_words)
{
    const char *name = call3_names[call];
    trace("    status %d, expected %d", status, expected);
    statistics.calls++;
    CHECK(status == expected, "fmi3%s returns %d where %d is expected (mode %d, %s)", name, status, expected,
          (int)pair->mode, pair->exchange ? "model exchange" : "co-simulation");
    check_messages(pair, name, status, pair->warns ? said[0].count.warnings : 0);
    CHECK(!same_words || !pair->logger || status == fmi3OK || same_text(said[0].text, said[1].text),
          "FMI 2.0 says `%s`, FMI 3.0 `%s`", said[0].text, said[1].text);
    check_memory(name, call == CALL3_GetFMUState || call == CALL3_FreeFMUState || call == CALL3_DeserializeFMUState);
    look_unchanged(pair, name, status);
    ++(status == fmi3OK ? statistics3.done : statistics3.refused)[call];
    statistics3.discarded += status == fmi3Discard;
    return status == fmi3OK;
}

void must_name(const char *name)
{
    expected_name = name;
}

void refused(Pair *pair, const char *call, fmi3Status status)
{
    trace("    hostile fmi3%s: status %d", call, (int)status);
    statistics3.hostile++;
    CHECK(status == fmi3Error, "fmi3%s returns %d where it must be refused (mode %d, %s)", call, (int)status,
          (int)pair->mode, pair->exchange ? "model exchange" : "co-simulation");
    check_messages(pair, call, fmi3Error, 0);
    int of_mode = strstr(said[1].text, " must be called ") != NULL;
    CHECK(expected_name == NULL || !pair->logger || of_mode || strstr(said[1].text, expected_name) != NULL,
          "fmi3%s does not name %s: %s", call, expected_name, said[1].text);
    expected_name = NULL;
    check_memory(call, 0);
    look_unchanged(pair, call, fmi3Error);
    listen(pair);
}

void check_equal(const double *three, const double *two, size_t count, const char *of)
{
    for (size_t i = 0; i < count; i++)
        CHECK(memcmp(&three[i], &two[i], sizeof *two) == 0, "value %zu of %s is %.17g in FMI 3.0 and %.17g in FMI 2.0",
              i, of, three[i], two[i]);
    statistics3.compared += (long)count;
}

/* ---- the beginning and end of a pair ----------------------------------------------------------------------------- */

static fmi3Instance instantiate_three(Pair *pair, const char *name, const char *token, int type, int events,
                                      size_t intermediate, fmi3LogMessageCallback logger)
{
    static const fmi3ValueReference none[1] = {0};
    switch (type) {
    case 0: return fmi3InstantiateModelExchange(name, token, NULL, below(2), pair->warns, pair, logger);
    case 1:
        return fmi3InstantiateCoSimulation(name, token, awkward_text(), below(2), pair->warns, events, below(2), none,
                                           intermediate, pair, logger, NULL);
    default:
        return fmi3InstantiateScheduledExecution(name, token, NULL, below(2), pair->warns, pair, logger, NULL, NULL,
                                                 NULL);
    }
}

int begin_pair(Pair *pair)
{
    int wrong = careless() ? 1 + below(6) : 0;
    /* The usual form of a spring with branches is for co-simulation alone. */
    int has_exchange = !OF_SYSTEM && (MODEL_STATES || MODEL_BRANCHES == 0);
    *pair = (Pair){.exchange = has_exchange && (MODEL_STATES || below(2)), .logger = chance(90), .mode = INSTANTIATED};
    pair->warns = pair->logger && below(2);
    trace("%ld: instantiate, wrong %d", (long)(pair - pairs), wrong);
    listen(pair);
    const char *const names[] = {NULL, ""}, *const tokens[] = {NULL, awkward_text()};
    int type = wrong == 3 ? (OF_SYSTEM ? 2 * below(2) : 2) : wrong == 4 || wrong == 5 ? 1 : !pair->exchange;
    char *name = exactly("spring", 7);
    starving = wrong == 6;
    pair->three =
        instantiate_three(pair, wrong == 1 ? names[below(2)] : name, wrong == 2 ? tokens[below(2)] : MODEL_GUID, type,
                          wrong == 4, wrong == 5, pair->logger ? log_three : NULL);
    starving = 0;
    memset(name, '!', 6);
    free(name);
    CHECK((pair->three == NULL) == (wrong != 0), "an instance is %s", wrong ? "made of wrong arguments" : "refused");
    check_messages(pair, "Instantiate", wrong ? fmi3Error : fmi3OK, 0);
    if (wrong) {
        check_memory("Instantiate", 0);
        return 0;
    }
    fmi2CallbackFunctions callbacks = host_callbacks(pair, 1, 1);
    callbacks.logger = log_two;
    pair->two = fmi2Instantiate("spring", pair->exchange ? fmi2ModelExchange : fmi2CoSimulation, MODEL_GUID, NULL,
                                &callbacks, 0, 0);
    CHECK(pair->two != NULL, "FMI 2.0 gives no instance");
    look_at(pair);
    return 1;
}

void end_pair(Pair *pair)
{
    trace("%ld: free", (long)(pair - pairs));
    listen(pair);
    CHECK(fmi2FreeFMUstate(pair->two, &pair->probe2) == fmi2OK &&
              fmi3FreeFMUState(pair->three, &pair->probe3) == fmi3OK && pair->probe3 == NULL,
          "a state is not freed");
    fmi2FreeInstance(pair->two);
    fmi3FreeInstance(pair->three);
    check_messages(pair, "FreeInstance", fmi3OK, 0);
    free(pair->bytes);
    *pair = (Pair){.two = NULL};
    statistics.sequences++;
}
