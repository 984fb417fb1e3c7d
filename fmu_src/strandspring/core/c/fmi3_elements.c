#include "fmi3_elements.h"

#include "fmu_model_exchange.h"

Elements fmi3_elements_of_other(const Instance *instance, fmi3ValueReference reference)
{
    const SpringParameters *p = &instance->state.settings.spring;
    const int arrays[] = {p->elastic, p->knots, p->forces, p->amplifier};
    unsigned first = SPRING_FIRST_PARAMETER, left = reference - 1 - SPRING_FIRST_PARAMETER;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        if (arrays[i] > 0 && left-- == 0)
            return (Elements){first, (unsigned)arrays[i]};
        first += (unsigned)arrays[i];
    }
    unsigned last = instance->variables + (instance->has_states ? 0 : 1);
    return left <= last - first ? (Elements){first + left, 1} : (Elements){0, 0};
}

VariableName fmi3_name(const Instance *instance, unsigned element)
{
    if (element < instance->variables)
        return fmu_variable_name(instance, element);
    return element == instance->variables ? (VariableName){"time"} : (VariableName){"reversal_indicator"};
}

double fmi3_value_beyond(const Instance *instance, unsigned element)
{
    return element == instance->variables ? instance->state.time : fmu_indicator(instance);
}

FmuStatus fmi3_require_derivable(const Instance *instance, unsigned element)
{
    if (element < instance->variables)
        return FMU_OK;
    return FMU_REFUSE(&instance->log, "There are no derivatives of or with respect to `%s`.",
                      fmi3_name(instance, element).text);
}
