#include "fmi3_elements.h"

#include "../fmu/fmu_instance.h"

enum { FIRST_COEFFICIENT = SPRING_FIRST_PARAMETER + SPRING_SCALARS };

/* Those from the first coefficient on. */
SPRING_APART Elements elements_of_other(const Instance *instance, fmi3ValueReference reference)
{
    const Settings *settings = &instance->state.settings;
    const SpringParameters *p = &settings->spring;
    const int arrays[] = {p->elastic, p->knots, p->forces, p->amplifier};
    unsigned first = FIRST_COEFFICIENT, left = reference - 1 - FIRST_COEFFICIENT;
    for (size_t i = 0; settings->arrays && i < sizeof arrays / sizeof *arrays; i++) {
        if (arrays[i] > 0 && left-- == 0)
            return (Elements){first, (unsigned)arrays[i]};
        first += (unsigned)arrays[i];
    }
    unsigned last = instance->variables + (unsigned)fmu_indicators(instance);
    return left <= last - first ? (Elements){first + left, 1} : (Elements){0, 0};
}

Elements fmi3_elements(const Instance *instance, fmi3ValueReference reference)
{
    return reference - 1 < FIRST_COEFFICIENT ? (Elements){reference - 1, 1} : elements_of_other(instance, reference);
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
