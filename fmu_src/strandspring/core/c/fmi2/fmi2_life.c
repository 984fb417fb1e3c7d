/* The calls of FMI 2.0 that the FMU of a spring and that of a system answer alike. */
#include "fmi2_arguments.h"
#include "../fmi/fmu_calls.c"

#include <math.h>

static const char *const TYPE_NAMES[] = {
    [VARIABLE_REAL] = "Real",
    [VARIABLE_INTEGER] = "Integer",
    [VARIABLE_BOOLEAN] = "Boolean",
    [VARIABLE_STRING] = "String",
};

FmuStatus fmi2_refuse_type(const Instance *instance, fmi2ValueReference reference, VariableType expected)
{
    if (reference >= instance->variables)
        return FMU_REFUSE(&instance->log, "There is no variable with value reference %u; they go from 0 to %u.",
                          reference, instance->variables - 1);
    return FMU_REFUSE(&instance->log, "`%s` (value reference %u) is %s, not %s.",
                      fmu_variable_name(instance, reference).text, reference, TYPE_NAMES[fmu_type(reference)],
                      TYPE_NAMES[expected]);
}

static void write_message(const Log *log, FmuStatus status, const char *category, const char *text)
{
    /* The logger takes a format, which text that holds a value of the host must not be; hosts that show the format alone
     * show all of it. */
    char format[2 * LONGEST_MESSAGE];
    size_t length = 0;
    for (; *text != '\0'; text++) {
        if (*text == '%')
            format[length++] = '%';
        format[length++] = *text;
    }
    format[length] = '\0';
    ((fmi2CallbackLogger)log->logger)(log->environment, log->instance_name, status, category, format);
}

/* Where messages go; the name is not copied. Warnings and errors are no debug logging: fmi2SetDebugLogging can silence
 * them. */
static Log first_log(fmi2String name, const fmi2CallbackFunctions *functions)
{
    int named = name != NULL && name[0] != '\0';
    return (Log){
        .write = functions->logger == NULL ? NULL : write_message,
        .logger = (void (*)(void))functions->logger,
        .environment = functions->componentEnvironment,
        .instance_name = named ? name : "unnamed",
        .categories = LOG_ALL,
    };
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    if (functions == NULL)
        return NULL;
    Log log = first_log(instanceName, functions);
    const Memory memory = {functions->allocateMemory, functions->freeMemory};
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0) or fmi2CoSimulation (1), got %d.",
                                  (int)fmuType);
    if ((memory.allocate == NULL) != (memory.free == NULL))
        return FMU_REFUSE_POINTER(
            &log, "The callbacks allocateMemory and freeMemory must both be given or both be NULL.");
    int mode = fmuType == fmi2ModelExchange ? ME_INSTANTIATED : CS_INSTANTIATED;
    return fmu_instantiate(&log, instanceName, fmuGUID, "GUID", &memory, mode);
}

FMU_CALL(EnterInitializationMode, (fmi2Component c), enter(instance, INITIALIZATION))
FMU_SNAPSHOT_CALLS(GetFMUstate, SetFMUstate, FreeFMUstate, SerializedFMUstateSize, SerializeFMUstate,
                   DeSerializeFMUstate)

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    FMU_REQUIRE(c, GetReal);
    FMI2_REQUIRE_VARIABLES(instance, GetReal, vr, nvr, value, VARIABLE_REAL);
    return fmu_read(instance, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    FMU_REQUIRE(c, SetReal);
    FMI2_REQUIRE_VARIABLES(instance, SetReal, vr, nvr, value, VARIABLE_REAL);
    return change_all(instance, vr, nvr, value);
}

/* The one Boolean is `extrapolating`. */
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    FMU_REQUIRE(c, GetBoolean);
    FMI2_REQUIRE_VARIABLES(instance, GetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
    int extrapolating;
    if (fmu_read_extrapolating(instance, &extrapolating) != FMU_OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        value[i] = extrapolating ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    FMU_REQUIRE(c, SetBoolean);
    FMI2_REQUIRE_VARIABLES(instance, SetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
    if (nvr == 0)
        return fmi2OK;
    return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.",
                      fmu_variable_name(instance, vr[0]).text);
}

/* Of types that no variable has. */
#define EXCHANGE_NONE(call, Type, type) \
    fmi2Status fmi2##call(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) \
    { \
        FMU_REQUIRE(c, call); \
        FMI2_REQUIRE_VARIABLES(instance, call, vr, nvr, value, type); \
        return fmi2OK; \
    }

EXCHANGE_NONE(GetInteger, fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(GetString, fmi2String, VARIABLE_STRING)
EXCHANGE_NONE(SetInteger, const fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(SetString, const fmi2String, VARIABLE_STRING)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    FMU_REQUIRE(c, DoStep);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK)
        return fmi2Error;
    return fmu_step(instance, currentCommunicationPoint, communicationStepSize);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

fmi2Status fmi2SetDebugLogging(
    fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[])
{
    FMU_REQUIRE(c, SetDebugLogging);
    FMU_REQUIRE_ARRAY(instance, SetDebugLogging, categories, nCategories);
    int chosen = 0;
    if (fmu_find_categories(&instance->log, nCategories, categories, &chosen) != FMU_OK)
        return fmi2Error;
    instance->log.categories = loggingOn ? chosen : 0;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    FMU_REQUIRE(c, SetupExperiment);
    double stop = stopTimeDefined ? stopTime : HUGE_VAL;
    if (fmu_require_experiment(&instance->log, startTime, stop) != FMU_OK)
        return fmi2Error;
    instance->state.time = startTime;
    instance->state.stop_time = stop;
    return fmi2OK;
}

FMU_CALL(CancelStep, (fmi2Component c), fmi2OK)

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
