/* States of both versions: kept side by side, written by one and read by the other. */
#include "pairs.h"

#include <stdlib.h>
#include <string.h>

enum { KEPT = 4 };

typedef struct {
    fmi2FMUstate two;
    fmi3FMUState three;
    int exchange;
    Mode mode;
    double time;
    unsigned char *bytes;
} Kept;

static Kept kept[KEPT];

fmi3FMUState state_of_other_type(const Pair *pair)
{
    for (int i = 0; i < KEPT; i++)
        if (kept[i].three != NULL && kept[i].exchange != pair->exchange)
            return kept[i].three;
    return NULL;
}

static void keep(Kept *state, const Pair *pair)
{
    free(state->bytes);
    state->exchange = pair->exchange;
    state->mode = pair->mode;
    state->time = pair->time;
    state->bytes = exactly(pair->bytes, state_size());
}

static void take(Pair *pair, Kept *state)
{
    fmi3Status three = fmi3GetFMUState(pair->three, &state->three);
    if (settled(pair, CALL3_GetFMUState, (int)three, (int)fmi2GetFMUstate(pair->two, &state->two), 1))
        keep(state, pair);
}

static void restore(Pair *pair, const Kept *state)
{
    fmi3Status three = fmi3SetFMUState(pair->three, state->three);
    if (!settled(pair, CALL3_SetFMUState, (int)three, (int)fmi2SetFMUstate(pair->two, state->two), 0))
        return;
    CHECK(memcmp(pair->bytes, state->bytes, state_size()) == 0, "an instance is not in the state it was taken to");
    pair->mode = state->mode;
    pair->time = state->time;
}

static void release(Pair *pair, Kept *state)
{
    fmi3Status three = fmi3FreeFMUState(pair->three, &state->three);
    settled(pair, CALL3_FreeFMUState, (int)three, (int)fmi2FreeFMUstate(pair->two, &state->two), 1);
    CHECK(state->three == NULL && state->two == NULL, "the pointer to a freed state is left");
    free(state->bytes);
    *state = (Kept){.two = NULL};
}

static void serialize(Pair *pair, const Kept *state)
{
    size_t size = careless() ? (size_t)below(2 * (int)state_size()) : state_size();
    unsigned char *bytes = allocated(size);
    fmi3Status status = fmi3SerializeFMUState(pair->three, state->three, bytes, size);
    int sound = state->three != NULL && size == state_size();
    if (settled(pair, CALL3_SerializeFMUState, (int)status, sound ? fmi3OK : fmi3Error, 0))
        CHECK(memcmp(bytes, state->bytes, size) == 0, "a state has changed while it was kept");
    free(bytes);
}

/* Each version reads bytes of the other, which may be damaged; if so a state that both took for sound does no harm. */
static void deserialize(Pair *pair, Kept *state)
{
    Kept before = {.mode = pair->mode, .time = pair->time};
    const Kept *part = &kept[below(KEPT)];
    Serialized made = serialized_from(pair->bytes, part->bytes == NULL ? pair->bytes : part->bytes, state_size());
    fmi3FMUState three = NULL;
    fmi2FMUstate two = NULL;
    fmi3Status status = fmi3DeserializeFMUState(pair->three, made.bytes, made.size, &three);
    fmi2Status expected = fmi2DeSerializeFMUstate(pair->two, (const fmi2Byte *)made.bytes, made.size, &two);
    int taken = settled(pair, CALL3_DeserializeFMUState, (int)status, (int)expected, 1);
    CHECK(made.quality == CRAFTED || taken == (made.quality == SOUND), "a state is %s",
          taken ? "taken though it is damaged" : "refused");
    statistics3.damaged += made.quality != SOUND;
    free(made.bytes);
    if (taken && made.quality == SOUND) {
        if (state->three != NULL) {
            listen(pair);
            release(pair, state);
        }
        state->two = two;
        state->three = three;
        keep(state, pair);
        return;
    }
    if (!taken)
        return;
    /* Whatever it holds both read the same of it. */
    fmi3FMUState back3 = NULL;
    fmi2FMUstate back2 = NULL;
    List all = some_variables("iolpsOr");
    double *values = allocated(all.size * sizeof *values);
    listen(pair);
    CHECK(fmi3GetFMUState(pair->three, &back3) == fmi3OK && fmi2GetFMUstate(pair->two, &back2) == fmi2OK,
          "a state cannot be taken");
    listen(pair);
    if (settled(pair, CALL3_SetFMUState, (int)fmi3SetFMUState(pair->three, three), (int)fmi2SetFMUstate(pair->two, two),
                0)) {
        listen(pair);
        fmi2Status of_two = fmi2GetReal(pair->two, all.elements, all.size, values);
        int differ = of_two != fmi2OK; /* before initialization, or where parameters are no spring */
        status = differ ? fmi3OK : fmi3GetFloat64(pair->three, all.references, all.count, all.values, all.size);
        CHECK(status == fmi3OK, "FMI 3.0 does not read what FMI 2.0 reads");
        if (!differ)
            check_equal(all.values, values, all.size, "a crafted state");
    }
    listen(pair);
    CHECK(fmi3SetFMUState(pair->three, back3) == fmi3OK && fmi2SetFMUstate(pair->two, back2) == fmi2OK,
          "there is no way back");
    CHECK(fmi3FreeFMUState(pair->three, &back3) == fmi3OK && fmi2FreeFMUstate(pair->two, &back2) == fmi2OK &&
              fmi3FreeFMUState(pair->three, &three) == fmi3OK && fmi2FreeFMUstate(pair->two, &two) == fmi2OK,
          "a state is not freed");
    look_at(pair);
    pair->mode = before.mode;
    pair->time = before.time;
    free(values);
    free_list(&all);
}

void call_states(Pair *pair, Call3 call)
{
    Kept *state = &kept[below(KEPT)];
    switch (call) {
    case CALL3_GetFMUState: take(pair, state); break;
    case CALL3_SetFMUState: restore(pair, state); break;
    case CALL3_FreeFMUState: release(pair, state); break;
    case CALL3_SerializeFMUState: serialize(pair, state); break;
    case CALL3_DeserializeFMUState: deserialize(pair, state); break;
    default: FAIL("there is no such call");
    }
}

void forget_states(Pair *pair)
{
    for (int i = 0; i < KEPT; i++) {
        listen(pair);
        release(pair, &kept[i]);
    }
}
