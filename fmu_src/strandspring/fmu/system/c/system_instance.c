#include "../../../core/c/spring/spring_number.h"
#include "../../../kernel/c/motion/vectors.h"
#include "system_instance.h"

#include <math.h>
#include <string.h>

/* Of one step of co-simulation; some seconds. */
static const double MOST_STEPS = 1e8;
/* Of a step: what hosts' rounding of times may add to it. */
static const double STEP_ROUNDING = 1e-9;

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* Lets the motion of a state point to the state's own arrays. */
static void join_motion(State *state)
{
    state->motion.body = state->bodies;
    state->motion.reach = state->reach;
    state->motion.axis = state->axes;
    state->motion.added = state->added;
}

static void forget_outputs(Instance *instance)
{
    instance->has_points = 0;
}

void fmu_begin(Instance *instance, int mode)
{
    State *state = &instance->state;
    memset(state, 0, sizeof *state);
    state->mode = mode;
    state->stop_time = HUGE_VAL;
    state->settings = system_start().settings;
    join_motion(state);
    forget_outputs(instance);
}

void fmu_restore(Instance *instance, const State *state)
{
    instance->state = *state;
    join_motion(&instance->state);
    forget_outputs(instance);
}

/* Copies what a step changes, so far as it is used. */
static void copy_motion(const MotionSystem *system, State *to, const State *from)
{
    to->extrapolating = from->extrapolating;
    memcpy(to->is_outside, from->is_outside, system->axes * sizeof *to->is_outside);
    to->motion = from->motion;
    memcpy(to->bodies, from->bodies, system->bodies * sizeof *to->bodies);
    memcpy(to->reach, from->reach, system->mounts * sizeof *to->reach);
    memcpy(to->axes, from->axes, system->axes * sizeof *to->axes);
    if (system_counts().added > 0)
        memcpy(to->added, from->added, system->axes * sizeof *to->added);
    join_motion(to);
}

/* ---- rest -------------------------------------------------------------------------------------------------------- */

/* Notes which springs are outside their ranges; those that were inside before are added to the excursions. */
static size_t note_excursions(Instance *instance, size_t count)
{
    State *state = &instance->state;
    for (unsigned a = 0; a < instance->system.axes; a++) {
        const SpringParameters *spring = &instance->system.axis[a].law->parameters;
        double displacement = state->axes[a].memory.displacement;
        int is_outside = displacement < spring->displacement_min || displacement > spring->displacement_max;
        state->extrapolating |= is_outside;
        if (is_outside && !state->is_outside[a] && count < MOTION_AXES)
            instance->excursions[count++] = (Excursion){a, displacement};
        state->is_outside[a] = is_outside;
    }
    return count;
}

static void warn_of_excursions(const Instance *instance, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const Excursion *excursion = instance->excursions + i;
        const SpringParameters *spring = &instance->system.axis[excursion->axis].law->parameters;
        SpringNumber low = spring_number(spring->displacement_min), high = spring_number(spring->displacement_max);
        fmu_report(&instance->log, FMU_WARNING,
                   "`%s` %s m lies outside the identified range [%s, %s] m: the force is extrapolated until it comes "
                   "back.",
                   system_name(instance->first.displacement + excursion->axis).text,
                   spring_number(excursion->displacement).text, low.text, high.text);
    }
}

static FmuStatus find_rest(Instance *instance, const double *omega, double *pose)
{
    const MotionSystem *system = &instance->system;
    State *state = &instance->state;
    const double *gravity = state->settings.gravity, still[3] = {0.0, 0.0, 0.0};
    double unbalance;
    if (!motion_rest(system, gravity, omega, &state->motion, pose, &unbalance, instance->of_rest))
        return FMU_REFUSE(&instance->log,
                          "The bodies find no static equilibrium under gravity (%s, %s, %s) m/s^2: %s N remain "
                          "unbalanced. Change gravity, or build the FMU with mounts that can carry the bodies.",
                          spring_number(gravity[0]).text, spring_number(gravity[1]).text,
                          spring_number(gravity[2]).text, spring_number(unbalance).text);
    motion_begin(system, &state->motion, gravity, pose, omega, still);
    return FMU_OK;
}

/* Takes the bodies to rest, unless they are there. omega of an axis is omega_start in the direction of its force at
 * rest with omega = 0. */
