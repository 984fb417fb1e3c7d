#include "fmi2_instance.h"

#include "fmi2_block.h"
#include "numerics.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Where the displacement set last lies: -1 below the identified range, +1 above it, 0 inside. */
static int side(const State *state)
{
    const SpringParameters *spring = &state->settings.spring;
    return (state->displacement > spring->displacement_max) - (state->displacement < spring->displacement_min);
}

double fmu_range(const State *state)
{
    return state->settings.spring.displacement_max - state->settings.spring.displacement_min;
}

void fmu_begin(Instance *instance, int mode)
{
    instance->velocity_watch = (VelocityWatch){.warned = 0};
    State start = {
        .mode = mode,
        .stop_time = INFINITY,
        .settings = fmu_start_settings(),
    };
    instance->variables = fmu_variables(&start.settings);
    instance->has_states = start.settings.has_states != 0;
    start.memory = spring_start(start.displacement, start.settings.omega_start);
    start.watch = fmu_watch_from(start.time, start.displacement);
    fmu_restore(instance, &start);
}

void fmu_restore(Instance *instance, const State *state)
{
    if (memcmp(&instance->state.settings, &state->settings, sizeof state->settings) != 0)
        instance->law = NULL;
    instance->has_trial = 0;
    instance->velocity_watch.begun = 0;
    instance->state = *state;
}

/* Prepares the law of some parameters. */
static fmi2Status make_law(Instance *instance, const Settings *settings)
{
    char problem[256];
    if (!(fabs(settings->omega_start) <= 1.0))
        return FMU_REFUSE(&instance->log, "`omega_start` must be within [-1, 1], got %s.",
                          spring_number(settings->omega_start).text);
    if (spring_problem(&settings->spring, problem, sizeof problem))
        return FMU_REFUSE(&instance->log, "%s", problem);
    if (settings->has_states) {
        spring_prepare(&instance->own_law, &settings->spring, NULL);
        instance->law = &instance->own_law;
        return fmi2OK;
    }
    /* Acquired before the old one is released, which is often the same. */
    const SharedSpring *shared = fmu_acquire(&settings->spring);
    if (shared == NULL)
        return FMU_REFUSE(&instance->log, "There is not enough memory for the table of this spring.");
    fmu_release(instance->shared);
    instance->shared = shared;
    instance->law = &shared->law;
    if (memcmp(&shared->law.parameters, &settings->spring, sizeof settings->spring) != 0) {
        spring_prepare(&instance->own_law, &settings->spring, &shared->table);
        instance->law = &instance->own_law;
    }
    return fmi2OK;
}

/* Prepares the law of the present parameters, unless it is there. */
static fmi2Status require_law(Instance *instance)
{
    return instance->law != NULL ? fmi2OK : make_law(instance, &instance->state.settings);
}

/* Computes the response to the displacement set last. */
static const SpringMemory *make_trial(Instance *instance)
{
    const State *state = &instance->state;
    if (require_law(instance) != fmi2OK)
        return NULL;
    if (instance->has_states)
        instance->trial = state->memory;
    else if (state->mode & INITIALIZATION)
        instance->trial = spring_start(state->displacement, state->settings.omega_start);
    else
        instance->trial = spring_trial(instance->law, &state->memory, state->displacement);
    instance->has_trial = 1;
    return &instance->trial;
}

const SpringMemory *fmu_reach(Instance *instance)
{
    const State *state = &instance->state;
    int committed = instance->law != NULL && !(state->mode & INITIALIZATION) &&
                    state->displacement == state->memory.displacement;
    return instance->has_trial ? &instance->trial : committed ? &state->memory : make_trial(instance);
}

SpringSensitivity fmu_sensitivity(const Instance *instance, const SpringMemory *reached)
{
    const State *state = &instance->state;
    return spring_trial_sensitivity(instance->law, &state->memory, &state->sensitivity, reached);
}

static double output(Instance *instance, const SpringMemory *reached, unsigned reference)
{
    switch (reference) {
    case SPRING_FORCE: return spring_force(instance->law, reached);
    case SPRING_STIFFNESS: return spring_stiffness(instance->law, reached);
    case SPRING_OMEGA: return reached->omega;
    case SPRING_ABSORBED_ENERGY:
        instance->state.energy_wanted = 1;
        /* A trial is integrated once; the committed memory by steps only, or reading it would change their last bits. */
        if (instance->has_trial)
            spring_integrate(instance->law, &instance->trial);
        return spring_absorbed_energy(instance->law, reached);
    default:
        return instance->state.velocity * (reference == fmu_first_own(&instance->state.settings) + OWN_POWER
                                               ? spring_force(instance->law, reached)
                                               : spring_omega_slope(instance->law, reached).value);
    }
}

