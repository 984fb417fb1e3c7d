/* The calls of FMI 2.0 about derivatives. */
#include "fmi2_arguments.h"
#include "../spring/spring_number.h"

#include <math.h>

#define FMI_PLACE(reference) (reference)
#include "../fmu/fmu_derivatives.c"

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    const List unknowns = {vUnknown_ref, nUnknown}, knowns = {vKnown_ref, nKnown};
    if (require_derivatives(instance, &unknowns, &knowns) != FMU_OK)
        return fmi2Error;
    return sums(instance, &unknowns, &knowns, 0, dvKnown, dvUnknown);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    Gradients at;
    FMU_REQUIRE(c, GetRealOutputDerivatives);
    FMI2_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, GetRealOutputDerivatives, order, nvr);
    for (size_t i = 0; i < nvr; i++)
        if (require_rate(instance, vr[i], order[i]) != FMU_OK)
            return fmi2Error;
    if (nvr == 0)
        return fmi2OK;
    FmuStatus status = gradients_of_path(instance, &at);
    for (size_t i = 0; i < nvr && status == FMU_OK; i++)
        value[i] = rate_of(instance, &at, vr[i]);
    return status;
}

/* They hold for one step. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    FMU_REQUIRE(c, SetRealInputDerivatives);
    FMI2_REQUIRE_VARIABLES(instance, SetRealInputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, SetRealInputDerivatives, order, nvr);
    if (nvr > 0 && instance->state.settings.added.branches)
        return FMU_REFUSE(&instance->log, "`displacement` of an FMU with Maxwell branches moves straight through a step, "
                                          "so its derivatives cannot be set; take shorter steps.");
    for (size_t i = 0; i < nvr; i++) {
        VariableName name = fmu_name(vr[i]);
        if (fmu_causality(vr[i]) != VARIABLE_INPUT)
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
