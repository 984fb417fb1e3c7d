/* Derivatives of outputs and of rates of states with respect to variables, whose sums over knowns or over unknowns the
 * versions of FMI ask for, and to time. FMI_PLACE of a version says which variable has a value reference. */
#include "fmu_instance.h"

#include "../spring/spring_number.h"

#include <math.h>

/* What derivatives are made of where the path to the displacement set last ends, or where the states are. */
typedef struct {
    SpringGradient of_force, of_stiffness;
    SpringOmegaSlope slope;
    double force;
    /* Of a second mechanism alone. */
    SpringGradient second_of_force, second_of_stiffness;
    SpringOmegaSlope second_slope;
    const SpringAddedMemory *added;
} Gradients;

/* Adds to a gradient that of a second mechanism by what it has in common with the first. */
static void add_common(SpringGradient *gradient, const SpringGradient *second)
{
    gradient->by_displacement += second->by_displacement;
    gradient->by_place += second->by_place;
    gradient->by_displacement_offset += second->by_displacement_offset;
    gradient->by_displacement_min += second->by_displacement_min;
    gradient->by_displacement_max += second->by_displacement_max;
}

/* What a second mechanism and branches add: branches follow a displacement that is set as springs do. */
SPRING_NOINLINE static void add_gradients(const Instance *instance, const SpringAddedMemory *memory, int is_kept, Gradients *at)
{
    const SpringAdded *added = &instance->state.settings.added;
    at->added = memory;
    if (added->mechanisms) {
        const SpringLaw *law = instance->second.law;
        const SpringAddedMemory *committed = &instance->state.added;
        SpringSensitivity sensitivity = {0};
        if (is_kept)
            sensitivity =
                spring_trial_sensitivity(law, &committed->second, &committed->sensitivity, &memory->second);
        spring_gradient(
            law, &memory->second, is_kept ? &sensitivity : NULL, &at->second_of_force, &at->second_of_stiffness);
        at->second_slope = spring_omega_slope(law, &memory->second);
        add_common(&at->of_force, &at->second_of_force);
        add_common(&at->of_stiffness, &at->second_of_stiffness);
    }
    for (int i = 0; i < added->branches; i++)
        at->of_force.by_displacement += added->stiffness[i];
    at->force += spring_added_force(added, instance->second.law, memory);
}

/* The memory where the path ends, if the force has derivatives there. */
static const SpringMemory *reach_smooth(Instance *instance)
{
    const State *state = &instance->state;
    if (state->settings.input_resolution > 0.0 && !(state->mode & INITIALIZATION))
        return FMU_REFUSE_POINTER(&instance->log, "There are no derivatives while `input_resolution` is above 0: where "
                                                  "the displacement turns, friction stands still within it.");
    return fmu_reach(instance);
}

static FmuStatus gradients(Instance *instance, Gradients *at)
{
    const SpringMemory *reached = reach_smooth(instance);
    if (reached == NULL)
        return FMU_ERROR;
    int is_kept = !instance->has_states;
    SpringSensitivity sensitivity = {0};
    if (is_kept)
        sensitivity = fmu_sensitivity(instance, reached);
    const SpringSensitivity *of_path = is_kept ? &sensitivity : NULL;
    spring_gradient(instance->first.law, reached, of_path, &at->of_force, &at->of_stiffness);
    at->slope = spring_omega_slope(instance->first.law, reached);
    at->force = spring_force(instance->first.law, reached);
    if (instance->has_added)
        add_gradients(instance, fmu_added_at(instance, reached), is_kept, at);
    return FMU_OK;
}

/* The derivative of force or stiffness by a parameter or a state, but for the displacement. */
static double partial_by(const Gradients *at, const Settings *settings, int of_force, const SpringVariable *known)
{
    const SpringGradient *first = of_force ? &at->of_force : &at->of_stiffness;
    const SpringGradient *second = of_force ? &at->second_of_force : &at->second_of_stiffness;
    int i = known->index;
    switch ((SpringKind)known->kind) {
    case SPRING_INPUT_RESOLUTION: return 0.0; /* where a path begins */
    case SPRING_OMEGA: return first->by_omega_start;
    case SECOND_OMEGA: return second->by_omega_start;
    case BRANCH_STIFFNESS: return of_force ? at->added->elongation[i] : 1.0;
    case BRANCH_ELONGATION: return of_force ? settings->added.stiffness[i] : 0.0;
    case BRANCH_TIME_CONSTANT: /* with states the elongation is given */
        return of_force && !settings->has_states
                   ? settings->added.stiffness[i] * at->added->by_log[i] / settings->added.time_constant[i]
                   : 0.0;
    default: return fmu_derivative_by(known->kind < SECOND_OMEGA ? first : second, known);
    }
}

