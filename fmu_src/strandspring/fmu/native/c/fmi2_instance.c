#include "fmi2_instance.h"

#include <math.h>
#include <string.h>

/* Of times added up by the host. */
static const double ROUNDING = 1e-9;

static double setting(const State *state, unsigned parameter)
{
    return state->settings[parameter - SPRING_FIRST_PARAMETER];
}

/* Where the displacement set last lies: -1 below the identified range, +1 above it, 0 inside. */
static int side(const State *state)
{
    return (state->displacement > setting(state, SPRING_DISPLACEMENT_MAX)) -
           (state->displacement < setting(state, SPRING_DISPLACEMENT_MIN));
}

double fmu_range(const State *state)
{
    return setting(state, SPRING_DISPLACEMENT_MAX) - setting(state, SPRING_DISPLACEMENT_MIN);
}

void fmu_begin(Instance *instance, int mode)
{
    State start = {.mode = mode, .stop_time = INFINITY, .displacement = fmu_variables[SPRING_DISPLACEMENT].start};
    for (unsigned i = 0; i < SPRING_PARAMETERS; i++)
        start.settings[i] = fmu_variables[SPRING_FIRST_PARAMETER + i].start;
    start.memory = spring_rest(start.displacement, setting(&start, SPRING_OMEGA_START));
    start.watch = fmu_watch_from(start.time, start.displacement);
    fmu_restore(instance, &start);
}

void fmu_restore(Instance *instance, const State *state)
{
    if (memcmp(instance->state.settings, state->settings, sizeof state->settings) != 0)
        instance->has_law = 0;
    instance->has_reached = 0;
    instance->state = *state;
}

/* Makes the law of the present parameters, or says why they are no possible spring. */
static fmi2Status require_law(Instance *instance)
{
    char problem[256];
    double omega_start = setting(&instance->state, SPRING_OMEGA_START);
    if (instance->has_law)
        return fmi2OK;
    if (!(fabs(omega_start) <= 1.0))
        return fmu_refuse(&instance->log, "`omega_start` must be within [-1, 1], got %s.",
                          spring_number(omega_start).text);
    SpringParameters parameters = fmu_spring_parameters(instance->state.settings);
    if (spring_problem(&parameters, problem, sizeof problem))
        return fmu_refuse(&instance->log, "%s", problem);
    spring_prepare(&instance->law, &parameters);
    instance->has_law = 1;
    return fmi2OK;
}

fmi2Status fmu_reach(Instance *instance)
{
    const State *state = &instance->state;
    if (instance->has_reached)
        return fmi2OK;
    if (require_law(instance) != fmi2OK)
        return fmi2Error;
    instance->reached = state->mode & INITIALIZATION
                            ? spring_rest(state->displacement, setting(state, SPRING_OMEGA_START))
                            : spring_advance(&instance->law, &state->memory, state->displacement);
    instance->has_reached = 1;
    return fmi2OK;
}

SpringSensitivity fmu_reached_sensitivity(const Instance *instance)
{
    const State *state = &instance->state;
    return spring_advance_sensitivity(&instance->law, &state->memory, &state->sensitivity, &instance->reached);
}

fmi2Status fmu_read(Instance *instance, unsigned reference, double *value)
{
    State *state = &instance->state;
    if (reference >= SPRING_FIRST_PARAMETER)
        *value = setting(state, reference);
    else if (reference == SPRING_DISPLACEMENT)
        *value = state->displacement;
    else if (fmu_reach(instance) != fmi2OK)
        return fmi2Error;
    else if (reference == SPRING_FORCE)
        *value = spring_force(&instance->law, &instance->reached);
    else if (reference == SPRING_STIFFNESS)
        *value = spring_stiffness(&instance->law, &instance->reached);
    else if (reference == SPRING_OMEGA)
        *value = instance->reached.omega;
    else {
        state->energy_wanted = 1;
        instance->reached = spring_settle(&instance->law, &instance->reached);
        *value = instance->reached.energy;
    }
    return fmi2OK;
}

void fmu_write(Instance *instance, unsigned reference, double value)
{
    State *state = &instance->state;
    instance->has_reached = 0;
    if (reference == SPRING_DISPLACEMENT) {
        state->displacement = value;
    } else {
        state->settings[reference - SPRING_FIRST_PARAMETER] = value;
        instance->has_law = 0;
    }
}

