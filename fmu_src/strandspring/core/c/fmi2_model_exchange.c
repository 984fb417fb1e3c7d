/* The calls of FMI 2.0 for model exchange.
 *
 * In the usual form the spring has no continuous states: its memory changes only where a point of the path is accepted, and between these
 * the force is a function of the displacement. A point is accepted when an integrator step is completed, and once more
 * at the end of event mode, where the displacement may have jumped. Trial evaluations leave no trace.
 *
 * In the form with states there is no memory besides them and no event but that of `extrapolating`: their rates are
 * continuous where the velocity changes its sign, since they are proportional to it.
 */
#include "fmi2_arguments.h"
#include "fmi2_block.h"
#include "fmi2_instance.h"

#include <math.h>

enum { STATES = 2 };

/* The number of elements that the host asks for must be that of the model description. */
#define REQUIRE_COUNT(instance, call, pointer, count, expected) \
    do { \
        if ((count) != (size_t)(expected)) \
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
    if (fmu_accept(instance, 1) != fmi2OK)
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
    if (fmu_accept(instance, 0) != fmi2OK)
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
    const State *state = &instance->state;
    int indicators = state->settings.has_states ? 0 : 1;
    REQUIRE_COUNT(instance, GetEventIndicators, eventIndicators, ni, indicators);
    if (indicators)
        eventIndicators[0] = fmu_watch_indicator(&state->watch, state->time, state->displacement, fmu_range(state));
    return fmi2OK;
}

static const fmi2ValueReference STATE_REFERENCES[STATES] = {SPRING_ABSORBED_ENERGY, SPRING_OMEGA};

static int states(const Instance *instance)
{
    return instance->state.settings.has_states ? STATES : 0;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    FMU_REQUIRE(c, SetContinuousStates);
    REQUIRE_COUNT(instance, SetContinuousStates, x, nx, states(instance));
    return fmi2SetReal(c, STATE_REFERENCES, nx, x);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    FMU_REQUIRE(c, GetContinuousStates);
    REQUIRE_COUNT(instance, GetContinuousStates, x, nx, states(instance));
    return fmi2GetReal(c, STATE_REFERENCES, nx, x);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    FMU_REQUIRE(c, GetDerivatives);
    REQUIRE_COUNT(instance, GetDerivatives, derivatives, nx, states(instance));
    fmi2ValueReference first = fmu_first_own(&instance->state.settings);
    return fmi2GetReal(c, (fmi2ValueReference[]){first + OWN_POWER, first + OWN_OMEGA_RATE}, nx, derivatives);
}

/* The energy that the hysteretic force takes on a way through the whole range, as identified, and 1. */
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    FMU_REQUIRE(c, GetNominalsOfContinuousStates);
    REQUIRE_COUNT(instance, GetNominalsOfContinuousStates, x_nominal, nx, states(instance));
    Settings start = fmu_start_settings();
    const SpringParameters *spring = &start.spring;
    const double nominals[STATES] = {spring->kappa_omega * (spring->displacement_max - spring->displacement_min), 1.0};
    for (size_t i = 0; i < nx; i++)
        x_nominal[i] = nominals[i];
    return fmi2OK;
}
