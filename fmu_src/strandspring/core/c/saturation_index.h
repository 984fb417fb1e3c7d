/* Buckets and edges, which making a table and looking it up share. */
#ifndef SATURATION_INDEX_H
#define SATURATION_INDEX_H

#include "spring_library.h"

#include <stdint.h>

/* Of a double that is not negative; see SpringIndex. */
static inline int spring_bucket(double z)
{
    uint64_t bits;
    memcpy(&bits, &z, sizeof bits);
    return (int)(bits >> 48);
}

/* The last of the edges low .. high that is <= value, or edge low. */
static inline int spring_search(const double *edges, int low, int high, double value)
{
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (value < edges[middle])
            high = middle - 1;
        else
            low = middle;
    }
    return low;
}

#endif
