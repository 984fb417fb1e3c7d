/* The calls of FMI 2.0 about derivatives. */
#include "../../../core/c/fmi2/fmi2_arguments.h"
#include "../../../core/c/spring/spring_number.h"

#include <math.h>

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    FMU_REQUIRE(c, SetRealInputDerivatives);
    FMI2_REQUIRE_VARIABLES(instance, SetRealInputDerivatives, vr, nvr, value, VARIABLE_REAL);
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
    FMI2_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, GetRealOutputDerivatives, order, nvr);
    return nvr == 0 ? fmi2OK : FMU_REFUSE(&instance->log, "This FMU gives no derivatives of outputs.");
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    return nUnknown == 0 ? fmi2OK : FMU_REFUSE(&instance->log, "This FMU gives no directional derivatives.");
}
