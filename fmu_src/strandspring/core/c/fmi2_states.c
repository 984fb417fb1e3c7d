#include "fmi2_states.h"

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

fmi2Status fmu_refuse_call(const Log *log, int mode, const char *call, int allowed)
{
    int kind = mode & MODEL_EXCHANGE ? MODEL_EXCHANGE : CO_SIMULATION;
    char expected[160] = "";
    const char *actual = "";
    if (allowed == NO_MODE)
        return FMU_REFUSE(log, "%s must be called while a step is pending, and steps of this FMU never are.", call);
    if (!(allowed & kind))
        return FMU_REFUSE(log, "%s must be called in %s, but the instance is for %s.", call,
                          kind == CO_SIMULATION ? "model exchange" : "co-simulation",
                          kind == CO_SIMULATION ? "co-simulation" : "model exchange");
    for (int i = 0; i < MODE_COUNT; i++) {
        size_t length = strlen(expected);
        if (MODES[i].modes & allowed & kind)
            snprintf(expected + length, sizeof expected - length, "%s%s", length ? " or " : "", MODES[i].name);
        if (MODES[i].modes & mode)
            actual = MODES[i].name;
    }
    return FMU_REFUSE(log, "%s must be called while the instance is %s, but it is %s.", call, expected, actual);
}
