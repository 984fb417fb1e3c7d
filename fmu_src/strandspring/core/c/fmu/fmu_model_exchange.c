/* Model exchange in both versions of FMI.
 *
 * In the usual form the spring has no continuous states: its memory changes only where a point of the path is accepted,
 * and between these the force is a function of the displacement. A point is accepted when an integrator step is
 * completed, and once more at the end of event mode, where the displacement may have jumped. Trial evaluations leave no
 * trace.
 *
 * In the form with states there is no memory besides them and no event but that of `extrapolating`: their rates are
 * continuous where the velocity changes its sign, since they are proportional to it.
 */
#include "fmu_instance.h"

#include "../spring/spring_number.h"

#include <math.h>

FMI(Status) FMI(EnterEventMode)(FmiInstance c)
{
    FMU_REQUIRE(c, EnterEventMode);
    instance->state.mode = ME_EVENT;
    return FMI(OK);
}

FMI(Status) FMI(EnterContinuousTimeMode)(FmiInstance c)
{
    FMU_REQUIRE(c, EnterContinuousTimeMode);
    if (fmu_accept(instance, 1) != FMU_OK)
        return FMI(Error);
    instance->state.extrapolating = fmu_extrapolating(instance);
    instance->state.mode = ME_CONTINUOUS_TIME;
    return FMI(OK);
}

/* Accepts a point. `extrapolating`, which is discrete, may change at events only. */
FMI(Status) FMI(CompletedIntegratorStep)(FmiInstance c, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
                                         FMI(Boolean) *enterEventMode, FMI(Boolean) *terminateSimulation)
{
    FMU_REQUIRE(c, CompletedIntegratorStep);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, enterEventMode, 1);
    FMU_REQUIRE_ARRAY(instance, CompletedIntegratorStep, terminateSimulation, 1);
    if (fmu_accept(instance, 0) != FMU_OK)
        return FMI(Error);
    *enterEventMode = (instance->state.side != 0) != instance->state.extrapolating;
    *terminateSimulation = 0;
    return FMI(OK);
}

FMI(Status) FMI(SetTime)(FmiInstance c, double time)
{
    FMU_REQUIRE(c, SetTime);
    if (!isfinite(time))
        return FMU_REFUSE(&instance->log, "The time must be finite [s], got %s.", spring_number(time).text);
    instance->state.time = time;
    return FMI(OK);
}

static FmuStatus get_indicators(const Instance *instance, double values[])
{
    if (!instance->has_states)
        values[0] = fmu_indicator(instance);
    return FMU_OK;
}

/* References of the states in their order, or of their rates; their number. */
static size_t references_of(const Instance *instance, int rates, unsigned references[MOST_STATES])
{
    size_t count = 0;
    for (unsigned i = 0; i < instance->variables && instance->has_states; i++) {
        SpringVariable variable = fmu_variable(i);
        if (rates ? variable.is_rate : variable.is_state)
            references[count++] = i;
    }
    return count;
}

static FmuStatus set_states(Instance *instance, const double values[])
{
    unsigned states[MOST_STATES];
    size_t count = references_of(instance, 0, states);
    return change_all(instance, states, count, values);
}

static FmuStatus get_states(Instance *instance, double values[])
{
    unsigned states[MOST_STATES];
    size_t count = references_of(instance, 0, states);
    return fmu_read(instance, states, count, values);
}

static FmuStatus get_rates(Instance *instance, double values[])
{
    unsigned rates[MOST_STATES];
    size_t count = references_of(instance, 1, rates);
    return fmu_read(instance, rates, count, values);
}

static FmuStatus get_nominals(const Instance *instance, double values[])
{
    Settings start = fmu_start_settings();
    const SpringParameters *spring = &start.spring;
    double range = spring->displacement_max - spring->displacement_min;
    double nominals[MOST_STATES] = {spring->kappa_omega * range, 1.0};
    int count = 2;
    if (start.added.mechanisms)
        nominals[count++] = 1.0;
    for (int i = 0; i < start.added.branches; i++)
        nominals[count++] = 0.5 * range;
    for (size_t i = 0; i < fmu_states(instance); i++)
        values[i] = nominals[i];
    return FMU_OK;
}

/* Of arrays that must have as many elements as `expected` says. */
#define EXCHANGE_ARRAY(call, Value, values, expected, exchange) \
    FMI(Status) FMI(call)(FmiInstance c, Value values[], size_t count) \
    { \
        FMU_REQUIRE(c, call); \
        FMU_REQUIRE_COUNT(instance, call, values, count, expected(instance)); \
        return exchange(instance, values); \
    }

EXCHANGE_ARRAY(GetEventIndicators, double, eventIndicators, fmu_indicators, get_indicators)
EXCHANGE_ARRAY(SetContinuousStates, const double, continuousStates, fmu_states, set_states)
EXCHANGE_ARRAY(GetContinuousStates, double, continuousStates, fmu_states, get_states)
EXCHANGE_ARRAY(GetNominalsOfContinuousStates, double, nominals, fmu_states, get_nominals)
EXCHANGE_ARRAY(FMI_GET_RATES, double, derivatives, fmu_states, get_rates)
