#include "fmu_branches.h"

#include "../spring/spring_number.h"
#include "../spring/spring_problem.h"

#include <stdio.h>
#include <string.h>

static const char *const SCALAR_NAMES[] = {"kappa_omega", "rho", "sigma", "n"};
enum { OF_MECHANISM = 4 };

/* Takes a run of variables off what is left of a reference; whether it is one of them. */
static int is_within(int *left, int count)
{
    if (*left < count)
        return 1;
    *left -= count;
    return 0;
}

AddedVariable fmu_added(const Settings *settings, unsigned reference)
{
    static const AddedKind OF_BRANCH[] = {ADDED_STIFFNESS, ADDED_TIME_CONSTANT, ADDED_ELONGATION};
    const SpringAdded *added = &settings->added;
    int left = (int)reference - (int)fmu_first_added(settings), is_usual = !settings->has_states;
    if (left < 0)
        return (AddedVariable){ADDED_NONE, 0};
    if (added->mechanisms) {
        if (is_within(&left, 1))
            return (AddedVariable){ADDED_OMEGA, 0};
        if (is_within(&left, OF_MECHANISM))
            return (AddedVariable){ADDED_SCALAR, left};
        if (is_within(&left, added->amplifier))
            return (AddedVariable){ADDED_AMPLIFIER, left};
        if (is_usual && is_within(&left, 1))
            return (AddedVariable){ADDED_OMEGA_START, 0};
    }
    if (is_within(&left, 3 * added->branches))
        return (AddedVariable){OF_BRANCH[left % 3], left / 3};
    if (added->branches && is_within(&left, 1))
        return (AddedVariable){ADDED_STORED_ENERGY, 0};
    if (added->mechanisms && !is_usual && is_within(&left, 1))
        return (AddedVariable){ADDED_OMEGA_RATE, 0};
    return !is_usual && left < added->branches ? (AddedVariable){ADDED_ELONGATION_RATE, left}
                                               : (AddedVariable){ADDED_NONE, 0};
}

VariableName fmu_added_name(AddedVariable variable)
{
    static const char *const FORMATS[] = {
        [ADDED_NONE] = "",
        [ADDED_OMEGA] = "second_omega",
        [ADDED_AMPLIFIER] = "second_kA_%d",
        [ADDED_OMEGA_START] = "second_omega_start",
        [ADDED_STIFFNESS] = "branch_%d_stiffness",
        [ADDED_TIME_CONSTANT] = "branch_%d_time_constant",
        [ADDED_ELONGATION] = "branch_%d_elongation",
        [ADDED_STORED_ENERGY] = "stored_energy",
        [ADDED_OMEGA_RATE] = "der(second_omega)",
        [ADDED_ELONGATION_RATE] = "der(branch_%d_elongation)",
    };
    VariableName name;
    if (variable.kind == ADDED_SCALAR) {
        snprintf(name.text, sizeof name.text, "second_%s", SCALAR_NAMES[variable.index]);
        return name;
    }
    const char *format = FORMATS[variable.kind], *place = strchr(format, '%');
    if (place == NULL)
        snprintf(name.text, sizeof name.text, "%s", format);
    else
        snprintf(name.text, sizeof name.text, "%.*s%d%s", (int)(place - format), format, variable.index, place + 2);
    return name;
}

double *fmu_added_setting(Settings *settings, AddedVariable variable)
{
    SpringAdded *added = &settings->added;
    double *const scalars[OF_MECHANISM] = {&added->kappa_omega, &added->rho, &added->sigma, &added->n};
    switch (variable.kind) {
    case ADDED_SCALAR: return scalars[variable.index];
    case ADDED_AMPLIFIER: return &added->kA[variable.index];
    case ADDED_STIFFNESS: return &added->stiffness[variable.index];
    case ADDED_TIME_CONSTANT: return &added->time_constant[variable.index];
    default: return &settings->second_omega_start;
    }
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
        AddedVariable wrong = {is_stiffness ? ADDED_STIFFNESS : ADDED_TIME_CONSTANT, i};
        snprintf(text, size, "`%s` must be within [%g, %.6g] %s, got %s.", fmu_added_name(wrong).text,
                 is_stiffness ? 0.0 : LEAST_TIME_CONSTANT, is_stiffness ? largest : LARGEST_TIME_CONSTANT,
                 is_stiffness ? "N/m" : "s", spring_number(is_stiffness ? stiffness : tau).text);
        return 1;
    }
    return 0;
}
