#include "fmu_instance.h"

#include "../spring/numerics.h"
#include "../spring/spring_number.h"
#include "../spring/spring_problem.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
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

/* The table of some parameters: the one that instances share, or one in the memory of this one. */
static const SpringTable *table_of(HeldLaw *held, const SpringParameters *parameters)
{
    if (held->shared != NULL && fmu_fits(&held->shared->table, parameters))
        return &held->shared->table;
    if (!fmu_fits(&held->own->table, parameters))
        fmu_tabulate(&held->own->table, parameters);
    return &held->own->table;
}

/* Prepares the law of one mechanism. */
static void take_law(HeldLaw *held, const SpringParameters *parameters, int has_path)
{
    const SpringTable *table = has_path ? table_of(held, parameters) : NULL;
    const SharedSpring *shared = held->shared;
    if (shared != NULL && memcmp(&shared->law.parameters, parameters, sizeof *parameters) == 0) {
        held->law = &shared->law;
    } else {
        spring_prepare(&held->own->law, parameters, table);
        held->law = &held->own->law;
    }
}

/* What a mechanism needs as long as it lives: nothing is allocated later. Returns 0 if memory is missing. */
static int hold(HeldLaw *held, const SpringParameters *start, int has_path)
{
    char problem[256];
    held->own = fmu_unused_table();
    if (held->own == NULL || !has_path || spring_problem(start, problem, sizeof problem))
        return held->own != NULL;
    held->shared = fmu_acquire(start);
    return held->shared != NULL;
}

Instance *fmu_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, int mode)
{
    Settings start = fmu_start_settings();
    if (mode == CS_INSTANTIATED && start.has_states)
        return FMU_REFUSE_POINTER(
            log, "This form of the FMU has continuous states and no solver; instantiate it for model exchange.");
    if (mode == ME_INSTANTIATED && start.added.branches && !start.has_states)
        return FMU_REFUSE_POINTER(
            log, "This FMU has Maxwell branches and is for co-simulation; build its form with states for model exchange.");
    Instance *instance = fmu_new_instance(log, name, guid, guid_name, memory, sizeof *instance);
    if (instance == NULL)
        return NULL;
    instance->log = *log;
    instance->memory = *memory;
    SpringParameters second = spring_second(&start.spring, &start.added);
    if (!hold(&instance->first, &start.spring, !start.has_states) ||
        (start.added.mechanisms && !hold(&instance->second, &second, !start.has_states))) {
        (void)FMU_REFUSE(log, "There is not enough memory for the tables of this spring.");
        fmu_free(instance);
        return NULL;
    }
    fmu_begin(instance, mode);
    return instance;
}

void fmu_free(Instance *instance)
{
    if (instance == NULL)
        return;
    Memory memory = instance->memory;
    fmu_release(instance->first.shared);
    fmu_release(instance->second.shared);
    free(instance->first.own);
    free(instance->second.own);
    fmu_free_instance(instance, &memory);
}

void fmu_begin(Instance *instance, int mode)
{
    instance->velocity_watch = (VelocityWatch){.warned = 0};
    State start = {
        .mode = mode,
        .stop_time = HUGE_VAL,
        .settings = fmu_start_settings(),
    };
    instance->variables = fmu_variables();
    instance->has_states = start.settings.has_states != 0;
    instance->has_added = fmu_has_added(&start.settings);
    start.memory = spring_start(start.displacement, start.settings.omega_start);
    start.added = spring_added_start(start.displacement, start.settings.second_omega_start);
    start.watch = fmu_watch_from(start.time, start.displacement);
    fmu_restore(instance, &start);
}

void fmu_restore(Instance *instance, const State *state)
{
    if (memcmp(&instance->state.settings, &state->settings, sizeof state->settings) != 0)
        instance->first.law = NULL;
    instance->has_trial = 0;
    instance->velocity_watch.begun = 0;
    instance->state = *state;
}

/* Whether some parameters are a spring. */
SPRING_COLD FmuStatus require_spring(const Instance *instance, const Settings *settings)
{
    char problem[256];
    if (!(fabs(settings->omega_start) <= 1.0))
        return FMU_REFUSE(&instance->log, "`omega_start` must be within [-1, 1], got %s.",
                          spring_number(settings->omega_start).text);
    if (!fmu_is_resolution(settings->input_resolution))
        return FMU_REFUSE(&instance->log, "`input_resolution` must be within [0, %g] m, got %s.", LARGEST_DISPLACEMENT,
                          spring_number(settings->input_resolution).text);
    if (spring_problem(&settings->spring, problem, sizeof problem) ||
        (instance->has_added && fmu_added_problem(settings, problem, sizeof problem)))
        return FMU_REFUSE(&instance->log, "%s", problem);
    return FMU_OK;
}

