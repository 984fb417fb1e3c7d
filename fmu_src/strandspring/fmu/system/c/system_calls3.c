/* The calls of FMI 3.0 about derivatives. Inputs hold over a step: FMI 3.0 has no derivatives of inputs, and there is no
 * intermediate update. */
#include "../../../core/c/fmi3/fmi3_arguments.h"

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, GetOutputDerivatives);
    FMI3_REQUIRE_VALUES(instance, GetOutputDerivatives, VARIABLE_REAL);
    return nValueReferences == 0 ? fmi3OK : FMU_REFUSE(&instance->log, "This FMU gives no derivatives of outputs.");
}

#define NO_DERIVATIVES(call, text) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                          const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                          fmi3Float64 sensitivity[], size_t nSensitivity) \
    { \
        FMU_REQUIRE(c, call); \
        return nUnknowns == 0 ? fmi3OK : FMU_REFUSE(&instance->log, text); \
    }

NO_DERIVATIVES(GetDirectionalDerivative, "This FMU gives no directional derivatives.")
NO_DERIVATIVES(GetAdjointDerivative, "This FMU gives no adjoint derivatives.")
