/* The calls of FMI 3.0 for model exchange and event mode, which are legal in no mode of this FMU. They are there since
 * FMPy runs no FMU that lacks a function. */
#include "../../core/c/fmi3/fmi3_arguments.h"

/* The instance is never in a mode that allows the call. */
#define OF_EXCHANGE(call, parameters) \
    fmi3Status fmi3##call parameters \
    { \
        FMU_REQUIRE(c, call); \
        return fmi3Error; \
    }

OF_EXCHANGE(EnterEventMode, (fmi3Instance c))
OF_EXCHANGE(EvaluateDiscreteStates, (fmi3Instance c))
OF_EXCHANGE(EnterContinuousTimeMode, (fmi3Instance c))

/* The remaining arguments are of no use. */
#define OF_EXCHANGE_1(call, First) \
    fmi3Status fmi3##call(fmi3Instance c, First first) \
    { \
        (void)first; \
        FMU_REQUIRE(c, call); \
        return fmi3Error; \
    }
#define OF_EXCHANGE_VALUES(call, Value) \
    fmi3Status fmi3##call(fmi3Instance c, Value values[], size_t count) \
    { \
        (void)values; \
        (void)count; \
        FMU_REQUIRE(c, call); \
        return fmi3Error; \
    }

OF_EXCHANGE_1(SetTime, fmi3Float64)
OF_EXCHANGE_1(GetNumberOfEventIndicators, size_t *)
OF_EXCHANGE_1(GetNumberOfContinuousStates, size_t *)
OF_EXCHANGE_VALUES(GetEventIndicators, fmi3Float64)
OF_EXCHANGE_VALUES(SetContinuousStates, const fmi3Float64)
OF_EXCHANGE_VALUES(GetContinuousStates, fmi3Float64)
OF_EXCHANGE_VALUES(GetContinuousStateDerivatives, fmi3Float64)
OF_EXCHANGE_VALUES(GetNominalsOfContinuousStates, fmi3Float64)

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    (void)enterEventMode;
    (void)terminateSimulation;
    FMU_REQUIRE(c, CompletedIntegratorStep);
    return fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(
    fmi3Instance c, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime)
{
    (void)discreteStatesNeedUpdate;
    (void)terminateSimulation;
    (void)nominalsOfContinuousStatesChanged;
    (void)valuesOfContinuousStatesChanged;
    (void)nextEventTimeDefined;
    (void)nextEventTime;
    FMU_REQUIRE(c, UpdateDiscreteStates);
    return fmi3Error;
}
