/* The FMU of FMI 3.0 as one unit, as fmi2_all.c is that of FMI 2.0. */
#define SPRING_LOCAL static inline

#include "fmi3_absent.c"
#include "fmi3_arguments.c"
#include "fmi3_derivatives.c"
#include "fmi3_elements.c"
#include "fmi3_fmustate.c"
#include "fmi3_life.c"
#include "fmi3_model_exchange.c"
#include "fmu_all.c"
