/* States that the host holds, of pairs that may be gone. */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

enum { KEPT = 5 };

typedef struct {
    fmi2FMUstate two;
    fmi3FMUState three;
    unsigned char *bytes; /* the serialized form of both */
    Twin twin;
} Kept;

static Kept kept[KEPT];

/* What is no state at all. */
static unsigned char junk[4096];

static void forget(Kept *state)
{
    free(state->bytes);
    *state = (Kept){.two = NULL};
}

void forget_states(Pair *pair)
{
    listen(pair, pair->name);
    for (int i = 0; i < KEPT; i++) {
        CHECK(fmi2FreeFMUstate(pair->two, &kept[i].two) == fmi2OK &&
                  fmi3FreeFMUState(pair->three, &kept[i].three) == fmi3OK,
              "a state is not freed");
        forget(&kept[i]);
    }
}

/* A state that is held, or what a careless host takes for one: nothing, junk, or that of another FMU, as which the other
 * version stands. */
static Kept some_state(Trial *trial, int *right)
{
    Kept state = kept[below(KEPT)];
    *right = !careless() && state.two != NULL;
    must(trial, *right ? YES : NO);
    trial->words = 0; /* arguments have other names */
    starving = 0;
    if (!*right) {
        int kind = below(3);
        state.two = kind == 0 ? NULL : kind == 1 ? (fmi2FMUstate)junk : trial->pair->probe3;
        state.three = kind == 0 ? NULL : kind == 1 ? (fmi3FMUState)junk : trial->pair->probe2;
    }
    return state;
}

static void check_bytes(const Pair *pair, const Kept *state)
{
    unsigned char *two = allocated(state_size), *three = allocated(state_size);
    CHECK(fmi2SerializeFMUstate(pair->two, state->two, (fmi2Byte *)two, state_size) == fmi2OK &&
              fmi3SerializeFMUState(pair->three, state->three, three, state_size) == fmi3OK,
          "a state cannot be serialized");
    CHECK(memcmp(two, state->bytes, state_size) == 0 && memcmp(three, state->bytes, state_size) == 0,
          "a state is not what it was");
    free(two);
    free(three);
}

/* Takes the state of the pair, or that of the bytes if there are any, into new memory or over an old state. */
static int take(Trial *trial, const Serialized *from, const Twin *twin)
{
    Pair *pair = trial->pair;
    Kept *state = &kept[below(KEPT)], made = *state;
    int nowhere = careless() && chance(30), wrong = careless();
    if (wrong) {
        made.two = chance(50) ? (fmi2FMUstate)junk : pair->probe3;
        made.three = chance(50) ? (fmi3FMUState)junk : pair->probe2;
    }
    Kept before = made;
    must(trial, nowhere || wrong ? NO : YES);
    trial->effect = LOOKS;
    trial->words = 0; /* arguments have other names */
    trial->states = made.two == NULL;
    starving = made.two == NULL && careless();
    must(trial, starving ? NO : YES);
    fmi2FMUstate *two = nowhere ? NULL : &made.two;
    fmi3FMUState *three = nowhere ? NULL : &made.three;
    int done = from == NULL
                   ? judged(trial, (int)fmi2GetFMUstate(trial->two, two), (int)fmi3GetFMUState(trial->three, three))
                   : judged(trial, (int)fmi2DeSerializeFMUstate(trial->two, (fmi2Byte *)from->bytes, from->size, two),
                            (int)fmi3DeserializeFMUState(trial->three, from->bytes, from->size, three));
    CHECK(!done ? made.two == before.two && made.three == before.three
                : made.two != NULL && made.three != NULL && (before.two == NULL || made.two == before.two) &&
                      (before.three == NULL || made.three == before.three),
          "a pointer to a state is not what it should be");
    if (!done)
        return 0;
    free(state->bytes);
    *state = made;
    state->bytes = exactly(from == NULL ? pair->bytes : from->bytes, state_size);
    state->twin = *twin;
    check_bytes(pair, state);
    return 1;
}

void get_state(Trial *trial)
{
    take(trial, NULL, &trial->pair->twin);
}

void deserialize(Trial *trial)
{
    Pair *pair = trial->pair;
    const Kept *state = &kept[below(KEPT)], *part = &kept[below(KEPT)];
    int from_kept = state->two != NULL && chance(50);
    Twin twin = from_kept ? state->twin : pair->twin;
    const unsigned char *bytes = from_kept ? state->bytes : pair->bytes;
    Serialized made = serialized_from(bytes, part->two == NULL ? pair->bytes : part->bytes, 0);
    trace("    quality %d, %zu bytes", made.quality, made.size);
    must(trial, made.quality == SOUND ? YES : made.quality == BROKEN ? NO : UNSURE);
    if (made.quality == CRAFTED)
        twin.mode = UNKNOWN;
    int taken = take(trial, &made, &twin);
    if (made.quality == CRAFTED)
        ++*(taken ? &statistics.crafted_taken : &statistics.crafted_refused);
    free(made.bytes);
}

void set_state(Trial *trial)
{
    Pair *pair = trial->pair;
    int right, exchange = pair->twin.exchange;
    Kept state = some_state(trial, &right);
    if (right && state.twin.mode == UNKNOWN)
        must(trial, UNSURE);
    else if (right)
        must(trial, state.twin.exchange == exchange ? YES : NO);
    if (!judged(trial, (int)fmi2SetFMUstate(trial->two, state.two), (int)fmi3SetFMUState(trial->three, state.three)))
        return;
    CHECK(memcmp(pair->bytes, state.bytes, state_size) == 0, "a pair is not in the state it was taken to");
    pair->twin = state.twin;
    pair->twin.exchange = exchange;
}

