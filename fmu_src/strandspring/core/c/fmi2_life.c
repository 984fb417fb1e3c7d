/* The calls of FMI 2.0 that the FMU of a spring and that of a system answer alike. */
#include "fmi2_life.h"

#include "fmi2_arguments.h"

FmuStatus fmi2_memory(const Log *log, const fmi2CallbackFunctions *functions, Memory *memory)
{
    *memory = (Memory){functions->allocateMemory, functions->freeMemory};
    if ((functions->allocateMemory == NULL) != (functions->freeMemory == NULL))
        return FMU_REFUSE(log, "The callbacks allocateMemory and freeMemory must both be given or both be NULL.");
    return FMU_OK;
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
    FMU_REQUIRE_VARIABLES(instance, GetReal, vr, nvr, value, VARIABLE_REAL);
    return fmu_read(instance, vr, nvr, value);
}

/* The one Boolean is `extrapolating`. */
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    FMU_REQUIRE(c, GetBoolean);
    FMU_REQUIRE_VARIABLES(instance, GetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
    int extrapolating;
    if (fmu_read_extrapolating(instance, &extrapolating) != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        value[i] = extrapolating ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[])
{
    FMU_REQUIRE(c, SetBoolean);
    FMU_REQUIRE_VARIABLES(instance, SetBoolean, vr, nvr, value, VARIABLE_BOOLEAN);
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
        FMU_REQUIRE_VARIABLES(instance, call, vr, nvr, value, type); \
        return fmi2OK; \
    }

EXCHANGE_NONE(GetInteger, fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(GetString, fmi2String, VARIABLE_STRING)
EXCHANGE_NONE(SetInteger, const fmi2Integer, VARIABLE_INTEGER)
EXCHANGE_NONE(SetString, const fmi2String, VARIABLE_STRING)
