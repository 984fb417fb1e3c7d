#include "fuzz.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- values ------------------------------------------------------------------------------------------------------ */

static void check_value(Slot *slot, fmi2ValueReference reference, double value)
{
    Twin *twin = &slot->twin;
    char causality = described[reference].causality;
    const char *name = described[reference].name;
    CHECK(isfinite(value), "%s is %g", name, value);
    if (strcmp(name, "omega") == 0 && !MODEL_STATES)
        CHECK(fabs(value) <= 1.0, "omega is %g", value);
    if (twin->mode == UNKNOWN || strchr("olr", causality) != NULL)
        return;
    double expected = twin->value[reference];
    if (twin->moved && causality == 'i') {
        CHECK(fabs(value - expected) <= twin->doubt, "%s is %.17g, not %.17g", name, value, expected);
        twin->value[reference] = value;
    } else {
        CHECK(memcmp(&value, &expected, sizeof value) == 0, "%s is %.17g, not %.17g", name, value, expected);
    }
}

void get_real(Trial *trial)
{
    Slot *slot = trial->slot;
    References of = references('R', READABLE);
    double *values = elements(of.count, sizeof *values);
    must_be_references(trial, &of);
    must_be_given(trial, values, of.count);
    if (!all_have(&of, "ip"))
        must(trial, possible(&slot->twin));
    fmi2Status status = fmi2GetReal(trial->component, of.at, of.count, values);
    int energy = variable("absorbed_energy"), effect = LOOKS;
    for (size_t i = 0; of.at != NULL && i < of.count; i++)
        if (of.at[i] == (fmi2ValueReference)energy)
            effect = CHANGES; /* from now on each step keeps account of it */
    if (judged(trial, status, effect))
        for (size_t i = 0; i < of.count; i++)
            check_value(slot, of.at[i], values[i]);
    free(of.at);
    free(values);
}

/* Whether parameters may be set to these values after initialization. */
static Answer may_tune(const Twin *twin, const References *of, const double *values)
{
    Twin tuned = *twin;
    if (twin->mode == UNKNOWN)
        return UNSURE;
    int is_closed = twin->mode == CONTINUOUS_TIME && !MODEL_STATES;
    for (size_t i = 0; of->at != NULL && values != NULL && of->sound && i < of->count; i++) {
        /* Any parameter may be set to what it is. */
        int is_change =
            described[of->at[i]].causality == 'p' && memcmp(&twin->value[of->at[i]], &values[i], sizeof values[i]) != 0;
        if (is_change && (is_closed || !described[of->at[i]].tunable))
            return NO;
        twin_set(&tuned, of->at[i], values[i]);
    }
    return possible(&tuned);
}

void set_real(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    int early = twin->mode == INSTANTIATED || twin->mode == INITIALIZATION;
    References of = references('R', early || chance(20) ? SETTABLE : "isO");
    double *values = usual_values(&of);
    must_be_references(trial, &of);
    must_be_given(trial, values, of.count);
    must(trial, all_have(&of, SETTABLE) ? YES : NO);
    if (!all_have(&of, "isO"))
        must(trial, early ? YES : may_tune(twin, &of, values));
    for (size_t i = 0; values != NULL && of.at != NULL && of.sound && i < of.count; i++) {
        trace("    value %.17g", values[i]);
        must(trial, fabs(values[i]) <= largest_given(of.at[i]) ? YES : NO);
    }
    if (judged(trial, fmi2SetReal(trial->component, of.at, of.count, values), CHANGES))
        for (size_t i = 0; i < of.count; i++)
            twin_set(twin, of.at[i], values[i]);
    free(of.at);
    free(values);
}

void get_others(Trial *trial, char type)
{
    Twin *twin = &trial->slot->twin;
    References of = references(type, READABLE);
    void *values = elements(of.count, sizeof(fmi2String));
    must_be_references(trial, &of);
    must_be_given(trial, values, of.count);
    fmi2Status status = type == 'I'   ? fmi2GetInteger(trial->component, of.at, of.count, values)
                        : type == 'B' ? fmi2GetBoolean(trial->component, of.at, of.count, values)
                                      : fmi2GetString(trial->component, of.at, of.count, values);
    if (judged(trial, status, LOOKS) && type == 'B')
        for (size_t i = 0; i < of.count; i++) {
            int value = ((fmi2Boolean *)values)[i];
            CHECK(value == fmi2True || value == fmi2False, "extrapolating is %d", value);
            if (possible(twin) == YES && !twin->moved)
                CHECK(value == (twin->mode == CONTINUOUS_TIME ? twin->held : side_of(twin) != 0), "extrapolating is %d",
                      value);
        }
    free(of.at);
    free(values);
}

