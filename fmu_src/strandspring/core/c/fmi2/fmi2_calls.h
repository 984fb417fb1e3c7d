/* Calls of FMI 2.0 that the binaries of both back ends answer alike. Included once in each, where an `Instance` with
 * the fields `log`, `state.mode`, `state.time` and `state.stop_time` is declared. */
#ifndef FMI2_CALLS_H
#define FMI2_CALLS_H

#include "fmi2_states.h"

#include <math.h>

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(
    fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    FMU_REQUIRE(c, SetDebugLogging);
    FMU_REQUIRE_ARRAY(instance, SetDebugLogging, categories, nCategories);
    int chosen = 0;
    if (fmu_find_categories(&instance->log, nCategories, categories, &chosen) != FMU_OK)
        return fmi2Error;
    instance->log.categories = loggingOn ? chosen : 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    FMU_REQUIRE(c, SetupExperiment);
    double stop = stopTimeDefined ? stopTime : INFINITY;
    if (fmu_require_experiment(&instance->log, startTime, stop) != FMU_OK)
        return fmi2Error;
    instance->state.time = startTime;
    instance->state.stop_time = stop;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    FMU_REQUIRE(c, CancelStep);
    return fmi2OK;
}

/* No step is ever pending, so that few kinds of status are known. */
#define GET_STATUS(call, Type, known, answer) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2StatusKind s, Type *value) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_ARRAY(instance, call, value, 1); \
        if (!(known)) \
            return fmu_report(&instance->log, fmi2Discard, \
                              "%s has no status of kind %d, since steps of this FMU are never pending.", "fmi2" #call, \
                              (int)s); \
        *value = (answer); \
        return fmi2OK; \
    }

GET_STATUS(GetStatus, fmi2Status, 0, fmi2OK)
GET_STATUS(GetRealStatus, fmi2Real, s == fmi2LastSuccessfulTime, instance->state.time)
GET_STATUS(GetIntegerStatus, fmi2Integer, 0, 0)
GET_STATUS(GetBooleanStatus, fmi2Boolean, s == fmi2Terminated, fmi2False)
GET_STATUS(GetStringStatus, fmi2String, 0, NULL)

#endif
