#include "fmi2_arguments.h"

#include <stdio.h>
#include <string.h>

static const struct {
    int modes;
    const char *name;
} MODES[] = {
    {INSTANTIATED, "instantiated"},
    {INITIALIZATION, "in initialization mode"},
    {ME_EVENT, "in event mode"},
    {ME_CONTINUOUS_TIME, "in continuous-time mode"},
    {CS_STEP, "in step mode"},
    {TERMINATED, "terminated"},
};
enum { MODE_COUNT = sizeof MODES / sizeof *MODES };

static const char *const TYPE_NAMES[] = {
    [VARIABLE_REAL] = "Real",
    [VARIABLE_INTEGER] = "Integer",
    [VARIABLE_BOOLEAN] = "Boolean",
    [VARIABLE_STRING] = "String",
};

fmi2Status fmu_refuse_call(const Instance *instance, const char *call, int allowed)
{
    int mode = instance->state.mode;
    int kind = mode & MODEL_EXCHANGE ? MODEL_EXCHANGE : CO_SIMULATION;
    char expected[160] = "";
    const char *actual = "";
    if (allowed == NO_MODE)
        return FMU_REFUSE(&instance->log, "%s must be called while a step is pending, and steps of this FMU never are.", call);
    if (!(allowed & kind))
        return FMU_REFUSE(&instance->log, "%s must be called in %s, but the instance is for %s.", call,
                          kind == CO_SIMULATION ? "model exchange" : "co-simulation",
                          kind == CO_SIMULATION ? "co-simulation" : "model exchange");
    for (int i = 0; i < MODE_COUNT; i++) {
        size_t length = strlen(expected);
        if (MODES[i].modes & allowed & kind)
            snprintf(expected + length, sizeof expected - length, "%s%s", length ? " or " : "", MODES[i].name);
        if (MODES[i].modes & mode)
            actual = MODES[i].name;
    }
    return FMU_REFUSE(&instance->log, "%s must be called while the instance is %s, but it is %s.", call, expected,
                      actual);
}

fmi2Status fmu_refuse_type(const Instance *instance, fmi2ValueReference reference, VariableType expected)
{
    const Settings *settings = &instance->state.settings;
    if (reference >= instance->variables)
        return FMU_REFUSE(&instance->log, "There is no variable with value reference %u; they go from 0 to %u.",
                          reference, instance->variables - 1);
    return FMU_REFUSE(&instance->log, "`%s` (value reference %u) is %s, not %s.", fmu_name(settings, reference).text,
                      reference, TYPE_NAMES[fmu_type(reference)], TYPE_NAMES[expected]);
}
