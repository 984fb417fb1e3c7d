/* The least that a step of co-simulation or model exchange can cost: an FMU that copies its input to its outputs, with
 * the checks that any FMU owes its host (instance, mode, pointers, value references, finite numbers), compiled like the
 * springs it is compared with. Its value references are theirs: 0 is the input, 1, 2 and 3 are outputs.
 */
#include "fmi2Functions.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

enum { INSTANTIATED = 1, INITIALIZATION = 2, STEP = 4, EVENT = 8, CONTINUOUS_TIME = 16, TERMINATED = 32 };
enum { VARIABLES = 4 };

typedef struct {
    int mode, model_exchange;
    double time, value[VARIABLES];
    fmi2CallbackFunctions functions;
} Instance;

static fmi2Status refuse(const Instance *instance, const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (instance->functions.logger != NULL)
        instance->functions.logger(
            instance->functions.componentEnvironment, "feedthrough", fmi2Error, "logStatusError", "%s", text);
    return fmi2Error;
}

#define REQUIRE(instance, modes) \
    do { \
        if ((instance) == NULL) \
            return fmi2Error; \
        if (!((instance)->mode & (modes))) \
            return refuse((instance), "%s is not allowed in mode %d.", __func__, (instance)->mode); \
    } while (0)

static fmi2Status require_variables(
    const Instance *instance, const fmi2ValueReference references[], size_t count, const double values[])
{
    if (count > 0 && (references == NULL || values == NULL))
        return refuse(instance, "Arrays must not be NULL.");
    for (size_t i = 0; i < count; i++)
        if (references[i] >= VARIABLES)
            return refuse(instance, "There is no variable %u.", references[i]);
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name;
    (void)guid;
    (void)resources;
    (void)visible;
    (void)logging;
    Instance *instance = functions->allocateMemory(1, sizeof *instance);
    if (instance != NULL)
        *instance = (Instance){
            .mode = INSTANTIATED, .model_exchange = type == fmi2ModelExchange, .functions = *functions};
    return instance;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *instance = c;
    instance->functions.freeMemory(instance);
}

fmi2Status fmi2SetupExperiment(
    fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    Instance *instance = c;
    (void)defined;
    (void)tolerance;
    (void)ends;
    (void)stop;
    REQUIRE(instance, INSTANTIATED);
    instance->time = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *instance = c;
    REQUIRE(instance, INSTANTIATED);
    instance->mode = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Instance *instance = c;
    REQUIRE(instance, INITIALIZATION);
    instance->mode = instance->model_exchange ? EVENT : STEP;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    Instance *instance = c;
    REQUIRE(instance, EVENT);
    instance->mode = CONTINUOUS_TIME;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    Instance *instance = c;
    REQUIRE(instance, STEP | EVENT | CONTINUOUS_TIME);
    instance->mode = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    Instance *instance = c;
    REQUIRE(instance, INITIALIZATION | STEP | EVENT | CONTINUOUS_TIME | TERMINATED);
    if (require_variables(instance, vr, nvr, value) != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        value[i] = instance->value[vr[i]];
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    Instance *instance = c;
    REQUIRE(instance, INSTANTIATED | INITIALIZATION | STEP | EVENT | CONTINUOUS_TIME);
    if (require_variables(instance, vr, nvr, value) != fmi2OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        if (vr[i] != 0)
            return refuse(instance, "Variable %u is computed.", vr[i]);
        if (!isfinite(value[i]))
            return refuse(instance, "The input must be finite, got %g.", value[i]);
    }
    for (size_t i = 0; i < nvr; i++)
        for (int k = 0; k < VARIABLES; k++)
            instance->value[k] = value[i];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    Instance *instance = c;
    (void)no_set_state;
    REQUIRE(instance, STEP);
    if (!isfinite(time) || !(isfinite(size) && size >= 0.0))
        return refuse(instance, "The step of %g s at %g s must be finite.", size, time);
    instance->time = time + size;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    Instance *instance = c;
    REQUIRE(instance, EVENT | CONTINUOUS_TIME);
    if (!isfinite(time))
        return refuse(instance, "The time must be finite, got %g.", time);
    instance->time = time;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean *event, fmi2Boolean *terminate)
{
    Instance *instance = c;
    (void)no_set_state;
    REQUIRE(instance, CONTINUOUS_TIME);
    if (event == NULL || terminate == NULL)
        return refuse(instance, "Answers must not be NULL.");
    *event = *terminate = fmi2False;
    return fmi2OK;
}
