#include "fmu_variables.h"

#include <stdio.h>

static const char *const NAMES[SPRING_FIRST_PARAMETER] = {
    "displacement", "force", "stiffness", "absorbed_energy", "extrapolating", "omega"};

/* Name of a parameter, or of a list of them, and the places of its value and of the derivative by it. */
typedef struct {
    const char *name;
    size_t value, derivative;
} Parameter;

#define PARAMETER(name) {#name, offsetof(Settings, spring.name), offsetof(SpringGradient, by_##name)}
static const Parameter SCALARS[SPRING_SCALARS] = {
    PARAMETER(kappa_omega),
    PARAMETER(rho),
    PARAMETER(sigma),
    PARAMETER(n),
    PARAMETER(displacement_offset),
    PARAMETER(displacement_min),
    PARAMETER(displacement_max),
};
static const Parameter LISTS[] = {PARAMETER(kE), PARAMETER(FE_knots), PARAMETER(FE_forces), PARAMETER(kA)};
#undef PARAMETER

static const char *const OWN_USUAL_NAMES[OWN_OF_USUAL_FORM] = {"omega_start", "input_resolution"};
static const char *const OWN_NAMES[OWN_OF_STATES_FORM] = {"velocity", "der(absorbed_energy)", "der(omega)"};

/* Those up to n. */
enum { TUNABLE_SCALARS = 4 };

/* The place of a parameter in its list, and of its value and of the derivative by it. */
typedef struct {
    enum { SCALAR, ELASTIC, KNOT, KNOT_FORCE, AMPLIFIER, OWN, NO_PARAMETER } list;
    int index;
    size_t value, derivative;
} ParameterPlace;

static ParameterPlace parameter_place(const Settings *settings, unsigned reference)
{
    const SpringParameters *p = &settings->spring;
    const int counts[OWN] = {SPRING_SCALARS, p->elastic, p->knots, p->forces, p->amplifier};
    if (reference < SPRING_FIRST_PARAMETER)
        return (ParameterPlace){.list = NO_PARAMETER};
    int index = (int)reference - SPRING_FIRST_PARAMETER, list = SCALAR;
    while (list < OWN && index >= counts[list])
        index -= counts[list++];
    if (list == OWN && index == OWN_INPUT_RESOLUTION) /* of which there are no derivatives */
        return (ParameterPlace){.list = list, .index = index, .value = offsetof(Settings, input_resolution)};
    if (list == OWN)
        return (ParameterPlace){
            list, index, offsetof(Settings, omega_start), offsetof(SpringGradient, by_omega_start)};
    const Parameter *parameter = list == SCALAR ? &SCALARS[index] : &LISTS[list - ELASTIC];
    size_t before = list == SCALAR ? 0 : (size_t)index * sizeof(double);
    return (ParameterPlace){list, index, parameter->value + before, parameter->derivative + before};
}

int fmu_is_state(const Settings *settings, unsigned reference)
{
    return settings->has_states && (reference == SPRING_OMEGA || reference == SPRING_ABSORBED_ENERGY ||
                                    fmu_added_is_state(settings, fmu_added(settings, reference)));
}

int fmu_is_rate(const Settings *settings, unsigned reference)
{
    if (reference >= fmu_first_added(settings))
        return fmu_added_is_rate(fmu_added(settings, reference));
    return settings->has_states && reference > fmu_first_own(settings) + OWN_VELOCITY;
}

int fmu_is_tunable(const Settings *settings, unsigned reference)
{
    AddedVariable added = fmu_added(settings, reference);
    if (added.kind != ADDED_NONE)
        return fmu_added_is_tunable(added);
    ParameterPlace place = parameter_place(settings, reference);
    if (place.list == AMPLIFIER)
        return place.index > 0; /* kA_0 is 1 */
    if (place.list == OWN)
        return reference == fmu_input_resolution(settings);
    return place.list == SCALAR ? place.index < TUNABLE_SCALARS : place.list != KNOT;
}

VariableName fmu_name(const Settings *settings, unsigned reference)
{
    AddedVariable added = fmu_added(settings, reference);
    if (added.kind != ADDED_NONE)
        return fmu_added_name(added);
    VariableName name;
    ParameterPlace place = parameter_place(settings, reference);
    if (place.list == NO_PARAMETER)
        snprintf(name.text, sizeof name.text, "%s", NAMES[reference]);
    else if (place.list == SCALAR)
        snprintf(name.text, sizeof name.text, "%s", SCALARS[place.index].name);
    else if (place.list == OWN)
        snprintf(name.text, sizeof name.text, "%s", (settings->has_states ? OWN_NAMES : OWN_USUAL_NAMES)[place.index]);
    else
        snprintf(name.text, sizeof name.text, "%s_%d", LISTS[place.list - ELASTIC].name, place.index);
    return name;
}

double *fmu_setting(Settings *settings, unsigned reference)
{
    AddedVariable added = fmu_added(settings, reference);
    if (added.kind != ADDED_NONE)
        return fmu_added_setting(settings, added);
    return (double *)((char *)settings + parameter_place(settings, reference).value);
}

double fmu_derivative_by(const SpringGradient *gradient, const Settings *settings, unsigned reference)
{
    return *(const double *)((const char *)gradient + parameter_place(settings, reference).derivative);
}

double fmu_slope_derivative_by(const SpringOmegaSlope *slope, const Settings *settings, unsigned reference)
{
    ParameterPlace place = parameter_place(settings, reference);
    /* kappa_omega, rho, sigma, n */
    const double derivatives[TUNABLE_SCALARS] = {0.0, slope->by_rho, slope->by_sigma, slope->by_n};
    return place.list == SCALAR && place.index < TUNABLE_SCALARS ? derivatives[place.index] : 0.0;
}