/* Where a value is kept that the host may give. */
static double *given(State *state, unsigned reference)
{
    switch (reference) {
    case SPRING_DISPLACEMENT: return &state->displacement;
    case SPRING_OMEGA: return &state->memory.omega;
    case SPRING_ABSORBED_ENERGY: return &state->memory.energy;
    default:
        return fmu_causality(&state->settings, reference) == VARIABLE_INPUT ? &state->velocity
                                                                            : fmu_setting(&state->settings, reference);
    }
}

fmi2Status fmu_read(Instance *instance, const fmi2ValueReference references[], size_t count, double values[])
{
    State *state = &instance->state;
    for (size_t i = 0; i < count; i++) {
        if (references[i] == SPRING_DISPLACEMENT) {
            values[i] = state->displacement;
        } else if (references[i] >= SPRING_FIRST_PARAMETER && !fmu_is_rate(&state->settings, references[i])) {
            values[i] = *given(state, references[i]);
        } else {
            const SpringMemory *reached = fmu_reach(instance);
            if (reached == NULL)
                return fmi2Error;
            values[i] = output(instance, reached, references[i]);
        }
    }
    return fmi2OK;
}

/* Changes parameters of a path that has begun. */
static fmi2Status change_parameters(Instance *instance, const Settings *settings)
{
    State *state = &instance->state;
    if (memcmp(settings, &state->settings, sizeof *settings) == 0)
        return fmi2OK;
    if (settings->has_states) {
        if (make_law(instance, settings) != fmi2OK)
            return fmi2Error;
        state->settings = *settings;
        return fmi2OK;
    }
    if (require_law(instance) != fmi2OK)
        return fmi2Error;
    /* The table of the old law must last until it has been left. */
    SpringLaw before = *instance->law;
    const SharedSpring *shared = fmu_acquire(&before.parameters);
    if (shared == NULL)
        return FMU_REFUSE(&instance->log, "There is not enough memory for the table of this spring.");
    fmi2Status status = make_law(instance, settings);
    if (status == fmi2OK) {
        spring_change(&before, instance->law, &state->memory, &state->sensitivity);
        state->settings = *settings;
    }
    fmu_release(shared);
    return status;
}

/* Writes values other than the displacement: all of them, or none. */
static fmi2Status write_others(
    Instance *instance, const fmi2ValueReference references[], size_t count, const double values[])
{
    State *state = &instance->state;
    Settings settings = state->settings;
    for (size_t i = 0; i < count; i++)
        if (fmu_causality(&settings, references[i]) == VARIABLE_PARAMETER)
            *fmu_setting(&settings, references[i]) = values[i];
    if (!(state->mode & INITIALIZED)) {
        state->settings = settings;
        instance->law = NULL;
    } else if (change_parameters(instance, &settings) != fmi2OK) {
        return fmi2Error;
    }
    for (size_t i = 0; i < count; i++)
        if (references[i] != SPRING_DISPLACEMENT)
            *given(state, references[i]) = values[i];
    return fmi2OK;
}

/* Makes the memory that of the inputs and the states. */
static void remember_states(State *state)
{
    SpringMemory memory = spring_start(state->displacement, state->memory.omega);
    memory.energy = state->memory.energy;
    memory.direction = (state->velocity > 0.0) - (state->velocity < 0.0);
    state->memory = memory;
}

fmi2Status fmu_write(Instance *instance, const fmi2ValueReference references[], size_t count, const double values[])
{
    State *state = &instance->state;
    double displacement = state->displacement;
    size_t i = 0;
    while (i < count && references[i] == SPRING_DISPLACEMENT)
        displacement = values[i++];
    if (i < count && write_others(instance, references + i, count - i, values + i) != fmi2OK)
        return fmi2Error;
    for (; i < count; i++)
        if (references[i] == SPRING_DISPLACEMENT)
            displacement = values[i];
    state->displacement = displacement;
    instance->has_trial = 0;
    if (instance->has_states)
        remember_states(state);
    return fmi2OK;
}

int fmu_extrapolating(const Instance *instance)
{
    const State *state = &instance->state;
    return state->mode & ME_CONTINUOUS_TIME ? state->extrapolating : side(state) != 0;
}

