/* States that the host holds, of pairs that may be gone; bytes that are none; and calls that are taken back. */
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

/* Bytes changed, and mostly given the size and the checksum that they should have: crafted contents under the right
 * checksum only the fields can betray. */
static void spoil(unsigned char *bytes, size_t size, const unsigned char *other, int crafted)
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
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

void forget_states(Pair *pair)
{
    listen(pair, pair->name);
    for (int i = 0; i < KEPT; i++) {
        CHECK(fmi2FreeFMUstate(pair->two, &kept[i].two) == fmi2OK && fmi3FreeFMUState(pair->three, &kept[i].three) == fmi3OK,
              "a state is not freed");
        free(kept[i].bytes);
        kept[i] = (Kept){.two = NULL};
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
static int take(Trial *trial, unsigned char *bytes, size_t size, const Twin *twin)
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
        return 0;
    free(to->bytes);
    *to = made;
    to->bytes = exactly(bytes == NULL ? pair->bytes : bytes, state_size);
    to->twin = *twin;
    return 1;
}

void get_state(Trial *trial)
{
    take(trial, NULL, 0, &trial->pair->twin);
}

void deserialize(Trial *trial)
{
    const Kept *state = &kept[below(KEPT)], *part = &kept[below(KEPT)];
    Twin twin = state->two != NULL ? state->twin : trial->pair->twin;
    const unsigned char *sound = state->two != NULL ? state->bytes : trial->pair->bytes;
    size_t size = careless() && chance(30) ? 1 + (size_t)below((int)state_size - 1) : state_size;
    unsigned char *bytes = memcpy(lent(state_size), sound, state_size);
    int crafted = chance(20), broken = !crafted && careless();
    if (crafted || broken)
        spoil(bytes, state_size, part->two ? part->bytes : trial->pair->bytes, crafted);
    broken = broken && memcmp(sound, bytes, state_size) != 0; /* not by bits that were flipped twice */
    must(trial, broken || size < state_size ? NO : crafted ? UNSURE : YES);
    twin.mode = crafted ? UNKNOWN : twin.mode;
    twin.sound = crafted ? UNSURE : twin.sound;
    unsigned char *cut = memcpy(lent(size), bytes, size);
    made_up[!take(trial, cut, size, &twin)] += crafted;
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
        if (kept[i].two == two) {
            free(kept[i].bytes);
            kept[i] = (Kept){.two = NULL};
        }
}

/* With its size, or another number of bytes. */
void serialize(Trial *trial)
{
    Kept state = some_state(trial, 0);
    size_t size = !careless() ? state_size : (size_t)below(2 * (int)state_size), size2 = 0, size3 = 0;
    void *two = elements(size, 1), *three = two == NULL ? NULL : lent(size);
    must(trial, size == state_size && two != NULL ? YES : NO);
    if (judged(trial, (int)fmi2SerializeFMUstate(trial->two, state.two, two, size),
               (int)fmi3SerializeFMUState(trial->three, state.three, three, size)))
        CHECK(memcmp(two, state.bytes, size) == 0 && memcmp(three, state.bytes, size) == 0 &&
                  fmi2SerializedFMUstateSize(trial->two, state.two, &size2) == fmi2OK && size2 == size &&
                  fmi3SerializedFMUStateSize(trial->three, state.three, &size3) == fmi3OK && size3 == size,
              "a state has changed while it was kept");
}

/* ---- there and back ---------------------------------------------------------------------------------------------- */

/* One version goes back by its state, the other one by the bytes; what they lack would else be there already. */
static void go_back(Pair *pair, fmi2FMUstate two, unsigned char *bytes)
{
    listen(pair, pair->name);
    CHECK(fmi2SetFMUstate(pair->two, two) == fmi2OK && fmi3Reset(pair->three) == fmi3OK &&
              fmi3DeserializeFMUState(pair->three, bytes, state_size, &pair->probe3) == fmi3OK &&
              fmi3SetFMUState(pair->three, pair->probe3) == fmi3OK,
          "a pair cannot go back");
    look(pair);
    CHECK(memcmp(pair->bytes, bytes, state_size) == 0, "a pair has not gone back");
}

void repeat(Pair *pair)
{
    const Twin twin = pair->twin;
    fmi2FMUstate home = NULL;
    unsigned char *before = exactly(pair->bytes, state_size), *end = NULL;
    uint64_t seed = random_bits(), first = 0;
    trace("%ld: a stretch of calls, twice\n", (long)(pair - pairs));
    CHECK(fmi2GetFMUstate(pair->two, &home) == fmi2OK, "a state cannot be taken");
    for (int time = 0; time < 2; time++) {
        random_seed(seed);
        heard = 0;
        for (int k = 2 + below(10); k > 0; k--)
            try_any(pair, 1);
        if (time == 1)
            break;
        first = heard;
        end = exactly(pair->bytes, state_size);
        go_back(pair, home, before);
        pair->twin = twin;
    }
    CHECK(first == heard && memcmp(end, pair->bytes, state_size) == 0, "the same calls give other answers");
    CHECK(fmi2FreeFMUstate(pair->two, &home) == fmi2OK, "a state is not freed");
    free(before);
    free(end);
    repeated++;
}
