/* The calls of FMI 3.0 about derivatives. */
#include "fmi3_arguments.h"

#define FMI_PLACE(reference) fmi3_place(reference)
#include "../fmu/fmu_derivatives.c"

/* Neither the time nor the event indicator has derivatives. */
static FmuStatus require_derivable(const Instance *instance, const List *list)
{
    for (size_t i = 0; i < list->count; i++)
        if (place_of(list, i) >= instance->variables)
            return FMU_REFUSE(&instance->log, "There are no derivatives of or with respect to `%s`.",
                              fmi3_name(instance, place_of(list, i)).text);
    return FMU_OK;
}

#define DERIVATIVE(call, of, over, adjoint) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                          const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                          fmi3Float64 sensitivity[], size_t nSensitivity) \
    { \
        FMU_REQUIRE(c, call); \
        const List unknown_list = {unknowns, nUnknowns}, known_list = {knowns, nKnowns}; \
        if (fmi3_require(instance, "fmi3" #call, (over).references, (over).count, "seed", seed, nSeed, \
                         VARIABLE_REAL) != FMU_OK || \
            fmi3_require(instance, "fmi3" #call, (of).references, (of).count, "sensitivity", sensitivity, \
                         nSensitivity, VARIABLE_REAL) != FMU_OK || \
            require_derivable(instance, &unknown_list) != FMU_OK || \
            require_derivable(instance, &known_list) != FMU_OK || \
            require_derivatives(instance, &unknown_list, &known_list) != FMU_OK) \
            return fmi3Error; \
        return sums(instance, &(of), &(over), adjoint, seed, sensitivity); \
    }

DERIVATIVE(GetDirectionalDerivative, unknown_list, known_list, 0)
DERIVATIVE(GetAdjointDerivative, known_list, unknown_list, 1)

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    Gradients at;
    FMU_REQUIRE(c, GetOutputDerivatives);
    FMU_REQUIRE_ARRAY(instance, GetOutputDerivatives, orders, nValueReferences);
    FMI3_REQUIRE_VALUES(instance, GetOutputDerivatives, VARIABLE_REAL);
    const List outputs = {valueReferences, nValueReferences};
    if (require_derivable(instance, &outputs) != FMU_OK)
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        if (require_rate(instance, fmi3_place(valueReferences[i]), orders[i]) != FMU_OK)
            return fmi3Error;
    if (nValueReferences == 0)
        return fmi3OK;
    FmuStatus status = gradients_of_path(instance, &at);
    for (size_t i = 0; i < nValueReferences && status == FMU_OK; i++)
        values[i] = rate_of(instance, &at, fmi3_place(valueReferences[i]));
    return status;
}