static FmuStatus require_rest(Instance *instance)
{
    static const double NOMINAL[7] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0};
    const MotionSystem *system = &instance->system;
    State *state = &instance->state;
    double pose[7 * MOTION_BODIES], omega[MOTION_AXES] = {0.0};
    if (state->is_at_rest)
        return FMU_OK;
    if (!(state->mode & INITIALIZATION))
        return FMU_REFUSE(&instance->log, "Nothing calculated is known before initialization mode, in which the bodies "
                                          "come to rest.");
    for (size_t b = 0; b < system->bodies; b++)
        memcpy(pose + 7 * b, NOMINAL, sizeof NOMINAL);
    if (find_rest(instance, omega, pose) != FMU_OK)
        return FMU_ERROR;
    if (state->settings.omega_start != 0.0) {
        for (size_t a = 0; a < system->axes; a++)
            omega[a] = state->settings.omega_start * motion_sense(system->axis + a, state->axes[a].force);
        if (find_rest(instance, omega, pose) != FMU_OK)
            return FMU_ERROR;
    }
    motion_of_points(system, &state->motion, state->inputs, instance->accelerations, state->rest_sway);
    for (size_t b = 0; b < system->bodies; b++)
        memcpy(state->rest_turn[b], state->bodies[b].turn, sizeof state->rest_turn[b]);
    state->extrapolating = 0;
    memset(state->is_outside, 0, sizeof state->is_outside);
    (void)note_excursions(instance, 0);
    state->is_at_rest = 1;
    forget_outputs(instance);
    return FMU_OK;
}

