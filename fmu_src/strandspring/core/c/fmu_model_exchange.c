#include "fmu_model_exchange.h"

#include "spring_number.h"

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

int fmu_indicators(const Instance *instance)
{
    return instance->has_states ? 0 : 1;
}

double fmu_indicator(const Instance *instance)
{
    const State *state = &instance->state;
    return fmu_watch_indicator(&state->watch, state->time, state->displacement, fmu_range(state));
}

int fmu_states(const Instance *instance)
{
    return instance->has_states ? FMU_MOST_STATES : 0;
}

unsigned fmu_state(int i)
{
    return i == 0 ? SPRING_ABSORBED_ENERGY : SPRING_OMEGA;
}

unsigned fmu_state_rate(const Instance *instance, int i)
{
    return fmu_first_own(&instance->state.settings) + (i == 0 ? OWN_POWER : OWN_OMEGA_RATE);
}

/* The energy that the hysteretic force takes on a way through the whole range, as identified, and 1. */
double fmu_state_nominal(int i)
{
    Settings start = fmu_start_settings();
    const SpringParameters *spring = &start.spring;
    return i == 0 ? spring->kappa_omega * (spring->displacement_max - spring->displacement_min) : 1.0;
}
