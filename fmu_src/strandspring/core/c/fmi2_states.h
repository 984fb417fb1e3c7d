/* The state machines of FMI 2.0 (sections 3.2.3 and 4.2.4): which call is legal in which mode.
 *
 * A refused call changes nothing, so there is no mode of error; and since no step is ever pending, discarded or
 * cancelled, co-simulation knows one mode between initialization and termination.
 */
#ifndef FMI2_STATES_H
#define FMI2_STATES_H

#include "fmi2_api.h"
#include "fmi2_log.h"

enum {
    ME_INSTANTIATED = 1 << 0,
    ME_INITIALIZATION = 1 << 1,
    ME_EVENT = 1 << 2,
    ME_CONTINUOUS_TIME = 1 << 3,
    ME_TERMINATED = 1 << 4,
    CS_INSTANTIATED = 1 << 5,
    CS_INITIALIZATION = 1 << 6,
    CS_STEP = 1 << 7,
    CS_TERMINATED = 1 << 8,

    NO_MODE = 0,
    INSTANTIATED = ME_INSTANTIATED | CS_INSTANTIATED,
    INITIALIZATION = ME_INITIALIZATION | CS_INITIALIZATION,
    TERMINATED = ME_TERMINATED | CS_TERMINATED,
    ME_INITIALIZED = ME_EVENT | ME_CONTINUOUS_TIME,
    INITIALIZED = ME_INITIALIZED | CS_STEP,
    MODEL_EXCHANGE = ME_INSTANTIATED | ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED,
    CO_SIMULATION = CS_INSTANTIATED | CS_INITIALIZATION | CS_STEP | CS_TERMINATED,
    ANY_MODE = MODEL_EXCHANGE | CO_SIMULATION
};

#define FMU_CALLS(CALL) \
    CALL(SetDebugLogging, ANY_MODE) \
    CALL(SetupExperiment, INSTANTIATED) \
    CALL(EnterInitializationMode, INSTANTIATED) \
    CALL(ExitInitializationMode, INITIALIZATION) \
    CALL(Terminate, INITIALIZED) \
    CALL(Reset, ANY_MODE) \
    CALL(GetReal, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetInteger, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetBoolean, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(GetString, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(SetReal, INSTANTIATED | INITIALIZATION | INITIALIZED) \
    CALL(SetInteger, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(SetBoolean, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(SetString, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(GetFMUstate, ANY_MODE) \
    CALL(SetFMUstate, ANY_MODE) \
    CALL(FreeFMUstate, ANY_MODE) \
    CALL(SerializedFMUstateSize, ANY_MODE) \
    CALL(SerializeFMUstate, ANY_MODE) \
    CALL(DeSerializeFMUstate, ANY_MODE) \
    CALL(GetDirectionalDerivative, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(EnterEventMode, ME_INITIALIZED) \
    CALL(NewDiscreteStates, ME_EVENT) \
    CALL(EnterContinuousTimeMode, ME_EVENT) \
    CALL(CompletedIntegratorStep, ME_CONTINUOUS_TIME) \
    CALL(SetTime, ME_INITIALIZED) \
    CALL(SetContinuousStates, ME_CONTINUOUS_TIME) \
    CALL(GetDerivatives, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetEventIndicators, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetContinuousStates, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetNominalsOfContinuousStates, ME_INSTANTIATED | ME_INITIALIZED | ME_TERMINATED) \
    CALL(SetRealInputDerivatives, CS_INSTANTIATED | CS_INITIALIZATION | CS_STEP) \
    CALL(GetRealOutputDerivatives, CS_STEP | CS_TERMINATED) \
    CALL(DoStep, CS_STEP) \
    CALL(CancelStep, NO_MODE) \
    CALL(GetStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetRealStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetIntegerStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetBooleanStatus, CS_STEP | CS_TERMINATED) \
    CALL(GetStringStatus, CS_STEP | CS_TERMINATED)

#define FMU_ALLOWED(call, modes) ALLOWED_##call = (modes),
enum { FMU_CALLS(FMU_ALLOWED) };
#undef FMU_ALLOWED

/* Declares `instance`, which component c is; the call must be allowed in its present mode. */
#define FMU_REQUIRE(c, call) \
    Instance *instance = (c); \
    do { \
        if (instance == NULL) \
            return fmi2Error; \
        if (!(instance->state.mode & ALLOWED_##call)) \
            return fmu_refuse_call(&instance->log, instance->state.mode, "fmi2" #call, ALLOWED_##call); \
    } while (0)

/* A pointer to `count` elements may be NULL if there are none. */
#define FMU_REQUIRE_ARRAY(instance, call, pointer, count) \
    do { \
        if ((count) > 0 && (pointer) == NULL) \
            return FMU_REFUSE(&(instance)->log, "`%s` of %s must not be NULL.", #pointer, "fmi2" #call); \
    } while (0)

SPRING_LOCAL fmi2Status fmu_refuse_call(const Log *log, int mode, const char *call, int allowed);

#endif
