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
#define VARIABLE(name, type, causality, start) {name, type, causality, start},
static const Variable fmu_variables[SPRING_VARIABLES] = {SPRING_VARIABLE_TABLE(VARIABLE)};
#undef VARIABLE

/* The values of the parameters, in the order of the table, as the kernel takes them; omega_start is none of these. */
SPRING_LOCAL SpringParameters fmu_spring_parameters(const double settings[SPRING_PARAMETERS]);

/* The derivative by a parameter. */
SPRING_LOCAL double fmu_derivative_by(const SpringGradient *gradient, unsigned parameter);

#endif
