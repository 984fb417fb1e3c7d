/* Which call of FMI 2.0 is legal in which mode (sections 3.2.3 and 4.2.4 of the standard). */
#ifndef FMI2_STATES_H
#define FMI2_STATES_H

#include "fmi2_api.h"
#include "../fmi/fmu_modes.h"

#define FMU_CALLS(CALL) \
    FMU_CALLS_OF_BOTH(CALL) \
    CALL(SetupExperiment, INSTANTIATED) \
    CALL(GetReal, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetInteger, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetBoolean, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetString, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(SetReal, INSTANTIATED | INITIALIZATION | INITIALIZED) \
    CALL(SetInteger, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(SetString, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(GetFMUstate, ANY_MODE) \
    CALL(SetFMUstate, ANY_MODE) \
    CALL(FreeFMUstate, ANY_MODE) \
    CALL(SerializedFMUstateSize, ANY_MODE) \
    CALL(SerializeFMUstate, ANY_MODE) \
    CALL(DeSerializeFMUstate, ANY_MODE) \
    CALL(NewDiscreteStates, ME_EVENT) \
    CALL(GetDerivatives, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetNominalsOfContinuousStates, ME_INSTANTIATED | ME_INITIALIZED | ME_TERMINATED) \
    CALL(SetRealInputDerivatives, CS_INSTANTIATED | CS_INITIALIZATION | CS_STEP) \
    CALL(GetRealOutputDerivatives, CS_STEP | CS_TERMINATED) \
    CALL(CancelStep, NO_MODE) \
    CALL(GetStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetRealStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetIntegerStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetBooleanStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetStringStatus, CS_STEP | CS_TERMINATED)

enum { FMU_CALLS(FMU_ALLOWED) };

#endif
