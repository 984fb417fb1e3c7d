#include "fmi3_arguments.h"

static const char *type_name(unsigned reference)
{
    return fmu_type(reference) == VARIABLE_BOOLEAN ? "Boolean" : "Float64";
}

SPRING_COLD FmuStatus refuse(const Instance *instance, const char *call, fmi3ValueReference reference, const char *type)
{
    Elements elements = fmi3_elements(instance, reference);
    if (elements.count == 0)
        return FMU_REFUSE(&instance->log, "There is no variable with value reference %u, which was given to %s.",
                          (unsigned)reference, call);
    return FMU_REFUSE(&instance->log, "`%s` (value reference %u) is %s, not %s.",
                      fmi3_name(instance, elements.first).text, (unsigned)reference, type_name(elements.first), type);
}

FmuStatus fmi3_require(const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count,
                       const char *name, const void *values, size_t value_count, VariableType type)
{
    size_t expected = 0;
    if ((count > 0 && references == NULL) || (value_count > 0 && values == NULL))
        return FMU_REFUSE(&instance->log, "The value references and `%s` of %s must not be NULL.", name, call);
    for (size_t i = 0; i < count; i++) {
        Elements elements = fmi3_elements(instance, references[i]);
        if (elements.count == 0 || fmu_type(elements.first) != type)
            return refuse(instance, call, references[i], type == VARIABLE_BOOLEAN ? "Boolean" : "Float64");
        expected += elements.count;
    }
    if (value_count != expected)
        return FMU_REFUSE(&instance->log, "`%s` of %s must have %.0f elements, as the variables have, got %.0f.", name,
                          call, (double)expected, (double)value_count);
    return FMU_OK;
}

FmuStatus fmi3_refuse_type(
    const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count, const char *type)
{
    if (count == 0)
        return FMU_OK;
    if (references == NULL)
        return FMU_REFUSE(&instance->log, "The value references of %s must not be NULL.", call);
    return refuse(instance, call, references[0], type);
}
