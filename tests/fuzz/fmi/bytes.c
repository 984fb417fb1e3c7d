/* Serialized states: whole, damaged, of another FMU or version, and made up. The FMU documents how they begin: 8 bytes
 * that name the format, its version (uint32), the size of the whole and the checksum (FNV-1a) of what follows (uint64
 * each), the GUID of the FMU; then come its fields, of 4 or 8 bytes. All numbers are little-endian.
 */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

enum { VERSION_AT = 8, SIZE_AT = 12, CHECKSUM_AT = 20, GUID_AT = 28, FIELDS_AT = GUID_AT + sizeof MODEL_GUID - 1 };

static void put(unsigned char *at, uint64_t number, int size)
{
    for (int i = 0; i < size; i++)
        at[i] = (unsigned char)(number >> 8 * i & 0xff);
}

/* Gives the bytes the size and the checksum that they should have. */
static void seal(unsigned char *bytes, size_t size)
{
    uint64_t sum = 0xcbf29ce484222325u;
    if (size < GUID_AT)
        return;
    for (size_t i = GUID_AT; i < size; i++)
        sum = (sum ^ bytes[i]) * 0x100000001b3u;
    put(bytes + SIZE_AT, size, 8);
    put(bytes + CHECKSUM_AT, sum, 8);
}

static void make_up_fields(unsigned char *bytes, const unsigned char *other, size_t other_size)
{
    size_t size = state_size(), words = (size - FIELDS_AT) / 4;
    for (int k = 1 + below(3); k > 0; k--) {
        size_t at = FIELDS_AT + 4 * (random_bits() % words);
        double number = chance(50) ? awkward() : usual_displacement();
        switch (below(5)) {
        case 0:
            bytes[at] ^= (unsigned char)(1 << below(8));
            break;
        case 1:
            put(bytes + at, (uint64_t)(int64_t)(chance(70) ? below(7) - 3 : 1 << below(31)), 4);
            break;
        case 2: /* part of another state */
            for (size_t length = (size_t)below(100); length > 0 && at < size && at < other_size; length--, at++)
                bytes[at] = other[at];
            break;
        default:
            if (at + sizeof number <= size)
                memcpy(bytes + at, &number, sizeof number);
        }
    }
}

static void damage(unsigned char *bytes, size_t from, size_t to)
{
    for (int k = 1 + below(4); k > 0; k--)
        bytes[from + random_bits() % (to - from)] ^= (unsigned char)(1 << below(8));
}

Serialized made_up(const unsigned char *bytes, const unsigned char *part)
{
    Serialized made = {exactly(bytes, state_size()), state_size(), CRAFTED};
    make_up_fields(made.bytes, part == NULL ? bytes : part, state_size());
    seal(made.bytes, made.size);
    return made;
}

Serialized serialized_from(const unsigned char *bytes, const unsigned char *other, size_t other_size)
{
    size_t whole = state_size();
    Serialized made = {exactly(bytes, whole), whole, BROKEN};
    if (!careless() && chance(60)) {
        made.quality = SOUND;
        return made;
    }
    int sealed = chance(50);
    switch (below(8)) {
    case 0: /* cut off, or longer */
        made.size = chance(80) ? (size_t)below((int)whole) : whole + 1 + (size_t)below(1000);
        made.bytes = realloc(made.bytes, made.size + 1); /* no allocation of none */
        CHECK(made.bytes != NULL, "the test has no memory");
        for (size_t i = whole; i < made.size; i++)
            made.bytes[i] = (unsigned char)below(256);
        made.bytes = realloc(made.bytes, made.size ? made.size : 1);
        break;
    case 1:
        damage(made.bytes, 0, whole);
        sealed = 0;
        break;
    case 2: /* another version, or no such format */
        damage(made.bytes, chance(50) ? VERSION_AT : 0, SIZE_AT);
        break;
    case 3: /* another FMU */
        damage(made.bytes, GUID_AT, FIELDS_AT);
        break;
    case 4:
        free(made.bytes);
        made.size = other_size;
        made.bytes = exactly(other, other_size);
        made.quality = other_size == whole ? CRAFTED : BROKEN; /* then it is of this FMU */
        break;
    case 5:
        for (size_t i = sealed ? GUID_AT : 0; i < whole; i++)
            made.bytes[i] = (unsigned char)below(256);
        break;
    default:
        make_up_fields(made.bytes, other, other_size);
        made.quality = CRAFTED;
        sealed = 1;
    }
    if (sealed)
        seal(made.bytes, made.size);
    if (made.size == whole && memcmp(made.bytes, bytes, whole) == 0)
        made.quality = SOUND;
    return made;
}
