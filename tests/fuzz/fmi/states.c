/* States that the host holds, of pairs that may be gone; bytes that are none; and calls that are taken back. */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

enum { KEPT = 5, BROKEN = 1, CRAFTED = 2 };

typedef struct {
    fmi2FMUstate two;
    fmi3FMUState three;
    unsigned char *bytes; /* the serialized form of both */
    Twin twin;
} Kept;

static Kept kept[KEPT];
static unsigned char junk[4096]; /* what is no state at all */
long made_up[2], repeated;

/* ---- bytes ------------------------------------------------------------------------------------------------------- */

/* The FMU documents how they begin: 8 bytes that name the format, its version (uint32), the size of the whole and the
 * checksum (FNV-1a) of what follows (uint64 each), the GUID of the FMU; then come its fields, of 4 or 8 bytes. All
 * numbers are little-endian. */
enum { SIZE_AT = 12, CHECKSUM_AT = 20, GUID_AT = 28, FIELDS_AT = GUID_AT + sizeof MODEL_GUID - 1 };

static void put(unsigned char *at, uint64_t number, int size)
{
    for (int i = 0; i < size; i++)
        at[i] = (unsigned char)(number >> 8 * i & 0xff);
}

/* Bytes changed, and mostly given the size and the checksum that they should have: made-up contents under the right
 * checksum (CRAFTED) only the fields can betray, others are BROKEN. */
