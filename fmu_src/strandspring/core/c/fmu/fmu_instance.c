#include "fmu_instance.h"

#include "fmu_branches.h"
#include "../spring/numerics.h"
#include "../spring/spring_number.h"
#include "../spring/spring_problem.h"

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

/* The table of some parameters. With buffers the present one stays valid, and nothing is allocated. */
static const SharedSpring *acquire(const Instance *instance, HeldLaw *held, const SpringParameters *parameters)
{
    const SharedSpring *present = held->shared;
    if (held->buffers == NULL)
        return fmu_acquire(parameters);
    if (present != NULL && fmu_fits(present, parameters))
        return present;
    SharedSpring *spare = &held->buffers[present == &held->buffers[0] ? 1 : 0];
    fmu_fill(spare, parameters, instance->state.settings.no_energy ? 0 : SPRING_WITH_ENERGIES);
    return spare;
}

static void release(const HeldLaw *held, const SharedSpring *shared)
{
    if (held->buffers == NULL)
        fmu_release(shared);
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
    /* For steps with a deadline, where nothing may be allocated later. */
    size_t seconds = start.added.mechanisms ? 2 : 0;
    size_t buffers = start.real_time ? 2 + seconds : 0;
    Instance *instance =
        fmu_new_instance(log, name, guid, guid_name, memory,
                         sizeof *instance + seconds * sizeof(SpringLaw) + buffers * sizeof(SharedSpring));
    if (instance == NULL)
        return NULL;
    instance->log = *log;
    instance->memory = *memory;
    SpringLaw *laws = (SpringLaw *)(void *)(instance + 1);
    SharedSpring *tables = buffers ? (SharedSpring *)(void *)(laws + seconds) : NULL;
    instance->first = (HeldLaw){.own_laws = instance->own_laws, .buffers = tables};
    if (seconds)
        instance->second = (HeldLaw){.own_laws = laws, .buffers = buffers ? tables + 2 : NULL};
    fmu_begin(instance, mode);
    return instance;
}

void fmu_free(Instance *instance)
{
    if (instance == NULL)
        return;
    Memory memory = instance->memory;
    release(&instance->first, instance->first.shared);
    release(&instance->second, instance->second.shared);
    fmu_free_instance(instance, &memory);
}

void fmu_begin(Instance *instance, int mode)
{
    instance->velocity_watch = (VelocityWatch){.warned = 0};
    State start = {
        .mode = mode,
        .stop_time = INFINITY,
        .settings = fmu_start_settings(),
    };
    /* Steps with a deadline cost the same from the first one on. */
    start.energy_wanted = start.settings.real_time && !start.settings.no_energy;
    instance->variables = fmu_variables(&start.settings);
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

SPRING_COLD FmuStatus refuse_memory(const Instance *instance)
{
    return FMU_REFUSE(&instance->log, "There is not enough memory for the tables of this spring.");
}

/* Prepares the law of one mechanism. */
static FmuStatus take_law(Instance *instance, HeldLaw *held, const SpringParameters *parameters, int has_path)
{
    /* Acquired before the old one is released, which is often the same. */
    const SharedSpring *shared = has_path ? acquire(instance, held, parameters) : NULL;
    if (shared == NULL && has_path)
        return refuse_memory(instance);
    if (shared != NULL && memcmp(&shared->law.parameters, parameters, sizeof *parameters) == 0) {
        held->law = &shared->law;
    } else {
        SpringLaw *law = &held->own_laws[held->law == &held->own_laws[0] ? 1 : 0];
        spring_prepare(law, parameters, shared == NULL ? NULL : &shared->table);
        held->law = law;
    }
    release(held, held->shared);
    held->shared = shared;
    return FMU_OK;
}

SPRING_COLD FmuStatus take_second_law(Instance *instance, const Settings *settings)
{
    SpringParameters second = spring_second(&settings->spring, &settings->added);
    FmuStatus status = take_law(instance, &instance->second, &second, !settings->has_states);
    if (status != FMU_OK)
        instance->first.law = NULL; /* both are made again */
    return status;
}

/* Prepares the laws of some parameters. The present ones stay as they are, but for shared ones that are no longer
 * acquired. */
SPRING_COLD FmuStatus make_law(Instance *instance, const Settings *settings)
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
    instance->duration = -1.0; /* of no decays yet */
    FmuStatus status = take_law(instance, &instance->first, &settings->spring, !settings->has_states);
    return status == FMU_OK && instance->second.own_laws != NULL ? take_second_law(instance, settings) : status;
}