/* Prepares the laws of parameters that are a spring. */
SPRING_COLD void make_laws(Instance *instance, const Settings *settings)
{
    instance->duration = -1.0; /* of no decays yet */
    take_law(&instance->first, &settings->spring, !settings->has_states);
    if (instance->second.own != NULL) {
        SpringParameters second = spring_second(&settings->spring, &settings->added);
        take_law(&instance->second, &second, !settings->has_states);
    }
}

FmuStatus fmu_require_law(Instance *instance)
{
    if (instance->first.law != NULL)
        return FMU_OK;
    FmuStatus status = require_spring(instance, &instance->state.settings);
    if (status == FMU_OK)
        make_laws(instance, &instance->state.settings);
    return status;
}

static int is_resolved(const State *state)
{
    return state->settings.input_resolution > 0.0;
}

/* Where friction goes with the displacement set last, where it is not always that. */
SPRING_COLD double followed(const State *state)
{
    SpringResolver resolver = state->resolver;
    return spring_resolve(&resolver, state->displacement, state->settings.input_resolution);
}

/* Where the path ends. */
static double path_end(const State *state)
{
    return is_resolved(state) ? state->resolver.displacement : state->memory.displacement;
}

/* Branches follow the displacement itself: their way as one that ends where friction does. */
static double start_of_way(const State *state, double end)
{
    return path_end(state) + (end - state->displacement);
}

/* What a trial makes of a second mechanism and of branches: time stands still, so that branches follow as springs. */
SPRING_COLD void make_added_trial(Instance *instance)
{
    const State *state = &instance->state;
    if (instance->has_states) {
        instance->added_trial = state->added;
    } else if (state->mode & (INSTANTIATED | INITIALIZATION)) {
        instance->added_trial = spring_added_start(state->displacement, state->settings.second_omega_start);
    } else {
        instance->added_trial = state->added;
        const SpringDecay jump = {1.0, 1.0, 0.5}, jumps[SPRING_MAXWELLS] = {jump, jump, jump};
        /* A jump leaves the derivatives of elongations, and those of omega are made where they are asked for. */
        double end = instance->trial.displacement;
        spring_added_commit(&state->settings.added, instance->second.law, &instance->added_trial, 0,
                            start_of_way(state, end), end, 0.0, jumps);
    }
}

/* The trial at the displacement set last, where the friction is not, with omega and energy as they are there. */
SPRING_COLD void show_trial(Instance *instance)
{
    const State *state = &instance->state;
    SpringMemory *second = &instance->added_trial.second;
    instance->shown = instance->trial;
    instance->shown.displacement = state->displacement;
    if (instance->second.law == NULL)
        return;
    spring_integrate(instance->second.law, second);
    second->displacement = second->energy_at = state->displacement;
}

static const SpringMemory *trial_of(const Instance *instance)
{
    return is_resolved(&instance->state) ? &instance->shown : &instance->trial;
}

/* Computes the response to the displacement set last. */
SPRING_APART const SpringMemory *make_trial(Instance *instance)
{
    const State *state = &instance->state;
    if (fmu_require_law(instance) != FMU_OK)
        return NULL;
    if (instance->has_states)
        instance->trial = state->memory;
    else if (state->mode & (INSTANTIATED | INITIALIZATION))
        instance->trial = spring_start(state->displacement, state->settings.omega_start);
    else
        instance->trial = spring_trial(instance->first.law, &state->memory,
                                       is_resolved(state) ? followed(state) : state->displacement);
    if (instance->has_added)
        make_added_trial(instance);
    if (is_resolved(state))
        show_trial(instance);
    instance->has_trial = 1;
    return trial_of(instance);
}

const SpringMemory *fmu_reach(Instance *instance)
{
    const State *state = &instance->state;
    int committed = instance->first.law != NULL && !(state->mode & (INSTANTIATED | INITIALIZATION)) &&
                    state->displacement == state->memory.displacement && !is_resolved(state);
    return instance->has_trial ? trial_of(instance) : committed ? &state->memory : make_trial(instance);
}

