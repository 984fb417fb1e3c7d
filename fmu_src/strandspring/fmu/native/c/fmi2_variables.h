/* The variables of the FMU. */
#ifndef FMI2_VARIABLES_H
#define FMI2_VARIABLES_H

#include "spring.h"
#include "spring_config.h"

enum { SPRING_PARAMETERS = SPRING_VARIABLES - SPRING_FIRST_PARAMETER };

typedef enum { VARIABLE_REAL, VARIABLE_INTEGER, VARIABLE_BOOLEAN, VARIABLE_STRING } VariableType;

typedef enum { VARIABLE_INPUT, VARIABLE_OUTPUT, VARIABLE_LOCAL, VARIABLE_PARAMETER } VariableCausality;

typedef struct {
    const char *name;
    VariableType type;
    VariableCausality causality;
    double start;
} Variable;

/* By value reference. */
extern const Variable fmu_variables[SPRING_VARIABLES];

/* The values of the parameters, in the order of the table, as the kernel takes them; omega_start is none of these. */
SpringParameters fmu_spring_parameters(const double settings[SPRING_PARAMETERS]);

/* The derivative by a parameter. */
double fmu_derivative_by(const SpringGradient *gradient, unsigned parameter);

#endif
