#include "../../../core/c/fmi/fmu_modes.h"
#include "../../../core/c/fmi/fmu_sound.h"
#include "../../../kernel/c/motion/vectors.h"
#include "system_state.h"

#include <math.h>

/* All but the memories of springs are numbers of eight bytes, one behind the other. */
enum {
    OF_MOTION = offsetof(MotionState, body) / sizeof(double),
    OF_BODY = sizeof(MotionBodyState) / sizeof(double),
    OF_REACH = sizeof(MotionReach) / sizeof(double),
    OF_AXIS = (sizeof(MotionAxisState) - offsetof(MotionAxisState, displacement)) / sizeof(double)
};
_Static_assert(
    sizeof(MotionState) - offsetof(MotionState, body) < 4 * sizeof(void *) + sizeof(double),
    "every number is serialized, as nothing but pointers is behind");
_Static_assert(
    sizeof(MotionAxisState) == sizeof(SpringMemory) + OF_AXIS * sizeof(double), "every number is serialized");

static void doubles(Cursor *cursor, double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        fmu_double_field(cursor, values + i);
}

static void memory_fields(Cursor *cursor, SpringMemory *memory)
{
    fmu_double_field(cursor, &memory->displacement);
    fmu_double_field(cursor, &memory->omega);
    fmu_double_field(cursor, &memory->start);
    fmu_double_field(cursor, &memory->start_xi);
    fmu_double_field(cursor, &memory->energy_at);
    fmu_double_field(cursor, &memory->energy);
    fmu_int_field(cursor, &memory->direction);
}

void fmu_state_fields(Cursor *cursor, State *state)
{
    SystemCounts counts = system_counts();
    fmu_int_field(cursor, &state->mode);
    fmu_double_field(cursor, &state->time);
    fmu_double_field(cursor, &state->stop_time);
    doubles(cursor, (double *)&state->settings, SYSTEM_PARAMETERS);
    doubles(cursor, state->inputs, (size_t)counts.channels);
    doubles(cursor, state->slopes, (size_t)counts.channels);
    fmu_int_field(cursor, &state->is_interpolated);
    fmu_int_field(cursor, &state->is_at_rest);
    fmu_int_field(cursor, &state->extrapolating);
    doubles(cursor, state->rest_sway, 3 * (size_t)counts.points);
    doubles(cursor, state->rest_turn[0], 4 * (size_t)counts.bodies);
    doubles(cursor, (double *)&state->motion, OF_MOTION);
    doubles(cursor, (double *)state->bodies, (size_t)counts.bodies * OF_BODY);
    doubles(cursor, (double *)state->reach, (size_t)counts.mounts * OF_REACH);
    for (int64_t a = 0; a < counts.axes; a++) {
        MotionAxisState *axis = state->axes + a;
        fmu_int_field(cursor, state->is_outside + a);
        memory_fields(cursor, &axis->memory);
        doubles(cursor, &axis->displacement, OF_AXIS);
        if (counts.added == 0)
            continue;
        /* There are no derivatives. */
        SpringAddedMemory *added = state->added + a;
        memory_fields(cursor, &added->second);
        doubles(cursor, added->elongation, SPRING_MAXWELLS);
        fmu_double_field(cursor, &added->work);
    }
}

/* Of the square of a unit quaternion, with room for a host that rounds otherwise. */
static const double UNIT_ROUNDING = 1e-9;

static int are_within(double bound, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!(fabs(values[i]) <= bound))
            return 0;
    return 1;
}

static int is_sound(const SpringMemory *memory)
{
    return fabs(memory->omega) <= 1.0 && fmu_memory_is_sound(memory);
}

const char *system_impossible_motion(const State *state)
{
    SystemCounts counts = system_counts();
    if (!are_within(LARGEST_SUM, state->rest_sway, 3 * (size_t)counts.points) ||
        !are_within(1.0 + UNIT_ROUNDING, state->rest_turn[0], 4 * (size_t)counts.bodies) ||
        !are_within(LARGEST_SUM, (const double *)&state->motion, OF_MOTION) ||
        !are_within(LARGEST_SUM, (const double *)state->bodies, (size_t)counts.bodies * OF_BODY) ||
        !are_within(LARGEST_SUM, (const double *)state->reach, (size_t)counts.mounts * OF_REACH))
        return "motion";
    for (int64_t b = 0; b < counts.bodies; b++) {
        const double *turn = state->bodies[b].turn, square = turn[0] * turn[0] + dot3(turn + 1, turn + 1);
        if (!are_within(LARGEST_DISPLACEMENT, state->bodies[b].x, 3) ||
            (state->is_at_rest && !(fabs(square - 1.0) <= UNIT_ROUNDING)))
            return "motion";
    }
    for (int64_t a = 0; a < counts.axes; a++) {
        const MotionAxisState *axis = state->axes + a;
        const SpringAddedMemory *added = state->added + a;
        if (!is_sound(&axis->memory) || !is_sound(&added->second) ||
            !are_within(LARGEST_SUM, &axis->displacement, OF_AXIS) ||
            !are_within(LARGEST_SUM, added->elongation, SPRING_MAXWELLS) || !are_within(LARGEST_SUM, &added->work, 1))
            return "springs";
    }
    return NULL;
}

/* The first field that no instance can have, or NULL. */
static const char *damaged_field(const State *state)
{
    SystemCounts counts = system_counts();
    size_t channels = (size_t)counts.channels;
    if ((state->mode & IN_CO_SIMULATION) != state->mode || state->mode == 0 || (state->mode & (state->mode - 1)) != 0)
        return "mode";
    if (!isfinite(state->time) || isnan(state->stop_time))
        return "time";
    if (!system_are_possible(&state->settings))
        return "settings";
    for (size_t c = 0; c < channels; c++)
        if (!isfinite(state->inputs[c]) || !isfinite(state->slopes[c]))
            return "inputs";
    if (!fmu_is_flag(state->is_interpolated) || !fmu_is_flag(state->is_at_rest) || !fmu_is_flag(state->extrapolating) ||
        (state->mode & (INITIALIZED | TERMINATED) && !state->is_at_rest))
        return "flags";
    for (int64_t a = 0; a < counts.axes; a++)
        if (!fmu_is_flag(state->is_outside[a]))
            return "flags";
    return system_impossible_motion(state);
}

int fmu_state_problem(const State *state, char *problem, size_t size)
{
    return fmu_is_damaged(damaged_field(state), problem, size);
}