SpringSensitivity fmu_sensitivity(const Instance *instance, const SpringMemory *reached)
{
    const State *state = &instance->state;
    return spring_trial_sensitivity(instance->first.law, &state->memory, &state->sensitivity, reached);
}

/* Force, stiffness or energy with what a second mechanism and branches add to it: apart, so that springs without them
 * do not pay for these. */
SPRING_NOINLINE static double with_added(
    const Instance *instance, const SpringMemory *reached, unsigned reference, double of_first)
{
    const SpringAdded *added = &instance->state.settings.added;
    const SpringAddedMemory *memory = fmu_added_at(instance, reached);
    const SpringLaw *second = instance->second.law;
    return of_first + (reference == SPRING_FORCE       ? spring_added_force(added, second, memory)
                       : reference == SPRING_STIFFNESS ? spring_added_stiffness(added, second, memory)
                                                       : spring_added_energy(added, second, memory));
}

static double absorbed_energy(Instance *instance, const SpringMemory *reached)
{
    instance->state.energy_wanted = 1;
    /* A trial is integrated once; the committed memory by steps only, or reading it would change their last bits. */
    if (instance->has_trial)
        spring_integrate(instance->first.law, &instance->trial);
    double energy = spring_absorbed_energy(instance->first.law, instance->has_trial ? &instance->trial : reached);
    /* The form with states keeps the sum in the first memory. */
    return instance->has_added && !instance->has_states ? with_added(instance, reached, SPRING_ABSORBED_ENERGY, energy)
                                                        : energy;
}

/* The value of what is calculated of a second mechanism or a branch. */
SPRING_COLD double added_output(const Instance *instance, const SpringMemory *reached, unsigned reference)
{
    const SpringAdded *added = &instance->state.settings.added;
    const SpringAddedMemory *memory = fmu_added_at(instance, reached);
    SpringVariable variable = fmu_variable(reference);
    switch ((SpringKind)variable.kind) {
    case SECOND_OMEGA: return memory->second.omega;
    case BRANCH_ELONGATION: return memory->elongation[variable.index];
    case BRANCHES_ENERGY: return spring_added_stored(added, memory);
    case SECOND_OMEGA_RATE:
        return instance->state.velocity * spring_omega_slope(instance->second.law, &memory->second).value;
    default: return instance->state.velocity - memory->elongation[variable.index] / added->time_constant[variable.index];
    }
}

SPRING_APART double output(const Instance *instance, const SpringMemory *reached, unsigned reference)
{
    const SpringLaw *law = instance->first.law;
    SpringKind kind = reference <= SPRING_OMEGA ? (SpringKind)reference : fmu_kind(reference);
    switch (kind) {
    case SPRING_OMEGA: return reached->omega;
    case SPRING_OMEGA_RATE: return instance->state.velocity * spring_omega_slope(law, reached).value;
    case SPRING_STIFFNESS: {
        double stiffness = spring_stiffness(law, reached);
        return instance->has_added ? with_added(instance, reached, SPRING_STIFFNESS, stiffness) : stiffness;
    }
    case SPRING_FORCE:
    case SPRING_POWER: {
        double first = spring_force(law, reached);
        double force = instance->has_added ? with_added(instance, reached, SPRING_FORCE, first) : first;
        return kind == SPRING_FORCE ? force : instance->state.velocity * force;
    }
    default: return added_output(instance, reached, reference);
    }
}

/* The value of a variable from the first parameter on that is set; whether it is one. */
SPRING_NOINLINE static int is_given(State *state, unsigned reference, double *value)
{
    VariableCausality causality = fmu_causality(reference);
    if (causality == VARIABLE_LOCAL)
        return 0;
    SpringVariable variable = fmu_variable(reference);
    *value = causality == VARIABLE_INPUT ? state->velocity : *fmu_setting(&state->settings, &variable);
    return 1;
}

FmuStatus fmu_read(Instance *instance, const unsigned references[], size_t count, double values[])
{
    State *state = &instance->state;
    for (size_t i = 0; i < count; i++) {
        if (references[i] == SPRING_DISPLACEMENT) {
            values[i] = state->displacement;
        } else if (references[i] <= SPRING_OMEGA || !is_given(state, references[i], &values[i])) {
            const SpringMemory *reached = fmu_reach(instance);
            if (reached == NULL)
                return FMU_ERROR;
            values[i] = references[i] == SPRING_ABSORBED_ENERGY ? absorbed_energy(instance, reached)
                                                                : output(instance, reached, references[i]);
        }
    }
    return FMU_OK;
}

