#include "fmi2_arguments.h"

#include <stdio.h>
#include <string.h>

static const struct {
    int modes;
    const char *name;
} NAMES[] = {
    {INSTANTIATED, "instantiated"},
    {INITIALIZATION, "in initialization mode"},
    {ME_EVENT, "in event mode"},
    {ME_CONTINUOUS_TIME, "in continuous-time mode"},
    {CS_STEP, "in step mode"},
    {TERMINATED, "terminated"},
};
enum { NAMES_COUNT = sizeof NAMES / sizeof *NAMES };

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
        return fmu_refuse(&instance->log, "%s must follow a step that is pending, but none ever is.", call);
    if (!(allowed & kind))
        return fmu_refuse(&instance->log, "%s must be called in %s, but the instance is for %s.", call,
                          kind == CO_SIMULATION ? "model exchange" : "co-simulation",
                          kind == CO_SIMULATION ? "co-simulation" : "model exchange");
    for (int i = 0; i < NAMES_COUNT; i++) {
        size_t length = strlen(expected);
        if (NAMES[i].modes & allowed & kind)
            snprintf(expected + length, sizeof expected - length, "%s%s", length ? " or " : "", NAMES[i].name);
        if (NAMES[i].modes & mode)
            actual = NAMES[i].name;
    }
    return fmu_refuse(&instance->log, "%s must be called while the instance is %s, but it is %s.", call, expected,
                      actual);
}

fmi2Status fmu_refuse_type(const Instance *instance, fmi2ValueReference reference, VariableType expected)
{
    if (reference >= SPRING_VARIABLES)
        return fmu_refuse(&instance->log, "There is no variable with value reference %u; they go from 0 to %d.",
                          reference, SPRING_VARIABLES - 1);
    const Variable *variable = &fmu_variables[reference];
    return fmu_refuse(&instance->log, "`%s` (value reference %u) is %s, not %s.", variable->name, reference,
                      TYPE_NAMES[variable->type], TYPE_NAMES[expected]);
}
