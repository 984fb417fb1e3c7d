/* Calls of FMI 3.0 that the FMU of a spring and that of a system answer alike, and what they need at the beginning of an
 * instance. Included once in each, as fmi2_calls.h is. */
#ifndef FMI3_CALLS_H
#define FMI3_CALLS_H

#include "fmi3_arguments.h"
#include "fmu_life.h"

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

/* Steps of co-simulation have neither events nor intermediate updates. */
static FmuStatus require_plain_steps(const Log *log, int event_mode, size_t intermediate_variables)
{
    if (event_mode)
        return FMU_REFUSE(log, "`eventModeUsed` must be false: this FMU has no event mode in co-simulation.");
    if (intermediate_variables > 0)
        return FMU_REFUSE(log, "`nRequiredIntermediateVariables` must be 0: this FMU has no intermediate update.");
    return FMU_OK;
}

static const Memory C_LIBRARY = {NULL, NULL};

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
    fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    (void)clockUpdate;
    (void)lockPreemption;
    (void)unlockPreemption;
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    return FMU_REFUSE_POINTER(&log, "This FMU has no clocks for scheduled execution; instantiate it for co-simulation.");
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
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
    (void)toleranceDefined;
    (void)tolerance; /* the response is exact */
    FMU_REQUIRE(c, EnterInitializationMode);
    double stop = stopTimeDefined ? stopTime : INFINITY;
    if (fmu_require_experiment(&instance->log, startTime, stop) != FMU_OK)
        return fmi3Error;
    instance->state.time = startTime;
    instance->state.stop_time = stop;
    instance->state.mode = fmu_of_kind(instance->state.mode, INITIALIZATION);
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    FMU_REQUIRE(c, ExitInitializationMode);
    return fmu_end_initialization(instance);
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    FMU_REQUIRE(c, Terminate);
    instance->state.mode = fmu_of_kind(instance->state.mode, TERMINATED);
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    FMU_REQUIRE(c, Reset);
    fmu_begin(instance, fmu_of_kind(instance->state.mode, INSTANTIATED));
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Boolean values[], size_t nValues)
{
    FMU_REQUIRE(c, SetBoolean);
    FMI3_REQUIRE_VALUES(instance, SetBoolean, VARIABLE_BOOLEAN);
    return nValues == 0 ? fmi3OK : FMU_REFUSE(&instance->log, "`extrapolating` is calculated and cannot be set.");
}

#endif
