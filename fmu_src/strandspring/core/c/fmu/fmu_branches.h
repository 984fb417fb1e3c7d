/* The variables of a second mechanism and of Maxwell branches, which follow all others, in the order of
 * core/branch_variables.py. */
#ifndef FMU_BRANCHES_H
#define FMU_BRANCHES_H

#include "fmu_settings.h"

/* What a variable is; `index` is that of the coefficient or of the branch. */
typedef enum {
    ADDED_NONE, /* none of them */
    ADDED_OMEGA,
    ADDED_SCALAR, /* kappa_omega, rho, sigma and n */
    ADDED_AMPLIFIER,
    ADDED_OMEGA_START, /* of the usual form only */
    ADDED_STIFFNESS,
    ADDED_TIME_CONSTANT,
    ADDED_ELONGATION,
    ADDED_STORED_ENERGY,
    ADDED_OMEGA_RATE, /* this and the next of the form with states only */
    ADDED_ELONGATION_RATE
} AddedKind;

typedef struct {
    AddedKind kind;
    int index;
} AddedVariable;

SPRING_LOCAL AddedVariable fmu_added(const Settings *settings, unsigned reference);

static inline int fmu_added_is_parameter(AddedVariable variable)
{
    return variable.kind != ADDED_NONE && variable.kind != ADDED_OMEGA && variable.kind < ADDED_ELONGATION;
}

static inline int fmu_added_is_tunable(AddedVariable variable)
{
    return fmu_added_is_parameter(variable) && variable.kind != ADDED_OMEGA_START &&
           !(variable.kind == ADDED_AMPLIFIER && variable.index == 0);
}

/* Of the form with states: whether it is a state, or the rate of one. */
static inline int fmu_added_is_state(const Settings *settings, AddedVariable variable)
{
    return settings->has_states && (variable.kind == ADDED_OMEGA || variable.kind == ADDED_ELONGATION);
}

static inline int fmu_added_is_rate(AddedVariable variable)
{
    return variable.kind == ADDED_OMEGA_RATE || variable.kind == ADDED_ELONGATION_RATE;
}

SPRING_LOCAL VariableName fmu_added_name(AddedVariable variable);

/* The value of a parameter. */
SPRING_LOCAL double *fmu_added_setting(Settings *settings, AddedVariable variable);

/* A reason why these cannot be with this first spring, written into `text`; 0 if there is none. */
SPRING_LOCAL int fmu_added_problem(const Settings *settings, char *text, size_t size);

#endif
