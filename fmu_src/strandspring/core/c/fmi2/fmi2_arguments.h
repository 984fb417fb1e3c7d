/* Checks of variables at the beginning of a call of FMI 2.0, named without "fmi2"; they leave it with fmi2Error. */
#ifndef FMI2_ARGUMENTS_H
#define FMI2_ARGUMENTS_H

#include "fmi2_states.h"
#include "../fmi/fmu_interface.h"

/* Value references must be those of variables of one type. */
#define FMI2_REQUIRE_VARIABLES(instance, call, references, count, values, type) \
    do { \
        FMU_REQUIRE_ARRAY(instance, call, references, count); \
        FMU_REQUIRE_ARRAY(instance, call, values, count); \
        size_t other = fmi2_first_of_other_type((instance), (references), (count), (type)); \
        if (other < (count)) \
            return fmi2_refuse_type((instance), (references)[other], (type)); \
    } while (0)

/* The place of the first reference that is not of a variable of the type, or `count`. Inline, for each exchange asks
 * twice. */
static inline size_t fmi2_first_of_other_type(
    const Instance *instance, const fmi2ValueReference references[], size_t count, VariableType type)
{
    size_t i = 0;
    while (i < count && references[i] < instance->variables && fmu_type(references[i]) == type)
        i++;
    return i;
}

SPRING_COLD FmuStatus fmi2_refuse_type(const Instance *instance, fmi2ValueReference reference, VariableType expected);

#endif
