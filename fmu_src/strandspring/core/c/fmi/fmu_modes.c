#include "fmu_modes.h"

#include "../spring/spring_number.h"

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

FmuStatus fmu_refuse_call(const Log *log, int mode, const char *call, int allowed)
{
    int kind = fmu_of_kind(mode, ANY_MODE);
    char expected[160] = "";
    const char *actual = "";
    if (allowed == NO_MODE)
        return FMU_REFUSE(log, "%s must be called while a step is pending, and steps of this FMU never are.", call);
    if (!(allowed & kind))
        return FMU_REFUSE(log, "%s must be called in %s, but the instance is for %s.", call,
                          kind == IN_CO_SIMULATION ? "model exchange" : "co-simulation",
                          kind == IN_CO_SIMULATION ? "co-simulation" : "model exchange");
    for (int i = 0; i < MODE_COUNT; i++) {
        size_t length = strlen(expected);
        if (MODES[i].modes & allowed & kind)
            snprintf(expected + length, sizeof expected - length, "%s%s", length ? " or " : "", MODES[i].name);
        if (MODES[i].modes & mode)
            actual = MODES[i].name;
    }
    return FMU_REFUSE(log, "%s must be called while the instance is %s, but it is %s.", call, expected, actual);
}

FmuStatus fmu_require_strange_step(const Log *log, double time, double size, double stop_time)
{
    static const double ROUNDING = 1e-9; /* of times added up by the host */
    double end = time + size;
    if (!(fabs(time) <= DBL_MAX))
        return FMU_REFUSE(log, "The time of a step must be finite [s], got %s.", spring_number(time).text);
    if (!(size >= 0.0 && end <= DBL_MAX))
        return FMU_REFUSE(log, "The step size at time %s s must be finite and >= 0 [s], got %s.",
                          spring_number(time).text, spring_number(size).text);
    if (end > stop_time && end > stop_time + ROUNDING * fmax(fabs(end), fabs(stop_time)))
        return FMU_REFUSE(log, "The step of %s s at time %s s must not go beyond the stop time %s s.",
                          spring_number(size).text, spring_number(time).text, spring_number(stop_time).text);
    return FMU_OK;
}

FmuStatus fmu_require_experiment(const Log *log, double start_time, double stop_time)
{
    if (!isfinite(start_time))
        return FMU_REFUSE(log, "The start time must be finite [s], got %s.", spring_number(start_time).text);
    if (!(stop_time >= start_time))
        return FMU_REFUSE(log, "The stop time must not be before the start time %s s, got %s.",
                          spring_number(start_time).text, spring_number(stop_time).text);
    return FMU_OK;
}
