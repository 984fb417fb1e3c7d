/*     fuzz SEED SEQUENCES [trace]
 *
 * Does so many lives of pairs, as tests/fuzz/fmi/main.c does those of instances. */
#include "pairs.h"

#include <stdio.h>
#include <stdlib.h>

/* One that leads on, most often. */
static Call3 next_of_both(const Pair *pair)
{
    static const Call3 forth[][4] = {
        [INSTANTIATED] = {CALL3_EnterInitializationMode, CALL3_EnterInitializationMode, CALL3_SetFloat64,
                          CALL3_GetFloat64},
        [INITIALIZATION] = {CALL3_ExitInitializationMode, CALL3_ExitInitializationMode, CALL3_SetFloat64,
                            CALL3_GetFloat64},
        [EVENT] = {CALL3_EnterContinuousTimeMode, CALL3_SetFloat64, CALL3_GetFloat64, CALL3_UpdateDiscreteStates},
        [CONTINUOUS_TIME] = {CALL3_CompletedIntegratorStep, CALL3_SetFloat64, CALL3_GetFloat64, CALL3_EnterEventMode},
        [STEP] = {CALL3_DoStep, CALL3_SetFloat64, CALL3_GetFloat64, CALL3_GetDirectionalDerivative},
        [TERMINATED] = {CALL3_Reset, CALL3_Reset, CALL3_GetFloat64, CALL3_SetFMUState},
    };
    return chance(60) ? forth[pair->mode][below(4)] : (Call3)below(CALL3_COUNT);
}

static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0;) {
        Pair *pair = &pairs[below(PAIRS)];
        carelessness = chance(70) ? 0 : 15;
        if (pair->two == NULL) {
            if (begun < sequences && begin_pair(pair)) {
                begun++;
                alive++;
            }
        } else if (chance(3)) {
            if (alive == 1 && begun == sequences)
                forget_states(pair);
            end_pair(pair);
            alive--;
        } else if (chance(20)) {
            be_hostile(pair);
        } else if (pair->mode >= EVENT && pair->mode <= STEP && chance(10)) {
            move_pair(pair);
        } else {
            call_both(pair, next_of_both(pair));
        }
    }
    CHECK(blocks + tables == 0, "%ld blocks of memory are never returned", blocks + tables);
}

int main(int count, char **arguments)
{
    if (count < 3)
        return 2;
    tracing = count > 3;
    do_runs(arguments[1], atol(arguments[2]), run);
    printf("{\n");
    print_counts("done", CALL3_COUNT, call3_names, statistics3.done);
    print_counts("refused", CALL3_COUNT, call3_names, statistics3.refused);
    printf("  \"sequences\": %ld, \"calls\": %ld, \"hostile\": %ld, \"compared\": %ld,\n", statistics.sequences,
           statistics.calls, statistics3.hostile, statistics3.compared);
    printf("  \"damaged\": %ld, \"discarded\": %ld, \"transposed\": %ld\n}\n", statistics3.damaged,
           statistics3.discarded, statistics3.transposed);
    return 0;
}
