/* The calls of FMI 3.0 for model exchange. */
#include "fmi3_arguments.h"
#include "../fmu/fmu_model_exchange.h"

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    FMU_REQUIRE(c, EnterEventMode);
    instance->state.mode = ME_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    FMU_REQUIRE(c, EvaluateDiscreteStates);
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(
    fmi3Instance c, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
    FMU_REQUIRE(c, UpdateDiscreteStates);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, discreteStatesNeedUpdate, 1);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, terminateSimulation, 1);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, nominalsOfContinuousStatesChanged, 1);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, valuesOfContinuousStatesChanged, 1);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, nextEventTimeDefined, 1);
    FMU_REQUIRE_ARRAY(instance, UpdateDiscreteStates, nextEventTime, 1);
    *discreteStatesNeedUpdate = *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = *valuesOfContinuousStatesChanged = *nextEventTimeDefined = fmi3False;
    *nextEventTime = 0.0;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    FMU_REQUIRE(c, EnterContinuousTimeMode);
    return fmu_enter_continuous_time(instance);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    FMU_REQUIRE(c, CompletedIntegratorStep);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, enterEventMode, 1);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, terminateSimulation, 1);
    int needs_event = 0;
    if (fmu_complete_step(instance, &needs_event) != FMU_OK)
        return fmi3Error;
    *enterEventMode = needs_event != 0;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    FMU_REQUIRE(c, SetTime);
    return fmu_set_time(instance, time);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *nEventIndicators)
{
    FMU_REQUIRE(c, GetNumberOfEventIndicators);
    FMU_REQUIRE_ARRAY(instance, GetNumberOfEventIndicators, nEventIndicators, 1);
    *nEventIndicators = fmu_indicators(instance);
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *nContinuousStates)
{
    FMU_REQUIRE(c, GetNumberOfContinuousStates);
    FMU_REQUIRE_ARRAY(instance, GetNumberOfContinuousStates, nContinuousStates, 1);
    *nContinuousStates = fmu_states(instance);
    return fmi3OK;
}

/* Of arrays that must have as many elements as `expected` says. */
#define EXCHANGE_ARRAY(call, Value, values, count, expected, exchange) \
    fmi3Status fmi3##call(fmi3Instance c, Value values[], size_t count) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_COUNT(instance, call, values, count, expected(instance)); \
        return exchange(instance, values); \
    }

EXCHANGE_ARRAY(GetEventIndicators, fmi3Float64, eventIndicators, nEventIndicators, fmu_indicators, fmu_get_indicators)
EXCHANGE_ARRAY(SetContinuousStates, const fmi3Float64, continuousStates, nContinuousStates, fmu_states, fmu_set_states)
EXCHANGE_ARRAY(GetContinuousStates, fmi3Float64, continuousStates, nContinuousStates, fmu_states, fmu_get_states)
EXCHANGE_ARRAY(GetContinuousStateDerivatives, fmi3Float64, derivatives, nContinuousStates, fmu_states, fmu_get_rates)
EXCHANGE_ARRAY(GetNominalsOfContinuousStates, fmi3Float64, nominals, nContinuousStates, fmu_states, fmu_get_nominals)
