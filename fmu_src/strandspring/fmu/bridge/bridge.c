/* The binary of the Python-backed FMU: each call of FMI 2.0 for co-simulation becomes a call of core/component.py.
 *
 * Arrays travel as bytes in both directions and states as Python objects; what a call means, and every refusal but those
 * of the state machine and of NULL, is decided in Python. Python is never shut down, and no call keeps its lock.
 */
#ifndef _WIN32
#define _GNU_SOURCE /* RTLD_DEFAULT and dladdr */
#endif
#define SPRING_LOCAL static inline

#include "../../core/c/fmi2_api.h"
#include "../../core/c/fmi2_log.c"
#include "../../core/c/fmi2_states.c"

#include "python.c"
#ifdef _WIN32
#include "find_windows.c"
#else
#include "find_posix.c"
#endif

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Phases of co-simulation as Python counts them, from 0. */
static int mode_of_phase(double phase) { return CS_INSTANTIATED << (int)phase; }
_Static_assert(CS_TERMINATED == CS_INSTANTIATED << 3, "the modes of co-simulation follow each other");

typedef struct {
    struct {
        int mode;
        double time; /* where the last step ended [s] */
    } state;
    Log log;
    PyObject *component;
    char name[];
} Instance;

/* A state that the host holds. */
typedef struct {
    const void *of; /* the binary that made it */
    PyObject *state;
} Snapshot;

static const char IDENTITY;

/* One call of the component. */
typedef struct {
    const char *method;
    const char *kind; /* of the variables, passed on unless NULL */
    int arrays; /* how many of the two are passed on */
    const void *first;
    size_t first_size; /* in bytes, like all sizes here */
    const void *second;
    size_t second_size;
    PyObject *state; /* passed on in place of arrays unless NULL */
    void *answer;    /* takes the bytes of the answer, which must be `answer_size` */
    size_t answer_size;
    size_t *size;    /* takes the number of bytes of the answer unless NULL */
    PyObject **kept; /* takes the answer itself unless NULL */
} Question;

/* Runs `resources`/slavemodule.txt's module once per process, and asks it for a component. */
static const char START[] =
    "import importlib, os, sys\n"
    "from urllib.parse import unquote_to_bytes\n"
    "try:\n"
    "    path = uri[5:] if uri[:5].lower() == b'file:' else uri\n"
    "    if path[:2] == b'//':\n"
    "        host, slash, rest = path[2:].partition(b'/')\n"
    "        path = path if os.name == 'nt' and host.lower() not in (b'', b'localhost') else slash + rest\n"
    "    if os.name == 'nt' and path[2:3] in (b':', b'|'):\n"
    "        path = path[1:2] + b':' + path[3:]\n"
    "    folder = os.fsdecode(unquote_to_bytes(path))\n"
    "    if not os.path.isdir(folder):\n" /* the host has not encoded it */
    "        folder = os.fsdecode(path)\n"
    "    with open(os.path.join(folder, 'slavemodule.txt'), encoding='ascii') as file:\n"
    "        module = file.read().strip()\n"
    "    if module not in sys.modules:\n"
    "        sys.path.insert(0, folder)\n"
    "        try:\n"
    "            importlib.import_module(module)\n"
    "        finally:\n"
    "            sys.path.remove(folder)\n"
    "    answer = importlib.import_module(module).start(folder, name, guid)\n"
    "except BaseException as problem:\n"
    "    text = f'The FMU cannot be loaded from {os.fsdecode(uri)}: {type(problem).__name__}: {problem}'\n"
    "    answer = 3, None, b'3' + text.encode('ascii', 'replace').replace(b'\\n', b' ').replace(b'#', b'?') + b'\\n'\n";

/* Takes the lock of Python; an instance must not outlive it. */
static int enter(const Log *log, int *lock)
{
    if (!python.Py_IsInitialized()) {
        FMU_REFUSE(log, "The Python of this process has been shut down; end the simulation before that.");
        return 0;
    }
    *lock = python.PyGILState_Ensure();
    return 1;
}

/* Logs the lines of a reply without the lock, which the host's logger may wait for elsewhere. */
static void report_lines(const Log *log, const char *lines)
{
    void *thread = python.PyEval_SaveThread();
    for (const char *end; (end = strchr(lines, '\n')) != NULL; lines = end + 1)
        fmu_report(log, (fmi2Status)(lines[0] - '0'), "%.*s", (int)(end - lines - 1), lines + 1);
    python.PyEval_RestoreThread(thread);
}

