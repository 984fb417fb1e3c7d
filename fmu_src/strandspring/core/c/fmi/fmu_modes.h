/* The modes of an instance, which FMI 2.0 (sections 3.2.3 and 4.2.4) and FMI 3.0 (sections 2.3, 3.2 and 4.2) have in
 * common, and the checks at the beginning of a call. Which call is legal in which mode is said in fmi2_states.h and
 * fmi3_states.h.
 *
 * A refused call changes nothing, so there is no mode of error; and since no step is ever pending, discarded or
 * cancelled, co-simulation knows one mode between initialization and termination.
 */
#ifndef FMU_MODES_H
#define FMU_MODES_H

#include "fmu_log.h"

/* FMI gives its functions arguments that this FMU has no use for. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#include <float.h>
#include <math.h>

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
    IN_MODEL_EXCHANGE = ME_INSTANTIATED | ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED,
    IN_CO_SIMULATION = CS_INSTANTIATED | CS_INITIALIZATION | CS_STEP | CS_TERMINATED,
    ANY_MODE = IN_MODEL_EXCHANGE | IN_CO_SIMULATION
};

/* Those of the modes that belong to the kind of an instance, model exchange or co-simulation, which is in `mode`. */
static inline int fmu_of_kind(int mode, int modes)
{
    return modes & (mode & IN_MODEL_EXCHANGE ? IN_MODEL_EXCHANGE : IN_CO_SIMULATION);
}

/* The calls that both versions have, in the modes in which both allow them. */
#define FMU_CALLS_OF_BOTH(CALL) \
    CALL(SetDebugLogging, ANY_MODE) \
    CALL(EnterInitializationMode, INSTANTIATED) \
    CALL(ExitInitializationMode, INITIALIZATION) \
    CALL(Terminate, ANY_MODE) \
    CALL(Reset, ANY_MODE) \
    CALL(SetBoolean, INSTANTIATED | INITIALIZATION | ME_EVENT | CS_STEP) \
    CALL(GetDirectionalDerivative, INITIALIZATION | INITIALIZED | TERMINATED) \
    CALL(EnterEventMode, ME_INITIALIZED) \
    CALL(EnterContinuousTimeMode, ME_EVENT) \
    CALL(CompletedIntegratorStep, ME_CONTINUOUS_TIME) \
    CALL(SetTime, ME_INITIALIZED) \
    CALL(SetContinuousStates, ME_CONTINUOUS_TIME) \
    CALL(GetEventIndicators, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(GetContinuousStates, ME_INITIALIZATION | ME_INITIALIZED | ME_TERMINATED) \
    CALL(DoStep, CS_STEP)

/* For the list of calls of a version: the modes in which each is legal, as ALLOWED_call. */
#define FMU_ALLOWED(call, modes) ALLOWED_##call = (modes),

/* Declares `instance`, which c is; the call must be allowed in its present mode. FMI and FMI_PREFIX are those of the
 * version. */
#define FMU_REQUIRE(c, call) \
    Instance *instance = (c); \
    do { \
        if (instance == NULL) \
            return FMI(Error); \
        if (!(instance->state.mode & ALLOWED_##call)) \
            return fmu_refuse_call(&instance->log, instance->state.mode, FMI_PREFIX #call, ALLOWED_##call); \
    } while (0)

/* A call that does nothing but `answer`, an expression of `instance` and the parameters, where it is allowed. */
#define FMU_CALL(call, parameters, answer) \
    FMI(Status) FMI(call) parameters \
    { \
        FMU_REQUIRE(c, call); \
        return answer; \
    }

/* A pointer to `count` elements may be NULL if there are none. */
#define FMU_REQUIRE_ARRAY(instance, call, pointer, count) \
    do { \
        if ((count) > 0 && (pointer) == NULL) \
            return FMU_REFUSE(&(instance)->log, "`%s` of %s must not be NULL.", #pointer, FMI_PREFIX #call); \
    } while (0)

/* The number of elements that the host asks for must be that of the model description. */
#define FMU_REQUIRE_COUNT(instance, call, pointer, count, expected) \
    do { \
        if ((count) != (size_t)(expected)) \
            return FMU_REFUSE(&(instance)->log, "`%s` of %s must have %d elements, got %.0f.", #pointer, \
                              FMI_PREFIX #call, (int)(expected), (double)(count)); \
        FMU_REQUIRE_ARRAY(instance, call, pointer, count); \
    } while (0)

SPRING_COLD FmuStatus fmu_refuse_call(const Log *log, int mode, const char *call, int allowed);

/* Refuses a step of co-simulation whose time or size cannot be: an error, for discarding it would ask the host to try a
 * smaller one. */
SPRING_COLD FmuStatus fmu_require_strange_step(const Log *log, double time, double size, double stop_time);
static inline FmuStatus fmu_require_step(const Log *log, double time, double size, double stop_time)
{
    /* The usual case in a few instructions. */
    return fabs(time) <= DBL_MAX && size >= 0.0 && time + size <= stop_time && time + size <= DBL_MAX
               ? FMU_OK
               : fmu_require_strange_step(log, time, size, stop_time);
}

/* The times of an experiment, checked; the stop time is HUGE_VAL if there is none. */
SPRING_LOCAL FmuStatus fmu_require_experiment(const Log *log, double start_time, double stop_time);

#endif
