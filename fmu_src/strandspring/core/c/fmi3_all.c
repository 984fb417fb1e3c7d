/* The FMU of FMI 3.0 as one unit, as fmi2_all.c is that of FMI 2.0. */
#ifdef FMU_SHARED_APART
#include "fmu/fmu_instance.h"
#else
#define SPRING_LOCAL static inline
#include "fmu_all.c"
#endif

#include "fmi3/fmi3_absent.c"
#include "fmi3/fmi3_arguments.c"
#include "fmi3/fmi3_derivatives.c"
#include "fmi3/fmi3_life.c"
#include "fmi3/fmi3_model_exchange.c"
