#include "fmu_state.h"

#include "../fmi/fmu_modes.h"
#include "../fmi/fmu_sound.h"
#include "../spring/spring_problem.h"

#include <math.h>

static void memory_fields(Cursor *cursor, SpringMemory *memory)
{
    fmu_double_field(cursor, &memory->displacement);
    fmu_double_field(cursor, &memory->omega);
    fmu_int_field(cursor, &memory->direction);
    fmu_double_field(cursor, &memory->start);
    fmu_double_field(cursor, &memory->start_xi);
    fmu_double_field(cursor, &memory->energy_at);
    fmu_double_field(cursor, &memory->energy);
}

static void sensitivity_fields(Cursor *cursor, SpringSensitivity *sensitivity)
{
    fmu_double_field(cursor, &sensitivity->by_rho);
    fmu_double_field(cursor, &sensitivity->by_sigma);
    fmu_double_field(cursor, &sensitivity->by_n);
    fmu_double_field(cursor, &sensitivity->by_omega_start);
}

static void resolver_fields(Cursor *cursor, SpringResolver *resolver)
{
    fmu_double_field(cursor, &resolver->displacement);
    fmu_double_field(cursor, &resolver->followed);
    fmu_double_field(cursor, &resolver->furthest);
    fmu_double_field(cursor, &resolver->turn);
    fmu_double_field(cursor, &resolver->at_turn);
    fmu_int_field(cursor, &resolver->direction);
    fmu_int_field(cursor, &resolver->has_met);
}

/* Of a second mechanism and of branches, if there are any. */
static void added_fields(Cursor *cursor, State *state)
{
    const Settings *settings = &state->settings;
    if (settings->added.mechanisms) {
        memory_fields(cursor, &state->added.second);
        sensitivity_fields(cursor, &state->added.sensitivity);
    }
    for (int i = 0; i < settings->added.branches; i++) {
        fmu_double_field(cursor, &state->added.elongation[i]);
        fmu_double_field(cursor, &state->added.by_log[i]);
    }
    if (settings->added.branches)
        fmu_double_field(cursor, &state->added.work);
}

void fmu_state_fields(Cursor *cursor, State *state)
{
    ReversalWatch *watch = &state->watch;
    fmu_int_field(cursor, &state->mode);
    fmu_double_field(cursor, &state->time);
    fmu_double_field(cursor, &state->stop_time);
    for (unsigned i = 0; i < fmu_variables(); i++)
        if (fmu_causality(i) == VARIABLE_PARAMETER) {
            SpringVariable parameter = fmu_variable(i);
            fmu_double_field(cursor, fmu_setting(&state->settings, &parameter));
        }
    fmu_double_field(cursor, &state->displacement);
    fmu_double_field(cursor, &state->velocity);
    fmu_double_field(cursor, &state->acceleration);
    fmu_int_field(cursor, &state->interpolated);
    memory_fields(cursor, &state->memory);
    sensitivity_fields(cursor, &state->sensitivity);
    resolver_fields(cursor, &state->resolver);
    fmu_double_field(cursor, &state->rate);
    fmu_int_field(cursor, &state->energy_wanted);
    fmu_int_field(cursor, &state->side);
    fmu_int_field(cursor, &state->extrapolating);
    fmu_int_field(cursor, &watch->count);
    for (int i = 0; i < 2; i++) {
        fmu_double_field(cursor, &watch->time[i]);
        fmu_double_field(cursor, &watch->displacement[i]);
    }
    fmu_int_field(cursor, &watch->heading);
    fmu_double_field(cursor, &watch->turn);
    fmu_double_field(cursor, &watch->slack);
    added_fields(cursor, state);
}

static int is_sound(const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    const double sums[] = {sensitivity->by_rho, sensitivity->by_sigma, sensitivity->by_n, sensitivity->by_omega_start};
    for (size_t i = 0; i < sizeof sums / sizeof *sums; i++)
        if (!(fabs(sums[i]) <= LARGEST_SUM))
            return 0;
    return fmu_memory_is_sound(memory);
}

