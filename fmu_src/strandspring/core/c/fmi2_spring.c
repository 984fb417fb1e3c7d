/* The calls of FMI 2.0 that model exchange and co-simulation share, but for states and derivatives. */
#include "fmi2_arguments.h"
#include "fmi2_block.h"
#include "fmi2_instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Memory of instances comes from the host, or from the C library if the host gives no functions for it. */
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
    int named = instanceName != NULL && instanceName[0] != '\0';
    Log log = {functions->logger, functions->componentEnvironment, named ? instanceName : "unnamed", LOG_ALL};
    Guid guid = fmu_guid();
    int own_memory = functions->allocateMemory == NULL && functions->freeMemory == NULL;
    if (!named)
        return FMU_REFUSE_POINTER(&log, "The name of an instance must not be empty.");
    if (fmuType == fmi2CoSimulation && fmu_start_settings().has_states)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0): this form of the FMU has continuous states "
                                        "and no solver.");
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0) or fmi2CoSimulation (1), got %d.",
                                  (int)fmuType);
    if (fmuGUID == NULL || strcmp(fmuGUID, guid.text) != 0)
        return FMU_REFUSE_POINTER(&log, "The GUID must be %s, got %s.", guid.text,
                                  fmuGUID == NULL ? "none" : fmu_printable(fmuGUID).text);
    if (!own_memory && (functions->allocateMemory == NULL || functions->freeMemory == NULL))
        return FMU_REFUSE_POINTER(&log, "The callbacks allocateMemory and freeMemory must both be given or both be NULL.");
    const size_t name_size = strlen(instanceName) + 1, size = sizeof(Instance) + name_size;
    Instance *instance = own_memory ? calloc(1, size) : functions->allocateMemory(1, size);
    if (instance == NULL)
        return FMU_REFUSE_POINTER(&log, "There is not enough memory for an instance.");
    memset(instance, 0, sizeof *instance);
    memcpy(instance->name, instanceName, name_size);
    log.instance_name = instance->name;
    instance->log = log;
    instance->free = own_memory ? free : functions->freeMemory;
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

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, EnterInitializationMode);
    instance->state.mode = instance->state.mode & MODEL_EXCHANGE ? ME_INITIALIZATION : CS_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, ExitInitializationMode);
    return fmu_end_initialization(instance);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    FMU_REQUIRE(c, Terminate);
    instance->state.mode = instance->state.mode & MODEL_EXCHANGE ? ME_TERMINATED : CS_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    FMU_REQUIRE(c, Reset);
    fmu_begin(instance, instance->state.mode & MODEL_EXCHANGE ? ME_INSTANTIATED : CS_INSTANTIATED);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    FMU_REQUIRE(c, GetReal);
    FMU_REQUIRE_VARIABLES(instance, GetReal, vr, nvr, value, VARIABLE_REAL);
    return fmu_read(instance, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    FMU_REQUIRE(c, GetBoolean);
    FMU_REQUIRE_VARIABLES(instance, GetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
    for (size_t i = 0; i < nvr; i++)
        value[i] = fmu_extrapolating(instance) ? fmi2True : fmi2False;
    return fmi2OK;
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

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    FMU_REQUIRE(c, SetBoolean);
    FMU_REQUIRE_VARIABLES(instance, SetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
    return nvr == 0 ? fmi2OK : require_settable(instance, vr[0]);
}

/* Of types that no variable has. */
#define EXCHANGE_NONE(call, Type, type) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_VARIABLES(instance, call, vr, nvr, value, type); \
        return fmi2OK; \
    }

EXCHANGE_NONE(GetInteger, fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(GetString, fmi2String, VARIABLE_STRING)
EXCHANGE_NONE(SetInteger, const fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(SetString, const fmi2String, VARIABLE_STRING)
