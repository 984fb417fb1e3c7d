/* The beginning and end of a spring, and values of its variables. */
#include "fmi3_arguments.h"
#include "fmi3_calls.h"
#include "fmu_model_exchange.h"

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    (void)resourcePath;
    (void)visible;
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    return fmu_instantiate(&log, instanceName, instantiationToken, "instantiation token", &C_LIBRARY, ME_INSTANTIATED);
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
    const fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)resourcePath;
    (void)visible;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    if (fmu_start_settings().has_states)
        return FMU_REFUSE_POINTER(&log, "This form of the FMU has continuous states and no solver; instantiate it for model "
                                        "exchange.");
    if (require_plain_steps(&log, eventModeUsed, nRequiredIntermediateVariables) != FMU_OK)
        return NULL;
    return fmu_instantiate(&log, instanceName, instantiationToken, "instantiation token", &C_LIBRARY, CS_INSTANTIATED);
}

void fmi3FreeInstance(fmi3Instance c)
{
    fmu_free(c);
}

static FmuStatus read_element(Instance *instance, unsigned element, double *value)
{
    if (element < instance->variables)
        return fmu_read(instance, &element, 1, value);
    *value = element == instance->variables ? instance->state.time : fmu_indicator(instance);
    return FMU_OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, GetFloat64);
    FMI3_REQUIRE_VALUES(instance, GetFloat64, VARIABLE_REAL);
    for (size_t i = 0; i < nValueReferences; i++) {
        Elements elements = fmi3_elements(instance, valueReferences[i]);
        for (unsigned k = 0; k < elements.count; k++)
            if (read_element(instance, elements.first + k, values++) != FMU_OK)
                return fmi3Error;
    }
    return fmi3OK;
}

static FmuStatus require_change(const Instance *instance, unsigned element, double value)
{
    if (element < instance->variables)
        return fmu_require_change(instance, element, value);
    return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.", fmi3_name(instance, element).text);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, SetFloat64);
    FMI3_REQUIRE_VALUES(instance, SetFloat64, VARIABLE_REAL);
    const double *value = values;
    for (size_t i = 0; i < nValueReferences; i++) {
        Elements elements = fmi3_elements(instance, valueReferences[i]);
        for (unsigned k = 0; k < elements.count; k++)
            if (require_change(instance, elements.first + k, *value++) != FMU_OK)
                return fmi3Error;
    }
    value = values;
    fmu_open_changes(instance);
    for (size_t i = 0; i < nValueReferences; i++) {
        Elements elements = fmi3_elements(instance, valueReferences[i]);
        for (unsigned k = 0; k < elements.count; k++)
            fmu_change(instance, elements.first + k, *value++);
    }
    return fmu_apply_changes(instance);
}

/* The one Boolean is `extrapolating`. */
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    FMU_REQUIRE(c, GetBoolean);
    FMI3_REQUIRE_VALUES(instance, GetBoolean, VARIABLE_BOOLEAN);
    for (size_t i = 0; i < nValues; i++)
        values[i] = fmu_extrapolating(instance) != 0;
    return fmi3OK;
}
