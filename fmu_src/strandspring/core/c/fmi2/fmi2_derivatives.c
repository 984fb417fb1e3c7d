/* The calls of FMI 2.0 about derivatives. */
#include "fmi2_arguments.h"
#include "../fmu/fmu_derivatives.h"
#include "../spring/spring_number.h"

#include <math.h>

/* Whether all these derivatives can be given. */
static FmuStatus require_derivatives(
    const Instance *instance, const fmi2ValueReference unknowns[], size_t unknown_count,
    const fmi2ValueReference knowns[], size_t known_count, const double seeds[])
{
    for (size_t k = 0; k < known_count; k++)
        if (fmu_require_seed(instance, knowns[k], seeds[k]) != FMU_OK)
            return FMU_ERROR;
    for (size_t i = 0; i < unknown_count; i++)
        if (fmu_require_unknown(instance, unknowns[i]) != FMU_OK)
            return FMU_ERROR;
    for (size_t k = 0; k < known_count; k++) {
        if (fmu_require_known(instance, knowns[k]) != FMU_OK)
            return FMU_ERROR;
        for (size_t i = 0; i < unknown_count; i++)
            if (fmu_require_pair(instance, unknowns[i], knowns[k]) != FMU_OK)
                return FMU_ERROR;
    }
    return FMU_OK;
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    Gradients at;
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMI2_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    if (require_derivatives(instance, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown) != FMU_OK ||
        fmu_gradients(instance, &at) != FMU_OK)
        return fmi2Error;
    for (size_t i = 0; i < nUnknown; i++) {
        dvUnknown[i] = 0.0;
        for (size_t k = 0; k < nKnown; k++)
            dvUnknown[i] += dvKnown[k] * fmu_partial(instance, &at, vUnknown_ref[i], vKnown_ref[k]);
        if (fmu_require_sum(instance, vUnknown_ref[i], dvUnknown[i]) != FMU_OK)
            return fmi2Discard;
    }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    Gradients at;
    FMU_REQUIRE(c, GetRealOutputDerivatives);
    FMI2_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, GetRealOutputDerivatives, order, nvr);
    for (size_t i = 0; i < nvr; i++)
        if (fmu_require_rate(instance, vr[i], order[i]) != FMU_OK)
            return fmi2Error;
    if (nvr == 0)
        return fmi2OK;
    FmuStatus status = fmu_gradients_of_path(instance, &at);
    for (size_t i = 0; i < nvr && status == FMU_OK; i++)
        value[i] = fmu_rate(instance, &at, vr[i]);
    return status;
}

/* They hold for one step. */
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    FMU_REQUIRE(c, SetRealInputDerivatives);
    FMI2_REQUIRE_VARIABLES(instance, SetRealInputDerivatives, vr, nvr, value, VARIABLE_REAL);
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
