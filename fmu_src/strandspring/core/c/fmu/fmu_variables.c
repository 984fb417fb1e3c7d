#include "fmu_variables.h"

#include <stdio.h>

static const char *const NAMES[SPRING_FIRST_PARAMETER] = {
    "displacement", "force", "stiffness", "absorbed_energy", "extrapolating", "omega"};

/* Name of each scalar parameter, and the places of its value and of the derivative by it. */
static const struct {
    const char *name;
    size_t value, derivative;
} SCALARS[SPRING_SCALARS] = {
#define SCALAR(name) {#name, offsetof(Settings, spring.name), offsetof(SpringGradient, by_##name)}
    SCALAR(kappa_omega),
    SCALAR(rho),
    SCALAR(sigma),
    SCALAR(n),
    SCALAR(displacement_offset),
    SCALAR(displacement_min),
    SCALAR(displacement_max),
#undef SCALAR
};

static const char *const OWN_NAMES[OWN_OF_STATES_FORM] = {"velocity", "der(absorbed_energy)", "der(omega)"};

/* Those up to n. */
enum { TUNABLE_SCALARS = 4 };

/* The place of a parameter in its list. */
typedef struct {
    enum { ELASTIC, KNOT, KNOT_FORCE, AMPLIFIER, SCALAR, OWN } list;
    int index;
} ParameterPlace;

static const char *const LIST_NAMES[SCALAR] = {"kE", "FE_knots", "FE_forces", "kA"};

static ParameterPlace parameter_place(const Settings *settings, unsigned reference)
{
    const SpringParameters *p = &settings->spring;
    const int counts[OWN] = {p->elastic, p->knots, p->forces, p->amplifier, SPRING_SCALARS};
    int index = (int)reference - SPRING_FIRST_PARAMETER, list = 0;
    while (list < OWN && index >= counts[list])
        index -= counts[list++];
    return (ParameterPlace){list, index};
}

int fmu_is_tunable(const Settings *settings, unsigned reference)
{
    ParameterPlace place = parameter_place(settings, reference);
    return place.list == SCALAR ? place.index < TUNABLE_SCALARS : place.list != KNOT && place.list != OWN;
}

int fmu_shapes_path(const Settings *settings, unsigned reference)
{
    if (reference < SPRING_FIRST_PARAMETER)
        return 0;
    ParameterPlace place = parameter_place(settings, reference);
    return place.list == OWN || (place.list == SCALAR && place.index > 0 && place.index < TUNABLE_SCALARS);
}

VariableName fmu_name(const Settings *settings, unsigned reference)
{
    VariableName name;
    ParameterPlace place = parameter_place(settings, reference);
    if (reference < SPRING_FIRST_PARAMETER)
        snprintf(name.text, sizeof name.text, "%s", NAMES[reference]);
    else if (place.list == SCALAR)
        snprintf(name.text, sizeof name.text, "%s", SCALARS[place.index].name);
    else if (place.list == OWN)
        snprintf(name.text, sizeof name.text, "%s", settings->has_states ? OWN_NAMES[place.index] : "omega_start");
    else
        snprintf(name.text, sizeof name.text, "%s_%d", LIST_NAMES[place.list], place.index);
    return name;
}

double *fmu_setting(Settings *settings, unsigned reference)
{
    ParameterPlace place = parameter_place(settings, reference);
    switch (place.list) {
    case ELASTIC: return &settings->spring.kE[place.index];
    case KNOT: return &settings->spring.FE_knots[place.index];
    case KNOT_FORCE: return &settings->spring.FE_forces[place.index];
    case AMPLIFIER: return &settings->spring.kA[place.index];
    case SCALAR: return (double *)((char *)settings + SCALARS[place.index].value);
    default: return &settings->omega_start;
    }
}

double fmu_derivative_by(const SpringGradient *gradient, const Settings *settings, unsigned reference)
{
    ParameterPlace place = parameter_place(settings, reference);
    switch (place.list) {
    case ELASTIC: return gradient->by_kE[place.index];
    case KNOT: return gradient->by_FE_knots[place.index];
    case KNOT_FORCE: return gradient->by_FE_forces[place.index];
    case AMPLIFIER: return gradient->by_kA[place.index];
    case SCALAR: return *(const double *)((const char *)gradient + SCALARS[place.index].derivative);
    default: return gradient->by_omega_start;
    }
}

double fmu_slope_derivative_by(const SpringOmegaSlope *slope, const Settings *settings, unsigned reference)
{
    ParameterPlace place = parameter_place(settings, reference);
    /* kappa_omega, rho, sigma, n */
    const double derivatives[TUNABLE_SCALARS] = {0.0, slope->by_rho, slope->by_sigma, slope->by_n};
    return place.list == SCALAR && place.index < TUNABLE_SCALARS ? derivatives[place.index] : 0.0;
}
