/* What is random; what a host gives to the FMU: memory that is counted, loggers that judge; and the program. */
#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- numbers and texts from one seed ----------------------------------------------------------------------------- */

static uint64_t state;
int carelessness;

void random_seed(uint64_t seed)
{
    state = seed;
}

uint64_t random_bits(void)
{
    /* splitmix64: good from any seed, so that neighbouring seeds have nothing in common. */
    uint64_t bits = state += 0x9e3779b97f4a7c15u;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return bits ^ (bits >> 31);
}

int below(int count)
{
    return (int)(random_bits() % (uint64_t)count);
}

int chance(int percent)
{
    return below(100) < percent;
}

int careless(void)
{
    return chance(carelessness);
}

double uniform(double low, double high)
{
    return low + (high - low) * ((double)(random_bits() >> 11) / 9007199254740992.0);
}

double awkward(void)
{
    static const double numbers[] = {0.0, -0.0, 1.0, -1.0, 0.5, DBL_MIN, 5e-324, 1e-9, 1e9, -1e9, 1e15, 1e154, 1e300,
                                     -1e300, DBL_MAX, -DBL_MAX, NAN, INFINITY, -INFINITY};
    double number;
    uint64_t bits = random_bits();
    memcpy(&number, &bits, sizeof number);
    return chance(20) ? number : chance(25) ? uniform(-1.0, 1.0) * pow(10.0, uniform(-20.0, 20.0))
                                            : numbers[below(sizeof numbers / sizeof *numbers)];
}

const char *awkward_text(void)
{
    static char longest[5000];
    static const char *const texts[] = {"", "%s%n%d%1000000s", "\xff\xfe\x80\x01", "\n\r\t", "#r1#", "logall", "{%n}",
                                        "Feder \xc3\xa4\xc3\xb6 \xe5\xbc\xb9\xe7\xb0\xa7", "logStatusError ", longest};
    memset(longest, '%', sizeof longest - 1);
    return texts[below(sizeof texts / sizeof *texts)];
}

/* ---- failures ---------------------------------------------------------------------------------------------------- */

static int tracing;

void trace(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    if (tracing)
        vfprintf(stderr, format, arguments);
    va_end(arguments);
}

void fail(const char *file, int line, const char *format, ...)
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

Said said[2];
static const void *expected_environment;
static const char *expected_name;

void listen(const void *environment, const char *name)
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
        CHECK(*at >= ' ' && *at <= '~' && (version == 2 || *at != '#'), "the message `%s` holds the byte %d", text,
              (unsigned char)*at);
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

void log_three(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text)
{
    hear(3, environment, (int)status, category, text);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

long blocks, tables;
int starving;

/* Before each block stands its counter; malloc aligns what follows it, too. */
typedef union {
    long *counter;
    max_align_t alignment;
} Header;

/* Also what the FMU takes from the C library: tables, states, and all memory for hosts that give no functions. */
void *library_calloc(size_t count, size_t size);
void library_free(void *block);

void *library_calloc(size_t count, size_t size)
{
    static const size_t SMALL = 50000; /* more than an instance or a state takes, and less than a table */
    if (starving)
        return NULL;
    Header *header = calloc(1, sizeof *header + count * size);
    CHECK(header != NULL, "the test has no memory");
    /* The laws of changed parameters are small, and the only ones that are asked for by two. */
    header->counter = count == 1 && size < SMALL ? &blocks : &tables;
    ++*header->counter;
    return header + 1;
}

void library_free(void *block)
{
    if (block == NULL)
        return;
    Header *header = (Header *)block - 1;
    CHECK(header->counter == &blocks || header->counter == &tables, "memory is returned that was not given");
    --*header->counter;
    header->counter = NULL;
    free(header);
}

fmi2CallbackFunctions callbacks_of(void *environment, int logging, int counting)
{
    return (fmi2CallbackFunctions){logging ? log_two : NULL, counting ? library_calloc : NULL,
                                   counting ? library_free : NULL, NULL, environment};
}

void *allocated(size_t size)
{
    void *memory = malloc(size);
    CHECK(memory != NULL || size == 0, "the test has no memory");
    return memory;
}

void *exactly(const void *content, size_t size)
{
    return size == 0 ? NULL : memcpy(allocated(size), content, size);
}

static void *on_loan[200];
int loans;

void *lent(size_t size)
{
    CHECK(loans < 200, "the test lends too much");
    return on_loan[loans++] = memset(allocated(size), 0x5a, size);
}

void *elements(size_t count, size_t size)
{
    return count == 0 || (careless() && chance(20)) ? NULL : lent(count * size);
}

void take_back(int before)
{
    while (loans > before)
        free(on_loan[--loans]);
}

/* ---- the program: fuzz SEED SEQUENCES [trace] -------------------------------------------------------------------- */

/* Several pairs live side by side; each life has some 40 calls. */
static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0;) {
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
    CHECK(blocks + tables == 0, "%ld blocks of memory are never returned", blocks + tables);
}

/* Does so many sequences in runs of 50: the first run has the seed, the next one the seed after it. The last seed that is
 * printed is that of a failure: `fuzz SEED 50 trace` prints the calls that lead there. Prints how often each call was
 * done, discarded and refused, in JSON. */
int main(int count, char **arguments)
{
    enum { RUN = 50, LONGEST_RUN = 240 /* [s] */ };
    if (count < 3)
        return 2;
    tracing = count > 3;
    unsigned long long seed = strtoull(arguments[1], NULL, 10);
    for (long left = atol(arguments[2]); left > 0; left -= RUN, seed++) {
        alarm(LONGEST_RUN);
        fprintf(stderr, "seed %llu\n", seed);
        random_seed(seed);
        run(left < RUN ? left : RUN);
    }
    for (int i = 0; i < call_count; i++)
        printf("%s\"%s\": [%ld, %ld, %ld]", i ? ", " : "{", rows[i].two ? rows[i].two : rows[i].three, counts[i][0],
               counts[i][1], counts[i][2]);
    printf(", \"repeated\": %ld, \"hostile\": %ld, \"made up and taken\": %ld, \"made up and refused\": %ld}\n",
           repeated, hostile, made_up[0], made_up[1]);
    return 0;
}
