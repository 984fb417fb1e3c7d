#include "fmu_model_exchange.h"

#include "../spring/spring_number.h"

#include <math.h>

FmuStatus fmu_enter_continuous_time(Instance *instance)
{
    if (fmu_accept(instance, 1) != FMU_OK)
        return FMU_ERROR;
    instance->state.extrapolating = fmu_extrapolating(instance);
    instance->state.mode = ME_CONTINUOUS_TIME;
    return FMU_OK;
}

FmuStatus fmu_complete_step(Instance *instance, int *needs_event)
{
    if (fmu_accept(instance, 0) != FMU_OK)
        return FMU_ERROR;
    *needs_event = (instance->state.side != 0) != instance->state.extrapolating;
    return FMU_OK;
}

FmuStatus fmu_set_time(Instance *instance, double time)
{
    if (!isfinite(time))
        return FMU_REFUSE(&instance->log, "The time must be finite [s], got %s.", spring_number(time).text);
    instance->state.time = time;
    return FMU_OK;
}

size_t fmu_indicators(const Instance *instance)
{
    return instance->has_states ? 0 : 1;
}

double fmu_indicator(const Instance *instance)
{
    const State *state = &instance->state;
    return fmu_watch_indicator(&state->watch, state->time, state->displacement, fmu_range(state));
}

FmuStatus fmu_get_indicators(const Instance *instance, double values[])
{
    if (!instance->has_states)
        values[0] = fmu_indicator(instance);
    return FMU_OK;
}

enum { MOST_STATES = 2 };
static const unsigned STATES[MOST_STATES] = {SPRING_ABSORBED_ENERGY, SPRING_OMEGA};

size_t fmu_states(const Instance *instance)
{
    return instance->has_states ? MOST_STATES : 0;
}

FmuStatus fmu_set_states(Instance *instance, const double values[])
{
    size_t count = fmu_states(instance);
    for (size_t i = 0; i < count; i++)
        if (fmu_require_change(instance, STATES[i], values[i]) != FMU_OK)
            return FMU_ERROR;
    fmu_open_changes(instance);
    for (size_t i = 0; i < count; i++)
        fmu_change(instance, STATES[i], values[i]);
    return fmu_apply_changes(instance);
}

FmuStatus fmu_get_states(Instance *instance, double values[])
{
    return fmu_read(instance, STATES, fmu_states(instance), values);
}

FmuStatus fmu_get_rates(Instance *instance, double values[])
{
    unsigned first_own = fmu_first_own(&instance->state.settings);
    const unsigned rates[MOST_STATES] = {first_own + OWN_POWER, first_own + OWN_OMEGA_RATE};
    return fmu_read(instance, rates, fmu_states(instance), values);
}

FmuStatus fmu_get_nominals(const Instance *instance, double values[])
{
    Settings start = fmu_start_settings();
    const SpringParameters *spring = &start.spring;
    const double nominals[MOST_STATES] = {
        spring->kappa_omega * (spring->displacement_max - spring->displacement_min), 1.0};
    for (size_t i = 0; i < fmu_states(instance); i++)
        values[i] = nominals[i];
    return FMU_OK;
}
