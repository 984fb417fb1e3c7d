/* Runs of sequences, and what is printed where one fails. */
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
#include <unistd.h>

enum { RUN = 50, LONGEST_RUN = 240 /* [s] */ };

#define NAMED(name) #name,
const char *const call_names[CALL_COUNT] = {CALLS(NAMED)};
#undef NAMED

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

void print_counts(const char *name, int count, const char *const calls[], const long counts[])
{
    printf("  \"%s\": {", name);
    for (int i = 0; i < count; i++)
        printf("%s\"%s\": %ld", i ? ", " : "", calls[i], counts[i]);
    printf("},\n");
}

void print_statistics(void)
{
    printf("{\n");
    print_counts("done", CALL_COUNT, call_names, statistics.done);
    print_counts("discarded", CALL_COUNT, call_names, statistics.discarded);
    print_counts("refused", CALL_COUNT, call_names, statistics.refused);
    printf("  \"sequences\": %ld, \"calls\": %ld, \"starved\": %ld, \"copies\": %ld,\n", statistics.sequences,
           statistics.calls, statistics.starved, statistics.copies);
    printf("  \"crafted_taken\": %ld, \"crafted_refused\": %ld\n}\n", statistics.crafted_taken,
           statistics.crafted_refused);
}
