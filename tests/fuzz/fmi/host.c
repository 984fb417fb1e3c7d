/* What a host gives to the FMU: memory that is counted, loggers that judge what they hear; and what is printed. */
#include "fuzz.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#else
#define __sanitizer_set_death_callback(callback) (void)(callback)
#endif
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { RUN = 50, LONGEST_RUN = 240 /* [s] */ };

Statistics statistics;
int tracing;
static unsigned long long seed;

void trace(const char *format, ...)
{
    va_list arguments;
    if (!tracing)
        return;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void print_seed(void)
{
    fprintf(stderr, "It happens with the seed %llu.\n", seed);
}

/* The sanitizer of undefined behaviour calls this, and not the death callback, which belongs to that of addresses. */
void __ubsan_on_report(void);
void __ubsan_on_report(void)
{
    print_seed();
}

static void too_long(int signal_number)
{
    static const char text[] = "A run does not end.\n";
    (void)signal_number;
    (void)!write(STDERR_FILENO, text, sizeof text - 1);
    abort();
}

void fail(const char *file, int line, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s:%d: ", file, line);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    print_seed();
    _exit(1);
}

/* Runs until there are so many sequences: the first has the seed, the next one the seed after it. */
void do_runs(const char *first_seed, long sequences, void (*run)(long sequences))
{
    seed = strtoull(first_seed, NULL, 10);
    __sanitizer_set_death_callback(print_seed);
    signal(SIGALRM, too_long);
    while (statistics.sequences < sequences) {
        long left = sequences - statistics.sequences;
        alarm(LONGEST_RUN);
        random_seed(seed);
        run(left < RUN ? left : RUN);
        seed++;
    }
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
    Said *of = &said[version - 2];
    trace("    FMI %d says: %s", version, text);
    CHECK(environment == expected_environment, "a message goes to the environment of another instance");
    CHECK(strlen(text) > 10, "the message `%s` says nothing", text);
    for (const char *at = text; *at != '\0'; at++)
        CHECK(*at >= ' ' && *at <= '~' && (version == 2 || *at != '#'), "the message `%s` holds the byte %d", text, (unsigned char)*at);
    CHECK(status >= fmi2Warning && status <= fmi2Error, "a message has the status %d", status);
    CHECK(strcmp(category, status == fmi2Warning ? "logStatusWarning" : "logStatusError") == 0,
          "a message of status %d has the category %s", status, category);
    snprintf(of->text, sizeof of->text, "%s", text);
    ++*(status == fmi2Warning ? &of->warnings : status == fmi2Discard ? &of->discards : &of->errors);
}

static void log_two(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                    fmi2String format, ...)
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

/* Before each block stands this; malloc aligns what follows it, too. */
typedef union {
    struct {
        uint64_t mark;
        long *counter;
    } known;
    max_align_t alignment;
} Header;

static const uint64_t GIVEN = 0x676976656e2e2e2eu;
/* More than an instance or a state takes, and less than a table. */
static const size_t SMALL = 50000;

/* Also what the FMU takes from the C library: tables, states, and all memory for hosts that give no functions. */
void *library_calloc(size_t count, size_t size);
void library_free(void *block);

void *library_calloc(size_t count, size_t size)
{
    if (starving) {
        statistics.starved++;
        return NULL;
    }
    Header *header = calloc(1, sizeof *header + count * size);
    CHECK(header != NULL, "the test has no memory");
    header->known.mark = GIVEN;
    /* The laws of changed parameters are small, and the only ones that are asked for by two. */
    header->known.counter = count == 1 && size < SMALL ? &blocks : &tables;
    ++*header->known.counter;
    return header + 1;
}

void library_free(void *block)
{
    if (block == NULL)
        return;
    Header *header = (Header *)block - 1;
    CHECK(header->known.mark == GIVEN, "memory is returned that was not given");
    header->known.mark = 0;
    --*header->known.counter;
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
