/* The calls of FMI 3.0 for model exchange that FMI 2.0 has otherwise, or has not. */
#define FMI_GET_RATES GetContinuousStateDerivatives
#include "../fmu/fmu_model_exchange.c"

FMU_CALL(EvaluateDiscreteStates, (fmi3Instance c), fmi3OK)

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
