/* The calls of FMI 2.0 for model exchange.
 *
 * The spring has no continuous states: its memory changes only where a point of the path is accepted, and between these
 * the force is a function of the displacement. A point is accepted when an integrator step is completed, and once more
 * at the end of event mode, where the displacement may have jumped. Trial evaluations leave no trace.
 */
#include "fmi2_arguments.h"
#include "fmi2_instance.h"

#include <math.h>

enum { STATES = 0, EVENT_INDICATORS = 1 };

/* The number of elements that the host asks for must be that of the model description. */
#define REQUIRE_COUNT(instance, call, pointer, count, expected) \
    do { \
        if ((count) != (expected)) \
            return FMU_REFUSE(&(instance)->log, "`%s` of fmi2%s must have %d elements, got %.0f.", #pointer, #call, \
                              (expected), (double)(count)); \
        FMU_REQUIRE_ARRAY(instance, call, pointer, count); \
    } while (0)

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    FMU_REQUIRE(c, EnterEventMode);
    instance->state.mode = ME_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    FMU_REQUIRE(c, NewDiscreteStates);
    FMU_REQUIRE_ARRAY(instance, NewDiscreteStates, eventInfo, 1);
    *eventInfo = (fmi2EventInfo){.newDiscreteStatesNeeded = fmi2False};
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    FMU_REQUIRE(c, EnterContinuousTimeMode);
    if (fmu_accept(instance) != fmi2OK)
        return fmi2Error;
    instance->state.extrapolating = fmu_extrapolating(instance);
    instance->state.mode = ME_CONTINUOUS_TIME;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, CompletedIntegratorStep);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, enterEventMode, 1);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, terminateSimulation, 1);
    if (fmu_accept(instance) != fmi2OK)
        return fmi2Error;
    /* `extrapolating` is discrete: it may change at events only. */
    *enterEventMode = (instance->state.side != 0) != instance->state.extrapolating ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    FMU_REQUIRE(c, SetTime);
    if (!isfinite(time))
        return FMU_REFUSE(&instance->log, "The time must be finite [s], got %s.", spring_number(time).text);
    instance->state.time = time;
    return fmi2OK;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    FMU_REQUIRE(c, GetEventIndicators);
    REQUIRE_COUNT(instance, GetEventIndicators, eventIndicators, ni, EVENT_INDICATORS);
    const State *state = &instance->state;
    eventIndicators[0] = fmu_watch_indicator(&state->watch, state->time, state->displacement, fmu_range(state));
    return fmi2OK;
}

#define EXCHANGE_STATES(call, Type, values) \
    fmi2Status fmi2##call(fmi2Component c, Type values[], size_t nx) \
    { \
        FMU_REQUIRE(c, call); \
        REQUIRE_COUNT(instance, call, values, nx, STATES); \
        return fmi2OK; \
    }

EXCHANGE_STATES(SetContinuousStates, const fmi2Real, x)
EXCHANGE_STATES(GetDerivatives, fmi2Real, derivatives)
EXCHANGE_STATES(GetContinuousStates, fmi2Real, x)
EXCHANGE_STATES(GetNominalsOfContinuousStates, fmi2Real, x_nominal)
