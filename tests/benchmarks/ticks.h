/* A clock of few nanoseconds, less what reading it takes. */
#ifndef TICKS_H
#define TICKS_H

#include <time.h>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

double worst_ticks_per_ns(void);

static double nanoseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static unsigned long long ticks_now(void)
{
#if defined(__x86_64__)
    _mm_lfence();
    unsigned long long now = __rdtsc();
    _mm_lfence();
    return now;
#else
    return (unsigned long long)nanoseconds();
#endif
}

double worst_ticks_per_ns(void)
{
    double start = nanoseconds(), end = start;
    unsigned long long first = ticks_now();
    while (end - start < 1e8)
        end = nanoseconds();
    return (double)(ticks_now() - first) / (end - start);
}

/* The fewest ticks between two readings. */
static unsigned long long ticks_of_nothing(void)
{
    unsigned long long least = ~0ULL;
    for (int k = 0; k < 1000; k++) {
        unsigned long long start = ticks_now(), taken = ticks_now() - start;
        least = taken < least ? taken : least;
    }
    return least;
}

#endif
