/* Variables of FMI 3.0, whose coefficients are arrays, and checks at the beginning of a call.
 *
 * The value references are those of the model description: the variables in the order of fmu_variables.h, each array as one, then the
 * time and, but for the form with states, the event indicator, counted from 1: some importers read dependencies, which are value
 * references in FMI 3.0, as the indices that they are in FMI 2.0.
 */
#ifndef FMI3_ARGUMENTS_H
#define FMI3_ARGUMENTS_H

#include "fmi3_states.h"
#include "fmu_instance.h"

/* The elements of one variable by their references in fmu_variables.h, beyond whose last are the time and the event indicator. */
typedef struct {
    unsigned first, count; /* 0: there is no such variable */
} Elements;

SPRING_APART Elements fmi3_elements_of_other(const Instance *instance, fmi3ValueReference reference);
static inline Elements fmi3_elements(const Instance *instance, fmi3ValueReference reference)
{
    return reference - 1 < SPRING_FIRST_PARAMETER ? (Elements){reference - 1, 1} : fmi3_elements_of_other(instance, reference);
}

/* The name of the variable that an element belongs to, or of the element where FMI 2.0 has one. */
SPRING_LOCAL VariableName fmi3_name(const Instance *instance, unsigned element);

/* The variables must be of the type, and the values as many as their elements. `name` is that of the values. */
SPRING_APART FmuStatus fmi3_require(
    const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count,
    const char *name, const void *values, size_t value_count, VariableType type);

/* The same for the arguments that all calls which get or set values have. */
#define FMI3_REQUIRE_VALUES(instance, call, type) \
    do { \
        if (fmi3_require(instance, FMI_PREFIX #call, valueReferences, nValueReferences, "values", values, nValues, type) != \
            FMU_OK) \
            return fmi3Error; \
    } while (0)

/* In FMI 3.0 a variable that is no Boolean here is Float64. */
SPRING_LOCAL FmuStatus fmi3_refuse_type(
    const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count, const char *type);

/* Neither the time nor the event indicator has derivatives. */
SPRING_LOCAL FmuStatus fmi3_require_derivable(const Instance *instance, unsigned element);

#endif
