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

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    FMU_REQUIRE(c, GetEventIndicators);
    FMU_REQUIRE_COUNT(instance, GetEventIndicators, eventIndicators, nEventIndicators, fmu_indicators(instance));
    return fmu_get_indicators(instance, eventIndicators);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    FMU_REQUIRE(c, SetContinuousStates);
    FMU_REQUIRE_COUNT(instance, SetContinuousStates, continuousStates, nContinuousStates, fmu_states(instance));
    return fmu_set_states(instance, continuousStates);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    FMU_REQUIRE(c, GetContinuousStates);
    FMU_REQUIRE_COUNT(instance, GetContinuousStates, continuousStates, nContinuousStates, fmu_states(instance));
    return fmu_get_states(instance, continuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t nContinuousStates)
{
    FMU_REQUIRE(c, GetContinuousStateDerivatives);
    FMU_REQUIRE_COUNT(instance, GetContinuousStateDerivatives, derivatives, nContinuousStates, fmu_states(instance));
    return fmu_get_rates(instance, derivatives);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t nContinuousStates)
{
    FMU_REQUIRE(c, GetNominalsOfContinuousStates);
    FMU_REQUIRE_COUNT(instance, GetNominalsOfContinuousStates, nominals, nContinuousStates, fmu_states(instance));
    return fmu_get_nominals(instance, nominals);
}