FmuStatus fmu_end_initialization(Instance *instance)
{
    State *state = &instance->state;
    if (require_rest(instance) != FMU_OK)
        return FMU_ERROR;
    memset(state->is_outside, 0, sizeof state->is_outside);
    warn_of_excursions(instance, note_excursions(instance, 0));
    state->mode = CS_STEP;
    return FMU_OK;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

VariableCausality system_causality(const Instance *instance, unsigned reference)
{
    const Groups *first = &instance->first;
    return reference == SYSTEM_EXTRAPOLATING     ? VARIABLE_LOCAL
           : reference < first->acceleration     ? VARIABLE_INPUT
           : reference < first->parameter        ? VARIABLE_OUTPUT
                                                 : VARIABLE_PARAMETER;
}

static double absorbed_energy(const Instance *instance)
{
    double total = 0.0;
    for (size_t a = 0; a < instance->system.axes; a++)
        total += motion_absorbed(&instance->system, &instance->state.motion, a);
    return total;
}

/* The angle between the rotations of a body now and at rest. */
static double tilt(const State *state, unsigned body)
{
    const double *start = state->rest_turn[body];
    double back[4] = {start[0], -start[1], -start[2], -start[3]}, turn[4];
    quaternion_product(back, state->bodies[body].turn, turn);
    return 2.0 * atan2(sqrt(dot3(turn + 1, turn + 1)), fabs(turn[0]));
}

/* The force of all mounts on the base. */
static double reaction(const Instance *instance, unsigned direction)
{
    double total = 0.0;
    for (size_t m = 0; m < instance->system.mounts; m++)
        if (instance->system.mount[m].support < 0.0)
            total -= instance->state.reach[m].force[direction];
    return total;
}

static double output(Instance *instance, unsigned reference)
{
    const Groups *first = &instance->first;
    const State *state = &instance->state;
    if (reference < first->force && !instance->has_points) {
        motion_of_points(
            &instance->system, &state->motion, state->inputs, instance->accelerations, instance->sway);
        instance->has_points = 1;
    }
    if (reference < first->sway)
        return instance->accelerations[reference - first->acceleration];
    if (reference < first->force)
        return instance->sway[reference - first->sway] - state->rest_sway[reference - first->sway];
    if (reference < first->displacement)
        return state->axes[reference - first->force].force;
    if (reference < first->tilt)
        return state->axes[reference - first->displacement].memory.displacement;
    if (reference < first->reaction)
        return tilt(state, reference - first->tilt);
    if (reference < first->energy)
        return reaction(instance, reference - first->reaction);
    return absorbed_energy(instance);
}

/* Where a value is kept that the host may give. */
static double *given(Instance *instance, unsigned reference)
{
    State *state = &instance->state;
    return reference < instance->first.acceleration
               ? state->inputs + (reference - SYSTEM_FIRST_INPUT)
               : (double *)&state->settings + (reference - instance->first.parameter);
}

FmuStatus fmu_read(Instance *instance, const unsigned references[], size_t count, double values[])
{
    for (size_t i = 0; i < count; i++) {
        if (system_causality(instance, references[i]) != VARIABLE_OUTPUT) {
            values[i] = *given(instance, references[i]);
        } else {
            if (require_rest(instance) != FMU_OK)
                return FMU_ERROR;
            values[i] = output(instance, references[i]);
        }
    }
    return FMU_OK;
}

FmuStatus fmu_read_extrapolating(Instance *instance, int *extrapolating)
{
    FmuStatus status = require_rest(instance);
    *extrapolating = instance->state.extrapolating;
    return status;
}

/* Whether a variable may be set now; what is fixed, to the value that it has. */
static FmuStatus require_settable(const Instance *instance, unsigned reference, double value)
{
    VariableCausality causality = system_causality(instance, reference);
    if (causality == VARIABLE_INPUT)
        return FMU_OK;
    if (causality != VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log, "`%s` is calculated and cannot be set.", system_name(reference).text);
    if (!(instance->state.mode & (INSTANTIATED | INITIALIZATION)) && *given((Instance *)instance, reference) != value)
        return FMU_REFUSE(&instance->log, "`%s` is fixed after initialization; reset the instance to change it.",
                          system_name(reference).text);
    return FMU_OK;
}

/* Refuses what no input or parameter may be. */
static FmuStatus require_value(const Instance *instance, unsigned reference, double value)
{
    static const char *const UNITS[SYSTEM_PARAMETERS] = {" s", "", " m/s^2", " m/s^2", " m/s^2"};
    if (!isfinite(value))
        return FMU_REFUSE(&instance->log, "`%s` must be finite, got %s; the previous value is kept.",
                          system_name(reference).text, spring_number(value).text);
    if (reference < instance->first.parameter)
        return FMU_OK;
    unsigned parameter = reference - instance->first.parameter;
    SystemStart bounds = system_start();
    if (system_is_within(&bounds, parameter, value))
        return FMU_OK;
    return FMU_REFUSE(&instance->log, "`%s` must be within [%s, %s]%s, got %s; the previous value is kept.",
                      system_name(reference).text, spring_number(((const double *)&bounds.low)[parameter]).text,
                      spring_number(((const double *)&bounds.high)[parameter]).text, UNITS[parameter],
                      spring_number(value).text);
}

FmuStatus fmu_require_change(const Instance *instance, unsigned reference, double value)
{
    return require_settable(instance, reference, value) == FMU_OK ? require_value(instance, reference, value) : FMU_ERROR;
}

void fmu_change(Instance *instance, unsigned reference, double value)
{
    if (reference >= instance->first.parameter && *given(instance, reference) != value)
        instance->state.is_at_rest = 0;
    *given(instance, reference) = value;
    instance->has_points = 0;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static FmuStatus move(Instance *instance, size_t steps, double h)
{
    State *state = &instance->state;
    const MotionSystem *system = &instance->system;
    double values[MOTION_CHANNELS];
    size_t excursions = 0;
    copy_motion(system, &instance->before, state);
    memcpy(values, state->inputs, sizeof values);
    state->extrapolating = 0;
    int is_possible = 1;
    for (size_t k = 0; k < steps && is_possible; k++) {
        if (state->is_interpolated)
            for (size_t c = 0; c < system->channels; c++)
                values[c] = state->inputs[c] + state->slopes[c] * (((double)k + 0.5) * h);
        is_possible = motion_step(system, &state->motion, values, h);
        excursions = note_excursions(instance, excursions);
    }
    if (!is_possible || system_impossible_motion(state) != NULL) {
        copy_motion(system, state, &instance->before);
        return FMU_ERROR;
    }
    warn_of_excursions(instance, excursions);
    return FMU_OK;
}

FmuStatus fmu_step(Instance *instance, double time, double size)
{
    State *state = &instance->state;
    double steps = ceil(size / state->settings.step * (1.0 - STEP_ROUNDING));
    if (!(steps <= MOST_STEPS))
        return FMU_REFUSE(&instance->log,
                          "The step of %s s at time %s s would take more than %.0f steps of `step` %s s; take a "
                          "shorter one.",
                          spring_number(size).text, spring_number(time).text, MOST_STEPS,
                          spring_number(state->settings.step).text);
    steps = fmax(steps, 1.0);
    for (size_t c = 0; c < instance->system.channels; c++)
        if (!isfinite(state->inputs[c] + state->slopes[c] * size))
            return FMU_REFUSE(&instance->log, "The derivative %s of `%s` must keep it finite in the step at time %s s.",
                              spring_number(state->slopes[c]).text, system_name(SYSTEM_FIRST_INPUT + (unsigned)c).text,
                              spring_number(time).text);
    if (size > 0.0 && move(instance, (size_t)steps, size / steps) != FMU_OK)
        return FMU_REFUSE(&instance->log,
                          "The motion diverges in the step of %s s at time %s s: a displacement would be beyond %g m, "
                          "or another value beyond %g. Check the inputs, or take a smaller `step`.",
                          spring_number(size).text, spring_number(time).text, LARGEST_DISPLACEMENT, LARGEST_SUM);
    for (size_t c = 0; c < instance->system.channels; c++) {
        state->inputs[c] += state->slopes[c] * size;
        state->slopes[c] = 0.0;
    }
    state->is_interpolated = 0;
    state->time = time + size;
    forget_outputs(instance);
    return FMU_OK;
}