void free_state(Trial *trial)
{
    Kept *state = &kept[below(KEPT)], made = *state;
    int nowhere = careless() && chance(30), wrong = !nowhere && careless();
    if (wrong) {
        made.two = chance(50) ? (fmi2FMUstate)junk : trial->pair->probe3;
        made.three = chance(50) ? (fmi3FMUState)junk : trial->pair->probe2;
    }
    must(trial, wrong ? NO : YES);
    Kept before = made;
    trial->effect = LOOKS;
    trial->words = 0;
    trial->states = wrong || nowhere || made.two == NULL ? 0 : -1;
    int done = judged(trial, (int)fmi2FreeFMUstate(trial->two, nowhere ? NULL : &made.two),
                      (int)fmi3FreeFMUState(trial->three, nowhere ? NULL : &made.three));
    if (done && !nowhere) {
        CHECK(made.two == NULL && made.three == NULL, "the pointer to a freed state is left");
        forget(state);
    } else {
        CHECK(made.two == before.two && made.three == before.three, "the pointer to a state has changed");
    }
}

void size_of_state(Trial *trial)
{
    int right;
    size_t two = 0, three = 0, *to = careless() ? NULL : &two;
    Kept state = some_state(trial, &right);
    must(trial, to == NULL ? NO : YES);
    trial->effect = LOOKS;
    if (judged(trial, (int)fmi2SerializedFMUstateSize(trial->two, state.two, to),
               (int)fmi3SerializedFMUStateSize(trial->three, state.three, to == NULL ? NULL : &three)))
        CHECK(two == state_size && three == two, "a state has %zu bytes, another one %zu", two, state_size);
}

void serialize(Trial *trial)
{
    int right;
    Kept state = some_state(trial, &right);
    size_t size = !careless() ? state_size : chance(20) ? SIZE_MAX : (size_t)below(2 * (int)state_size);
    size_t room = size == SIZE_MAX ? 1 : size;
    void *two = elements(room, 1), *three = two == NULL ? NULL : allocated(room);
    must(trial, size == state_size && two != NULL ? YES : NO);
    trial->effect = LOOKS;
    if (judged(trial, (int)fmi2SerializeFMUstate(trial->two, state.two, two, size),
               (int)fmi3SerializeFMUState(trial->three, state.three, three, size)))
        CHECK(memcmp(two, state.bytes, size) == 0 && memcmp(three, state.bytes, size) == 0,
              "a state has changed while it was kept");
    free(two);
    free(three);
}

void live_through_a_made_up_state(Pair *pair)
{
    Kept home = {.twin = pair->twin, .bytes = exactly(pair->bytes, state_size)}, strange = {.two = NULL};
    const unsigned char *part = kept[below(KEPT)].bytes;
    Serialized made = serialized_from(pair->bytes, part == NULL ? pair->bytes : part, 1);
    trace("%ld: a made-up state", (long)(pair - pairs));
    listen(pair, pair->name);
    CHECK(fmi2GetFMUstate(pair->two, &home.two) == fmi2OK && fmi3GetFMUState(pair->three, &home.three) == fmi3OK,
          "a state cannot be taken");
    int two = (int)fmi2DeSerializeFMUstate(pair->two, (fmi2Byte *)made.bytes, made.size, &strange.two);
    int three = (int)fmi3DeserializeFMUState(pair->three, made.bytes, made.size, &strange.three);
    CHECK(two == three && (two == fmi2OK || two == fmi2Error), "a state is read with the status %d and %d", two, three);
    ++*(two == fmi2OK ? &statistics.crafted_taken : &statistics.crafted_refused);
    if (two == fmi2OK) {
        two = (int)fmi2SetFMUstate(pair->two, strange.two);
        three = (int)fmi3SetFMUState(pair->three, strange.three);
        CHECK(two == three, "a state is set with the status %d and %d", two, three);
        look(pair);
        CHECK(two != fmi2OK || memcmp(pair->bytes, made.bytes, state_size) == 0, "a state is not that of its bytes");
        if (two == fmi2OK)
            pair->twin.mode = UNKNOWN;
        for (int k = two == fmi2OK ? 12 : 0; k > 0; k--)
            try_call(pair, (int[]){CALL_GetReal, CALL_SetReal, CALL_DoStep, CALL_CompletedIntegratorStep,
                                   CALL_ExitInitializationMode, CALL_EnterContinuousTimeMode, CALL_GetEventIndicators,
                                   CALL_GetDirectionalDerivative, CALL_GetRealOutputDerivatives}[below(9)]);
        listen(pair, pair->name);
        CHECK(fmi2SetFMUstate(pair->two, home.two) == fmi2OK && fmi3SetFMUState(pair->three, home.three) == fmi3OK,
              "a pair cannot go back");
        look(pair);
        CHECK(memcmp(pair->bytes, home.bytes, state_size) == 0, "a pair has not gone back");
        pair->twin = home.twin;
    }
    listen(pair, pair->name);
    CHECK(fmi2FreeFMUstate(pair->two, &home.two) == fmi2OK && fmi3FreeFMUState(pair->three, &home.three) == fmi3OK &&
              fmi2FreeFMUstate(pair->two, &strange.two) == fmi2OK &&
              fmi3FreeFMUState(pair->three, &strange.three) == fmi3OK,
          "a state is not freed");
    free(made.bytes);
    free(home.bytes);
}
