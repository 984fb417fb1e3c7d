/* The calls of FMI 2.0 for model exchange. */
#include "fmi2_arguments.h"
#include "../fmu/fmu_model_exchange.h"

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
    return fmu_enter_continuous_time(instance);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    FMU_REQUIRE(c, CompletedIntegratorStep);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, enterEventMode, 1);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, terminateSimulation, 1);
    int needs_event = 0;
    if (fmu_complete_step(instance, &needs_event) != FMU_OK)
        return fmi2Error;
    *enterEventMode = needs_event ? fmi2True : fmi2False;
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    FMU_REQUIRE(c, SetTime);
    return fmu_set_time(instance, time);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    FMU_REQUIRE(c, GetEventIndicators);
    FMU_REQUIRE_COUNT(instance, GetEventIndicators, eventIndicators, ni, fmu_indicators(instance));
    return fmu_get_indicators(instance, eventIndicators);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    FMU_REQUIRE(c, SetContinuousStates);
    FMU_REQUIRE_COUNT(instance, SetContinuousStates, x, nx, fmu_states(instance));
    return fmu_set_states(instance, x);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    FMU_REQUIRE(c, GetContinuousStates);
    FMU_REQUIRE_COUNT(instance, GetContinuousStates, x, nx, fmu_states(instance));
    return fmu_get_states(instance, x);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    FMU_REQUIRE(c, GetDerivatives);
    FMU_REQUIRE_COUNT(instance, GetDerivatives, derivatives, nx, fmu_states(instance));
    return fmu_get_rates(instance, derivatives);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    FMU_REQUIRE(c, GetNominalsOfContinuousStates);
    FMU_REQUIRE_COUNT(instance, GetNominalsOfContinuousStates, x_nominal, nx, fmu_states(instance));
    return fmu_get_nominals(instance, x_nominal);
}
