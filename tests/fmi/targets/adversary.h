/* A path that is hard for a spring, the same on every machine. */
#ifndef ADVERSARY_H
#define ADVERSARY_H

#include <stdint.h>

/* In [0, 1). */
static double uniform(void)
{
    static uint64_t state = 16;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

/* A turn at every step, of every length, also out of the range; now and then a way on or none. */
static double next_displacement(double low, double high, double last)
{
    double width = high - low, kind = uniform(), length = width * uniform();
    static double direction = 1.0;
    direction = kind < 0.9 ? -direction : direction;
    if (kind > 0.98)
        return last;
    if (kind < 0.3)
        return low + width * (1.4 * uniform() - 0.2);
    if (kind < 0.5)
        length *= 1e-9;
    else if (kind < 0.8)
        length *= 0.05;
    double next = last + direction * length;
    return next > high || next < low ? last - direction * length : next;
}

#endif
