/* What values in a serialized state can be. */
#ifndef FMU_SOUND_H
#define FMU_SOUND_H

#include "../spring/spring.h"

#include <math.h>
#include <stdio.h>

static inline int fmu_is_flag(int value)
{
    return value == 0 || value == 1;
}

static inline int fmu_is_side(int value)
{
    return value >= -1 && value <= 1;
}

/* Whether the path is such that nothing made of it overflows; omega may be anything. Without a direction nothing has
 * moved yet. */
static inline int fmu_memory_is_sound(const SpringMemory *memory)
{
    int has_moved = memory->displacement != memory->start || memory->displacement != memory->energy_at;
    return fmu_is_side(memory->direction) && (memory->direction != 0 || !has_moved) &&
           fabs(memory->displacement) <= LARGEST_DISPLACEMENT && fabs(memory->start) <= LARGEST_DISPLACEMENT &&
           fabs(memory->energy_at) <= LARGEST_DISPLACEMENT && fabs(memory->energy) <= LARGEST_SUM &&
           fabs(memory->start_xi) <= LARGEST_START_XI;
}

/* Whether a field is named that no instance can have; the message is then in `problem`. */
static inline int fmu_is_damaged(const char *field, char *problem, size_t size)
{
    if (field != NULL)
        snprintf(problem, size, "The serialized state is damaged in its field `%s`.", field);
    return field != NULL;
}

#endif