FmuStatus fmu_require_law(Instance *instance)
{
    return instance->first.law != NULL ? FMU_OK : make_law(instance, &instance->state.settings);
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
    if (!state->settings.no_energy)
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
SPRING_COLD double added_output(const Instance *instance, const SpringMemory *reached, AddedVariable variable)
{
    const SpringAdded *added = &instance->state.settings.added;
    const SpringAddedMemory *memory = fmu_added_at(instance, reached);
    switch (variable.kind) {
    case ADDED_OMEGA: return memory->second.omega;
    case ADDED_ELONGATION: return memory->elongation[variable.index];
    case ADDED_STORED_ENERGY: return spring_added_stored(added, memory);
    case ADDED_OMEGA_RATE:
        return instance->state.velocity * spring_omega_slope(instance->second.law, &memory->second).value;
    default: return instance->state.velocity - memory->elongation[variable.index] / added->time_constant[variable.index];
    }
}

/* Whether a variable from the first parameter on is one that is set. */
static int is_given(const Settings *settings, unsigned reference)
{
    AddedVariable added = fmu_added(settings, reference);
    return added.kind == ADDED_NONE ? !fmu_is_rate(settings, reference) : fmu_added_is_parameter(added);
}

/* The rate of a state that every spring has, with the force of all parts. */
static double rate(const Instance *instance, unsigned reference, double force, double of_omega)
{
    return instance->state.velocity *
           (reference == fmu_first_own(&instance->state.settings) + OWN_POWER ? force : of_omega);
}

/* The outputs of a spring with a second mechanism or branches. */
SPRING_NOINLINE static double output_with_added(const Instance *instance, const SpringMemory *reached, unsigned reference)
{
    const SpringLaw *law = instance->first.law;
    if (reference >= fmu_first_added(&instance->state.settings))
        return added_output(instance, reached, fmu_added(&instance->state.settings, reference));
    if (reference == SPRING_OMEGA)
        return reached->omega;
    if (reference == SPRING_STIFFNESS)
        return with_added(instance, reached, SPRING_STIFFNESS, spring_stiffness(law, reached));
    double force = with_added(instance, reached, SPRING_FORCE, spring_force(law, reached));
    return reference == SPRING_FORCE ? force : rate(instance, reference, force, spring_omega_slope(law, reached).value);
}

SPRING_APART double output(const Instance *instance, const SpringMemory *reached, unsigned reference)
{
    if (instance->has_added)
        return output_with_added(instance, reached, reference);
    switch (reference) {
    case SPRING_FORCE: return spring_force(instance->first.law, reached);
    case SPRING_STIFFNESS: return spring_stiffness(instance->first.law, reached);
    case SPRING_OMEGA: return reached->omega;
    default:
        return rate(instance, reference, spring_force(instance->first.law, reached),
                    spring_omega_slope(instance->first.law, reached).value);
    }
}

FmuStatus fmu_read(Instance *instance, const unsigned references[], size_t count, double values[])
{
    State *state = &instance->state;
    for (size_t i = 0; i < count; i++) {
        if (references[i] == SPRING_DISPLACEMENT) {
            values[i] = state->displacement;
        } else if (references[i] >= SPRING_FIRST_PARAMETER && is_given(&state->settings, references[i])) {
            int is_velocity = fmu_causality(&state->settings, references[i]) == VARIABLE_INPUT;
            values[i] = is_velocity ? state->velocity : *fmu_setting(&state->settings, references[i]);
        } else if (references[i] == SPRING_ABSORBED_ENERGY && state->settings.no_energy) {
            return FMU_REFUSE(
                &instance->log, "`absorbed_energy` is left out of this FMU; build it with energy to read it.");
        } else {
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
    int is_kept = !state->settings.real_time;
    double end = path_end(state);
    spring_commit(instance->first.law, &state->memory, is_kept ? &state->sensitivity : NULL, end);
    if (instance->second.law != NULL)
        spring_commit(instance->second.law, &state->added.second, is_kept ? &state->added.sensitivity : NULL, end);
    state->resolver = spring_resolver_start(end, state->memory.direction);
}

/* Changes parameters of a path that has begun. */
SPRING_COLD FmuStatus change_parameters(Instance *instance, const Settings *settings)
{
    State *state = &instance->state;
    if (memcmp(settings, &state->settings, sizeof *settings) == 0)
        return FMU_OK;
    if (settings->has_states) {
        if (make_law(instance, settings) != FMU_OK)
            return FMU_ERROR;
        state->settings = *settings;
        return FMU_OK;
    }
    if (fmu_require_law(instance) != FMU_OK)
        return FMU_ERROR;
    /* The old laws must last until they have been left. */
    const SpringLaw *before = instance->first.law, *second = instance->second.law;
    const SharedSpring *kept = acquire(instance, &instance->first, &before->parameters);
    const SharedSpring *kept_second = second == NULL ? NULL : acquire(instance, &instance->second, &second->parameters);
    FmuStatus status = kept == NULL || (second != NULL && kept_second == NULL) ? refuse_memory(instance)
                                                                               : make_law(instance, settings);
    if (status == FMU_OK) {
        int is_kept = !settings->real_time;
        spring_change(before, instance->first.law, &state->memory, is_kept ? &state->sensitivity : NULL);
        if (second != NULL)
            spring_change(second, instance->second.law, &state->added.second,
                          is_kept ? &state->added.sensitivity : NULL);
        for (int i = 0; i < settings->added.branches; i++)
            if (settings->added.time_constant[i] != state->settings.added.time_constant[i])
                state->added.by_log[i] = 0.0; /* counts from here on */
        if (settings->input_resolution != state->settings.input_resolution)
            catch_up(instance);
        state->settings = *settings;
    }
    release(&instance->first, kept);
    if (second != NULL)
        release(&instance->second, kept_second);
    return status;
}

static FmuStatus require_settable(const Instance *instance, unsigned reference, double value)
{
    VariableCausality causality = fmu_causality(&instance->state.settings, reference);
    if (causality == VARIABLE_INPUT || fmu_is_state(&instance->state.settings, reference))
        return FMU_OK;
    if (causality != VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.",
                          fmu_name(&instance->state.settings, reference).text);
    /* Some hosts, OpenModelica before August 2026 among them, set all parameters to what they are. */
    if (instance->state.mode & (INSTANTIATED | INITIALIZATION) ||
        memcmp(fmu_setting((Settings *)&instance->state.settings, reference), &value, sizeof value) == 0)
        return FMU_OK;
    if (!fmu_is_tunable(&instance->state.settings, reference))
        return FMU_REFUSE(&instance->log,
                          "`%s` is fixed after initialization; reset the instance to change it.",
                          fmu_name(&instance->state.settings, reference).text);
    if (instance->state.mode & ME_CONTINUOUS_TIME && !instance->state.settings.has_states)
        return FMU_REFUSE(&instance->log, "`%s` can be changed at events only; enter event mode first.",
                          fmu_name(&instance->state.settings, reference).text);
    return FMU_OK;
}

/* Refuses what no input, state or parameter may be. */
static FmuStatus require_value(const Instance *instance, unsigned reference, double value)
{
    const Settings *settings = &instance->state.settings;
    VariableCausality causality = fmu_causality(settings, reference);
    int is_displacement = reference == SPRING_DISPLACEMENT, is_input = causality == VARIABLE_INPUT;
    double largest = is_displacement ? LARGEST_DISPLACEMENT : is_input ? LARGEST_VELOCITY : LARGEST_SUM;
    if (causality == VARIABLE_PARAMETER ? isfinite(value) : fabs(value) <= largest)
        return FMU_OK;
    if (causality == VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` must be finite, got %s; the previous value is kept.",
                          fmu_name(settings, reference).text, spring_number(value).text);
    return FMU_REFUSE(&instance->log, "`%s` must be within +-%g%s, got %s; the previous value is kept.",
                      fmu_name(settings, reference).text, largest, is_displacement ? " m" : is_input ? " m/s" : "",
                      spring_number(value).text);
}

FmuStatus fmu_require_other_change(const Instance *instance, unsigned reference, double value)
{
    FmuStatus status = require_settable(instance, reference, value);
    return status != FMU_OK ? status : require_value(instance, reference, value);
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
    const Settings *settings = &instance->state.settings;
    if (fmu_causality(settings, reference) == VARIABLE_PARAMETER) {
        if (!changes->has_parameters)
            changes->settings = *settings;
        changes->has_parameters = 1;
        *fmu_setting(&changes->settings, reference) = value;
    } else if (reference >= fmu_first_added(settings)) {
        AddedVariable added = fmu_added(settings, reference);
        if (!changes->has_added) {
            changes->second_omega = instance->state.added.second.omega;
            memcpy(changes->elongation, instance->state.added.elongation, sizeof changes->elongation);
        }
        changes->has_added = 1;
        *(added.kind == ADDED_OMEGA ? &changes->second_omega : &changes->elongation[added.index]) = value;
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
    if (!state->settings.real_time)
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
    spring_added_commit(&state->settings.added, second, &state->added, !state->settings.real_time,
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
    if (instance->has_trial) {
        take_trial(instance);
    } else {
        /* Within a deadline sensitivities are not kept. */
        SpringSensitivity *sensitivity = state->settings.real_time ? NULL : &state->sensitivity;
        spring_commit(instance->first.law, &state->memory, sensitivity, end);
    }
    if (is_resolved(state))
        spring_resolve(&state->resolver, state->displacement, state->settings.input_resolution);
    if (state->energy_wanted)
        spring_integrate(instance->first.law, &state->memory);
    if (at != state->side) {
        /* Within a deadline no text is made: `extrapolating` tells as much. */
        if (at != 0 && !state->settings.real_time)
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
