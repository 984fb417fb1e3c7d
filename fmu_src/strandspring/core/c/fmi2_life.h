/* The memory of an instance. */
#ifndef FMI2_LIFE_H
#define FMI2_LIFE_H

#include "fmi2_api.h"
#include "fmi2_log.h"

#include <stddef.h>

/* What messages go to before there is an instance. */
SPRING_LOCAL Log fmu_first_log(fmi2String name, const fmi2CallbackFunctions *functions);

/* Memory of `size` bytes for an instance, all zero, and behind it the copy of its name, which the log then takes; NULL, after a
 * message, if the name or the GUID are wrong or the memory is missing. It is to be freed by *free_memory. It comes from the
 * host, or from the C library if the host gives no functions for it. */
SPRING_LOCAL void *fmu_new_instance(
    Log *log, fmi2String name, fmi2String guid, const fmi2CallbackFunctions *functions, size_t size,
    fmi2CallbackFreeMemory *free_memory);

#endif
