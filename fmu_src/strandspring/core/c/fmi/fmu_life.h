/* The memory of an instance. */
#ifndef FMU_LIFE_H
#define FMU_LIFE_H

#include "fmu_log.h"

#include <stddef.h>

/* The host's functions for memory; NULL: those of the C library. */
typedef struct {
    void *(*allocate)(size_t count, size_t size);
    void (*free)(void *memory);
} Memory;

/* Memory of `size` bytes for an instance, all zero, and behind it the copy of its name, which the log then takes; NULL,
 * after a message, if the name is empty, the GUID (which the version of FMI calls `guid_name`) is wrong or the memory
 * is missing. */
SPRING_LOCAL void *fmu_new_instance(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, size_t size);

SPRING_LOCAL void fmu_free_instance(void *instance, const Memory *memory);

#endif
