/* The beginning and end of a spring, and what may be set. */
#include "fmi2_arguments.h"
#include "fmu_block.h"
#include "fmu_instance.h"
#include "fmi2_life.h"

#include <math.h>

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation;
    (void)visible;
    /* Warnings and errors are no debug logging: fmi2SetDebugLogging can silence them. */
    (void)loggingOn;
    if (functions == NULL)
        return NULL;
    Log log = fmi2_log(instanceName, functions);
    if (fmuType == fmi2CoSimulation && fmu_start_settings().has_states)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0): this form of the FMU has continuous states "
                                        "and no solver.");
    if (fmuType != fmi2ModelExchange && fmuType != fmi2CoSimulation)
        return FMU_REFUSE_POINTER(&log, "The type must be fmi2ModelExchange (0) or fmi2CoSimulation (1), got %d.",
                                  (int)fmuType);
    Memory memory;
    if (fmi2_memory(&log, functions, &memory) != FMU_OK)
        return NULL;
    int mode = fmuType == fmi2ModelExchange ? ME_INSTANTIATED : CS_INSTANTIATED;
    return fmu_instantiate(&log, instanceName, fmuGUID, "GUID", &memory, mode);
}

void fmi2FreeInstance(fmi2Component c)
{
    fmu_free(c);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    FMU_REQUIRE(c, SetReal);
    FMU_REQUIRE_VARIABLES(instance, SetReal, vr, nvr, value, VARIABLE_REAL);
    for (size_t i = 0; i < nvr; i++)
        if (fmu_require_change(instance, vr[i], value[i]) != FMU_OK)
            return fmi2Error;
    fmu_open_changes(instance);
    for (size_t i = 0; i < nvr; i++)
        fmu_change(instance, vr[i], value[i]);
    return fmu_apply_changes(instance);
}