/* Whether a memory is one of the form with states, which has no table to follow a path by. */
static int has_no_path(const SpringMemory *memory, double displacement)
{
    return memory->displacement == displacement && memory->start == displacement && memory->energy_at == displacement &&
           memory->start_xi == 0.0;
}

/* Whether friction can be where it is with what is remembered of the displacement. */
static int resolver_is_sound(const State *state)
{
    const SpringResolver *resolver = &state->resolver;
    const double places[] = {resolver->displacement, resolver->followed, resolver->furthest, resolver->turn, resolver->at_turn};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++)
        if (!(fabs(places[i]) <= LARGEST_DISPLACEMENT))
            return 0;
    int is_used = state->settings.input_resolution > 0.0 && state->mode & (INITIALIZED | TERMINATED);
    return (!is_used || resolver->followed == state->memory.displacement) && fmu_is_side(resolver->direction) &&
           fmu_is_flag(resolver->has_met);
}

/* Whether what is remembered of a second mechanism and of branches is such that nothing made of it overflows. */
static int added_is_sound(const State *state, double largest_omega)
{
    const SpringAddedMemory *added = &state->added;
    const Settings *settings = &state->settings;
    const SpringMemory *second = &added->second;
    int is_sound_memory = fabs(second->omega) <= largest_omega && is_sound(second, &added->sensitivity) &&
                          second->displacement == state->memory.displacement &&
                          (!settings->has_states || has_no_path(second, state->displacement));
    if (settings->added.mechanisms && !is_sound_memory)
        return 0;
    for (int i = 0; i < settings->added.branches; i++)
        if (!(fabs(added->elongation[i]) <= LARGEST_SUM && fabs(added->by_log[i]) <= LARGEST_SUM))
            return 0;
    return fabs(added->work) <= LARGEST_SUM;
}

/* The first field that no instance can have, or NULL. */
static const char *damaged_field(const State *state)
{
    const SpringMemory *memory = &state->memory;
    Settings settings = state->settings;
    if ((state->mode & ANY_MODE) != state->mode || state->mode == 0 || (state->mode & (state->mode - 1)) != 0)
        return "mode";
    if (!isfinite(state->time) || isnan(state->stop_time))
        return "time";
    if (!(fabs(state->displacement) <= LARGEST_DISPLACEMENT))
        return "displacement";
    if (settings.has_states ? !(fabs(state->velocity) <= LARGEST_VELOCITY) : !isfinite(state->velocity))
        return "velocity";
    if (!isfinite(state->acceleration) || !fmu_is_flag(state->interpolated) || !isfinite(state->rate))
        return "input derivatives";
    /* Solvers overshoot a state. */
    double largest = state->settings.has_states ? LARGEST_SUM : 1.0;
    if (!(fabs(memory->omega) <= largest) || !is_sound(memory, &state->sensitivity) ||
        (settings.has_states && !has_no_path(memory, state->displacement)))
        return "memory";
    if (!settings.has_states && !resolver_is_sound(state))
        return "resolver";
    if (!added_is_sound(state, largest))
        return "memory of a second mechanism or a branch";
    for (unsigned i = 0; i < fmu_variables(); i++) {
        SpringVariable variable = fmu_variable(i);
        if (variable.causality == VARIABLE_PARAMETER && !isfinite(*fmu_setting(&settings, &variable)))
            return "settings";
    }
    if (!fmu_is_flag(state->energy_wanted) || !fmu_is_side(state->side) || !fmu_is_flag(state->extrapolating))
        return "flags";
    if (!fmu_watch_is_sound(&state->watch))
        return "watch";
    int begun = state->mode & (INITIALIZED | TERMINATED);
    if (begun && !fmu_is_resolution(settings.input_resolution))
        return "input_resolution";
    return begun && !(fabs(settings.omega_start) <= 1.0) ? "omega_start" : NULL;
}

int fmu_state_problem(const State *state, char *problem, size_t size)
{
    return fmu_is_damaged(damaged_field(state), problem, size) ||
           (state->mode & (INITIALIZED | TERMINATED) && (spring_problem(&state->settings.spring, problem, size) ||
                                                         fmu_added_problem(&state->settings, problem, size)));
}
