/*     fuzz SEED SEQUENCES [trace]
 *
 * Does so many sequences in runs: the first run has the seed, the next one the seed after it. What fails names its seed:
 * `fuzz SEED 50 trace` prints the calls that lead there. Prints statistics in JSON.
 */
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>

/* Several pairs live side by side; each life has some 40 calls. */
static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0;) {
        Pair *pair = &pairs[below(PAIRS)];
        carelessness = chance(60) ? 0 : 15;
        if (pair->two == NULL) {
            if (begun < sequences && begin(pair)) {
                begun++;
                alive++;
            }
        } else if (chance(3)) {
            if (alive == 1 && begun == sequences)
                forget_states(pair);
            end(pair);
            alive--;
        } else if (chance(1)) {
            listen(pair, pair->name);
            join(pair, below(2)); /* a copy goes on like its original */
        } else if (chance(10)) {
            be_hostile(pair);
        } else if (chance(4)) {
            live_through_a_made_up_state(pair);
        } else if (pair->twin.mode >= EVENT && pair->twin.mode <= STEP && chance(10)) {
            move_on(pair);
        } else {
            try_call(pair, next_call(pair));
        }
    }
    CHECK(blocks + tables == 0, "%ld blocks of memory are never returned", blocks + tables);
}

static void print_counts(const char *name, const long counts[])
{
    printf("  \"%s\": {", name);
    for (int i = 0; i < CALL_COUNT; i++)
        printf("%s\"%s\": %ld", i ? ", " : "", rows[i].name, counts[i]);
    printf("},\n");
}

int main(int count, char **arguments)
{
    if (count < 3)
        return 2;
    tracing = count > 3;
    do_runs(arguments[1], atol(arguments[2]), run);
    printf("{\n");
    print_counts("done", statistics.done);
    print_counts("discarded", statistics.discarded);
    print_counts("refused", statistics.refused);
    printf("  \"sequences\": %ld, \"calls\": %ld, \"starved\": %ld, \"joined\": %ld, \"hostile\": %ld,\n",
           statistics.sequences, statistics.calls, statistics.starved, statistics.joined, statistics.hostile);
    printf("  \"compared\": %ld, \"transposed\": %ld, \"crafted_taken\": %ld, \"crafted_refused\": %ld\n}\n",
           statistics.compared, statistics.transposed, statistics.crafted_taken, statistics.crafted_refused);
    return 0;
}
