/* States that the host holds, of pairs that may be gone; and bytes that are none. */
#include "pair.h"

enum { KEPT = 5 };

typedef struct {
    fmi2FMUstate two;
    fmi3FMUState three;
    unsigned char bytes[MOST_BYTES]; /* the serialized form of both */
    Twin twin;
} Kept;

static Kept kept[KEPT];
static unsigned char junk[4096]; /* what is no state at all */
static long made_up[2];          /* how many states of made-up numbers were taken, and refused */

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

static void forget_states(Pair *pair)
{
    listen(pair, pair->name);
    for (Kept *state = kept; state < kept + KEPT; state++)
        CHECK(fmi2FreeFMUstate(pair->two, &state->two) == fmi2OK && fmi3FreeFMUState(pair->three, &state->three) == fmi3OK,
              "a state is not freed");
}

/* A state that is held, or what a careless host takes for one: nothing, junk, or that of another FMU, as which the other
 * version stands. */
static Kept *some_state(Trial *trial, int or_none)
{
    static Kept strange;
    Kept *state = &kept[below(KEPT)];
    trial->looks = 1;
    starving = 0;
    if (!careless() && (state->two != NULL || or_none))
        return state;
    int kind = below(or_none ? 2 : 3);
    must(trial, NO);
    strange = *state;
    strange.two = kind == 2 ? NULL : kind == 1 ? (fmi2FMUstate)junk : trial->pair->probe3;
    strange.three = kind == 2 ? NULL : kind == 1 ? (fmi3FMUState)junk : trial->pair->probe2;
    return &strange;
}

/* Takes the state of the pair, or that of the bytes if there are any, into new memory or over an old state. */
static int take(Trial *trial, unsigned char *bytes, size_t size, const Twin *twin)
{
    Kept *state = some_state(trial, 1);
    int nowhere = careless() && chance(30), is_new = state->two == NULL;
    fmi2FMUstate before2 = state->two, *two = nowhere ? NULL : &state->two;
    fmi3FMUState before3 = state->three, *three = nowhere ? NULL : &state->three;
    trial->states = is_new;
    starving = is_new && careless();
    must(trial, starving || nowhere ? NO : YES);
    int done = bytes == NULL ? judged(trial, (int)fmi2GetFMUstate(trial->two, two), (int)fmi3GetFMUState(trial->three, three))
                             : judged(trial, (int)fmi2DeSerializeFMUstate(trial->two, (fmi2Byte *)bytes, size, two),
                                      (int)fmi3DeserializeFMUState(trial->three, bytes, size, three));
    CHECK((done && is_new) || (state->two == before2 && state->three == before3),
          "a pointer to a state is not what it should be");
    if (!done)
        return 0;
    memcpy(state->bytes, bytes == NULL ? trial->pair->bytes : bytes, state_size);
    state->twin = *twin;
    return 1;
}

static void get_state(Trial *trial)
{
    take(trial, NULL, 0, trial->twin);
}

static void deserialize(Trial *trial)
{
    const Kept *state = &kept[below(KEPT)], *part = &kept[below(KEPT)];
    Twin twin = state->two != NULL ? state->twin : *trial->twin;
    const unsigned char *sound = state->two != NULL ? state->bytes : trial->pair->bytes;
    size_t size = careless() && chance(30) ? 1 + (size_t)below((int)state_size - 1) : state_size;
    unsigned char *bytes = copy(sound, state_size);
    int crafted = chance(20), broken = !crafted && careless();
    if (crafted || broken)
        spoil(bytes, state_size, part->two ? part->bytes : trial->pair->bytes, crafted);
    broken = broken && memcmp(sound, bytes, state_size) != 0; /* not by bits that were flipped twice */
    must(trial, broken || size < state_size ? NO : crafted ? UNSURE : YES);
    twin.mode = crafted ? UNKNOWN : twin.mode;
    twin.sound = crafted ? UNSURE : twin.sound;
    made_up[!take(trial, copy(bytes, size), size, &twin)] += crafted;
}

static void set_state(Trial *trial)
{
    const Kept *state = some_state(trial, 0);
    int exchange = trial->twin->exchange;
    trial->looks = 0;
    must(trial, state->twin.mode == UNKNOWN ? UNSURE : state->twin.exchange == exchange ? YES : NO);
    if (!judged(trial, (int)fmi2SetFMUstate(trial->two, state->two), (int)fmi3SetFMUState(trial->three, state->three)))
        return;
    CHECK(memcmp(trial->pair->bytes, state->bytes, state_size) == 0, "a pair is not in the state it was taken to");
    *trial->twin = state->twin;
    trial->twin->exchange = exchange;
}

static void free_state(Trial *trial)
{
    Kept *state = some_state(trial, 1);
    fmi2FMUstate two = state->two;
    int nowhere = careless() && chance(30);
    if (nowhere)
        trial->may2 = trial->may3 = trial->two == NULL ? NO : YES;
    trial->states = nowhere || two == NULL ? 0 : -1;
    int done = judged(trial, (int)fmi2FreeFMUstate(trial->two, nowhere ? NULL : &state->two),
                      (int)fmi3FreeFMUState(trial->three, nowhere ? NULL : &state->three));
    CHECK(done && !nowhere ? state->two == NULL && state->three == NULL : state->two == two,
          "the pointer to a state is not what it should be");
}

/* With its size, or another number of bytes. */
static void serialize(Trial *trial)
{
    const Kept *state = some_state(trial, 0);
    size_t size = !careless() ? state_size : (size_t)below(2 * (int)state_size), size2 = 0, size3 = 0;
    void *two = elements(size, 1), *three = two == NULL ? NULL : lent(size);
    must(trial, size == state_size && two != NULL ? YES : NO);
    if (judged(trial, (int)fmi2SerializeFMUstate(trial->two, state->two, two, size),
               (int)fmi3SerializeFMUState(trial->three, state->three, three, size)))
        CHECK(memcmp(two, state->bytes, size) == 0 && memcmp(three, state->bytes, size) == 0 &&
                  fmi2SerializedFMUstateSize(trial->two, state->two, &size2) == fmi2OK && size2 == size &&
                  fmi3SerializedFMUStateSize(trial->three, state->three, &size3) == fmi3OK && size3 == size,
              "a state has changed while it was kept");
}
