/* The calls of FMI 3.0 for model exchange and event mode, which are legal in no mode of this FMU. They are there since
 * FMPy runs no FMU that lacks a function. */
#include "../../../core/c/fmi3/fmi3_arguments.h"

#define OF_EXCHANGE(call, parameters) FMU_CALL(call, parameters, fmi3Error)

OF_EXCHANGE(EnterEventMode, (fmi3Instance c))
OF_EXCHANGE(EvaluateDiscreteStates, (fmi3Instance c))
OF_EXCHANGE(EnterContinuousTimeMode, (fmi3Instance c))
OF_EXCHANGE(SetTime, (fmi3Instance c, fmi3Float64 time))
OF_EXCHANGE(GetNumberOfEventIndicators, (fmi3Instance c, size_t *nEventIndicators))
OF_EXCHANGE(GetNumberOfContinuousStates, (fmi3Instance c, size_t *nContinuousStates))
OF_EXCHANGE(GetEventIndicators, (fmi3Instance c, fmi3Float64 indicators[], size_t nIndicators))
OF_EXCHANGE(SetContinuousStates, (fmi3Instance c, const fmi3Float64 states[], size_t nStates))
OF_EXCHANGE(GetContinuousStates, (fmi3Instance c, fmi3Float64 states[], size_t nStates))
OF_EXCHANGE(GetContinuousStateDerivatives, (fmi3Instance c, fmi3Float64 derivatives[], size_t nStates))
OF_EXCHANGE(GetNominalsOfContinuousStates, (fmi3Instance c, fmi3Float64 nominals[], size_t nStates))
OF_EXCHANGE(CompletedIntegratorStep, (fmi3Instance c, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                      fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation))
OF_EXCHANGE(UpdateDiscreteStates,
            (fmi3Instance c, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
             fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
             fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime))
