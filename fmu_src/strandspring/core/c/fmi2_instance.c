#include "fmi2_instance.h"

#include <float.h>
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
    instance->has_trial = 0;
    instance->state = *state;
}

/* Makes the law of the present parameters, or says why they are no possible spring. */
static fmi2Status make_law(Instance *instance)
{
    char problem[256];
    double omega_start = setting(&instance->state, SPRING_OMEGA_START);
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

/* Computes the response to the displacement set last. */
static const SpringMemory *make_trial(Instance *instance)
{
    const State *state = &instance->state;
    if (!instance->has_law && make_law(instance) != fmi2OK)
        return NULL;
    if (state->mode & INITIALIZATION) {
        instance->trial = spring_rest(state->displacement, setting(state, SPRING_OMEGA_START));
    } else {
        instance->trial = state->memory;
        spring_move(&instance->law, &instance->trial, NULL, state->displacement);
    }
    instance->has_trial = 1;
    return &instance->trial;
}

const SpringMemory *fmu_reach(Instance *instance)
{
    const State *state = &instance->state;
    int committed = instance->has_law && !(state->mode & INITIALIZATION) &&
                    state->displacement == state->memory.displacement;
    return instance->has_trial ? &instance->trial : committed ? &state->memory : make_trial(instance);
}

SpringSensitivity fmu_sensitivity(const Instance *instance, const SpringMemory *reached)
{
    const State *state = &instance->state;
    return spring_advance_sensitivity(&instance->law, &state->memory, &state->sensitivity, reached);
}

static double output(Instance *instance, const SpringMemory *reached, unsigned reference)
{
    switch (reference) {
    case SPRING_FORCE: return spring_force(&instance->law, reached);
    case SPRING_STIFFNESS: return spring_stiffness(&instance->law, reached);
    case SPRING_OMEGA: return reached->omega;
    default:
        instance->state.energy_wanted = 1;
        /* A trial is settled once; the committed memory only by steps, or reading it would change their last bits. */
        if (instance->has_trial)
            instance->trial = spring_settle(&instance->law, reached);
        return spring_absorbed_energy(&instance->law, reached);
    }
}

fmi2Status fmu_read(Instance *instance, const fmi2ValueReference references[], size_t count, double values[])
{
    const State *state = &instance->state;
    for (size_t i = 0; i < count; i++) {
        if (references[i] == SPRING_DISPLACEMENT) {
            values[i] = state->displacement;
        } else if (references[i] >= SPRING_FIRST_PARAMETER) {
            values[i] = setting(state, references[i]);
        } else {
            const SpringMemory *reached = fmu_reach(instance);
            if (reached == NULL)
                return fmi2Error;
            values[i] = output(instance, reached, references[i]);
        }
    }
    return fmi2OK;
}

void fmu_write(Instance *instance, const fmi2ValueReference references[], size_t count, const double values[])
{
    State *state = &instance->state;
    instance->has_trial = 0;
    for (size_t i = 0; i < count; i++) {
        if (references[i] == SPRING_DISPLACEMENT) {
            state->displacement = values[i];
        } else {
            state->settings[references[i] - SPRING_FIRST_PARAMETER] = values[i];
            instance->has_law = 0;
        }
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

/* Makes the way to the displacement set last part of the path. */
static void commit(Instance *instance)
{
    State *state = &instance->state;
    int at = side(state);
    if (!instance->has_law)
        make_law(instance); /* possible, as it was in the state that has been restored */
    if (instance->has_trial) {
        state->sensitivity = fmu_sensitivity(instance, &instance->trial);
        state->memory = instance->trial;
        instance->has_trial = 0;
    } else {
        spring_move(&instance->law, &state->memory, &state->sensitivity, state->displacement);
    }
    if (state->energy_wanted)
        state->memory = spring_settle(&instance->law, &state->memory);
    if (at != state->side) {
        if (at != 0)
            warn_of_excursion(instance);
        state->side = at;
    }
}

/* Goes straight on to a displacement. */
static void commit_at(Instance *instance, double displacement)
{
    instance->state.displacement = displacement;
    instance->has_trial = 0;
    commit(instance);
}

fmi2Status fmu_end_initialization(Instance *instance)
{
    State *state = &instance->state;
    if (fmu_reach(instance) == NULL)
        return fmi2Error;
    commit(instance);
    state->watch = fmu_watch_from(state->time, state->displacement);
    state->mode = state->mode & MODEL_EXCHANGE ? ME_EVENT : CS_STEP;
    return fmi2OK;
}

void fmu_accept(Instance *instance)
{
    State *state = &instance->state;
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
    if (size > 0.0)
        state->rate = (state->displacement - state->memory.displacement) / size;
    commit(instance);
}

fmi2Status fmu_step(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    double end = time + size;
    if (!(fabs(time) <= DBL_MAX))
        return fmu_refuse(&instance->log, "The time of a step must be finite [s], got %s.", spring_number(time).text);
    if (!(size >= 0.0 && end <= DBL_MAX))
        return fmu_refuse(&instance->log, "The step size at time %s s must be finite and >= 0 [s], got %s.",
                          spring_number(time).text, spring_number(size).text);
    if (end > state->stop_time && end > state->stop_time + ROUNDING * fmax(fabs(end), fabs(state->stop_time)))
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
