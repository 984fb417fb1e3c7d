/* The calls of FMI 3.0 for co-simulation. A step commits the straight path to the displacement set last, whatever the times that the
 * host gives. */
#include "fmi3_arguments.h"
#include "fmu_derivatives.h"

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, DoStep);
    FMU_REQUIRE_ARRAY(instance, DoStep, eventHandlingNeeded, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, terminateSimulation, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, earlyReturn, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, lastSuccessfulTime, 1);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi3Error;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = currentCommunicationPoint + communicationStepSize;
    return fmu_step(instance, currentCommunicationPoint, communicationStepSize);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    Gradients at;
    FMU_REQUIRE(c, GetOutputDerivatives);
    FMU_REQUIRE_ARRAY(instance, GetOutputDerivatives, orders, nValueReferences);
    FMI3_REQUIRE_VALUES(instance, GetOutputDerivatives, VARIABLE_REAL);
    /* Outputs are no arrays. */
    for (size_t i = 0; i < nValueReferences; i++) {
        unsigned output = fmi3_elements(instance, valueReferences[i]).first;
        if (fmi3_require_derivable(instance, output) != FMU_OK || fmu_require_rate(instance, output, orders[i]) != FMU_OK)
            return fmi3Error;
    }
    if (nValueReferences == 0)
        return fmi3OK;
    FmuStatus status = fmu_gradients_of_path(instance, &at);
    for (size_t i = 0; i < nValueReferences && status == FMU_OK; i++)
        values[i] = fmu_rate(instance, &at, fmi3_elements(instance, valueReferences[i]).first);
    return status;
}
