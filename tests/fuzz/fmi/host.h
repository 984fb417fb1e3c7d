/* What is random; what a host gives to the FMU: memory that is counted, and loggers that judge. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "fuzz_model.h"

/* ---- numbers and texts from one seed ----------------------------------------------------------------------------- */

static uint64_t seed;    /* everything that is random comes from it */
static int carelessness; /* how often an argument becomes wrong [percent] */
static int tracing;

static uint64_t random_bits(void)
{
    /* splitmix64: good from any seed, so that neighbouring seeds have nothing in common. */
    uint64_t bits = seed += 0x9e3779b97f4a7c15u;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return bits ^ (bits >> 31);
}

static int below(int count)
{
    return (int)(random_bits() % (uint64_t)count);
}

#define chance(percent) (below(100) < (percent))
#define careless() chance(carelessness)
#define uniform(low, high) ((low) + ((high) - (low)) * ((double)(random_bits() >> 11) / 9007199254740992.0))

/* Any double, with a taste for zeros, denormals, huge numbers, infinities and NaN. */
static double awkward(void)
{
    static const double numbers[] = {0.0, -0.0, 1.0, -1.0, 0.5, DBL_MIN, 5e-324, 1e-9, 1e9, -1e9, 1e15, 1e154, 1e300,
                                     -1e300, DBL_MAX, -DBL_MAX, NAN, INFINITY, -INFINITY};
    double number;
    uint64_t bits = random_bits();
    memcpy(&number, &bits, sizeof number);
    return chance(20) ? number : chance(25) ? uniform(-1.0, 1.0) * pow(10.0, uniform(-20.0, 20.0))
                                            : numbers[below(sizeof numbers / sizeof *numbers)];
}

static const char *awkward_text(void)
{
    static char longest[5000];
    static const char *const texts[] = {"", "%s%n%d%1000000s", "\xff\xfe\x80\x01", "\n\r\t", "#r1#", "logall", "{%n}",
                                        "Feder \xc3\xa4\xc3\xb6 \xe5\xbc\xb9\xe7\xb0\xa7", "logStatusError ", longest};
    memset(longest, '%', sizeof longest - 1);
    return texts[below(sizeof texts / sizeof *texts)];
}

/* Stops the program; the seed to repeat it by was printed before. */
#define CHECK(condition, ...) ((condition) ? (void)0 : fail(__FILE__, __LINE__, __VA_ARGS__))
#define trace(...) (tracing ? (void)fprintf(stderr, __VA_ARGS__) : (void)0)

static _Noreturn void fail(const char *file, int line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s:%d: ", file, line);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    _exit(1);
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

/* What FMI 2.0 and FMI 3.0 have said since `listen`. */
static struct {
    int errors, warnings;
} said[2];
static const void *expected_environment;
static const char *expected_name; /* NULL: any */

static void listen(const void *environment, const char *name)
{
    memset(said, 0, sizeof said);
    expected_environment = environment;
    expected_name = name;
}

/* A message is a sentence in plain ASCII, whatever the host has put into it. */
static void hear(int version, const void *environment, int status, const char *category, const char *text)
{
    trace("    FMI %d says: %s\n", version, text);
    CHECK(environment == expected_environment, "a message goes to the environment of another instance");
    CHECK(strlen(text) > 10, "the message `%s` says nothing", text);
    for (const char *at = text; *at != '\0'; at++)
        CHECK(*at >= ' ' && *at <= '~' && (version == 2 || *at != '#'), "the message `%s` is no plain text", text);
    CHECK(status >= fmi2Warning && status <= fmi2Error, "a message has the status %d", status);
    CHECK(strcmp(category, status == fmi2Warning ? "logStatusWarning" : "logStatusError") == 0,
          "a message of status %d has the category %s", status, category);
    ++*(status == fmi2Warning ? &said[version - 2].warnings : &said[version - 2].errors);
}

static void log_two(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String format, ...)
{
    char text[8192];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    CHECK(name != NULL && (expected_name == NULL || strcmp(name, expected_name) == 0),
          "a message comes from an instance of another name");
    hear(2, environment, (int)status, category, text);
}

static void log_three(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text)
{
    hear(3, environment, (int)status, category, text);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static long blocks;  /* given out and not yet returned */
static int starving; /* if not 0, the how manieth block from now on is the first that is not given */
static int starved;  /* whether one was not given */

/* Before each block stands this; malloc aligns what follows it, too. */
typedef union {
    const void *given;
    max_align_t alignment;
} Header;

/* Also what the FMU takes from the C library: tables, states, and all memory for hosts that give no functions. */
void *library_calloc(size_t count, size_t size)
{
    if (starving > 0 && --starving == 0) {
        starved = starving = 1;
        return NULL;
    }
    Header *header = calloc(1, sizeof *header + count * size);
    CHECK(header != NULL, "the test has no memory");
    header->given = &blocks;
    blocks++;
    return header + 1;
}

void *library_malloc(size_t size)
{
    return library_calloc(1, size);
}

void library_free(void *block)
{
    if (block == NULL)
        return;
    Header *header = (Header *)block - 1;
    CHECK(header->given == &blocks, "memory is returned that was not given");
    blocks--;
    header->given = NULL;
    free(header);
}

static void *on_loan[400];
static int loans;

/* So many bytes until the end of a call. */
static void *lent(size_t size)
{
    CHECK(loans < 400 && (on_loan[loans] = malloc(size)) != NULL, "the test lends too much");
    return memset(on_loan[loans++], 0x5a, size);
}

static void *copy(const void *content, size_t size)
{
    return memcpy(lent(size), content, size);
}

/* So many elements, or NULL for none, and at times if the host is careless. */
static void *elements(size_t count, size_t size)
{
    return count == 0 || (careless() && chance(20)) ? NULL : lent(count * size);
}

static void take_back(int before)
{
    while (loans > before)
        free(on_loan[--loans]);
}
