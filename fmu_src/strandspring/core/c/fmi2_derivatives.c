/* The calls of FMI 2.0 that ask for derivatives. */
#include "fmi2_arguments.h"
#include "fmu_derivatives.h"

/* Whether all these derivatives can be given. */
static FmuStatus require_derivatives(const Instance *instance, const fmi2ValueReference unknowns[], size_t unknown_count,
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
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
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
    FMU_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
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
