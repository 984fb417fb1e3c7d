/* What the FMUs of FMI 2.0 need at the beginning of an instance. */
#ifndef FMI2_LIFE_H
#define FMI2_LIFE_H

#include "fmi2_log.h"
#include "fmu_life.h"

/* The functions for memory that the host gives: both of them, or none. */
SPRING_LOCAL FmuStatus fmi2_memory(const Log *log, const fmi2CallbackFunctions *functions, Memory *memory);

#endif
