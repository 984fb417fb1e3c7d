/* The calls of FMI 2.0 for co-simulation that differ from those of a spring. */
#include "../../core/c/fmi2_arguments.h"
#include "../../core/c/fmi2_calls.h"
#include "../../core/c/fmi2_life.h"
#include "../../core/c/spring_number.h"
#include "system_life.h"

#include <math.h>

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation;
    (void)visible;
    /* Warnings and errors are no debug logging: fmi2SetDebugLogging can silence them. */
    (void)loggingOn;
    if (functions == NULL)
        return NULL;
    Log log = fmi2_log(instanceName, functions);
    if (fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2CoSimulation (1), got %d.", (int)fmuType);
    Memory memory;
    if (fmi2_memory(&log, functions, &memory) != FMU_OK)
        return NULL;
    return system_instantiate(&log, instanceName, fmuGUID, "GUID", &memory);
}

void fmi2FreeInstance(fmi2Component c)
{
    system_free(c);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    FMU_REQUIRE(c, SetReal);
    FMU_REQUIRE_VARIABLES(instance, SetReal, vr, nvr, value, VARIABLE_REAL);
    for (size_t i = 0; i < nvr; i++)
        if (system_require_change(instance, vr[i], value[i]) != FMU_OK)
            return fmi2Error;
    system_write(instance, vr, nvr, value);
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    FMU_REQUIRE(c, SetRealInputDerivatives);
    FMU_REQUIRE_VARIABLES(instance, SetRealInputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, SetRealInputDerivatives, order, nvr);
    for (size_t i = 0; i < nvr; i++) {
        if (system_causality(instance, vr[i]) != VARIABLE_INPUT)
            return FMU_REFUSE(&instance->log, "`%s` is not an input, so its derivatives cannot be set.",
                              system_name(vr[i]).text);
        if (order[i] != 1)
            return FMU_REFUSE(&instance->log, "The order of a derivative of `%s` must be 1, got %d.",
                              system_name(vr[i]).text, order[i]);
        if (!isfinite(value[i]))
            return FMU_REFUSE(&instance->log, "The derivative of `%s` must be finite, got %s.", system_name(vr[i]).text,
                              spring_number(value[i]).text);
    }
    for (size_t i = 0; i < nvr; i++) {
        instance->state.slopes[vr[i] - SYSTEM_FIRST_INPUT] = value[i];
        instance->state.is_interpolated = 1;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    FMU_REQUIRE(c, GetRealOutputDerivatives);
    FMU_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, GetRealOutputDerivatives, order, nvr);
    return nvr == 0 ? fmi2OK : FMU_REFUSE(&instance->log, "This FMU gives no derivatives of outputs.");
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    return nUnknown == 0 ? fmi2OK : FMU_REFUSE(&instance->log, "This FMU gives no directional derivatives.");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, DoStep);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi2Error;
    return system_step(instance, currentCommunicationPoint, communicationStepSize);
}