void set_others(Trial *trial, char type)
{
    References of = references(type, READABLE);
    void *values = elements(of.count, sizeof(fmi2String));
    must_be_references(trial, &of);
    must_be_given(trial, values, of.count);
    must(trial, of.count == 0 ? YES : NO); /* none of them is an input or a parameter */
    fmi2Status status = type == 'I'   ? fmi2SetInteger(trial->component, of.at, of.count, values)
                        : type == 'B' ? fmi2SetBoolean(trial->component, of.at, of.count, values)
                                      : fmi2SetString(trial->component, of.at, of.count, values);
    judged(trial, status, LOOKS);
    free(of.at);
    free(values);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* Whether seeds are finite, and so small that what they are multiplied with is as well. */
static void must_be_seeds(Trial *trial, const double *seeds, size_t count)
{
    for (size_t i = 0; seeds != NULL && i < count; i++)
        must(trial, isfinite(seeds[i]) ? YES : NO);
    for (size_t i = 0; seeds != NULL && i < count; i++)
        or_discard(trial, fabs(seeds[i]) <= 1e50 ? YES : UNSURE);
}

void directional_derivative(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    References unknown = references('R', UNKNOWNS), known = references('R', SETTABLE);
    if (unknown.count * known.count > 100000)
        known.count = 1; /* the rest of the array is for nobody */
    double *seed = usual_values(&known), *found = elements(unknown.count, sizeof *found);
    must_be_references(trial, &unknown);
    must_be_references(trial, &known);
    must_be_given(trial, seed, known.count);
    must_be_given(trial, found, unknown.count);
    must(trial, all_have(&unknown, UNKNOWNS) && all_have(&known, SETTABLE) ? YES : NO);
    if (!MODEL_STATES && any_is(&unknown, "absorbed_energy") && !all_have(&known, "i"))
        must(trial, twin->mode == INITIALIZATION ? YES : twin->mode == UNKNOWN ? UNSURE : NO);
    if (!MODEL_STATES && any_is(&known, "input_resolution"))
        must(trial, twin->mode == INITIALIZATION ? YES : twin->mode == UNKNOWN ? UNSURE : NO);
    must(trial, possible(twin));
    must(trial, is_smooth(twin));
    must_be_seeds(trial, seed, known.count);
    fmi2Status status =
        fmi2GetDirectionalDerivative(trial->component, unknown.at, unknown.count, known.at, known.count, seed, found);
    if (judged(trial, status, LOOKS))
        for (size_t i = 0; i < unknown.count; i++)
            CHECK(isfinite(found[i]), "the derivative of %s is %g", described[unknown.at[i]].name, found[i]);
    free(unknown.at);
    free(known.at);
    free(seed);
    free(found);
}

static int *orders(size_t count, int highest)
{
    int *made = elements(count, sizeof *made);
    for (size_t i = 0; made != NULL && i < count; i++)
        made[i] = careless() ? (int[]){0, -1, 3, INT_MIN}[below(4)] : 1 + below(highest);
    return made;
}

static int orders_sound(const int *order, size_t count, int highest)
{
    for (size_t i = 0; order != NULL && i < count; i++)
        if (order[i] < 1 || order[i] > highest)
            return 0;
    return 1;
}

void input_derivatives(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    References of = references('R', "i");
    int *order = orders(of.count, 2);
    double *values = elements(of.count, sizeof *values);
    must_be_references(trial, &of);
    must_be_given(trial, order, of.count);
    must_be_given(trial, values, of.count);
    must(trial, all_have(&of, "i") && orders_sound(order, of.count, 2) ? YES : NO);
    for (size_t i = 0; values != NULL && i < of.count; i++) {
        values[i] = careless() ? awkward() : uniform(-1.0, 1.0) * pow(10.0, uniform(-3.0, 3.0));
        must(trial, isfinite(values[i]) ? YES : NO);
    }
    if (judged(trial, fmi2SetRealInputDerivatives(trial->component, of.at, of.count, order, values), CHANGES))
        for (size_t i = 0; i < of.count; i++) {
            *(order[i] == 1 ? &twin->velocity : &twin->acceleration) = values[i];
            twin->interpolated = 1;
        }
    free(of.at);
    free(order);
    free(values);
}

void output_derivatives(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    References of = references('R', OUTPUTS);
    int *order = orders(of.count, 1);
    double *values = elements(of.count, sizeof *values);
    must_be_references(trial, &of);
    must_be_given(trial, order, of.count);
    must_be_given(trial, values, of.count);
    must(trial, all_have(&of, OUTPUTS) && orders_sound(order, of.count, 1) ? YES : NO);
    if (of.count > 0) {
        must(trial, is_smooth(twin));
        or_discard(trial, twin->mode == UNKNOWN ? UNSURE : rate_possible(twin));
    }
    fmi2Status status = fmi2GetRealOutputDerivatives(trial->component, of.at, of.count, order, values);
    if (judged(trial, status, LOOKS))
        for (size_t i = 0; i < of.count; i++)
            CHECK(isfinite(values[i]), "the rate of %s is %g", described[of.at[i]].name, values[i]);
    free(of.at);
    free(order);
    free(values);
}