static double partial_of_usual_form(const Gradients *at, const SpringVariable *unknown, const SpringVariable *known,
                                    const Settings *settings, int at_start)
{
    if (unknown->kind == SPRING_ABSORBED_ENERGY)
        return at_start ? 0.0 : at->force;
    int of_force = unknown->kind == SPRING_FORCE;
    const SpringGradient *gradient = of_force ? &at->of_force : &at->of_stiffness;
    if (known->kind != SPRING_DISPLACEMENT)
        return partial_by(at, settings, of_force, known);
    /* Where a path begins omega is given. */
    return at_start ? gradient->by_place : gradient->by_displacement;
}

/* The derivative of a rate that is proportional to the velocity, over it, by omega or a parameter of its mechanism. */
static double slope_by(const SpringOmegaSlope *slope, const SpringVariable *known)
{
    switch ((SpringKind)known->kind) {
    case SPRING_OMEGA:
    case SECOND_OMEGA: return slope->by_omega;
    case SPRING_RHO:
    case SECOND_RHO: return slope->by_rho;
    case SPRING_SIGMA:
    case SECOND_SIGMA: return slope->by_sigma;
    case SPRING_N:
    case SECOND_N: return slope->by_n;
    default: return 0.0;
    }
}

/* The derivative of the rate of an elongation, ds/dt = dx/dt - s/tau. */
static double elongation_rate_by(const Gradients *at, double tau, int branch, const SpringVariable *known)
{
    if (known->kind == SPRING_VELOCITY)
        return 1.0;
    if (known->index != branch)
        return 0.0;
    return known->kind == BRANCH_ELONGATION      ? -1.0 / tau
           : known->kind == BRANCH_TIME_CONSTANT ? at->added->elongation[branch] / (tau * tau)
                                                 : 0.0;
}

/* The same in the form with states, all of which are given. */
static double partial_of_states_form(
    const Gradients *at, const SpringVariable *unknown, const SpringVariable *known, const State *state)
{
    const Settings *settings = &state->settings;
    int is_second = unknown->kind == SECOND_OMEGA_RATE, by_velocity = known->kind == SPRING_VELOCITY;
    const SpringOmegaSlope *slope = is_second ? &at->second_slope : &at->slope;
    if (unknown->kind == SPRING_ABSORBED_ENERGY || known->kind == SPRING_ABSORBED_ENERGY)
        return unknown->kind == known->kind ? 1.0 : 0.0;
    switch ((SpringKind)unknown->kind) {
    case BRANCH_ELONGATION_RATE:
        return elongation_rate_by(at, settings->added.time_constant[unknown->index], unknown->index, known);
    case SPRING_OMEGA_RATE:
    case SECOND_OMEGA_RATE:
        return by_velocity                                       ? slope->value
               : (known->kind >= SECOND_OMEGA) == (is_second != 0) ? state->velocity * slope_by(slope, known)
                                                                 : 0.0;
    default: break;
    }
    if (by_velocity)
        return unknown->kind == SPRING_POWER ? at->force : 0.0;
    int of_force = unknown->kind != SPRING_STIFFNESS;
    double derivative = known->kind == SPRING_DISPLACEMENT ? (of_force ? at->of_force : at->of_stiffness).by_place
                                                           : partial_by(at, settings, of_force, known);
    return unknown->kind == SPRING_POWER ? state->velocity * derivative : derivative;
}

static double partial(const Instance *instance, const Gradients *at, unsigned unknown, unsigned known)
{
    const State *state = &instance->state;
    SpringVariable of = fmu_variable(unknown), by = fmu_variable(known);
    if (instance->has_states)
        return partial_of_states_form(at, &of, &by, state);
    return partial_of_usual_form(at, &of, &by, &state->settings, state->mode & INITIALIZATION);
}

/* Of an output or the rate of a state. */
static FmuStatus require_unknown(const Instance *instance, unsigned unknown)
{
    SpringVariable variable = fmu_variable(unknown);
    if (variable.causality != VARIABLE_OUTPUT && !variable.is_rate)
        return FMU_REFUSE(&instance->log, "`%s` is not an output, so it has no derivatives.", variable.name);
    return FMU_OK;
}

/* Of an input, a state or a parameter. */
static FmuStatus require_known(const Instance *instance, unsigned known)
{
    SpringVariable variable = fmu_variable(known);
    if (variable.causality != VARIABLE_INPUT && variable.causality != VARIABLE_PARAMETER && !variable.is_state)
        return FMU_REFUSE(
            &instance->log, "`%s` is calculated; there are no derivatives with respect to it.", variable.name);
    if (variable.kind == SPRING_INPUT_RESOLUTION && !(instance->state.mode & INITIALIZATION))
        return FMU_REFUSE(
            &instance->log, "There are no derivatives with respect to `input_resolution` after initialization.");
    return FMU_OK;
}

/* `absorbed_energy` is the sum over a path, of which derivatives by parameters are not kept. */
static FmuStatus require_pair(const Instance *instance, unsigned unknown, unsigned known)
{
    SpringVariable variable = fmu_variable(known);
    if (unknown == SPRING_ABSORBED_ENERGY && !instance->has_states && !(instance->state.mode & INITIALIZATION) &&
        variable.causality == VARIABLE_PARAMETER)
        return FMU_REFUSE(&instance->log,
                          "The derivative of `absorbed_energy` with respect to `%s` is available in "
                          "initialization mode only.",
                          variable.name);
    return FMU_OK;
}

