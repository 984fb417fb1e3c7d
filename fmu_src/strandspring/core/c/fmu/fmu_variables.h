/* The variables of the FMU, in the order of core/variables.py, which is that of their value references: six that every
 * spring has, the scalar parameters, the coefficients kE_i or the knots and forces of FE, the coefficients kA_i, of all
 * of which springs have different numbers, and those that only one form of the FMU has.
 *
 * In the usual form the spring remembers its path. In the form with states omega and absorbed_energy are continuous
 * states of model exchange, velocity is a second input, nothing else is remembered, and omega begins where it is set.
 *
 * Those of a second mechanism and of Maxwell branches follow all others; see fmu_branches.h.
 */
#ifndef FMU_VARIABLES_H
#define FMU_VARIABLES_H

#include "../fmi/fmu_interface.h"
#include "fmu_branches.h"

static inline VariableType fmu_type(unsigned reference)
{
    return reference == SPRING_EXTRAPOLATING ? VARIABLE_BOOLEAN : VARIABLE_REAL;
}

static inline VariableCausality fmu_causality(const Settings *settings, unsigned reference)
{
    if (reference < SPRING_FIRST_PARAMETER)
        return reference == SPRING_DISPLACEMENT   ? VARIABLE_INPUT
               : reference < SPRING_EXTRAPOLATING ? VARIABLE_OUTPUT
                                                  : VARIABLE_LOCAL;
    if (reference >= fmu_first_added(settings))
        return fmu_added_is_parameter(fmu_added(settings, reference)) ? VARIABLE_PARAMETER : VARIABLE_LOCAL;
    unsigned first_own = fmu_first_own(settings);
    if (!settings->has_states || reference < first_own)
        return VARIABLE_PARAMETER;
    return reference == first_own + OWN_VELOCITY ? VARIABLE_INPUT : VARIABLE_LOCAL;
}

/* Whether a variable is a continuous state. The order of states is that of the variables. */
SPRING_LOCAL int fmu_is_state(const Settings *settings, unsigned reference);

/* Whether a variable is the derivative of a continuous state. */
SPRING_LOCAL int fmu_is_rate(const Settings *settings, unsigned reference);

/* Whether a parameter may be changed after initialization. */
SPRING_LOCAL int fmu_is_tunable(const Settings *settings, unsigned reference);

SPRING_LOCAL VariableName fmu_name(const Settings *settings, unsigned reference);

/* Whether a value is one of input_resolution. */
static inline int fmu_is_resolution(double value)
{
    return 0.0 <= value && value <= LARGEST_DISPLACEMENT;
}

/* The value of a parameter. */
SPRING_LOCAL double *fmu_setting(Settings *settings, unsigned reference);

/* The derivative by a parameter. */
SPRING_LOCAL double fmu_derivative_by(const SpringGradient *gradient, const Settings *settings, unsigned reference);
SPRING_LOCAL double fmu_slope_derivative_by(
    const SpringOmegaSlope *slope, const Settings *settings, unsigned reference);

#endif
