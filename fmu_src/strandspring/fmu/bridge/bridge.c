/* The binary of the Python-backed FMU: each call of FMI 2.0 for co-simulation becomes a call of core/component.py.
 *
 * Arrays travel as bytes in both directions and states as Python objects. Python decides what a call means and refuses
 * what is wrong, but for the state machine and NULL. It is never shut down, and no call keeps its lock.
 */
#ifndef _WIN32
#define _GNU_SOURCE /* RTLD_DEFAULT and dladdr */
#endif
#define SPRING_LOCAL static inline

#include "../../core/c/fmi2/fmi2_api.h"
#include "../../core/c/fmi2/fmi2_log.c"
#include "../../core/c/fmi/fmu_log.c"
#include "../../core/c/fmi/fmu_modes.c"

#include "python.c"
#ifdef _WIN32
#include "find_windows.c"
#else
#include "find_posix.c"
#endif
#include "component.c"

#include <math.h>
#include <stdlib.h>

/* Phases of co-simulation as Python counts them, from 0. */
static int mode_of_phase(double phase) { return CS_INSTANTIATED << (int)phase; }
_Static_assert(CS_TERMINATED == CS_INSTANTIATED << 3, "the modes of co-simulation follow each other");

/* A state that the host holds. */
typedef struct {
    const void *of; /* the binary that made it */
    PyObject *state;
} Snapshot;

static const char IDENTITY;

#include "../../core/c/fmi2/fmi2_calls.h"

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    char problem[500];
    (void)visible;
    /* Warnings and errors are no debug logging: fmi2SetDebugLogging can silence them. */
    (void)loggingOn;
    if (functions == NULL)
        return NULL;
    Log log = fmi2_log(instanceName, functions);
    if (instanceName == NULL || instanceName[0] == '\0')
        return FMU_REFUSE_POINTER(&log, "The name of an instance must not be empty.");
    if (fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2CoSimulation (1), got %d.", (int)fmuType);
    if (fmuGUID == NULL || fmuResourceLocation == NULL)
        return FMU_REFUSE_POINTER(&log, "The GUID and the location of the resources must not be NULL.");
    if (!python_ready(problem, sizeof problem))
        return FMU_REFUSE_POINTER(&log, "%s", problem);
    const size_t name_size = strlen(instanceName) + 1;
    Instance *instance = calloc(1, sizeof *instance + name_size);
    if (instance == NULL)
        return FMU_REFUSE_POINTER(&log, "There is not enough memory for an instance.");
    memcpy(instance->name, instanceName, name_size);
    log.instance_name = instance->name;
    instance->log = log;
    instance->state.mode = CS_INSTANTIATED;
    instance->state.stop_time = INFINITY;
    instance->component = started(&log, fmuGUID, fmuResourceLocation);
    if (instance->component != NULL)
        return instance;
    free(instance);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *instance = c;
    if (instance == NULL)
        return;
    released(instance, instance->component);
    free(instance);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, EnterInitializationMode);
    instance->state.mode = CS_INITIALIZATION;
    return fmi2OK;
}

/* Asks, and changes the mode if that succeeds. */
static fmi2Status ask_for_mode(Instance *instance, const char *method, int mode)
{
    fmi2Status status = ask(instance, &(Question){.method = method});
    if (status == fmi2OK)
        instance->state.mode = mode;
    return status;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, ExitInitializationMode);
    return ask_for_mode(instance, "exit_initialization_mode", CS_STEP);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    FMU_REQUIRE(c, Terminate);
    return ask_for_mode(instance, "terminate", CS_TERMINATED);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    FMU_REQUIRE(c, Reset);
    fmi2Status status = ask_for_mode(instance, "reset", CS_INSTANTIATED);
    if (status == fmi2OK) {
        instance->state.time = 0.0;
        instance->state.stop_time = INFINITY;
    }
    return status;
}

#define GET(call, Type, of_kind, value_size) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_ARRAY(instance, call, vr, nvr); \
        FMU_REQUIRE_ARRAY(instance, call, value, nvr); \
        return ask(instance, &(Question){.method = "get", .kind = of_kind, .arrays = 1, .first = vr, \
                                         .first_size = nvr * sizeof *vr, .answer = value, \
                                         .answer_size = nvr * (value_size)}); \
    }
#define SET(call, Type, of_kind, value_size) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_ARRAY(instance, call, vr, nvr); \
        FMU_REQUIRE_ARRAY(instance, call, value, nvr); \
        return ask(instance, &(Question){.method = "set", .kind = of_kind, .arrays = 2, .first = vr, \
                                         .first_size = nvr * sizeof *vr, .second = value, \
                                         .second_size = nvr * (value_size)}); \
    }

GET(GetReal, fmi2Real, "real", sizeof *value)
GET(GetInteger, fmi2Integer, "integer", sizeof *value)
GET(GetBoolean, fmi2Boolean, "boolean", sizeof *value)
SET(SetReal, const fmi2Real, "real", sizeof *value)
SET(SetInteger, const fmi2Integer, "integer", sizeof *value)
SET(SetBoolean, const fmi2Boolean, "boolean", sizeof *value)
/* No variable is a String: Python refuses every reference, and no value is passed on. */
GET(GetString, fmi2String, "string", 0)
SET(SetString, const fmi2String, "string", 0)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, DoStep);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi2Error;
    const double step[] = {currentCommunicationPoint, communicationStepSize};
    fmi2Status status =
        ask(instance, &(Question){.method = "do_step", .arrays = 1, .first = step, .first_size = sizeof step});
    if (status == fmi2OK)
        instance->state.time = currentCommunicationPoint + communicationStepSize;
    return status;
}