/* The status in a reply (status, answer, lines to be logged), which is borrowed, and its answer. */
static fmi2Status unpacked(const Log *log, PyObject *reply, PyObject **answer)
{
    char *lines = NULL;
    long status = -1;
    ptrdiff_t length;
    if (reply != NULL) {
        status = python.PyLong_AsLong(python.PyTuple_GetItem(reply, 0));
        *answer = python.PyTuple_GetItem(reply, 1);
        python.PyBytes_AsStringAndSize(python.PyTuple_GetItem(reply, 2), &lines, &length);
    }
    if (status < 0 || lines == NULL) {
        python.PyErr_Clear();
        return FMU_REFUSE(log, "Python failed before the call reached the spring; it may be out of memory.");
    }
    if (lines[0] != '\0')
        report_lines(log, lines);
    return (fmi2Status)status;
}

static PyObject *bytes(const void *content, size_t size)
{
    return python.PyBytes_FromStringAndSize(size == 0 ? "" : content, (ptrdiff_t)size);
}

/* Copies the answer to where the question wants it. */
static fmi2Status delivered(const Instance *instance, const Question *question, PyObject *answer)
{
    char *content = NULL;
    ptrdiff_t size = 0;
    if (question->kept != NULL) {
        python.Py_IncRef(answer);
        *question->kept = answer;
        return fmi2OK;
    }
    if (python.PyBytes_AsStringAndSize(answer, &content, &size) != 0) {
        python.PyErr_Clear();
        return FMU_REFUSE(&instance->log, "`%s` of the FMU's Python code gave no bytes.", question->method);
    }
    if (question->size != NULL) {
        *question->size = (size_t)size;
    } else if ((size_t)size != question->answer_size) {
        return FMU_REFUSE(&instance->log, "The answer to `%s` has %.0f bytes, but there is room for %.0f.",
                          question->method, (double)size, (double)question->answer_size);
    } else if (size > 0) {
        memcpy(question->answer, content, (size_t)size);
    }
    return fmi2OK;
}

static fmi2Status ask(const Instance *instance, const Question *question)
{
    static const char *const FORMATS[] = {"s", "sN"}, *const OF_VARIABLES[] = {"", "ssN", "ssNN"};
    int lock;
    PyObject *reply, *answer = NULL;
    if (!enter(&instance->log, &lock))
        return fmi2Error;
    if (question->state != NULL) {
        reply = python.PyObject_CallMethod(instance->component, "call", "sO", question->method, question->state);
    } else {
        PyObject *first = question->arrays > 0 ? bytes(question->first, question->first_size) : NULL;
        PyObject *second = question->arrays > 1 ? bytes(question->second, question->second_size) : NULL;
        if (question->kind != NULL)
            reply = python.PyObject_CallMethod(instance->component, "call", OF_VARIABLES[question->arrays],
                                               question->method, question->kind, first, second);
        else
            reply = python.PyObject_CallMethod(
                instance->component, "call", FORMATS[question->arrays], question->method, first);
    }
    fmi2Status status = unpacked(&instance->log, reply, &answer);
    if (status == fmi2OK)
        status = delivered(instance, question, answer);
    python.Py_DecRef(reply);
    python.PyGILState_Release(lock);
    return status;
}

