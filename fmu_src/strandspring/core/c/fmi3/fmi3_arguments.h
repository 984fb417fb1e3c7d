/* Checks of variables and their values at the beginning of a call of FMI 3.0. */
#ifndef FMI3_ARGUMENTS_H
#define FMI3_ARGUMENTS_H

#include "fmi3_elements.h"

/* The variables must be of the type, and the values as many as their elements. `name` is that of the values. */
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
