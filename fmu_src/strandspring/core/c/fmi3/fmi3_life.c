/* The calls of FMI 3.0 that the FMU of a spring and that of a system answer alike. */
#include "fmi3_arguments.h"
#include "../fmi/fmu_calls.c"

#include <math.h>

static void write_message(const Log *log, FmuStatus status, const char *category, const char *text)
{
    ((fmi3LogMessageCallback)log->logger)(log->environment, (fmi3Status)status, category, text);
}

/* Errors are logged even where logging is off. */
static Log first_log(fmi3String name, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, int logging)
{
    return (Log){
        .write = logger == NULL ? NULL : write_message,
        .logger = (void (*)(void))logger,
        .environment = environment,
        .instance_name = name,
        .categories = logging ? LOG_ALL : LOG_ERRORS,
    };
}

static const Memory C_LIBRARY = {NULL, NULL};

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    return fmu_instantiate(&log, instanceName, instantiationToken, "instantiation token", &C_LIBRARY, ME_INSTANTIATED);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate)
{
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    if (eventModeUsed)
        return FMU_REFUSE_POINTER(&log, "`eventModeUsed` must be false: this FMU has no event mode in co-simulation.");
    if (nRequiredIntermediateVariables > 0)
        return FMU_REFUSE_POINTER(
            &log, "`nRequiredIntermediateVariables` must be 0: this FMU has no intermediate update.");
    return fmu_instantiate(&log, instanceName, instantiationToken, "instantiation token", &C_LIBRARY, CS_INSTANTIATED);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption)
{
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    return FMU_REFUSE_POINTER(
        &log, "This FMU has no clocks for scheduled execution; instantiate it for co-simulation.");
}

fmi3Status fmi3SetDebugLogging(
    fmi3Instance c, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[])
{
    int chosen = 0;
    FMU_REQUIRE(c, SetDebugLogging);
    FMU_REQUIRE_ARRAY(instance, SetDebugLogging, categories, nCategories);
    if (fmu_find_categories(&instance->log, nCategories, categories, &chosen) != FMU_OK)
        return fmi3Error;
    int before = instance->log.categories;
    instance->log.categories = (loggingOn ? before | chosen : before & ~chosen) | LOG_ERRORS;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    FMU_REQUIRE(c, EnterInitializationMode);
    double stop = stopTimeDefined ? stopTime : HUGE_VAL;
    if (fmu_require_experiment(&instance->log, startTime, stop) != FMU_OK)
        return fmi3Error;
    instance->state.time = startTime;
    instance->state.stop_time = stop;
    return enter(instance, INITIALIZATION);
}

FMU_SNAPSHOT_CALLS(GetFMUState, SetFMUState, FreeFMUState, SerializedFMUStateSize, SerializeFMUState,
                   DeserializeFMUState)

static FmuStatus read_value(Instance *instance, unsigned place, double *value)
{
    if (place < instance->variables)
        return fmu_read(instance, &place, 1, value);
    *value = place == instance->variables ? instance->state.time : fmu_indicator(instance);
    return FMU_OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, GetFloat64);
    FMI3_REQUIRE_VALUES(instance, GetFloat64, VARIABLE_REAL);
    for (size_t i = 0; i < nValueReferences; i++)
        if (read_value(instance, fmi3_place(valueReferences[i]), &values[i]) != FMU_OK)
            return fmi3Error;
    return fmi3OK;
}

static FmuStatus require_change(const Instance *instance, unsigned place, double value)
{
    if (place < instance->variables)
        return fmu_require_change(instance, place, value);
    return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.", fmi3_name(instance, place).text);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, SetFloat64);
    FMI3_REQUIRE_VALUES(instance, SetFloat64, VARIABLE_REAL);
    for (size_t i = 0; i < nValueReferences; i++)
        if (require_change(instance, fmi3_place(valueReferences[i]), values[i]) != FMU_OK)
            return fmi3Error;
    fmu_open_changes(instance);
    for (size_t i = 0; i < nValueReferences; i++)
        fmu_change(instance, fmi3_place(valueReferences[i]), values[i]);
    return fmu_apply_changes(instance);
}

/* The one Boolean is `extrapolating`. */
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    int extrapolating;
    FMU_REQUIRE(c, GetBoolean);
    FMI3_REQUIRE_VALUES(instance, GetBoolean, VARIABLE_BOOLEAN);
    if (nValues > 0 && fmu_read_extrapolating(instance, &extrapolating) != FMU_OK)
        return fmi3Error;
    for (size_t i = 0; i < nValues; i++)
        values[i] = extrapolating != 0;
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues)
{
    FMU_REQUIRE(c, SetBoolean);
    FMI3_REQUIRE_VALUES(instance, SetBoolean, VARIABLE_BOOLEAN);
    return nValues == 0 ? fmi3OK : FMU_REFUSE(&instance->log, "`extrapolating` is calculated and cannot be set.");
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    FMU_REQUIRE(c, DoStep);
    FMU_REQUIRE_ARRAY(instance, DoStep, eventHandlingNeeded, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, terminateSimulation, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, earlyReturn, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, lastSuccessfulTime, 1);
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = instance->state.time;
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi3Error;
    return fmu_step_to(instance, currentCommunicationPoint, communicationStepSize, lastSuccessfulTime);
}
