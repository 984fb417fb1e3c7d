/* The values of all parameters of the FMU, its form, and where runs of its variables begin; fmu_variables.h says which
 * these are. */
#ifndef FMU_SETTINGS_H
#define FMU_SETTINGS_H

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

/* What follows the parameters of both forms: omega_start and input_resolution, or velocity and derivatives. */
enum { OWN_OMEGA_START = 0, OWN_INPUT_RESOLUTION, OWN_OF_USUAL_FORM };
enum { OWN_VELOCITY = 0, OWN_POWER, OWN_OMEGA_RATE, OWN_OF_STATES_FORM };

/* The values of all parameters, and the form of the FMU. */
typedef struct {
    SpringParameters spring;
    double omega_start;
    double input_resolution; /* of the displacement [m]; 0 in the form with states */
    int64_t has_states;
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

/* The parameter input_resolution; no variable has this reference in the form with states, which has no such parameter. */
static inline unsigned fmu_input_resolution(const Settings *settings)
{
    return settings->has_states ? ~0u : fmu_first_own(settings) + OWN_INPUT_RESOLUTION;
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

#endif
