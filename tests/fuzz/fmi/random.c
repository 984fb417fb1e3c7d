#include "fuzz.h"

#include <float.h>
#include <math.h>
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
    case 1: return (size_t)below(40);
    case 2: return chance(5) ? (size_t)below(4000) : 2;
    case 3: case 4: case 5: return (size_t)(2 + below(4));
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