int fmu_extrapolating(const Instance *instance)
{
    const State *state = &instance->state;
    return state->mode & ME_CONTINUOUS_TIME ? state->extrapolating : side(state) != 0;
}

static void warn_of_excursion(const Instance *instance)
{
    const State *state = &instance->state;
    SpringNumber low = spring_number(setting(state, SPRING_DISPLACEMENT_MIN));
    SpringNumber high = spring_number(setting(state, SPRING_DISPLACEMENT_MAX));
    fmu_warn(&instance->log,
             "`displacement` %s m lies outside the identified range [%s, %s] m: the force is extrapolated until it "
             "comes back.",
             spring_number(state->displacement).text, low.text, high.text);
}

/* Makes what has been reached part of the path. */
static void commit(Instance *instance)
{
    State *state = &instance->state;
    int at = side(state);
    if (state->energy_wanted)
        instance->reached = spring_settle(&instance->law, &instance->reached);
    if (at != state->side) {
        if (at != 0)
            warn_of_excursion(instance);
        state->side = at;
    }
    if (instance->reached.direction != state->memory.direction)
        state->sensitivity = fmu_reached_sensitivity(instance);
    state->memory = instance->reached;
}

/* Goes straight on to a displacement. */
static void commit_at(Instance *instance, double displacement)
{
    instance->state.displacement = displacement;
    instance->has_reached = 0;
    fmu_reach(instance);
    commit(instance);
}

fmi2Status fmu_end_initialization(Instance *instance)
{
    State *state = &instance->state;
    if (fmu_reach(instance) != fmi2OK)
        return fmi2Error;
    commit(instance);
    state->watch = fmu_watch_from(state->time, state->displacement);
    state->mode = state->mode & MODEL_EXCHANGE ? ME_EVENT : CS_STEP;
    return fmi2OK;
}

void fmu_accept(Instance *instance)
{
    State *state = &instance->state;
    fmu_reach(instance);
    commit(instance);
    fmu_watch_accept(&state->watch, state->time, state->displacement, fmu_range(state));
}

/* Commits the path x(s) = x + v*s + a*s^2/2 for 0 <= s <= size, which begins at the displacement set last. */
static fmi2Status commit_parabola(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    double x = state->displacement, v = state->velocity, a = state->acceleration;
    double end = x + size * (v + 0.5 * a * size);
    double turn = a == 0.0 ? 0.0 : -v / a;
    double vertex = 0.0 < turn && turn < size ? x + 0.5 * v * turn : x;
    if (!isfinite(end) || !isfinite(vertex))
        return fmu_refuse(&instance->log,
                          "The derivatives %s m/s and %s m/s^2 of `displacement` must keep it finite [m] in the step "
                          "at time %s s.",
                          spring_number(v).text, spring_number(a).text, spring_number(time).text);
    commit_at(instance, x);
    commit_at(instance, vertex);
    commit_at(instance, end);
    state->rate = v + a * size;
    return fmi2OK;
}

/* Commits the straight path to the displacement set last. */
static void commit_line(Instance *instance, double size)
{
    State *state = &instance->state;
    fmu_reach(instance);
    if (size > 0.0)
        state->rate = (state->displacement - state->memory.displacement) / size;
    commit(instance);
}

fmi2Status fmu_step(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    double end = time + size;
    if (!isfinite(time))
        return fmu_refuse(&instance->log, "The time of a step must be finite [s], got %s.", spring_number(time).text);
    if (!(isfinite(size) && size >= 0.0 && isfinite(end)))
        return fmu_refuse(&instance->log, "The step size at time %s s must be finite and >= 0 [s], got %s.",
                          spring_number(time).text, spring_number(size).text);
    if (end > state->stop_time + ROUNDING * fmax(fabs(end), fabs(state->stop_time)))
        return fmu_refuse(&instance->log, "The step of %s s at time %s s must not go beyond the stop time %s s.",
                          spring_number(size).text, spring_number(time).text, spring_number(state->stop_time).text);
    if (!state->interpolated)
        commit_line(instance, size);
    else if (commit_parabola(instance, time, size) != fmi2OK)
        return fmi2Error;
    state->time = end;
    state->velocity = state->acceleration = 0.0;
    state->interpolated = 0;
    return fmi2OK;
}