static void warn_of_excursion(const Instance *instance)
{
    const State *state = &instance->state;
    SpringNumber low = spring_number(state->settings.spring.displacement_min);
    SpringNumber high = spring_number(state->settings.spring.displacement_max);
    fmu_report(&instance->log, fmi2Warning,
               "`displacement` %s m lies outside the identified range [%s, %s] m: the force is extrapolated until it "
               "comes back.",
               spring_number(state->displacement).text, low.text, high.text);
}

/* Makes the way to the displacement set last part of the path; the law must be present. */
static void commit(Instance *instance)
{
    State *state = &instance->state;
    int at = side(state);
    if (instance->has_trial) {
        state->sensitivity = fmu_sensitivity(instance, &instance->trial);
        state->memory = instance->trial;
        instance->has_trial = 0;
    } else {
        spring_commit(instance->law, &state->memory, &state->sensitivity, state->displacement);
    }
    if (state->energy_wanted)
        spring_integrate(instance->law, &state->memory);
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
    if (!(fabs(state->memory.omega) <= 1.0))
        return FMU_REFUSE(&instance->log, "`omega` must begin within [-1, 1], got %s.",
                          spring_number(state->memory.omega).text);
    commit(instance);
    state->watch = fmu_watch_from(state->time, state->displacement);
    state->mode = state->mode & MODEL_EXCHANGE ? ME_EVENT : CS_STEP;
    return fmi2OK;
}

static void watch_velocity(Instance *instance, int jumped)
{
    const State *state = &instance->state;
    VelocityWatch *watch = &instance->velocity_watch;
    if (jumped)
        fmu_velocity_from(watch, state->time, state->displacement, state->velocity);
    else if (fmu_velocity_accept(watch, state->time, state->displacement, state->velocity, fmu_range(state)))
        fmu_report(&instance->log, fmi2Warning,
                   "`velocity` must be the rate of `displacement`, but up to time %s s their steps differ by %.0f %%: "
                   "omega and the force are wrong. Connect `velocity`, or take the FMU for co-simulation, which needs none.",
                   spring_number(state->time).text, 100.0 * watch->difference / watch->distance);
}

fmi2Status fmu_accept(Instance *instance, int jumped)
{
    State *state = &instance->state;
    if (require_law(instance) != fmi2OK)
        return fmi2Error;
    commit(instance);
    if (instance->has_states)
        watch_velocity(instance, jumped);
    else
        fmu_watch_accept(&state->watch, state->time, state->displacement, fmu_range(state));
    return fmi2OK;
}

/* Commits the path x(s) = x + v*s + a*s^2/2 for 0 <= s <= size, which begins at the displacement set last. */
static fmi2Status commit_parabola(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    double x = state->displacement, v = state->velocity, a = state->acceleration;
    /* In this order, since half of the least numbers is 0. */
    double end = x + size * (v + 0.5 * size * a);
    double turn = a == 0.0 ? 0.0 : -v / a;
    double vertex = 0.0 < turn && turn < size ? x + 0.5 * v * turn : x;
    double rate = v + a * size;
    if (!(fabs(end) <= LARGEST_DISPLACEMENT && fabs(vertex) <= LARGEST_DISPLACEMENT && fabs(rate) <= LARGEST_VELOCITY))
        return FMU_REFUSE(&instance->log,
                          "The derivatives %s m/s and %s m/s^2 of `displacement` must keep it within +-%g m, and its rate "
                          "within +-%g m/s, in the step at time %s s.",
                          spring_number(v).text, spring_number(a).text, LARGEST_DISPLACEMENT, LARGEST_VELOCITY,
                          spring_number(time).text);
    commit_at(instance, x);
    commit_at(instance, vertex);
    commit_at(instance, end);
    state->rate = rate;
    return fmi2OK;
}

/* Commits the straight path to the displacement set last. */
static void commit_line(Instance *instance, double size)
{
    State *state = &instance->state;
    if (size > 0.0)
        state->rate = clip((state->displacement - state->memory.displacement) / size, -DBL_MAX, DBL_MAX);
    commit(instance);
}

fmi2Status fmu_step(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    if (require_law(instance) != fmi2OK)
        return fmi2Error;
    if (!state->interpolated)
        commit_line(instance, size);
    else if (commit_parabola(instance, time, size) != fmi2OK)
        return fmi2Error;
    state->time = time + size;
    state->velocity = state->acceleration = 0.0;
    state->interpolated = 0;
    return fmi2OK;
}
