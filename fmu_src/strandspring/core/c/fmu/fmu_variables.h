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
#include "../spring/branches.h"

#include <stdint.h>

enum {
    SPRING_DISPLACEMENT,
    SPRING_FORCE,
    SPRING_STIFFNESS,
    SPRING_ABSORBED_ENERGY,
    SPRING_EXTRAPOLATING,
    SPRING_OMEGA,
    SPRING_FIRST_PARAMETER
};

enum { SPRING_SCALARS = 7 }; /* parameters of both forms besides the coefficients */

/* What follows the parameters of both forms: omega_start, or velocity and derivatives. */
enum { OWN_OMEGA_START = 0, OWN_OF_USUAL_FORM = 1 };
enum { OWN_VELOCITY = 0, OWN_POWER, OWN_OMEGA_RATE, OWN_OF_STATES_FORM };

/* The values of all parameters, and the form of the FMU. */
typedef struct {
    SpringParameters spring;
    double omega_start;
    int64_t has_states;
    int64_t real_time; /* whether nothing may be allocated after instantiation */
    int64_t no_energy; /* whether absorbed_energy is left out */
    int64_t arrays; /* whether coefficients are arrays, in FMI 3.0 */
    SpringAdded added;
    double second_omega_start;
} Settings;

/* The start values of all parameters, copied from the FMU's block (fmu_block.c). */
SPRING_LOCAL Settings fmu_start_settings(void);

typedef struct {
    char text[32];
} VariableName;

/* The first variable that the other form does not have. */
static inline unsigned fmu_first_own(const Settings *settings)
{
    const SpringParameters *p = &settings->spring;
    return (unsigned)(SPRING_FIRST_PARAMETER + p->elastic + p->knots + p->forces + p->amplifier + SPRING_SCALARS);
}

/* The first variable of a second mechanism or of branches, if there are any. */
static inline unsigned fmu_first_added(const Settings *settings)
{
    return fmu_first_own(settings) + (settings->has_states ? OWN_OF_STATES_FORM : OWN_OF_USUAL_FORM);
}

/* Whether there is a second mechanism or a branch. */
static inline int fmu_has_added(const Settings *settings)
{
    return settings->added.mechanisms + settings->added.branches > 0;
}

/* How many variables there are. */
static inline unsigned fmu_variables(const Settings *settings)
{
    const SpringAdded *added = &settings->added;
    /* omega, kappa_omega, rho, sigma, n and either omega_start or the rate of omega; of each branch three, and its rate;
     * stored_energy. */
    int of_second = added->mechanisms ? 6 + added->amplifier : 0;
    int of_branches = added->branches * (settings->has_states ? 4 : 3) + (added->branches > 0);
    return fmu_first_added(settings) + (unsigned)(of_second + of_branches);
}

static inline VariableType fmu_type(unsigned reference)
{
    return reference == SPRING_EXTRAPOLATING ? VARIABLE_BOOLEAN : VARIABLE_REAL;
}

SPRING_LOCAL VariableCausality fmu_causality_of_added(const Settings *settings, unsigned reference);
static inline VariableCausality fmu_causality(const Settings *settings, unsigned reference)
{
    if (reference < SPRING_FIRST_PARAMETER)
        return reference == SPRING_DISPLACEMENT   ? VARIABLE_INPUT
               : reference < SPRING_EXTRAPOLATING ? VARIABLE_OUTPUT
                                                  : VARIABLE_LOCAL;
    if (reference >= fmu_first_added(settings))
        return fmu_causality_of_added(settings, reference);
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

/* Whether the memory of a path depends on a parameter: rho, sigma, n and omega_start, and those like them of a second
 * mechanism and of branches. */
SPRING_LOCAL int fmu_shapes_path(const Settings *settings, unsigned reference);

SPRING_LOCAL VariableName fmu_name(const Settings *settings, unsigned reference);

/* The value of a parameter. */
SPRING_LOCAL double *fmu_setting(Settings *settings, unsigned reference);

/* The derivative by a parameter. */
SPRING_LOCAL double fmu_derivative_by(const SpringGradient *gradient, const Settings *settings, unsigned reference);
SPRING_LOCAL double fmu_slope_derivative_by(
    const SpringOmegaSlope *slope, const Settings *settings, unsigned reference);

#endif