/* Takes friction to where the path is. */
SPRING_COLD void catch_up(Instance *instance)
{
    State *state = &instance->state;
    double end = path_end(state);
    spring_commit(instance->first.law, &state->memory, &state->sensitivity, end);
    if (instance->second.law != NULL)
        spring_commit(instance->second.law, &state->added.second, &state->added.sensitivity, end);
    state->resolver = spring_resolver_start(end, state->memory.direction);
}

/* Changes parameters of a path that has begun. */
SPRING_COLD FmuStatus change_parameters(Instance *instance, const Settings *settings)
{
    State *state = &instance->state;
    if (memcmp(settings, &state->settings, sizeof *settings) == 0)
        return FMU_OK;
    if (require_spring(instance, settings) != FMU_OK || fmu_require_law(instance) != FMU_OK)
        return FMU_ERROR;
    int has_path = !settings->has_states, has_second = has_path && instance->second.own != NULL;
    SpringMemory *second = &state->added.second;
    SpringSensitivity *of_second = &state->added.sensitivity;
    SpringParameters next = spring_second(&settings->spring, &settings->added);
    SpringDeparture left = {0}, left_second = {0};
    if (has_path)
        left = spring_leave(instance->first.law, &settings->spring, &state->memory, &state->sensitivity);
    if (has_second)
        left_second = spring_leave(instance->second.law, &next, second, of_second);
    make_laws(instance, settings);
    spring_arrive(instance->first.law, &left, &state->memory, &state->sensitivity);
    if (has_second)
        spring_arrive(instance->second.law, &left_second, second, of_second);
    for (int i = 0; i < settings->added.branches; i++)
        if (has_path && settings->added.time_constant[i] != state->settings.added.time_constant[i])
            state->added.by_log[i] = 0.0; /* counts from here on */
    if (settings->input_resolution != state->settings.input_resolution)
        catch_up(instance);
    state->settings = *settings;
    return FMU_OK;
}

