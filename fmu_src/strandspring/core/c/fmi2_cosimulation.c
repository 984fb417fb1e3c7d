/* The calls of FMI 2.0 for co-simulation.
 *
 * A step commits the straight path to the displacement set last, whatever the times that the host gives; or, if it has
 * set input derivatives, the parabola that begins at that displacement. The derivatives hold for one step. A step without
 * a finite size is an error and not discarded, since discarding would ask the host to try a smaller one.
 */
#include "fmi2_arguments.h"
#include "fmi2_calls.h"
#include "fmu_instance.h"

#include <math.h>

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    FMU_REQUIRE(c, SetRealInputDerivatives);
    FMU_REQUIRE_VARIABLES(instance, SetRealInputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, SetRealInputDerivatives, order, nvr);
    for (size_t i = 0; i < nvr; i++) {
        VariableName name = fmu_name(&instance->state.settings, vr[i]);
        if (fmu_causality(&instance->state.settings, vr[i]) != VARIABLE_INPUT)
            return FMU_REFUSE(&instance->log, "`%s` is not an input, so its derivatives cannot be set.", name.text);
        if (order[i] != 1 && order[i] != 2)
            return FMU_REFUSE(&instance->log, "The order of a derivative of `%s` must be 1 or 2, got %d.", name.text,
                              order[i]);
        if (!isfinite(value[i]))
            return FMU_REFUSE(&instance->log, "The derivative of order %d of `%s` must be finite, got %s.", order[i],
                              name.text, spring_number(value[i]).text);
    }
    for (size_t i = 0; i < nvr; i++) {
        *(order[i] == 1 ? &instance->state.velocity : &instance->state.acceleration) = value[i];
        instance->state.interpolated = 1;
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, DoStep);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi2Error;
    return fmu_step(instance, currentCommunicationPoint, communicationStepSize);
}
