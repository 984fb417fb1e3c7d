/* The variables of the FMU: rows of a table in its block, which is made from core/variables.py, and the values of its
 * parameters. A variable's value reference is its place in the table.
 *
 * In the usual form the spring remembers its path. In the form with states omega, absorbed_energy and what branches have
 * of a path are continuous states of model exchange, velocity is a second input, nothing else is remembered, and omega
 * begins where it is set.
 */
#ifndef FMU_VARIABLES_H
#define FMU_VARIABLES_H

#include "../fmi/fmu_interface.h"
#include "../spring/branches.h"

#include <stdint.h>

/* What a variable is, in the order of fmu/native/block.py. Every spring has the first six, whose references these are. */
typedef enum {
    SPRING_DISPLACEMENT,
    SPRING_FORCE,
    SPRING_STIFFNESS,
    SPRING_ABSORBED_ENERGY,
    SPRING_EXTRAPOLATING,
    SPRING_OMEGA,
    SPRING_KAPPA_OMEGA,
    SPRING_RHO,
    SPRING_SIGMA,
    SPRING_N,
    SPRING_OFFSET,
    SPRING_MIN,
    SPRING_MAX,
    SPRING_ELASTIC,
    SPRING_KNOT,
    SPRING_KNOT_FORCE,
    SPRING_AMPLIFIER,
    SPRING_OMEGA_START,
    SPRING_INPUT_RESOLUTION,
    SPRING_VELOCITY,
    SPRING_POWER, /* the rate of absorbed_energy */
    SPRING_OMEGA_RATE,
    SECOND_OMEGA,
    SECOND_KAPPA_OMEGA,
    SECOND_RHO,
    SECOND_SIGMA,
    SECOND_N,
    SECOND_AMPLIFIER,
    SECOND_OMEGA_START,
    SECOND_OMEGA_RATE,
    BRANCH_STIFFNESS,
    BRANCH_TIME_CONSTANT,
    BRANCH_ELONGATION,
    BRANCH_ELONGATION_RATE,
    BRANCHES_ENERGY
} SpringKind;

enum { MOST_VARIABLES = 112 };

/* `is_state` and `is_rate` of continuous states, whose order is that of the table. Without padding. */
typedef struct {
    char name[32];
    unsigned char kind, causality, is_tunable, is_state, is_rate, unused[3];
    int32_t index; /* of a coefficient or a branch */
    int32_t more;
} SpringVariable;

typedef struct {
    char text[32];
} VariableName;

/* The values of all parameters, and the form of the FMU. */
typedef struct {
    SpringParameters spring;
    double omega_start;
    double input_resolution; /* of the displacement [m]; 0 in the form with states */
    int64_t has_states;
    SpringAdded added;
    double second_omega_start;
} Settings;

/* The start values of all parameters, how many variables there are, and a variable, from the FMU's block. */
SPRING_LOCAL Settings fmu_start_settings(void);
SPRING_LOCAL unsigned fmu_variables(void);
SPRING_LOCAL SpringVariable fmu_variable(unsigned reference);
SPRING_LOCAL SpringKind fmu_kind(unsigned reference);
SPRING_LOCAL VariableCausality fmu_causality(unsigned reference);
SPRING_LOCAL VariableName fmu_name(unsigned reference);

static inline VariableType fmu_type(unsigned reference)
{
    return reference == SPRING_EXTRAPOLATING ? VARIABLE_BOOLEAN : VARIABLE_REAL;
}

/* Whether there is a second mechanism or a branch. */
static inline int fmu_has_added(const Settings *settings)
{
    return settings->added.mechanisms + settings->added.branches > 0;
}

/* Whether a value is one of input_resolution. */
static inline int fmu_is_resolution(double value)
{
    return 0.0 <= value && value <= LARGEST_DISPLACEMENT;
}

/* The value of a parameter. */
SPRING_LOCAL double *fmu_setting(Settings *settings, const SpringVariable *parameter);

/* The derivative by a parameter of the mechanism whose gradient it is. */
SPRING_LOCAL double fmu_derivative_by(const SpringGradient *gradient, const SpringVariable *parameter);

/* A reason why a second mechanism and branches cannot be with this first spring, written into `text`; 0 if there is
 * none. */
SPRING_LOCAL int fmu_added_problem(const Settings *settings, char *text, size_t size);

#endif
