/*     fuzz SEED SEQUENCES OTHER_LIBRARY OTHER_GUID [trace]
 *
 * Does so many sequences of calls in runs of RUN; the first run has the seed, the next one the seed after it. What
 * fails names its seed: `fuzz SEED 50 ... trace` prints the calls that lead there. Prints statistics in JSON.
 */
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

enum { RUN = 50, LONGEST_RUN = 120 /* [s] */ };

Statistics statistics;
int tracing;

#define NAMED(name) #name,
const char *const call_names[CALL_COUNT] = {CALLS(NAMED)};
#undef NAMED

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

/* Several instances live side by side; each life has some 40 calls. */
static void run(long sequences)
{
    long begun = 0;
    random_seed(seed);
    for (int alive = 0; begun < sequences || alive > 0;) {
        Slot *slot = &slots[below(SLOTS)];
        carelessness = chance(60) ? 0 : 15;
        if (slot->component == NULL) {
            if (begun < sequences && instantiate(slot)) {
                begun++;
                alive++;
            }
        } else if (chance(MODEL_PYTHON ? 12 : 3)) { /* Python is slow */
            if (alive == 1 && begun == sequences)
                release_states(slot);
            free_instance(slot);
            alive--;
        } else if (below(300) == 0) {
            compare_with_a_copy(slot);
        } else if (chance(4)) {
            live_through_a_made_up_state(slot);
        } else if (slot->twin.mode >= EVENT && slot->twin.mode <= STEP && chance(10)) {
            move_on(slot);
        } else {
            try_call(slot, next_call(slot));
        }
    }
    CHECK(blocks + tables == 0, "%ld blocks of memory are never returned", blocks + tables);
}

static void print_counts(const char *name, const long *counts)
{
    printf("  \"%s\": {", name);
    for (int i = 0; i < CALL_COUNT; i++)
        printf("%s\"%s\": %ld", i ? ", " : "", call_names[i], counts[i]);
    printf("},\n");
}

int main(int count, char **arguments)
{
    if (count < 5)
        return 2;
    seed = strtoull(arguments[1], NULL, 10);
    long sequences = atol(arguments[2]);
    tracing = count > 5;
    __sanitizer_set_death_callback(print_seed);
    signal(SIGALRM, too_long);
    open_other(arguments[3], arguments[4]);
    while (statistics.sequences < sequences) {
        long left = sequences - statistics.sequences;
        alarm(LONGEST_RUN);
        run(left < RUN ? left : RUN);
        seed++;
    }
    close_other();
    printf("{\n");
    print_counts("done", statistics.done);
    print_counts("discarded", statistics.discarded);
    print_counts("refused", statistics.refused);
    printf("  \"sequences\": %ld, \"calls\": %ld, \"starved\": %ld, \"copies\": %ld,\n", statistics.sequences,
           statistics.calls, statistics.starved, statistics.copies);
    printf("  \"crafted_taken\": %ld, \"crafted_refused\": %ld\n}\n", statistics.crafted_taken,
           statistics.crafted_refused);
    return 0;
}
