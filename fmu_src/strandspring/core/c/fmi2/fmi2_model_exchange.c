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

/* Of arrays that must have as many elements as `expected` says. */
#define EXCHANGE_ARRAY(call, Value, values, count, expected, exchange) \
    fmi2Status fmi2##call(fmi2Component c, Value values[], size_t count) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_COUNT(instance, call, values, count, expected(instance)); \
        return exchange(instance, values); \
    }

EXCHANGE_ARRAY(GetEventIndicators, fmi2Real, eventIndicators, ni, fmu_indicators, fmu_get_indicators)
EXCHANGE_ARRAY(SetContinuousStates, const fmi2Real, x, nx, fmu_states, fmu_set_states)
EXCHANGE_ARRAY(GetContinuousStates, fmi2Real, x, nx, fmu_states, fmu_get_states)
EXCHANGE_ARRAY(GetDerivatives, fmi2Real, derivatives, nx, fmu_states, fmu_get_rates)
EXCHANGE_ARRAY(GetNominalsOfContinuousStates, fmi2Real, x_nominal, nx, fmu_states, fmu_get_nominals)
