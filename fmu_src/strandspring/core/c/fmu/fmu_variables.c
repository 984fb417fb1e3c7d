#include "fmu_variables.h"

#include "../spring/spring_number.h"
#include "../spring/spring_problem.h"

#include <stdio.h>
#include <string.h>

/* Where the value of a parameter and the derivative by it lie. */
typedef struct {
    size_t value, derivative;
} ParameterPlace;

#define OF_FIRST(name) {offsetof(Settings, spring.name), offsetof(SpringGradient, by_##name)}
#define OF_SECOND(name) {offsetof(Settings, added.name), offsetof(SpringGradient, by_##name)}
static const ParameterPlace PLACES[] = {
    [SPRING_KAPPA_OMEGA] = OF_FIRST(kappa_omega),
    [SPRING_RHO] = OF_FIRST(rho),
    [SPRING_SIGMA] = OF_FIRST(sigma),
    [SPRING_N] = OF_FIRST(n),
    [SPRING_OFFSET] = OF_FIRST(displacement_offset),
    [SPRING_MIN] = OF_FIRST(displacement_min),
    [SPRING_MAX] = OF_FIRST(displacement_max),
    [SPRING_ELASTIC] = OF_FIRST(kE),
    [SPRING_KNOT] = OF_FIRST(FE_knots),
    [SPRING_KNOT_FORCE] = OF_FIRST(FE_forces),
    [SPRING_AMPLIFIER] = OF_FIRST(kA),
    [SPRING_OMEGA_START] = {offsetof(Settings, omega_start), offsetof(SpringGradient, by_omega_start)},
    [SPRING_INPUT_RESOLUTION] = {offsetof(Settings, input_resolution), 0}, /* of which there are no derivatives */
    [SECOND_KAPPA_OMEGA] = OF_SECOND(kappa_omega),
    [SECOND_RHO] = OF_SECOND(rho),
    [SECOND_SIGMA] = OF_SECOND(sigma),
    [SECOND_N] = OF_SECOND(n),
    [SECOND_AMPLIFIER] = OF_SECOND(kA),
    [SECOND_OMEGA_START] = {offsetof(Settings, second_omega_start), offsetof(SpringGradient, by_omega_start)},
    [BRANCH_STIFFNESS] = {offsetof(Settings, added.stiffness), 0},
    [BRANCH_TIME_CONSTANT] = {offsetof(Settings, added.time_constant), 0},
};

double *fmu_setting(Settings *settings, const SpringVariable *parameter)
{
    return (double *)((char *)settings + PLACES[parameter->kind].value) + parameter->index;
}

double fmu_derivative_by(const SpringGradient *gradient, const SpringVariable *parameter)
{
    const char *place = (const char *)gradient + PLACES[parameter->kind].derivative;
    return ((const double *)place)[parameter->index];
}

VariableName fmu_name(unsigned reference)
{
    SpringVariable variable = fmu_variable(reference);
    VariableName name;
    memcpy(name.text, variable.name, sizeof name.text);
    return name;
}

static int second_problem(const Settings *settings, char *text, size_t size)
{
    SpringParameters second = spring_second(&settings->spring, &settings->added);
    if (!spring_problem(&second, text, size))
        return 0;
    /* What is named first is wrong, and has these letters before its name here. */
    char *name = strchr(text, '`');
    const char prefix[] = "second_";
    size_t length = sizeof prefix - 1, behind = name == NULL ? 0 : strlen(name + 1) + 1;
    if (name != NULL && (size_t)(name + 1 - text) + length + behind <= size) {
        memmove(name + 1 + length, name + 1, behind);
        memcpy(name + 1, prefix, length);
    }
    return 1;
}

int fmu_added_problem(const Settings *settings, char *text, size_t size)
{
    const SpringAdded *added = &settings->added;
    double width = settings->spring.displacement_max - settings->spring.displacement_min;
    if (added->mechanisms && !(fabs(settings->second_omega_start) <= 1.0)) {
        snprintf(text, size, "`second_omega_start` must be within [-1, 1], got %s.",
                 spring_number(settings->second_omega_start).text);
        return 1;
    }
    if (added->mechanisms && second_problem(settings, text, size))
        return 1;
    for (int i = 0; i < added->branches; i++) {
        double stiffness = added->stiffness[i], tau = added->time_constant[i], largest = LARGEST_FORCE / width;
        int is_stiffness = !(0.0 <= stiffness && stiffness <= largest);
        if (!is_stiffness && LEAST_TIME_CONSTANT <= tau && tau <= LARGEST_TIME_CONSTANT)
            continue;
        snprintf(text, size, "`branch_%d_%s` must be within [%g, %.6g] %s, got %s.", i,
                 is_stiffness ? "stiffness" : "time_constant", is_stiffness ? 0.0 : LEAST_TIME_CONSTANT,
                 is_stiffness ? largest : LARGEST_TIME_CONSTANT, is_stiffness ? "N/m" : "s",
                 spring_number(is_stiffness ? stiffness : tau).text);
        return 1;
    }
    return 0;
}
