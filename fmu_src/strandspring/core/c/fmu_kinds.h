/* Types and causalities of variables. */
#ifndef FMU_KINDS_H
#define FMU_KINDS_H

typedef enum { VARIABLE_REAL, VARIABLE_INTEGER, VARIABLE_BOOLEAN, VARIABLE_STRING } VariableType;

typedef enum { VARIABLE_INPUT, VARIABLE_OUTPUT, VARIABLE_LOCAL, VARIABLE_PARAMETER } VariableCausality;

#endif
