/* The FMU of FMI 2.0 as one unit, of which the other files are parts. No name but those of FMI's functions leaves it,
 * so that several FMUs can be linked into one program, each with its FMI2_FUNCTION_PREFIX. Inline, so that compilers do
 * not warn of functions that only others need. */
#ifdef FMU_SHARED_APART /* as in our own build, whose one binary for both versions of FMI has fmu_all.c once */
#include "fmu/fmu_instance.h"
#else
#define SPRING_LOCAL static inline
#include "fmu_all.c"
#endif
#include "fmi2/fmi2_derivatives.c"
#include "fmi2/fmi2_life.c"
#include "fmi2/fmi2_model_exchange.c"