static FmuStatus require_seed(const Instance *instance, unsigned reference, double seed)
{
    if (isfinite(seed))
        return FMU_OK;
    return FMU_REFUSE(&instance->log, "The seed of `%s` must be finite, got %s.",
                      fmu_variable_name(instance, reference).text, spring_number(seed).text);
}

/* Sums with huge seeds may overflow. */
static FmuStatus require_sum(const Instance *instance, unsigned reference, double sum)
{
    if (isfinite(sum))
        return FMU_OK;
    return fmu_report(&instance->log, FMU_DISCARD, "The directional derivative of `%s` overflows; use smaller seeds.",
                      fmu_variable_name(instance, reference).text);
}

/* A list of variables, as the host gives it. */
typedef struct {
    const FMI(ValueReference) *references;
    size_t count;
} List;

static unsigned place_of(const List *list, size_t i)
{
    return FMI_PLACE(list->references[i]);
}

/* Whether all these derivatives can be given. */
static FmuStatus require_derivatives(const Instance *instance, const List *unknowns, const List *knowns)
{
    for (size_t i = 0; i < unknowns->count; i++)
        if (require_unknown(instance, place_of(unknowns, i)) != FMU_OK)
            return FMU_ERROR;
    for (size_t k = 0; k < knowns->count; k++) {
        if (require_known(instance, place_of(knowns, k)) != FMU_OK)
            return FMU_ERROR;
        for (size_t i = 0; i < unknowns->count; i++)
            if (require_pair(instance, place_of(unknowns, i), place_of(knowns, k)) != FMU_OK)
                return FMU_ERROR;
    }
    return FMU_OK;
}

/* For each variable of `of` the sum over those of `over` of seed times partial derivative; `adjoint`: `over` are the
 * unknowns. */
static FmuStatus sums(Instance *instance, const List *of, const List *over, int adjoint, const double seeds[],
                      double values[])
{
    Gradients at;
    for (size_t k = 0; k < over->count; k++)
        if (require_seed(instance, place_of(over, k), seeds[k]) != FMU_OK)
            return FMU_ERROR;
    if (gradients(instance, &at) != FMU_OK)
        return FMU_ERROR;
    for (size_t i = 0; i < of->count; i++) {
        unsigned one = place_of(of, i);
        double sum = 0.0;
        for (size_t k = 0; k < over->count; k++) {
            unsigned other = place_of(over, k);
            sum += seeds[k] * (adjoint ? partial(instance, &at, other, one) : partial(instance, &at, one, other));
        }
        if (require_sum(instance, one, sum) != FMU_OK)
            return FMU_DISCARD;
        values[i] = sum;
    }
    return FMU_OK;
}

/* Derivatives by time of outputs at the end of the last step, whatever displacement has been set since: first of all
 * whether the output has one of this order, then d(output)/dt. */
static FmuStatus require_rate(const Instance *instance, unsigned output, int order)
{
    if (require_unknown(instance, output) != FMU_OK)
        return FMU_ERROR;
    if (order != 1)
        return FMU_REFUSE(&instance->log, "The order of the derivative of `%s` must be 1, got %d.",
                          fmu_variable_name(instance, output).text, order);
    return FMU_OK;
}

static FmuStatus gradients_of_path(Instance *instance, Gradients *at)
{
    const State *state = &instance->state;
    if (reach_smooth(instance) == NULL) /* makes the law */
        return FMU_ERROR;
    if (fabs(state->rate) > LARGEST_VELOCITY)
        return fmu_report(&instance->log, FMU_DISCARD,
                          "The outputs have no derivatives, for `displacement` moved at %s m/s in the last step; take "
                          "steps in which it moves at %g m/s or less.",
                          spring_number(state->rate).text, LARGEST_VELOCITY);
    spring_gradient(instance->first.law, &state->memory, &state->sensitivity, &at->of_force, &at->of_stiffness);
    at->force = spring_force(instance->first.law, &state->memory);
    if (instance->has_added)
        add_gradients(instance, &state->added, 1, at);
    return FMU_OK;
}

/* What decays of the branches' forces [N/s]. */
static double decay_rate(const SpringAdded *added, const SpringAddedMemory *memory)
{
    double rate = 0.0;
    for (int i = 0; i < added->branches; i++)
        rate -= added->stiffness[i] * memory->elongation[i] / added->time_constant[i];
    return rate;
}

static double rate_of(const Instance *instance, const Gradients *at, unsigned output)
{
    double by_displacement = output == SPRING_FORCE       ? at->of_force.by_displacement
                             : output == SPRING_STIFFNESS ? at->of_stiffness.by_displacement
                                                          : at->force;
    double of_motion = by_displacement * instance->state.rate;
    return output == SPRING_FORCE && instance->has_added
               ? of_motion + decay_rate(&instance->state.settings.added, at->added)
               : of_motion;
}
