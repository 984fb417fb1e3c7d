/*     fuzz SEED SEQUENCES OTHER_LIBRARY OTHER_GUID [trace]
 *
 * Does so many sequences of calls in runs (watch.c); the first run has the seed, the next one the seed after it. What
 * fails names its seed: `fuzz SEED 50 ... trace` prints the calls that lead there. Prints statistics in JSON.
 */
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Several instances live side by side; each life has some 40 calls. */
static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0;) {
        Slot *slot = &slots[below(SLOTS)];
        carelessness = chance(60) ? 0 : 15;
        if (slot->component == NULL) {
            if (begun < sequences && instantiate(slot)) {
                begun++;
                alive++;
            }
        } else if (chance(3)) {
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

int main(int count, char **arguments)
{
    if (count < 5)
        return 2;
    tracing = count > 5;
    open_other(arguments[3], arguments[4]);
    do_runs(arguments[1], atol(arguments[2]), run);
    close_other();
    print_statistics();
    return 0;
}
