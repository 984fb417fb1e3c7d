/* Variables of FMI 3.0 by their value references, and checks of them at the beginning of a call.
 *
 * A reference is the place of a variable in FMI 2.0, after which come the time and, if there is one, the event indicator,
 * counted from 1: some importers read dependencies, which are value references in FMI 3.0, as the indices that they are
 * in FMI 2.0.
 */
#ifndef FMI3_ARGUMENTS_H
#define FMI3_ARGUMENTS_H

#include "fmi3_states.h"
#include "../fmi/fmu_interface.h"

static inline unsigned fmi3_place(fmi3ValueReference reference)
{
    return reference - 1u;
}

/* The name of the variable at a place, also of the time and the event indicator. */
SPRING_LOCAL VariableName fmi3_name(const Instance *instance, unsigned place);

/* The variables must be of the type, and the values as many. `name` is that of the values. */
SPRING_APART FmuStatus fmi3_require(
    const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count,
    const char *name, const void *values, size_t value_count, VariableType type);

/* The same for the arguments that all calls which get or set values have. */
#define FMI3_REQUIRE_VALUES(instance, call, type) \
    do { \
        if (fmi3_require(instance, FMI_PREFIX #call, valueReferences, nValueReferences, "values", values, nValues, \
                         type) != FMU_OK) \
            return fmi3Error; \
    } while (0)

/* In FMI 3.0 a variable that is no Boolean here is Float64. */
SPRING_LOCAL FmuStatus fmi3_refuse_type(
    const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count, const char *type);

#endif
