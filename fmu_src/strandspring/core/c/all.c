/* The FMU as one unit, of which the other files are parts. No name but those of FMI's functions leaves it, so that
 * several FMUs can be linked into one program, each with its FMI2_FUNCTION_PREFIX. Inline, so that compilers do not warn of
 * functions that only others need. */
#define SPRING_LOCAL static inline

#include "fmi2_arguments.c"
#include "fmi2_block.c"
#include "fmi2_bytes.c"
#include "fmi2_cosimulation.c"
#include "fmi2_derivatives.c"
#include "fmi2_fmustate.c"
#include "fmi2_instance.c"
#include "fmi2_life.c"
#include "fmi2_log.c"
#include "fmi2_model_exchange.c"
#include "fmi2_reversal.c"
#include "fmi2_spring.c"
#include "fmi2_state.c"
#include "fmi2_states.c"
#include "fmi2_tables.c"
#include "fmi2_variables.c"
#include "fmi2_velocity.c"
#include "saturation.c"
#include "spline.c"
#include "spring.c"
