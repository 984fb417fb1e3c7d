/* The calls of FMI 2.0 for co-simulation.
 *
 * A step commits the straight path to the displacement set last, whatever the times that the host gives; or, if it has
 * set input derivatives, the parabola that begins at that displacement. The derivatives hold for one step. A step without
 * a finite size is an error and not discarded, since discarding would ask the host to try a smaller one.
 */
#include "fmi2_arguments.h"
#include "fmi2_instance.h"

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
    return fmu_step(instance, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    FMU_REQUIRE(c, CancelStep);
    return fmi2OK;
}

/* No step is ever pending, so that few kinds of status are known. */
#define GET_STATUS(call, Type, known, answer) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2StatusKind s, Type *value) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_ARRAY(instance, call, value, 1); \
        if (!(known)) \
            return fmu_report(&instance->log, fmi2Discard, \
                              "%s has no status of kind %d, since steps of this FMU are never pending.", "fmi2" #call, \
                              (int)s); \
        *value = (answer); \
        return fmi2OK; \
    }

GET_STATUS(GetStatus, fmi2Status, 0, fmi2OK)
GET_STATUS(GetRealStatus, fmi2Real, s == fmi2LastSuccessfulTime, instance->state.time)
GET_STATUS(GetIntegerStatus, fmi2Integer, 0, 0)
GET_STATUS(GetBooleanStatus, fmi2Boolean, s == fmi2Terminated, fmi2False)
GET_STATUS(GetStringStatus, fmi2String, 0, NULL)