static FmuStatus require_settable(const Instance *instance, const SpringVariable *variable, double value)
{
    const State *state = &instance->state;
    if (variable->causality == VARIABLE_INPUT || variable->is_state)
        return FMU_OK;
    if (variable->causality != VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.", variable->name);
    /* Some hosts, OpenModelica before August 2026 among them, set all parameters to what they are. */
    if (state->mode & (INSTANTIATED | INITIALIZATION) ||
        memcmp(fmu_setting((Settings *)&state->settings, variable), &value, sizeof value) == 0)
        return FMU_OK;
    if (!variable->is_tunable)
        return FMU_REFUSE(
            &instance->log, "`%s` is fixed after initialization; reset the instance to change it.", variable->name);
    if (state->mode & ME_CONTINUOUS_TIME && !instance->has_states)
        return FMU_REFUSE(
            &instance->log, "`%s` can be changed at events only; enter event mode first.", variable->name);
    return FMU_OK;
}

/* Refuses what no input, state or parameter may be. */
static FmuStatus require_value(const Instance *instance, const SpringVariable *variable, double value)
{
    int is_displacement = variable->kind == SPRING_DISPLACEMENT, is_input = variable->causality == VARIABLE_INPUT;
    int is_parameter = variable->causality == VARIABLE_PARAMETER;
    double largest = is_displacement ? LARGEST_DISPLACEMENT : is_input ? LARGEST_VELOCITY : LARGEST_SUM;
    if (is_parameter ? isfinite(value) : fabs(value) <= largest)
        return FMU_OK;
    if (is_parameter)
        return FMU_REFUSE(&instance->log, "`%s` must be finite, got %s; the previous value is kept.", variable->name,
                          spring_number(value).text);
    return FMU_REFUSE(&instance->log, "`%s` must be within +-%g%s, got %s; the previous value is kept.",
                      variable->name, largest, is_displacement ? " m" : is_input ? " m/s" : "",
                      spring_number(value).text);
}

FmuStatus fmu_require_other_change(const Instance *instance, unsigned reference, double value)
{
    SpringVariable variable = fmu_variable(reference);
    FmuStatus status = require_settable(instance, &variable, value);
    return status != FMU_OK ? status : require_value(instance, &variable, value);
}

void fmu_open_changes(Instance *instance)
{
    const State *state = &instance->state;
    Changes *changes = &instance->changes;
    changes->displacement = state->displacement;
    changes->velocity = state->velocity;
    changes->omega = state->memory.omega;
    changes->energy = state->memory.energy;
    changes->has_parameters = changes->has_added = 0;
}

SPRING_NOINLINE static void change_other(Instance *instance, unsigned reference, double value)
{
    Changes *changes = &instance->changes;
    SpringVariable variable = fmu_variable(reference);
    if (variable.causality == VARIABLE_PARAMETER) {
        if (!changes->has_parameters)
            changes->settings = instance->state.settings;
        changes->has_parameters = 1;
        *fmu_setting(&changes->settings, &variable) = value;
    } else if (variable.kind == SECOND_OMEGA || variable.kind == BRANCH_ELONGATION) {
        if (!changes->has_added) {
            changes->second_omega = instance->state.added.second.omega;
            memcpy(changes->elongation, instance->state.added.elongation, sizeof changes->elongation);
        }
        changes->has_added = 1;
        *(variable.kind == SECOND_OMEGA ? &changes->second_omega : &changes->elongation[variable.index]) = value;
    } else {
        *(reference == SPRING_OMEGA             ? &changes->omega
          : reference == SPRING_ABSORBED_ENERGY ? &changes->energy
                                                : &changes->velocity) = value;
    }
}

void fmu_change(Instance *instance, unsigned reference, double value)
{
    if (reference == SPRING_DISPLACEMENT)
        instance->changes.displacement = value;
    else
        change_other(instance, reference, value);
}

/* Makes the memory that of the inputs and the states. */
static void remember_states(Instance *instance)
{
    State *state = &instance->state;
    const Changes *changes = &instance->changes;
    state->velocity = changes->velocity;
    state->memory = spring_start(changes->displacement, changes->omega);
    state->memory.energy = changes->energy;
    state->memory.direction = (changes->velocity > 0.0) - (changes->velocity < 0.0);
    SpringMemory *second = &state->added.second;
    *second = spring_start(changes->displacement, changes->has_added ? changes->second_omega : second->omega);
    second->direction = state->memory.direction;
    if (changes->has_added)
        memcpy(state->added.elongation, changes->elongation, sizeof changes->elongation);
}

FmuStatus fmu_apply_changes(Instance *instance)
{
    State *state = &instance->state;
    const Changes *changes = &instance->changes;
    if (changes->has_parameters && state->mode & INITIALIZED) {
        if (change_parameters(instance, &changes->settings) != FMU_OK)
            return FMU_ERROR;
    } else if (changes->has_parameters) {
        state->settings = changes->settings;
        instance->first.law = NULL;
    }
    state->displacement = changes->displacement;
    instance->has_trial = 0;
    if (instance->has_states)
        remember_states(instance);
    return FMU_OK;
}

int fmu_extrapolating(const Instance *instance)
{
    const State *state = &instance->state;
    return state->mode & ME_CONTINUOUS_TIME ? state->extrapolating : side(state) != 0;
}

SPRING_COLD void warn_of_excursion(const Instance *instance)
{
    const State *state = &instance->state;
    SpringNumber low = spring_number(state->settings.spring.displacement_min);
    SpringNumber high = spring_number(state->settings.spring.displacement_max);
    fmu_report(&instance->log, FMU_WARNING,
               "`displacement` %s m lies outside the identified range [%s, %s] m: the force is extrapolated until it "
               "comes back.",
               spring_number(state->displacement).text, low.text, high.text);
}

SPRING_APART void take_trial(Instance *instance)
{
    State *state = &instance->state;
    state->sensitivity = fmu_sensitivity(instance, &instance->trial);
    state->memory = instance->trial;
    instance->has_trial = 0;
}

/* What is left of the branches' elongations over a duration; most hosts take steps of one size. */
static const SpringDecay *decays_over(Instance *instance, double duration)
{
    const SpringAdded *added = &instance->state.settings.added;
    if (instance->duration != duration)
        for (int i = 0; i < added->branches; i++)
            instance->decays[i] = spring_decay(duration / added->time_constant[i]);
    instance->duration = duration;
    return instance->decays;
}

/* Makes the way to the displacement set last part of the path of a second mechanism and of branches, which take the time
 * that it lasted; before the memory of the first mechanism goes on. */
SPRING_APART void commit_added(Instance *instance, double end, double duration)
{
    State *state = &instance->state;
    const SpringLaw *second = instance->second.law;
    if (instance->has_states)
        return;
    spring_added_commit(&state->settings.added, second, &state->added, 1,
                        start_of_way(state, end), end, duration, decays_over(instance, duration));
    if (state->energy_wanted && second != NULL)
        spring_integrate(second, &state->added.second);
}

/* Makes the way to the displacement set last part of the path, in a duration [s]; the law must be present. */
static void commit(Instance *instance, double duration)
{
    State *state = &instance->state;
    int at = side(state);
    double end = is_resolved(state) ? followed(state) : state->displacement;
    if (instance->has_added)
        commit_added(instance, end, duration);
    if (instance->has_trial)
        take_trial(instance);
    else
        spring_commit(instance->first.law, &state->memory, &state->sensitivity, end);
    if (is_resolved(state))
        spring_resolve(&state->resolver, state->displacement, state->settings.input_resolution);
    if (state->energy_wanted)
        spring_integrate(instance->first.law, &state->memory);
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
    commit(instance, 0.0);
}

FmuStatus fmu_end_initialization(Instance *instance)
{
    State *state = &instance->state;
    if (fmu_reach(instance) == NULL)
        return FMU_ERROR;
    if (!(fabs(state->memory.omega) <= 1.0))
        return FMU_REFUSE(&instance->log, "`omega` must begin within [-1, 1], got %s.",
                          spring_number(state->memory.omega).text);
    if (instance->has_added && !(fabs(state->added.second.omega) <= 1.0))
        return FMU_REFUSE(&instance->log, "`second_omega` must begin within [-1, 1], got %s.",
                          spring_number(state->added.second.omega).text);
    if (instance->has_added && !instance->has_states) {
        /* Where the path begins, which is no jump. */
        state->memory = instance->trial;
        state->added = instance->added_trial;
    }
    state->resolver = spring_resolver_start(state->displacement, 0);
    commit(instance, 0.0);
    state->watch = fmu_watch_from(state->time, state->displacement);
    state->mode = fmu_of_kind(state->mode, ME_EVENT | CS_STEP);
    return FMU_OK;
}

SPRING_COLD void watch_velocity(Instance *instance, int jumped)
{
    const State *state = &instance->state;
    VelocityWatch *watch = &instance->velocity_watch;
    if (jumped)
        fmu_velocity_from(watch, state->time, state->displacement, state->velocity);
    else if (fmu_velocity_accept(watch, state->time, state->displacement, state->velocity, fmu_range(state)))
        fmu_report(&instance->log, FMU_WARNING,
                   "`velocity` must be the rate of `displacement`, but up to time %s s their steps differ by %.0f %%: "
                   "omega and the force are wrong. Connect `velocity`, or take the FMU for co-simulation, which needs "
                   "none.",
                   spring_number(state->time).text, 100.0 * watch->difference / watch->distance);
}

FmuStatus fmu_accept(Instance *instance, int jumped)
{
    State *state = &instance->state;
    if (fmu_require_law(instance) != FMU_OK)
        return FMU_ERROR;
    commit(instance, 0.0);
    if (instance->has_states)
        watch_velocity(instance, jumped);
    else
        fmu_watch_accept(&state->watch, state->time, state->displacement, fmu_range(state));
    return FMU_OK;
}

/* Commits the path x(s) = x + v*s + a*s^2/2 for 0 <= s <= size, which begins at the displacement set last. */
SPRING_COLD FmuStatus commit_parabola(Instance *instance, double time, double size)
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
                          "The derivatives %s m/s and %s m/s^2 of `displacement` must keep it within +-%g m, and its "
                          "rate within +-%g m/s, in the step at time %s s.",
                          spring_number(v).text, spring_number(a).text, LARGEST_DISPLACEMENT, LARGEST_VELOCITY,
                          spring_number(time).text);
    commit_at(instance, x);
    commit_at(instance, vertex);
    commit_at(instance, end);
    state->rate = rate;
    return FMU_OK;
}

/* Commits the straight path to the displacement set last. */
static void commit_line(Instance *instance, double size)
{
    State *state = &instance->state;
    if (size > 0.0)
        state->rate = clip((state->displacement - path_end(state)) / size, -DBL_MAX, DBL_MAX);
    commit(instance, size);
}

FmuStatus fmu_step(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    if (fmu_require_law(instance) != FMU_OK)
        return FMU_ERROR;
    if (!state->interpolated)
        commit_line(instance, size);
    else if (commit_parabola(instance, time, size) != FMU_OK)
        return FMU_ERROR;
    state->time = time + size;
    state->velocity = state->acceleration = 0.0;
    state->interpolated = 0;
    return FMU_OK;
}
