/* What values in a serialized state can be. */
#ifndef FMU_SOUND_H
#define FMU_SOUND_H

#include "spring.h"

#include <math.h>

static inline int fmu_is_flag(int value)
{
    return value == 0 || value == 1;
}

static inline int fmu_is_side(int value)
{
    return value >= -1 && value <= 1;
}

/* Whether the path is such that nothing made of it overflows; omega may be anything. */
static inline int fmu_memory_is_sound(const SpringMemory *memory)
{
    return fabs(memory->displacement) <= LARGEST_DISPLACEMENT && fabs(memory->start) <= LARGEST_DISPLACEMENT &&
           fabs(memory->energy_at) <= LARGEST_DISPLACEMENT && fabs(memory->energy) <= LARGEST_SUM &&
           fabs(memory->start_xi) <= LARGEST_START_XI && fmu_is_side(memory->direction);
}

#endif