/* Derivatives, of which the model description says that there are none. */
static fmi2Status refuse_derivatives(const Instance *instance, const char *what)
{
    return FMU_REFUSE(
        &instance->log, "The Python-backed FMU has no %s; the native FMU of the same model has them.", what);
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown, (void)dvKnown, (void)dvUnknown;
    FMU_REQUIRE(c, GetDirectionalDerivative);
    return refuse_derivatives(instance, "directional derivatives");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr, (void)nvr, (void)order, (void)value;
    FMU_REQUIRE(c, SetRealInputDerivatives);
    return refuse_derivatives(instance, "input derivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    (void)vr, (void)nvr, (void)order, (void)value;
    FMU_REQUIRE(c, GetRealOutputDerivatives);
    return refuse_derivatives(instance, "output derivatives");
}

/* A state given by the host must be one of this FMU. */
#define REQUIRE_SNAPSHOT(instance, call, snapshot) \
    do { \
        FMU_REQUIRE_ARRAY(instance, call, snapshot, 1); \
        if ((snapshot)->of != &IDENTITY) \
            return FMU_REFUSE(&(instance)->log, \
                              "The state given to fmi2%s must come from an instance of the same FMU.", #call); \
    } while (0)

/* Puts the state that answers a question into the host's snapshot, or into a new one. */
static fmi2Status keep(const Instance *instance, Question question, fmi2FMUstate *held)
{
    Snapshot *snapshot = *held == NULL ? calloc(1, sizeof *snapshot) : *held;
    PyObject *state = NULL;
    if (snapshot == NULL)
        return FMU_REFUSE(&instance->log, "There is not enough memory for a state.");
    question.kept = &state;
    fmi2Status status = ask(instance, &question);
    if (status != fmi2OK) {
        if (*held == NULL)
            free(snapshot);
        return status;
    }
    if (snapshot->state != NULL)
        released(instance, snapshot->state);
    *snapshot = (Snapshot){&IDENTITY, state};
    *held = snapshot;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, GetFMUstate);
    FMU_REQUIRE_ARRAY(instance, GetFMUstate, FMUstate, 1);
    const Snapshot *held = *FMUstate;
    if (held != NULL)
        REQUIRE_SNAPSHOT(instance, GetFMUstate, held);
    double where[] = {0.0, instance->state.time, instance->state.stop_time};
    while (mode_of_phase(where[0]) != instance->state.mode)
        where[0] += 1.0;
    return keep(instance, (Question){.method = "get_state", .arrays = 1, .first = where, .first_size = sizeof where},
                FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    const Snapshot *snapshot = FMUstate;
    double where[3] = {0.0, 0.0, 0.0};
    FMU_REQUIRE(c, SetFMUstate);
    REQUIRE_SNAPSHOT(instance, SetFMUstate, snapshot);
    fmi2Status status = ask(instance, &(Question){.method = "set_state", .state = snapshot->state, .answer = where,
                                                  .answer_size = sizeof where});
    if (status == fmi2OK) {
        instance->state.mode = mode_of_phase(where[0]);
        instance->state.time = where[1];
        instance->state.stop_time = where[2];
    }
    return status;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, FreeFMUstate);
    if (FMUstate == NULL || *FMUstate == NULL)
        return fmi2OK;
    Snapshot *snapshot = *FMUstate;
    REQUIRE_SNAPSHOT(instance, FreeFMUstate, snapshot);
    released(instance, snapshot->state);
    snapshot->of = NULL;
    free(snapshot);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    const Snapshot *snapshot = FMUstate;
    FMU_REQUIRE(c, SerializedFMUstateSize);
    REQUIRE_SNAPSHOT(instance, SerializedFMUstateSize, snapshot);
    FMU_REQUIRE_ARRAY(instance, SerializedFMUstateSize, size, 1);
    return ask(instance, &(Question){.method = "to_bytes", .state = snapshot->state, .size = size});
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    const Snapshot *snapshot = FMUstate;
    FMU_REQUIRE(c, SerializeFMUstate);
    REQUIRE_SNAPSHOT(instance, SerializeFMUstate, snapshot);
    FMU_REQUIRE_ARRAY(instance, SerializeFMUstate, serializedState, size);
    return ask(instance, &(Question){.method = "to_bytes", .state = snapshot->state, .answer = serializedState,
                                     .answer_size = size});
}

fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, DeSerializeFMUstate);
    FMU_REQUIRE_ARRAY(instance, DeSerializeFMUstate, serializedState, size);
    FMU_REQUIRE_ARRAY(instance, DeSerializeFMUstate, FMUstate, 1);
    const Snapshot *held = *FMUstate;
    if (held != NULL)
        REQUIRE_SNAPSHOT(instance, DeSerializeFMUstate, held);
    return keep(instance, (Question){.method = "from_bytes", .arrays = 1, .first = serializedState, .first_size = size},
                FMUstate);
}