static int spoil(unsigned char *bytes, size_t size, const unsigned char *other, int crafted)
{
    uint64_t sum = 0xcbf29ce484222325u;
    int sealed = crafted || chance(50);
    for (int k = 1 + below(3); k > 0; k--) {
        size_t at = FIELDS_AT + 4 * (random_bits() % ((size - FIELDS_AT) / 4 - 1));
        double number = chance(50) ? awkward() : uniform(-1.0, 1.0);
        if (!crafted)
            bytes[random_bits() % (sealed ? FIELDS_AT : size)] ^= (unsigned char)(1 << below(8));
        else if (chance(25))
            put(bytes + at, (uint64_t)(int64_t)(chance(70) ? below(7) - 3 : 1 << below(31)), 4);
        else if (chance(25))
            memcpy(bytes + at, other + at, (size_t)below((int)(size - at)));
        else
            memcpy(bytes + at, &number, sizeof number);
    }
    for (size_t i = GUID_AT; i < size; i++)
        sum = (sum ^ bytes[i]) * 0x100000001b3u;
    if (sealed) {
        put(bytes + SIZE_AT, size, 8);
        put(bytes + CHECKSUM_AT, sum, 8);
    }
    return crafted ? CRAFTED : BROKEN;
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

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
static Kept some_state(Trial *trial, int or_none)
{
    Kept state = kept[below(KEPT)];
    trial->looks = 1;
    starving = 0;
    if (careless() || (state.two == NULL && !or_none)) {
        int kind = below(or_none ? 2 : 3);
        must(trial, NO);
        state.two = kind == 2 ? NULL : kind == 1 ? (fmi2FMUstate)junk : trial->pair->probe3;
        state.three = kind == 2 ? NULL : kind == 1 ? (fmi3FMUState)junk : trial->pair->probe2;
    }
    return state;
}

/* Takes the state of the pair, or that of the bytes if there are any, into new memory or over an old state. */
static void take(Trial *trial, unsigned char *bytes, size_t size, const Twin *twin)
{
    Pair *pair = trial->pair;
    Kept made = some_state(trial, 1), *to = NULL;
    int nowhere = careless() && chance(30), is_new = made.two == NULL;
    for (int i = KEPT - 1; i >= 0; i--)
        to = kept[i].two == made.two ? &kept[i] : to;
    trial->states = is_new;
    starving = is_new && careless();
    must(trial, starving || nowhere ? NO : YES);
    fmi2FMUstate before2 = made.two, *two = nowhere ? NULL : &made.two;
    fmi3FMUState before3 = made.three, *three = nowhere ? NULL : &made.three;
    int done = bytes == NULL ? judged(trial, (int)fmi2GetFMUstate(trial->two, two), (int)fmi3GetFMUState(trial->three, three))
                             : judged(trial, (int)fmi2DeSerializeFMUstate(trial->two, (fmi2Byte *)bytes, size, two),
                                      (int)fmi3DeserializeFMUState(trial->three, bytes, size, three));
    CHECK(!done || is_new ? done || (made.two == before2 && made.three == before3)
                          : made.two == before2 && made.three == before3,
          "a pointer to a state is not what it should be");
    if (!done)
        return;
    free(to->bytes);
    *to = made;
    to->bytes = exactly(bytes == NULL ? pair->bytes : bytes, state_size);
    to->twin = *twin;
}

void get_state(Trial *trial)
{
    take(trial, NULL, 0, &trial->pair->twin);
}

void deserialize(Trial *trial)
{
    const Kept *state = &kept[below(KEPT)], *part = &kept[below(KEPT)];
    Twin twin = state->two != NULL ? state->twin : trial->pair->twin;
    unsigned char *bytes = exactly(state->two != NULL ? state->bytes : trial->pair->bytes, state_size);
    size_t size = careless() && chance(30) ? (size_t)below((int)state_size) : state_size;
    unsigned char *sound = exactly(bytes, state_size);
    int quality = careless() ? spoil(bytes, state_size, part->two ? part->bytes : trial->pair->bytes, chance(30)) : 0;
    unsigned char *cut = exactly(bytes, size);
    int same = memcmp(sound, bytes, state_size) == 0; /* bits that were flipped twice */
    must(trial, size < state_size || (quality == BROKEN && !same) ? NO : quality == CRAFTED ? UNSURE : YES);
    if (quality == CRAFTED)
        twin.mode = UNKNOWN;
    take(trial, cut == NULL ? bytes : cut, size, &twin);
    free(sound);
    free(bytes);
    free(cut);
}

void set_state(Trial *trial)
{
    Pair *pair = trial->pair;
    int exchange = pair->twin.exchange;
    Kept state = some_state(trial, 0);
    trial->looks = 0;
    must(trial, state.twin.mode == UNKNOWN ? UNSURE : state.twin.exchange == exchange ? YES : NO);
    if (!judged(trial, (int)fmi2SetFMUstate(trial->two, state.two), (int)fmi3SetFMUState(trial->three, state.three)))
        return;
    CHECK(memcmp(pair->bytes, state.bytes, state_size) == 0, "a pair is not in the state it was taken to");
    pair->twin = state.twin;
    pair->twin.exchange = exchange;
}

void free_state(Trial *trial)
{
    Kept state = some_state(trial, 1);
    fmi2FMUstate two = state.two;
    int nowhere = careless() && chance(30);
    if (nowhere)
        trial->may2 = trial->may3 = trial->two == NULL ? NO : YES;
    trial->states = nowhere || two == NULL ? 0 : -1;
    int done = judged(trial, (int)fmi2FreeFMUstate(trial->two, nowhere ? NULL : &state.two),
                      (int)fmi3FreeFMUState(trial->three, nowhere ? NULL : &state.three));
    CHECK(done && !nowhere ? state.two == NULL && state.three == NULL : state.two == two,
          "the pointer to a state is not what it should be");
    for (int i = 0; done && !nowhere && two != NULL && i < KEPT; i++)
        if (kept[i].two == two)
            forget(&kept[i]);
}

void size_of_state(Trial *trial)
{
    size_t two = 0, three = 0, *to = careless() ? NULL : &two;
    Kept state = some_state(trial, 0);
    must(trial, to == NULL ? NO : YES);
    if (judged(trial, (int)fmi2SerializedFMUstateSize(trial->two, state.two, to),
               (int)fmi3SerializedFMUStateSize(trial->three, state.three, to == NULL ? NULL : &three)))
        CHECK(two == state_size && three == two, "a state has %zu bytes, another one %zu", two, state_size);
}

void serialize(Trial *trial)
{
    Kept state = some_state(trial, 0);
    size_t size = !careless() ? state_size : chance(20) ? SIZE_MAX : (size_t)below(2 * (int)state_size);
    size_t room = size == SIZE_MAX ? 1 : size;
    void *two = elements(room, 1), *three = two == NULL ? NULL : allocated(room);
    must(trial, size == state_size && two != NULL ? YES : NO);
    if (judged(trial, (int)fmi2SerializeFMUstate(trial->two, state.two, two, size),
               (int)fmi3SerializeFMUState(trial->three, state.three, three, size)))
        CHECK(memcmp(two, state.bytes, size) == 0 && memcmp(three, state.bytes, size) == 0,
              "a state has changed while it was kept");
    free(two);
    free(three);
}

/* ---- there and back ---------------------------------------------------------------------------------------------- */

static Kept leave(Pair *pair)
{
    Kept home = {.twin = pair->twin, .bytes = exactly(pair->bytes, state_size)};
    listen(pair, pair->name);
    CHECK(fmi2GetFMUstate(pair->two, &home.two) == fmi2OK && fmi3GetFMUState(pair->three, &home.three) == fmi3OK,
          "a state cannot be taken");
    return home;
}

static void go_back(Pair *pair, const Kept *home)
{
    listen(pair, pair->name);
    /* One by its state, the other one by the bytes; what they lack would else be there already. */
    CHECK(fmi2SetFMUstate(pair->two, home->two) == fmi2OK && fmi3Reset(pair->three) == fmi3OK &&
              fmi3DeserializeFMUState(pair->three, home->bytes, state_size, &pair->probe3) == fmi3OK &&
              fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
          "a pair cannot go back");
    look(pair);
    CHECK(memcmp(pair->bytes, home->bytes, state_size) == 0, "a pair has not gone back");
    pair->twin = home->twin;
}

static void stay(Pair *pair, Kept *home)
{
    listen(pair, pair->name);
    CHECK(fmi2FreeFMUstate(pair->two, &home->two) == fmi2OK && fmi3FreeFMUState(pair->three, &home->three) == fmi3OK,
          "a state is not freed");
    free(home->bytes);
}

void repeat(Pair *pair)
{
    Kept home = leave(pair);
    uint64_t seed = random_bits(), first = 0;
    unsigned char *end = NULL;
    trace("%ld: a stretch of calls, twice\n", (long)(pair - pairs));
    for (int time = 0; time < 2; time++) {
        if (time == 1)
            go_back(pair, &home);
        random_seed(seed);
        heard = 0;
        for (int k = 2 + below(10); k > 0; k--)
            try_any(pair, 1);
        if (time == 0) {
            first = heard;
            end = exactly(pair->bytes, state_size);
        }
    }
    CHECK(first == heard && memcmp(end, pair->bytes, state_size) == 0, "the same calls give other answers");
    free(end);
    stay(pair, &home);
    repeated++;
}

void live_through_a_made_up_state(Pair *pair)
{
    Kept home = leave(pair), strange = {.two = NULL};
    const unsigned char *part = kept[below(KEPT)].bytes;
    unsigned char *bytes = exactly(pair->bytes, state_size);
    trace("%ld: a made-up state\n", (long)(pair - pairs));
    spoil(bytes, state_size, part == NULL ? pair->bytes : part, 1);
    int two = (int)fmi2DeSerializeFMUstate(pair->two, (fmi2Byte *)bytes, state_size, &strange.two);
    int three = (int)fmi3DeserializeFMUState(pair->three, bytes, state_size, &strange.three);
    CHECK(two == three && (two == fmi2OK || two == fmi2Error), "a state is read with the status %d and %d", two, three);
    made_up[two != fmi2OK]++;
    if (two == fmi2OK) {
        two = (int)fmi2SetFMUstate(pair->two, strange.two);
        CHECK(two == (int)fmi3SetFMUState(pair->three, strange.three), "a state is set by one version");
        look(pair);
        CHECK(two != fmi2OK || memcmp(pair->bytes, bytes, state_size) == 0, "a state is not that of its bytes");
        pair->twin.mode = two == fmi2OK ? UNKNOWN : pair->twin.mode;
        pair->twin.sound = UNSURE;
        for (int k = two == fmi2OK ? 12 : 0; k > 0; k--)
            try_any(pair, 1);
        go_back(pair, &home);
    }
    stay(pair, &strange);
    free(home.two == NULL ? NULL : bytes);
    stay(pair, &home);
}
