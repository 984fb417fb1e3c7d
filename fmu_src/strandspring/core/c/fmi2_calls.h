/* Calls of FMI 2.0 that the binaries of both back ends answer alike. Included once in each, where an `Instance` with the
 * fields `log`, `state.mode`, `state.time` and `state.stop_time` is declared. */
#ifndef FMI2_CALLS_H
#define FMI2_CALLS_H

#include "fmi2_states.h"
#include "spring_number.h"

#include <float.h>
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
    return fmu_choose_categories(&instance->log, loggingOn, nCategories, categories);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined;
    (void)tolerance; /* the response is exact */
    FMU_REQUIRE(c, SetupExperiment);
    if (!isfinite(startTime))
        return FMU_REFUSE(&instance->log, "The start time must be finite [s], got %s.", spring_number(startTime).text);
    if (stopTimeDefined && !(stopTime >= startTime))
        return FMU_REFUSE(&instance->log, "The stop time must not be before the start time %s s, got %s.",
                          spring_number(startTime).text, spring_number(stopTime).text);
    instance->state.time = startTime;
    instance->state.stop_time = stopTimeDefined ? stopTime : INFINITY;
    return fmi2OK;
}

/* Refuses a step of co-simulation whose time or size cannot be. */
static fmi2Status require_step(const Instance *instance, double time, double size)
{
    static const double ROUNDING = 1e-9; /* of times added up by the host */
    double end = time + size, stop_time = instance->state.stop_time;
    if (!(fabs(time) <= DBL_MAX))
        return FMU_REFUSE(&instance->log, "The time of a step must be finite [s], got %s.", spring_number(time).text);
    if (!(size >= 0.0 && end <= DBL_MAX))
        return FMU_REFUSE(&instance->log, "The step size at time %s s must be finite and >= 0 [s], got %s.",
                          spring_number(time).text, spring_number(size).text);
    if (end > stop_time && end > stop_time + ROUNDING * fmax(fabs(end), fabs(stop_time)))
        return FMU_REFUSE(&instance->log, "The step of %s s at time %s s must not go beyond the stop time %s s.",
                          spring_number(size).text, spring_number(time).text, spring_number(stop_time).text);
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
