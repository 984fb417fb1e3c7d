/* The calls of FMI 2.0 that ask for derivatives of outputs. */
#include "fmi2_arguments.h"
#include "fmi2_instance.h"

#include <math.h>

/* What derivatives are made of where the path to the displacement set last ends, or where the states are. */
typedef struct {
    SpringGradient of_force, of_stiffness;
    SpringOmegaSlope slope;
    double force;
} Gradients;

static Gradients reached_gradients(const Instance *instance, const SpringMemory *reached)
{
    Gradients found;
    int has_states = instance->state.settings.has_states != 0;
    SpringSensitivity sensitivity = fmu_sensitivity(instance, reached);
    spring_gradient(
        instance->law, reached, has_states ? NULL : &sensitivity, &found.of_force, &found.of_stiffness);
    found.slope = spring_omega_slope(instance->law, reached);
    found.force = spring_force(instance->law, reached);
    return found;
}

static double partial(const Gradients *at, unsigned unknown, unsigned known,
                      const Settings *settings, int at_start)
{
    const SpringGradient *gradient = unknown == SPRING_FORCE ? &at->of_force : &at->of_stiffness;
    if (unknown == SPRING_ABSORBED_ENERGY)
        return at_start ? 0.0 : at->force;
    if (known != SPRING_DISPLACEMENT)
        return fmu_derivative_by(gradient, settings, known);
    /* Where a path begins omega is given. */
    return at_start ? gradient->by_place : gradient->by_displacement;
}

/* The same in the form with states, all of which are given. */
static double partial_of_states_form(const Gradients *at, unsigned unknown, unsigned known, const State *state)
{
    const Settings *settings = &state->settings;
    unsigned first_own = fmu_first_own(settings);
    const SpringGradient *gradient = unknown == SPRING_STIFFNESS ? &at->of_stiffness : &at->of_force;
    if (unknown == SPRING_ABSORBED_ENERGY || known == SPRING_ABSORBED_ENERGY)
        return unknown == known ? 1.0 : 0.0;
    if (known == first_own + OWN_VELOCITY)
        return unknown == first_own + OWN_POWER        ? at->force
               : unknown == first_own + OWN_OMEGA_RATE ? at->slope.value
                                                       : 0.0;
    if (unknown == first_own + OWN_OMEGA_RATE)
        return state->velocity *
               (known == SPRING_OMEGA ? at->slope.by_omega : fmu_slope_derivative_by(&at->slope, settings, known));
    double derivative = known == SPRING_DISPLACEMENT ? gradient->by_place
                        : known == SPRING_OMEGA      ? gradient->by_omega_start
                                                     : fmu_derivative_by(gradient, settings, known);
    return unknown == first_own + OWN_POWER ? state->velocity * derivative : derivative;
}

static fmi2Status refuse_no_output(const Instance *instance, unsigned reference)
{
    return FMU_REFUSE(&instance->log, "`%s` is not an output, so it has no derivatives.",
                      fmu_name(&instance->state.settings, reference).text);
}

/* Whether derivatives with respect to a variable can be given. */
static fmi2Status require_known(
    const Instance *instance, unsigned known, const fmi2ValueReference unknowns[], size_t count)
{
    const Settings *settings = &instance->state.settings;
    VariableCausality causality = fmu_causality(settings, known);
    if (causality != VARIABLE_INPUT && causality != VARIABLE_PARAMETER && !fmu_is_state(settings, known))
        return FMU_REFUSE(&instance->log, "`%s` is calculated; there are no derivatives with respect to it.",
                          fmu_name(settings, known).text);
    if (settings->has_states || instance->state.mode & INITIALIZATION || causality != VARIABLE_PARAMETER)
        return fmi2OK;
    for (size_t i = 0; i < count; i++)
        if (unknowns[i] == SPRING_ABSORBED_ENERGY)
            return FMU_REFUSE(&instance->log,
                              "The derivative of `absorbed_energy` with respect to `%s` is available in "
                              "initialization mode only.",
                              fmu_name(settings, known).text);
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    const State *state = &instance->state;
    int at_start = state->mode & INITIALIZATION;
    for (size_t k = 0; k < nKnown; k++)
        if (!isfinite(dvKnown[k]))
            return FMU_REFUSE(&instance->log, "The seed of `%s` must be finite, got %s.",
                              fmu_name(&state->settings, vKnown_ref[k]).text, spring_number(dvKnown[k]).text);
    for (size_t i = 0; i < nUnknown; i++)
        if (fmu_causality(&state->settings, vUnknown_ref[i]) != VARIABLE_OUTPUT &&
            !fmu_is_rate(&state->settings, vUnknown_ref[i]))
            return refuse_no_output(instance, vUnknown_ref[i]);
    for (size_t k = 0; k < nKnown; k++)
        if (require_known(instance, vKnown_ref[k], vUnknown_ref, nUnknown) != fmi2OK)
            return fmi2Error;
    const SpringMemory *reached = fmu_reach(instance);
    if (reached == NULL)
        return fmi2Error;
    Gradients at = reached_gradients(instance, reached);
    for (size_t i = 0; i < nUnknown; i++) {
        dvUnknown[i] = 0.0;
        for (size_t k = 0; k < nKnown; k++)
            dvUnknown[i] += dvKnown[k] *
                            (state->settings.has_states
                                 ? partial_of_states_form(&at, vUnknown_ref[i], vKnown_ref[k], state)
                                 : partial(&at, vUnknown_ref[i], vKnown_ref[k], &state->settings, at_start));
        if (!isfinite(dvUnknown[i]))
            return fmu_report(&instance->log, fmi2Discard, "The directional derivative of `%s` overflows; use smaller seeds.",
                              fmu_name(&state->settings, vUnknown_ref[i]).text);
    }
    return fmi2OK;
}

/* Of the path up to the end of the last step, whatever displacement has been set since. */
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[])
{
    FMU_REQUIRE(c, GetRealOutputDerivatives);
    FMU_REQUIRE_VARIABLES(instance, GetRealOutputDerivatives, vr, nvr, value, VARIABLE_REAL);
    FMU_REQUIRE_ARRAY(instance, GetRealOutputDerivatives, order, nvr);
    for (size_t i = 0; i < nvr; i++) {
        if (fmu_causality(&instance->state.settings, vr[i]) != VARIABLE_OUTPUT)
            return refuse_no_output(instance, vr[i]);
        if (order[i] != 1)
            return FMU_REFUSE(&instance->log, "The order of the derivative of `%s` must be 1, got %d.",
                              fmu_name(&instance->state.settings, vr[i]).text, order[i]);
    }
    if (fmu_reach(instance) == NULL) /* makes the law */
        return fmi2Error;
    const State *state = &instance->state;
    if (nvr > 0 && fabs(state->rate) > LARGEST_VELOCITY)
        return fmu_report(&instance->log, fmi2Discard,
                          "The outputs have no derivatives, for `displacement` moved at %s m/s in the last step; take steps "
                          "in which it moves at %g m/s or less.",
                          spring_number(state->rate).text, LARGEST_VELOCITY);
    SpringGradient of_force, of_stiffness;
    spring_gradient(instance->law, &state->memory, &state->sensitivity, &of_force, &of_stiffness);
    for (size_t i = 0; i < nvr; i++) {
        double by_displacement = vr[i] == SPRING_FORCE       ? of_force.by_displacement
                                 : vr[i] == SPRING_STIFFNESS ? of_stiffness.by_displacement
                                                             : spring_force(instance->law, &state->memory);
        value[i] = by_displacement * state->rate;
    }
    return fmi2OK;
}
