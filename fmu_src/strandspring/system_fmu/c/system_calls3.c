/* The calls of FMI 3.0 for co-simulation that differ from those of a spring. Inputs hold over a step: FMI 3.0 has no
 * derivatives of inputs, and there is no intermediate update. */
#include "../../core/c/fmi3_arguments.h"
#include "../../core/c/fmi3_calls.h"
#include "system_life.h"

VariableName fmi3_name(const Instance *instance, unsigned element)
{
    return element < instance->variables ? system_name(element) : (VariableName){"time"};
}

fmi3Instance fmi3InstantiateModelExchange(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean visible,
    fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage)
{
    (void)instantiationToken;
    (void)resourcePath;
    (void)visible;
    Log log = first_log(instanceName, instanceEnvironment, logMessage, loggingOn);
    return FMU_REFUSE_POINTER(&log, "This FMU has a solver of its own; instantiate it for co-simulation.");
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
    if (require_plain_steps(&log, eventModeUsed, nRequiredIntermediateVariables) != FMU_OK)
        return NULL;
    return system_instantiate(&log, instanceName, instantiationToken, "instantiation token", &C_LIBRARY);
}

void fmi3FreeInstance(fmi3Instance c)
{
    system_free(c);
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, GetFloat64);
    FMI3_REQUIRE_VALUES(instance, GetFloat64, VARIABLE_REAL);
    for (size_t i = 0; i < nValueReferences; i++) {
        unsigned element = fmi3_elements(instance, valueReferences[i]).first;
        if (element == instance->variables)
            values[i] = instance->state.time;
        else if (fmu_read(instance, &element, 1, values + i) != FMU_OK)
            return fmi3Error;
    }
    return fmi3OK;
}

static FmuStatus require_change(const Instance *instance, unsigned element, double value)
{
    if (element < instance->variables)
        return system_require_change(instance, element, value);
    return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.", fmi3_name(instance, element).text);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    FMU_REQUIRE(c, SetFloat64);
    FMI3_REQUIRE_VALUES(instance, SetFloat64, VARIABLE_REAL);
    for (size_t i = 0; i < nValueReferences; i++)
        if (require_change(instance, fmi3_elements(instance, valueReferences[i]).first, values[i]) != FMU_OK)
            return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        system_write(instance, &(unsigned){fmi3_elements(instance, valueReferences[i]).first}, 1, values + i);
    return fmi3OK;
}

/* The one Boolean is `extrapolating`. */
fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    int extrapolating;
    FMU_REQUIRE(c, GetBoolean);
    FMI3_REQUIRE_VALUES(instance, GetBoolean, VARIABLE_BOOLEAN);
    if (nValues > 0 && fmu_read_extrapolating(instance, &extrapolating) != FMU_OK)
        return fmi3Error;
    for (size_t i = 0; i < nValues; i++)
        values[i] = extrapolating != 0;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    FMU_REQUIRE(c, DoStep);
    FMU_REQUIRE_ARRAY(instance, DoStep, eventHandlingNeeded, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, terminateSimulation, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, earlyReturn, 1);
    FMU_REQUIRE_ARRAY(instance, DoStep, lastSuccessfulTime, 1);
    double stop_time = instance->state.stop_time;
    if (fmu_require_step(&instance->log, currentCommunicationPoint, communicationStepSize, stop_time) != FMU_OK ||
        system_step(instance, currentCommunicationPoint, communicationStepSize) != FMU_OK)
        return fmi3Error;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = instance->state.time;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    (void)orders;
    FMU_REQUIRE(c, GetOutputDerivatives);
    FMI3_REQUIRE_VALUES(instance, GetOutputDerivatives, VARIABLE_REAL);
    return nValueReferences == 0 ? fmi3OK : FMU_REFUSE(&instance->log, "This FMU gives no derivatives of outputs.");
}

#define NO_DERIVATIVES(call, text) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                          const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                          fmi3Float64 sensitivity[], size_t nSensitivity) \
    { \
        (void)unknowns; \
        (void)knowns; \
        (void)nKnowns; \
        (void)seed; \
        (void)nSeed; \
        (void)sensitivity; \
        (void)nSensitivity; \
        FMU_REQUIRE(c, call); \
        return nUnknowns == 0 ? fmi3OK : FMU_REFUSE(&instance->log, text); \
    }

NO_DERIVATIVES(GetDirectionalDerivative, "This FMU gives no directional derivatives.")
NO_DERIVATIVES(GetAdjointDerivative, "This FMU gives no adjoint derivatives.")
