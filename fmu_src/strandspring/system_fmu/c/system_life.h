/* The beginning and end of an instance. */
#ifndef SYSTEM_LIFE_H
#define SYSTEM_LIFE_H

#include "system_instance.h"

/* An instance for co-simulation, as fmu_new_instance makes its memory; NULL after a message. */
SPRING_LOCAL Instance *system_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory);

/* NULL is allowed. */
SPRING_LOCAL void system_free(Instance *instance);

#endif
