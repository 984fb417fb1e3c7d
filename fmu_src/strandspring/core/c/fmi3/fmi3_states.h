/* Which call of FMI 3.0 is legal in which mode (sections 2.3, 3.2 and 4.2 of the standard). Co-simulation has no event
 * mode here, for the path between communication points is straight. */
#ifndef FMI3_STATES_H
#define FMI3_STATES_H

#include "fmi3_api.h"
#include "../fmi/fmu_modes.h"

#define FMU_CALLS(CALL) \
    FMU_CALLS_OF_BOTH(CALL) \
    CALL(GetFloat64, ANY_MODE) \
    CALL(GetBoolean, ANY_MODE) \
    CALL(SetFloat64, INSTANTIATED | INITIALIZATION | INITIALIZED) \
    CALL(GetFMUState, ANY_MODE) \
    CALL(SetFMUState, ANY_MODE) \
    CALL(FreeFMUState, ANY_MODE) \
    CALL(SerializedFMUStateSize, ANY_MODE) \
    CALL(SerializeFMUState, ANY_MODE) \
    CALL(DeserializeFMUState, ANY_MODE) \
    CALL(GetAdjointDerivative, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(EvaluateDiscreteStates, ME_EVENT) \
    CALL(UpdateDiscreteStates, ME_EVENT) \
    CALL(GetContinuousStateDerivatives, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetNominalsOfContinuousStates, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetNumberOfEventIndicators, IN_MODEL_EXCHANGE) \
    CALL(GetNumberOfContinuousStates, IN_MODEL_EXCHANGE) \
    CALL(GetOutputDerivatives, CS_STEP | CS_TERMINATED)

enum { FMU_CALLS(FMU_ALLOWED) };

#endif
