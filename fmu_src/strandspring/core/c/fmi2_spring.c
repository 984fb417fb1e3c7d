/* The beginning and end of a spring, and what may be set. */
#include "fmi2_arguments.h"
#include "fmi2_block.h"
#include "fmi2_instance.h"
#include "fmi2_life.h"

#include <math.h>

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation;
    (void)visible;
    /* Warnings and errors are no debug logging: fmi2SetDebugLogging can silence them. */
    (void)loggingOn;
    if (functions == NULL)
        return NULL;
    Log log = fmu_first_log(instanceName, functions);
    if (fmuType == fmi2CoSimulation && fmu_start_settings().has_states)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0): this form of the FMU has continuous states "
                                        "and no solver.");
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0) or fmi2CoSimulation (1), got %d.",
                                  (int)fmuType);
    fmi2CallbackFreeMemory free_memory;
    Instance *instance = fmu_new_instance(&log, instanceName, fmuGUID, functions, sizeof *instance, &free_memory);
    if (instance == NULL)
        return NULL;
    instance->log = log;
    instance->free = free_memory;
    fmu_begin(instance, fmuType == fmi2ModelExchange ? ME_INSTANTIATED : CS_INSTANTIATED);
    return instance;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *instance = c;
    if (instance == NULL)
        return;
    fmu_release(instance->shared);
    instance->free(instance);
}

/* Whether a variable may be set now. In the form with states it may be wherever no path depends on it. */
static fmi2Status require_settable(const Instance *instance, fmi2ValueReference reference)
{
    VariableCausality causality = fmu_causality(&instance->state.settings, reference);
    if (causality == VARIABLE_INPUT || fmu_is_state(&instance->state.settings, reference))
        return fmi2OK;
    if (causality != VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.",
                          fmu_name(&instance->state.settings, reference).text);
    if (instance->state.mode & (INSTANTIATED | INITIALIZATION))
        return fmi2OK;
    if (!fmu_is_tunable(&instance->state.settings, reference))
        return FMU_REFUSE(&instance->log,
                          "`%s` is fixed after initialization; reset the instance to change it.",
                          fmu_name(&instance->state.settings, reference).text);
    if (instance->state.mode & ME_CONTINUOUS_TIME && !instance->state.settings.has_states)
        return FMU_REFUSE(&instance->log, "`%s` can be changed at events only; enter event mode first.",
                          fmu_name(&instance->state.settings, reference).text);
    return fmi2OK;
}

/* Refuses what no input, state or parameter may be. */
static fmi2Status require_value(const Instance *instance, fmi2ValueReference reference, double value)
{
    const Settings *settings = &instance->state.settings;
    VariableCausality causality = fmu_causality(settings, reference);
    int is_displacement = reference == SPRING_DISPLACEMENT, is_input = causality == VARIABLE_INPUT;
    double largest = is_displacement ? LARGEST_DISPLACEMENT : is_input ? LARGEST_VELOCITY : LARGEST_SUM;
    if (causality == VARIABLE_PARAMETER ? isfinite(value) : fabs(value) <= largest)
        return fmi2OK;
    if (causality == VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` must be finite, got %s; the previous value is kept.",
                          fmu_name(settings, reference).text, spring_number(value).text);
    return FMU_REFUSE(&instance->log, "`%s` must be within +-%g%s, got %s; the previous value is kept.",
                      fmu_name(settings, reference).text, largest, is_displacement ? " m" : is_input ? " m/s" : "",
                      spring_number(value).text);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    FMU_REQUIRE(c, SetReal);
    FMU_REQUIRE_VARIABLES(instance, SetReal, vr, nvr, value, VARIABLE_REAL);
    for (size_t i = 0; i < nvr; i++) {
        /* The usual case in a few instructions. */
        if (vr[i] == SPRING_DISPLACEMENT && fabs(value[i]) <= LARGEST_DISPLACEMENT)
            continue;
        if (require_settable(instance, vr[i]) != fmi2OK || require_value(instance, vr[i], value[i]) != fmi2OK)
            return fmi2Error;
    }
    return fmu_write(instance, vr, nvr, value);
}
