#include "fmi3_arguments.h"

static int exists(const Instance *instance, unsigned place)
{
    return place <= instance->variables + fmu_indicators(instance);
}

VariableName fmi3_name(const Instance *instance, unsigned place)
{
    if (place < instance->variables)
        return fmu_variable_name(instance, place);
    return place == instance->variables ? (VariableName){"time"} : (VariableName){"reversal_indicator"};
}

SPRING_COLD FmuStatus refuse(const Instance *instance, const char *call, fmi3ValueReference reference, const char *type)
{
    unsigned place = fmi3_place(reference);
    if (!exists(instance, place))
        return FMU_REFUSE(&instance->log, "There is no variable with value reference %u, which was given to %s.",
                          (unsigned)reference, call);
    return FMU_REFUSE(&instance->log, "`%s` (value reference %u) is %s, not %s.",
                      fmi3_name(instance, place).text, (unsigned)reference,
                      fmu_type(place) == VARIABLE_BOOLEAN ? "Boolean" : "Float64", type);
}

FmuStatus fmi3_require(const Instance *instance, const char *call, const fmi3ValueReference references[], size_t count,
                       const char *name, const void *values, size_t value_count, VariableType type)
{
    if ((count > 0 && references == NULL) || (value_count > 0 && values == NULL))
        return FMU_REFUSE(&instance->log, "The value references and `%s` of %s must not be NULL.", name, call);
    for (size_t i = 0; i < count; i++)
        if (!exists(instance, fmi3_place(references[i])) || fmu_type(fmi3_place(references[i])) != type)
            return refuse(instance, call, references[i], type == VARIABLE_BOOLEAN ? "Boolean" : "Float64");
    if (value_count != count)
        return FMU_REFUSE(&instance->log, "`%s` of %s must have %.0f elements, as the variables have, got %.0f.", name,
                          call, (double)count, (double)value_count);
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
