/* The calls of FMI 2.0 that the FMU of a spring and that of a system answer alike. */
#include "fmi2_arguments.h"
#include "fmi2_calls.h"
#include "fmi2_log.h"

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    /* Warnings and errors are no debug logging, whatever `loggingOn`: fmi2SetDebugLogging can silence them. */
    if (functions == NULL)
        return NULL;
    Log log = fmi2_log(instanceName, functions);
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

void fmi2FreeInstance(fmi2Component c)
{
    fmu_free(c);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, EnterInitializationMode);
    instance->state.mode = fmu_of_kind(instance->state.mode, INITIALIZATION);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    FMU_REQUIRE(c, ExitInitializationMode);
    return fmu_end_initialization(instance);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    FMU_REQUIRE(c, Terminate);
    instance->state.mode = fmu_of_kind(instance->state.mode, TERMINATED);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    FMU_REQUIRE(c, Reset);
    fmu_begin(instance, fmu_of_kind(instance->state.mode, INSTANTIATED));
    return fmi2OK;
}

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
    for (size_t i = 0; i < nvr; i++)
        if (fmu_require_change(instance, vr[i], value[i]) != FMU_OK)
            return fmi2Error;
    fmu_open_changes(instance);
    for (size_t i = 0; i < nvr; i++)
        fmu_change(instance, vr[i], value[i]);
    return fmu_apply_changes(instance);
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
