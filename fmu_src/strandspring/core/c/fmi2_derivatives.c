/* The calls of FMI 2.0 that ask for derivatives of outputs. */
#include "fmi2_arguments.h"
#include "fmi2_instance.h"

/* Derivatives of force and stiffness where the path to the displacement set last ends. */
typedef struct {
    SpringGradient of_force, of_stiffness;
    double force;
} Gradients;

static Gradients reached_gradients(const Instance *instance, const SpringMemory *reached)
{
    Gradients found;
    SpringSensitivity sensitivity = fmu_sensitivity(instance, reached);
    spring_gradient(instance->law, reached, &sensitivity, &found.of_force, &found.of_stiffness);
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

static fmi2Status refuse_no_output(const Instance *instance, unsigned reference)
{
    return FMU_REFUSE(&instance->log, "`%s` is not an output, so it has no derivatives.",
                      fmu_name(&instance->state.settings, reference).text);
}

fmi2Status fmi2GetDirectionalDerivative(
    fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown, const fmi2ValueReference vKnown_ref[],
    size_t nKnown, const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    FMU_REQUIRE(c, GetDirectionalDerivative);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vUnknown_ref, nUnknown, dvUnknown, VARIABLE_REAL);
    FMU_REQUIRE_VARIABLES(instance, GetDirectionalDerivative, vKnown_ref, nKnown, dvKnown, VARIABLE_REAL);
    const Settings *settings = &instance->state.settings;
    int at_start = instance->state.mode & INITIALIZATION;
    for (size_t i = 0; i < nUnknown; i++)
        if (fmu_causality(vUnknown_ref[i]) != VARIABLE_OUTPUT)
            return refuse_no_output(instance, vUnknown_ref[i]);
    for (size_t k = 0; k < nKnown; k++) {
        VariableCausality causality = fmu_causality(vKnown_ref[k]);
        if (causality != VARIABLE_INPUT && causality != VARIABLE_PARAMETER)
            return FMU_REFUSE(&instance->log, "`%s` is calculated; there are no derivatives with respect to it.",
                              fmu_name(settings, vKnown_ref[k]).text);
        for (size_t i = 0; i < nUnknown; i++)
            if (vUnknown_ref[i] == SPRING_ABSORBED_ENERGY && causality == VARIABLE_PARAMETER && !at_start)
                return FMU_REFUSE(&instance->log,
                                  "The derivative of `absorbed_energy` with respect to `%s` is available in "
                                  "initialization mode only.",
                                  fmu_name(settings, vKnown_ref[k]).text);
    }
    const SpringMemory *reached = fmu_reach(instance);
    if (reached == NULL)
        return fmi2Error;
    Gradients at = reached_gradients(instance, reached);
    for (size_t i = 0; i < nUnknown; i++) {
        dvUnknown[i] = 0.0;
        for (size_t k = 0; k < nKnown; k++)
            dvUnknown[i] += partial(&at, vUnknown_ref[i], vKnown_ref[k], settings, at_start) * dvKnown[k];
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
        if (fmu_causality(vr[i]) != VARIABLE_OUTPUT)
            return refuse_no_output(instance, vr[i]);
        if (order[i] != 1)
            return FMU_REFUSE(&instance->log, "The order of the derivative of `%s` must be 1, got %d.",
                              fmu_name(&instance->state.settings, vr[i]).text, order[i]);
    }
    if (fmu_reach(instance) == NULL) /* makes the law */
        return fmi2Error;
    const State *state = &instance->state;
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
