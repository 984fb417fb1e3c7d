/* The variables of the FMU, in the order of core/variables.py, which is that of their value references: six that every
 * spring has, the coefficients kE_i or the knots and forces of FE, the coefficients kA_i, of all of which springs have
 * different numbers, and the other parameters. */
#ifndef FMI2_VARIABLES_H
#define FMI2_VARIABLES_H

#include "spring.h"

enum {
    SPRING_DISPLACEMENT,
    SPRING_FORCE,
    SPRING_STIFFNESS,
    SPRING_ABSORBED_ENERGY,
    SPRING_EXTRAPOLATING,
    SPRING_OMEGA,
    SPRING_FIRST_PARAMETER
};

enum { SPRING_SCALARS = 8 }; /* parameters besides the coefficients */

static const double LARGEST_DISPLACEMENT = 1e9; /* [m] */

/* The values of all parameters. */
typedef struct {
    SpringParameters spring;
    double omega_start;
} Settings;

typedef enum { VARIABLE_REAL, VARIABLE_INTEGER, VARIABLE_BOOLEAN, VARIABLE_STRING } VariableType;

typedef enum { VARIABLE_INPUT, VARIABLE_OUTPUT, VARIABLE_LOCAL, VARIABLE_PARAMETER } VariableCausality;

typedef struct {
    char text[24];
} VariableName;

/* How many variables there are. */
static inline unsigned fmu_variables(const Settings *settings)
{
    const SpringParameters *p = &settings->spring;
    return (unsigned)(SPRING_FIRST_PARAMETER + p->elastic + p->knots + p->forces + p->amplifier + SPRING_SCALARS);
}

static inline VariableType fmu_type(unsigned reference)
{
    return reference == SPRING_EXTRAPOLATING ? VARIABLE_BOOLEAN : VARIABLE_REAL;
}

static inline VariableCausality fmu_causality(unsigned reference)
{
    return reference == SPRING_DISPLACEMENT      ? VARIABLE_INPUT
           : reference < SPRING_EXTRAPOLATING    ? VARIABLE_OUTPUT
           : reference >= SPRING_FIRST_PARAMETER ? VARIABLE_PARAMETER
                                                 : VARIABLE_LOCAL;
}

/* Whether a parameter may be changed after initialization. */
SPRING_LOCAL int fmu_is_tunable(const Settings *settings, unsigned reference);

SPRING_LOCAL VariableName fmu_name(const Settings *settings, unsigned reference);

/* The value of a parameter. */
SPRING_LOCAL double *fmu_setting(Settings *settings, unsigned reference);

/* The derivative by a parameter. */
SPRING_LOCAL double fmu_derivative_by(const SpringGradient *gradient, const Settings *settings, unsigned reference);

#endif
