/* Numbers, texts and serialized states, all from one seed. */
#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state;
int carelessness;

void random_seed(uint64_t seed)
{
    state = seed;
}

uint64_t random_bits(void)
{
    /* splitmix64: good from any seed, so that neighbouring seeds have nothing in common. */
    uint64_t bits = state += 0x9e3779b97f4a7c15u;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return bits ^ (bits >> 31);
}

int below(int count)
{
    return (int)(random_bits() % (uint64_t)count);
}

int chance(int percent)
{
    return below(100) < percent;
}

int careless(void)
{
    return chance(carelessness);
}

double uniform(double low, double high)
{
    return low + (high - low) * ((double)(random_bits() >> 11) / 9007199254740992.0);
}

double awkward(void)
{
    static const double numbers[] = {0.0, -0.0, 1.0, -1.0, 0.5, 2.0, DBL_EPSILON, DBL_MIN, 5e-324, -5e-324, 1e-300,
                                     1e-9, 1e9, 1e15, 1e16, 1e154, -1e155, 1e300, -1e300, DBL_MAX, -DBL_MAX};
    double number;
    uint64_t bits = random_bits();
    switch (below(5)) {
    case 0: return (double[]){NAN, INFINITY, -INFINITY}[below(3)];
    case 1:
        memcpy(&number, &bits, sizeof number);
        return number;
    case 2: return uniform(-1.0, 1.0) * pow(10.0, uniform(-20.0, 20.0));
    default: return numbers[below(sizeof numbers / sizeof *numbers)];
    }
}

size_t count_of_elements(void)
{
    switch (below(16)) {
    case 0: return 0;
    case 1: return (size_t)below(chance(5) ? 200 : 40);
    case 2: case 3: case 4: case 5: return (size_t)(2 + below(4));
    default: return 1;
    }
}

const char *awkward_text(void)
{
    static char longest[5000];
    static const char *const texts[] = {"", "%s%n%d%1000000s", "\xff\xfe\x80\x01", "\n\r\t", "#r1#", "logall", "{%n}",
                                        "Feder \xc3\xa4\xc3\xb6 \xe5\xbc\xb9\xe7\xb0\xa7", "logStatusError ", longest};
    memset(longest, '%', sizeof longest - 1);
    return texts[below(sizeof texts / sizeof *texts)];
}

/* ---- serialized states ------------------------------------------------------------------------------------------- */

/* The FMU documents how they begin: 8 bytes that name the format, its version (uint32), the size of the whole and the
 * checksum (FNV-1a) of what follows (uint64 each), the GUID of the FMU; then come its fields, of 4 or 8 bytes. All
 * numbers are little-endian. */
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

static void make_up_fields(unsigned char *bytes, const unsigned char *other)
{
    size_t words = (state_size - FIELDS_AT) / 4;
    for (int k = 1 + below(3); k > 0; k--) {
        size_t at = FIELDS_AT + 4 * (random_bits() % words);
        double number = chance(50) ? awkward() : usual_displacement();
        switch (below(5)) {
        case 0: bytes[at] ^= (unsigned char)(1 << below(8)); break;
        case 1: put(bytes + at, (uint64_t)(int64_t)(chance(70) ? below(7) - 3 : 1 << below(31)), 4); break;
        case 2: /* part of another state */
            for (size_t length = (size_t)below(100); length > 0 && at < state_size; length--, at++)
                bytes[at] = other[at];
            break;
        default:
            if (at + sizeof number <= state_size)
                memcpy(bytes + at, &number, sizeof number);
        }
    }
}

static void damage(unsigned char *bytes, size_t from, size_t to)
{
    for (int k = 1 + below(4); k > 0; k--)
        bytes[from + random_bits() % (to - from)] ^= (unsigned char)(1 << below(8));
}

Serialized serialized_from(const unsigned char *bytes, const unsigned char *other, int crafted)
{
    Serialized made = {exactly(bytes, state_size), state_size, BROKEN};
    int sealed = chance(50);
    switch (crafted ? 7 : !careless() && chance(60) ? 8 : below(8)) {
    case 0: /* cut off, or longer */
        made.size = chance(80) ? (size_t)below((int)state_size) : state_size + 1 + (size_t)below(1000);
        free(made.bytes);
        made.bytes = memset(allocated(made.size ? made.size : 1), below(256), made.size);
        memcpy(made.bytes, bytes, made.size < state_size ? made.size : state_size);
        break;
    case 1:
        damage(made.bytes, 0, made.size);
        sealed = 0;
        break;
    case 2: damage(made.bytes, chance(50) ? VERSION_AT : 0, SIZE_AT); break; /* another version, or no such format */
    case 3: damage(made.bytes, GUID_AT, FIELDS_AT); break;                   /* another FMU */
    case 4:
        for (size_t i = sealed ? GUID_AT : 0; i < made.size; i++)
            made.bytes[i] = (unsigned char)below(256);
        break;
    case 8: sealed = 0; break;
    default:
        make_up_fields(made.bytes, other);
        made.quality = CRAFTED;
        sealed = 1;
    }
    if (sealed)
        seal(made.bytes, made.size);
    if (made.size == state_size && memcmp(made.bytes, bytes, made.size) == 0)
        made.quality = SOUND;
    return made;
}