static void released(const Instance *instance, PyObject *object)
{
    int lock;
    if (!enter(&instance->log, &lock))
        return;
    python.Py_DecRef(object);
    python.PyGILState_Release(lock);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

/* A component for a new instance, or NULL. */
static PyObject *started(const Log *log, const char *guid, const char *resources)
{
    int lock;
    PyObject *component = NULL;
    if (!enter(log, &lock))
        return NULL;
    PyObject *builtins = python.PyImport_ImportModule("builtins");
    PyObject *scope = python.Py_BuildValue("{s:y,s:y,s:y}", "uri", resources, "name", log->instance_name, "guid", guid);
    PyObject *done = python.PyObject_CallMethod(builtins, "exec", "sO", START, scope);
    PyObject *reply = done == NULL ? NULL : python.PyDict_GetItemString(scope, "answer");
    if (unpacked(log, reply, &component) == fmi2OK)
        python.Py_IncRef(component);
    else
        component = NULL;
    python.Py_DecRef(done);
    python.Py_DecRef(scope);
    python.Py_DecRef(builtins);
    python.PyGILState_Release(lock);
    return component;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    char problem[400];
    (void)visible;
    /* Warnings and errors are no debug logging: fmi2SetDebugLogging can silence them. */
    (void)loggingOn;
    if (functions == NULL)
        return NULL;
    int named = instanceName != NULL && instanceName[0] != '\0';
    Log log = {functions->logger, functions->componentEnvironment, named ? instanceName : "unnamed", LOG_ALL};
    if (!named)
        return FMU_REFUSE_POINTER(&log, "The name of an instance must not be empty.");
    if (fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2CoSimulation (1), got %d.", (int)fmuType);
    if (fmuGUID == NULL || fmuResourceLocation == NULL)
        return FMU_REFUSE_POINTER(&log, "The GUID and the location of the resources must not be NULL.");
    if (!python_ready(problem, sizeof problem))
        return FMU_REFUSE_POINTER(&log, "%s", problem);
    Instance *instance = calloc(1, sizeof *instance + strlen(instanceName) + 1);
    if (instance == NULL)
        return FMU_REFUSE_POINTER(&log, "There is not enough memory for an instance.");
    strcpy(instance->name, instanceName);
    log.instance_name = instance->name;
    instance->log = log;
    instance->state.mode = CS_INSTANTIATED;
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

fmi2Status fmi2SetDebugLogging(
    fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    FMU_REQUIRE(c, SetDebugLogging);
    FMU_REQUIRE_ARRAY(instance, SetDebugLogging, categories, nCategories);
    return fmu_choose_categories(&instance->log, loggingOn, nCategories, categories);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined;
    (void)tolerance; /* the response is exact */
    FMU_REQUIRE(c, SetupExperiment);
    if (!isfinite(startTime))
        return FMU_REFUSE(&instance->log, "The start time must be finite [s], got %.17g.", startTime);
    if (stopTimeDefined && !(stopTime >= startTime))
        return FMU_REFUSE(&instance->log, "The stop time must not be before the start time %.17g s, got %.17g.",
                          startTime, stopTime);
    instance->state.time = startTime;
    return fmi2OK;
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
    return ask_for_mode(instance, "reset", CS_INSTANTIATED);
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
    const double step[] = {currentCommunicationPoint, communicationStepSize};
    fmi2Status status =
        ask(instance, &(Question){.method = "do_step", .arrays = 1, .first = step, .first_size = sizeof step});
    if (status == fmi2OK)
        instance->state.time = currentCommunicationPoint + communicationStepSize;
    return status;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    FMU_REQUIRE(c, CancelStep);
    return fmi2OK;
}

/* No step is ever pending, so that few kinds of status are known. */
#define GET_STATUS(call, Type, known, answer) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2StatusKind s, Type *value) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_ARRAY(instance, call, value, 1); \
        if (!(known)) \
            return fmu_report(&instance->log, fmi2Discard, \
                              "%s has no status of kind %d, since steps of this FMU are never pending.", "fmi2" #call, \
                              (int)s); \
        *value = (answer); \
        return fmi2OK; \
    }

GET_STATUS(GetStatus, fmi2Status, 0, fmi2OK)
GET_STATUS(GetRealStatus, fmi2Real, s == fmi2LastSuccessfulTime, instance->state.time)
GET_STATUS(GetIntegerStatus, fmi2Integer, 0, 0)
GET_STATUS(GetBooleanStatus, fmi2Boolean, s == fmi2Terminated, fmi2False)
GET_STATUS(GetStringStatus, fmi2String, 0, NULL)

/* Derivatives, of which the model description says that there are none. */
static fmi2Status refuse_derivatives(const Instance *instance, const char *what)
{
    return FMU_REFUSE(&instance->log, "The Python-backed FMU has no %s; the native FMU of the same model has them.", what);
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
    double where[] = {0.0, instance->state.time};
    while (mode_of_phase(where[0]) != instance->state.mode)
        where[0] += 1.0;
    return keep(instance, (Question){.method = "get_state", .arrays = 1, .first = where, .first_size = sizeof where},
                FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    const Snapshot *snapshot = FMUstate;
    double where[2];
    FMU_REQUIRE(c, SetFMUstate);
    REQUIRE_SNAPSHOT(instance, SetFMUstate, snapshot);
    fmi2Status status = ask(instance, &(Question){.method = "set_state", .state = snapshot->state, .answer = where,
                                                  .answer_size = sizeof where});
    if (status == fmi2OK) {
        instance->state.mode = mode_of_phase(where[0]);
        instance->state.time = where[1];
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
