#include "fmi2_arguments.h"

static const char *const TYPE_NAMES[] = {
    [VARIABLE_REAL] = "Real",
    [VARIABLE_INTEGER] = "Integer",
    [VARIABLE_BOOLEAN] = "Boolean",
    [VARIABLE_STRING] = "String",
};

FmuStatus fmi2_refuse_type(const Instance *instance, fmi2ValueReference reference, VariableType expected)
{
    if (reference >= instance->variables)
        return FMU_REFUSE(&instance->log, "There is no variable with value reference %u; they go from 0 to %u.",
                          reference, instance->variables - 1);
    return FMU_REFUSE(&instance->log, "`%s` (value reference %u) is %s, not %s.",
                      fmu_variable_name(instance, reference).text, reference, TYPE_NAMES[fmu_type(reference)],
                      TYPE_NAMES[expected]);
}
