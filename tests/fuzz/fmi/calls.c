/* Each call but those of states: its arguments, what is allowed, and what must come back. */
#include "fuzz.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Which the FMU of a system does not have. */
#pragma weak fmi2EnterEventMode
#pragma weak fmi2NewDiscreteStates
#pragma weak fmi2EnterContinuousTimeMode
#pragma weak fmi2CompletedIntegratorStep
#pragma weak fmi2SetTime
#pragma weak fmi2SetContinuousStates
#pragma weak fmi2GetDerivatives
#pragma weak fmi2GetEventIndicators
#pragma weak fmi2GetContinuousStates
#pragma weak fmi2GetNominalsOfContinuousStates

static void must_be_given(Trial *trial, const void *array, size_t count)
{
    must(trial, count == 0 || array != NULL ? YES : NO);
    trial->words = trial->words && (count == 0 || array != NULL);
}

/* ---- calls that lead from mode to mode --------------------------------------------------------------------------- */

static int change_mode(Trial *trial, int two, int three, Mode mode)
{
    Twin *twin = &trial->pair->twin;
    if (!judged(trial, two, three))
        return 0;
    if (twin->mode != UNKNOWN)
        twin->mode = mode;
    return 1;
}

#define CHANGE_MODE(trial, call, mode) \
    change_mode((trial), CALL2((trial), fmi2##call((trial)->two)), (int)fmi3##call((trial)->three), (mode))

static void set_debug_logging(Trial *trial)
{
    static const char *const names[] = {"logAll", "logStatusError", "logStatusWarning"};
    Pair *pair = trial->pair;
    int on = chance(80), errors = 0, warnings = 0;
    size_t count = chance(30) ? 0 : (size_t)below(4);
    fmi2String *chosen = elements(count, sizeof *chosen);
    must_be_given(trial, chosen, count);
    for (size_t i = 0; chosen != NULL && i < count; i++) {
        int number = below(3), strange = careless();
        chosen[i] = !strange ? names[number] : chance(20) ? NULL : awkward_text();
        must(trial, strange ? NO : YES);
        errors |= number < 2;
        warnings |= number != 1;
    }
    trial->effect = LOOKS;
    int done = judged(trial, (int)fmi2SetDebugLogging(trial->two, on, count, chosen),
                      (int)fmi3SetDebugLogging(trial->three, on, count, chosen));
    if (done) {
        int heard = pair->logger && on;
        pair->errors2 = heard && (count == 0 || errors);
        pair->warnings2 = heard && (count == 0 || warnings);
        /* In FMI 3.0 errors are always told, and what is not named stays. */
        pair->warnings3 = count == 0 || warnings ? heard : pair->warnings3;
    }
    free(chosen);
}

static void draw_experiment(Trial *trial, double *start, double *stop, int *ends)
{
    *ends = chance(30);
    *start = careless() ? awkward() : chance(70) ? 0.0 : uniform(-1e3, 1e3);
    *stop = careless() ? awkward() : *start + uniform(0.0, OF_SYSTEM ? 1.0 : 10.0);
    must(trial, isfinite(*start) && (!*ends || *stop >= *start) ? YES : NO);
}

static void setup_experiment(Trial *trial)
{
    double start, stop;
    int ends;
    draw_experiment(trial, &start, &stop, &ends);
    if (judged(trial, (int)fmi2SetupExperiment(trial->two, below(2), awkward(), start, ends, stop), NOT_CALLED)) {
        trial->pair->twin.time = start;
        trial->pair->twin.stop_time = ends ? stop : INFINITY;
    }
}

/* FMI 2.0 takes the times by another call, at times by the last one. */
static void enter_initialization(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    double start = twin->time, stop = twin->stop_time, value = awkward();
    int ends = isfinite(stop), anew = twin->mode == UNKNOWN || chance(50), tolerance = below(2);
    fmi2Status two = fmi2OK;
    if (anew)
        draw_experiment(trial, &start, &stop, &ends);
    trial->words = !anew || twin->mode == INSTANTIATED; /* else it names the other call */
    if (anew)
        two = fmi2SetupExperiment(trial->two, tolerance, value, start, ends, stop);
    if (two == fmi2OK)
        two = fmi2EnterInitializationMode(trial->two);
    int three = (int)fmi3EnterInitializationMode(trial->three, tolerance, value, start, ends, stop);
    if (change_mode(trial, (int)two, three, INITIALIZATION)) {
        twin->time = start;
        twin->stop_time = ends ? stop : INFINITY;
    }
}

/* Calls that commit the path: the excursion that begins by it gives one warning. */
static Twin committed(Trial *trial)
{
    Twin after = trial->pair->twin;
    int warning = twin_commit(&after);
    /* In the form with states a velocity that is not the rate of displacement gives one, too; in real time there is
     * none. */
    if (after.mode != UNKNOWN)
        trial->warnings = MODEL_REAL_TIME ? 0 : after.moved || MODEL_STATES ? -1 : warning;
    return after;
}

static void exit_initialization(Trial *trial)
{
    Twin *twin = &trial->pair->twin, after = committed(trial);
    must(trial, OF_SYSTEM ? UNSURE : possible(twin)); /* bodies may find no rest */
    if (MODEL_STATES && twin->mode != UNKNOWN)
        must(trial, fabs(twin->value[variable("omega")]) <= 1.0 ? YES : NO);
    after.mode = twin->mode == UNKNOWN ? UNKNOWN : twin->exchange ? EVENT : STEP;
    if (CHANGE_MODE(trial, ExitInitializationMode, after.mode))
        *twin = after;
}

static void terminate(Trial *trial)
{
    Mode mode = trial->pair->twin.mode;
    CHANGE_MODE(trial, Terminate, mode == INSTANTIATED || mode == INITIALIZATION ? mode : TERMINATED);
}

static void enter_event(Trial *trial)
{
    CHANGE_MODE(trial, EnterEventMode, EVENT);
}

static void reset(Trial *trial)
{
    if (CHANGE_MODE(trial, Reset, INSTANTIATED))
        trial->pair->twin = twin_of(trial->pair->twin.exchange);
}

static void cancel_step(Trial *trial)
{
    judged(trial, (int)fmi2CancelStep(trial->two), NOT_CALLED);
}

static void evaluate_discrete_states(Trial *trial)
{
    trial->effect = LOOKS;
    judged(trial, NOT_CALLED, (int)fmi3EvaluateDiscreteStates(trial->three));
}

static void new_discrete_states(Trial *trial)
{
    fmi2EventInfo *two = elements(1, sizeof *two);
    fmi3Boolean flags[5] = {1, 1, 1, 1, 1}, *first = two == NULL ? NULL : flags;
    double next = NAN;
    must_be_given(trial, two, 1);
    trial->effect = LOOKS;
    if (judged(trial, CALL2(trial, fmi2NewDiscreteStates(trial->two, two)),
               (int)fmi3UpdateDiscreteStates(trial->three, first, &flags[1], &flags[2], &flags[3], &flags[4], &next)))
        CHECK(!two->newDiscreteStatesNeeded && !two->terminateSimulation && !two->nominalsOfContinuousStatesChanged &&
                  !two->valuesOfContinuousStatesChanged && !two->nextEventTimeDefined && !flags[0] && !flags[1] &&
                  !flags[2] && !flags[3] && !flags[4],
              "an event leads to another one");
    free(two);
}

static void enter_continuous_time(Trial *trial)
{
    Twin *twin = &trial->pair->twin, after = committed(trial);
    after.held = after.side != 0;
    after.mode = twin->mode == UNKNOWN ? UNKNOWN : CONTINUOUS_TIME;
    if (CHANGE_MODE(trial, EnterContinuousTimeMode, after.mode))
        *twin = after;
}

static void completed_integrator_step(Trial *trial)
{
    Twin *twin = &trial->pair->twin, after = committed(trial);
    fmi2Boolean *event = elements(1, sizeof *event), *stops = elements(1, sizeof *stops);
    fmi3Boolean event3 = 1, stops3 = 1;
    int kept = below(2);
    must_be_given(trial, event, 1);
    must_be_given(trial, stops, 1);
    int two = CALL2(trial, fmi2CompletedIntegratorStep(trial->two, kept, event, stops));
    int three = (int)fmi3CompletedIntegratorStep(
        trial->three, kept != 0, event == NULL ? NULL : &event3, stops == NULL ? NULL : &stops3);
    if (judged(trial, two, three)) {
        CHECK(*stops == fmi2False && !stops3 && (*event != 0) == (event3 != 0), "the ends of a step differ");
        if (twin->mode != UNKNOWN)
            CHECK(*event == ((after.side != 0) != twin->held), "event mode is asked for: %d", *event);
        *twin = after;
    }
    free(event);
    free(stops);
}

static void set_time(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    double time = careless() ? awkward() : twin->time + (chance(90) ? uniform(0.0, 1e-2) : uniform(-1.0, 1.0));
    must(trial, isfinite(time) ? YES : NO);
    if (judged(trial, CALL2(trial, fmi2SetTime(trial->two, time)), (int)fmi3SetTime(trial->three, time)))
        twin->time = time;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static void check_value(Twin *twin, unsigned element, double value)
{
    const Described *of = &described[element];
    CHECK(isfinite(value) || (OF_SYSTEM && twin->mode == UNKNOWN) ||
              (twin->mode == INSTANTIATED && strcmp(of->name, "absorbed_energy") == 0),
          "%s is %g", of->name, value);
    CHECK(strcmp(of->name, "omega") != 0 || MODEL_STATES || fabs(value) <= 1.0, "omega is %g", value);
    if (twin->mode == UNKNOWN || strchr("olr", of->causality) != NULL || (OF_SYSTEM && twin->moved))
        return;
    double expected = twin->value[element];
    if (twin->moved && of->causality == 'i') {
        CHECK(fabs(value - expected) <= twin->doubt, "%s is %.17g, not %.17g", of->name, value, expected);
        twin->value[element] = value;
    } else {
        CHECK(memcmp(&value, &expected, sizeof value) == 0, "%s is %.17g, not %.17g", of->name, value, expected);
    }
}

/* FMI 2.0 reads nothing before initialization, so it goes there, and back. */
static void read_ahead(Pair *pair, const List *list)
{
    fmi2FMUstate before = NULL;
    listen(pair, pair->name);
    CHECK(fmi2GetFMUstate(pair->two, &before) == fmi2OK && fmi2EnterInitializationMode(pair->two) == fmi2OK,
          "FMI 2.0 does not go ahead");
    if (fmi2GetReal(pair->two, list->two, list->size, list->values2) == fmi2OK)
        check_equal(list->values3, list->values2, list->size, "fmi3GetFloat64");
    CHECK(fmi2SetFMUstate(pair->two, before) == fmi2OK && fmi2FreeFMUstate(pair->two, &before) == fmi2OK,
          "FMI 2.0 does not go back");
}

/* What is calculated of a system is not sure: the bodies may find no rest, which reading in initialization mode finds;
 * before it there is nothing to read in FMI 3.0. */
static void must_be_calculated(Trial *trial)
{
    Mode mode = trial->pair->twin.mode;
    if (OF_SYSTEM && mode == INSTANTIATED)
        must(trial, NO);
    must(trial, OF_SYSTEM && mode == INITIALIZATION ? UNSURE : possible(&trial->pair->twin));
}

static void get_real(Trial *trial)
{
    Pair *pair = trial->pair;
    Mode mode = pair->twin.mode;
    List list = drawn('R', READABLE);
    must_be_sound(trial, &list);
    if (!all_have(&list, "ip"))
        must_be_calculated(trial);
    int energy = holds(&list, "absorbed_energy");
    must(trial, MODEL_NO_ENERGY && energy ? NO : YES);
    /* Energy that has been read is kept account of at each step from now on. */
    trial->effect = energy || (OF_SYSTEM && (mode == INITIALIZATION || mode == UNKNOWN)) ? CHANGES : LOOKS;
    int two = list.size == 0 && OF_SYSTEM
                  ? NOT_CALLED /* which finds the rest of a system, too */
                  : (int)fmi2GetReal(trial->two, list.two, list.size, list.values2);
    int three = (int)fmi3GetFloat64(trial->three, list.three, list.count, list.values3, list.size);
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < list.size; i++)
        check_value(&pair->twin, list.two[i], list.values3[i]);
    if (done == (DONE2 | DONE3))
        check_equal(list.values3, list.values2, list.size, "fmi3GetFloat64");
    else if (done && mode == INSTANTIATED && list.size > 0 && !OF_SYSTEM)
        read_ahead(pair, &list);
    free_list(&list);
}

static void set_real(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    int early = twin->mode == INSTANTIATED || twin->mode == INITIALIZATION;
    List list = drawn('R', early || chance(20) ? SETTABLE : "isO");
    fill(&list);
    must_be_sound(trial, &list);
    if (list.sound)
        must(trial, may_set(twin, list.size, list.two, list.values2));
    int two = (int)fmi2SetReal(trial->two, list.two, list.size, list.values2);
    int three = (int)fmi3SetFloat64(trial->three, list.three, list.count, list.values3, list.size);
    if (judged(trial, two, three))
        for (size_t i = 0; i < list.size; i++)
            twin_set(twin, list.two[i], list.values2[i]);
    free_list(&list);
}

static void get_boolean(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    List list = drawn('B', READABLE);
    fmi2Boolean *values2 = elements(list.size, sizeof *values2);
    fmi3Boolean *values3 = values2 == NULL ? NULL : allocated(list.size * sizeof *values3);
    must_be_sound(trial, &list);
    must_be_given(trial, values2, list.size);
    if (list.size > 0 && OF_SYSTEM)
        must_be_calculated(trial);
    trial->effect = OF_SYSTEM && (twin->mode == INITIALIZATION || twin->mode == UNKNOWN) ? CHANGES : LOOKS;
    int two = list.size == 0 && OF_SYSTEM ? NOT_CALLED
                                          : (int)fmi2GetBoolean(trial->two, list.two, list.size, values2);
    int three = (int)fmi3GetBoolean(trial->three, list.three, list.count, values3, list.count);
    int done = judged(trial, two, three);
    for (size_t i = 0; done && i < list.size; i++) {
        int value = values3[i];
        CHECK(value == 0 || value == 1, "extrapolating is %d", value);
        CHECK(done == DONE3 || values2[i] == value, "extrapolating is %d in FMI 3.0", value);
        if (!OF_SYSTEM && possible(twin) == YES && !twin->moved)
            CHECK(value == (twin->mode == CONTINUOUS_TIME ? twin->held : side_of(twin) != 0), "extrapolating is %d",
                  value);
    }
    free(values2);
    free(values3);
    free_list(&list);
}

/* None of them is an input or a parameter. */
static void set_boolean(Trial *trial)
{
    List list = drawn('B', READABLE);
    int *values = elements(list.size, sizeof *values);
    must_be_sound(trial, &list);
    must_be_given(trial, values, list.size);
    must(trial, list.size == 0 ? YES : NO);
    trial->effect = LOOKS;
    judged(trial, (int)fmi2SetBoolean(trial->two, list.two, list.size, values),
           (int)fmi3SetBoolean(trial->three, list.three, list.count, (const fmi3Boolean *)values, list.count));
    free(values);
    free_list(&list);
}

/* Of which there are no variables. */
static void other_types(Trial *trial)
{
    int integers = trial->call == CALL_GetInteger || trial->call == CALL_SetInteger;
    List list = drawn(integers ? 'I' : 'S', READABLE);
    void *values = elements(list.size, sizeof(fmi2String));
    fmi2Status two;
    must_be_sound(trial, &list);
    must_be_given(trial, values, list.size);
    must(trial, list.size == 0 ? YES : NO);
    trial->effect = LOOKS;
    switch (trial->call) {
    case CALL_GetInteger: two = fmi2GetInteger(trial->two, list.two, list.size, values); break;
    case CALL_SetInteger: two = fmi2SetInteger(trial->two, list.two, list.size, values); break;
    case CALL_GetString: two = fmi2GetString(trial->two, list.two, list.size, values); break;
    default: two = fmi2SetString(trial->two, list.two, list.size, values);
    }
    judged(trial, (int)two, NOT_CALLED);
    free(values);
    free_list(&list);
}

/* The time and the event indicator, which are variables of FMI 3.0. */
static void own_variables(Trial *trial)
{
    Pair *pair = trial->pair;
    const fmi3ValueReference references[] = {TIME3, INDICATOR3};
    size_t count = 1 + (size_t)(INDICATORS && below(2));
    double values[2] = {NAN, NAN}, indicator = NAN;
    trial->effect = LOOKS;
    if (!judged(trial, NOT_CALLED, (int)fmi3GetFloat64(trial->three, references, count, values, count)))
        return;
    CHECK(pair->twin.mode == UNKNOWN || values[0] == pair->twin.time, "the time is %.17g, not %.17g", values[0],
          pair->twin.time);
    listen(pair, pair->name);
    if (count > 1 && pair->twin.exchange && fmi2GetEventIndicators(pair->two, &indicator, 1) == fmi2OK)
        check_equal(&values[1], &indicator, 1, "the event indicator");
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

static int directional(const Trial *trial, const List *unknown, const List *known, const double seeds[], double found[])
{
    return (int)fmi3GetDirectionalDerivative(trial->three, unknown->three, unknown->count, known->three, known->count,
                                             seeds, known->size, found, unknown->size);
}

/* The adjoint derivative has the same matrix, up to rounding of the sum of its terms' sizes. */
static void compare_transpose(const Trial *trial, const List *unknown, const List *known)
{
    static const double ROUNDING = 1e-12;
    size_t height = unknown->size, width = known->size;
    double *weights = allocated(height * 8), *column = allocated(height * 8), *unit = calloc(width, 8);
    double *adjoint = allocated(width * 8);
    CHECK(unit != NULL, "the test has no memory");
    for (size_t i = 0; i < height; i++)
        weights[i] = uniform(-1.0, 1.0) * (chance(20) ? 1e6 : 1.0);
    fmi3Status status = fmi3GetAdjointDerivative(trial->three, unknown->three, unknown->count, known->three,
                                                 known->count, weights, height, adjoint, width);
    CHECK(status == fmi3OK, "fmi3GetAdjointDerivative has the status %d", (int)status);
    for (size_t k = 0; k < width; k++) {
        double sum = 0.0, size = 0.0;
        unit[k] = 1.0;
        CHECK(directional(trial, unknown, known, unit, column) == fmi3OK, "a column of the Jacobian is refused");
        unit[k] = 0.0;
        for (size_t i = 0; i < height; i++) {
            sum += weights[i] * column[i];
            size += fabs(weights[i] * column[i]);
        }
        CHECK(fabs(adjoint[k] - sum) <= ROUNDING * size + DBL_MIN,
              "the adjoint derivative %zu is %.17g, and by columns %.17g", k, adjoint[k], sum);
    }
    statistics.transposed++;
    free(weights);
    free(column);
    free(unit);
    free(adjoint);
}

static void must_have_derivatives(Trial *trial, const List *unknown, const List *known)
{
    const Twin *twin = &trial->pair->twin;
    Answer early = twin->mode == INITIALIZATION ? YES : twin->mode == UNKNOWN ? UNSURE : NO;
    must(trial, all_have(unknown, "oOr") && all_have(known, SETTABLE) ? YES : NO);
    must(trial, MODEL_NO_ENERGY && holds(unknown, "absorbed_energy") ? NO : YES);
    if (!MODEL_STATES && holds(unknown, "absorbed_energy") && !all_have(known, "i"))
        must(trial, early);
    if (!MODEL_STATES && holds(known, "input_resolution"))
        must(trial, early);
    if (MODEL_REAL_TIME && !MODEL_STATES && !all_have(known, "i"))
        must(trial, early == NO ? UNSURE : early); /* by parameters that shape the path there are none */
    must(trial, both(possible(twin), is_smooth(twin)));
}

static void directional_derivative(Trial *trial)
{
    List unknown = drawn('R', "oOr"), known = drawn('R', SETTABLE);
    fill(&known);
    must_be_sound(trial, &unknown);
    must_be_sound(trial, &known);
    int plain = known.sound && unknown.size > 0 && known.size > 0 && unknown.size * known.size < 200;
    if (OF_SYSTEM) {
        must(trial, unknown.size == 0 ? YES : NO);
    } else {
        must_have_derivatives(trial, &unknown, &known);
        for (size_t i = 0; known.sound && i < known.size; i++) {
            must(trial, isfinite(known.values2[i]) ? YES : NO);
            /* What a large one is multiplied with may be infinite. */
            if (!(fabs(known.values2[i]) <= 1e50))
                trial->kept = both(trial->kept, UNSURE);
            plain = plain && fabs(known.values2[i]) <= 1e13;
        }
    }
    trial->effect = LOOKS;
    trial->words = 0; /* which of several reasons is named is open */
    int two = (int)fmi2GetDirectionalDerivative(trial->two, unknown.two, unknown.size, known.two, known.size,
                                                known.values2, unknown.values2);
    int three = OF_SYSTEM && unknown.size == 0 ? NOT_CALLED
                                               : directional(trial, &unknown, &known, known.values2, unknown.values3);
    if (judged(trial, two, three) && three != NOT_CALLED) {
        for (size_t i = 0; i < unknown.size; i++)
            CHECK(isfinite(unknown.values2[i]), "the derivative of %s is not finite", described[unknown.two[i]].name);
        check_equal(unknown.values3, unknown.values2, unknown.size, "fmi3GetDirectionalDerivative");
        if (plain && unknown.sound)
            compare_transpose(trial, &unknown, &known);
    }
    free_list(&unknown);
    free_list(&known);
}

static int *orders_of(Trial *trial, size_t count, int highest)
{
    int *made = elements(count, sizeof *made);
    must_be_given(trial, made, count);
    for (size_t i = 0; made != NULL && i < count; i++) {
        made[i] = careless() ? (int[]){0, -1, 3, INT_MIN}[below(4)] : 1 + below(highest);
        must(trial, made[i] >= 1 && made[i] <= highest ? YES : NO);
    }
    return made;
}

static void input_derivatives(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    List list = drawn('R', "i");
    int *orders = orders_of(trial, list.size, OF_SYSTEM ? 1 : 2);
    must_be_sound(trial, &list);
    must(trial, all_have(&list, "i") && !(MODEL_BRANCHES && list.size > 0) ? YES : NO);
    for (size_t i = 0; list.values2 != NULL && i < list.size; i++) {
        list.values2[i] = careless() ? awkward() : uniform(-1.0, 1.0) * pow(10.0, uniform(-3.0, OF_SYSTEM ? 4.0 : 3.0));
        must(trial, isfinite(list.values2[i]) ? YES : NO);
    }
    if (judged(trial, (int)fmi2SetRealInputDerivatives(trial->two, list.two, list.size, orders, list.values2),
               NOT_CALLED))
        for (size_t i = 0; i < list.size; i++) {
            *(orders[i] == 1 ? &twin->velocity : &twin->acceleration) = list.values2[i];
            twin->interpolated = 1;
            twin->moved |= OF_SYSTEM;
        }
    free(orders);
    free_list(&list);
}

static void output_derivatives(Trial *trial)
{
    List list = drawn('R', "oO");
    int *orders = orders_of(trial, list.size, 1);
    must_be_sound(trial, &list);
    must(trial, all_have(&list, "oO") ? YES : NO);
    must(trial, MODEL_NO_ENERGY && holds(&list, "absorbed_energy") ? NO : YES);
    if (list.size > 0) {
        must(trial, OF_SYSTEM ? NO : is_smooth(&trial->pair->twin));
        trial->kept = both(trial->kept, OF_SYSTEM ? YES : rate_possible(&trial->pair->twin));
    }
    trial->effect = LOOKS;
    trial->words = trial->words && orders != NULL;
    int two = (int)fmi2GetRealOutputDerivatives(trial->two, list.two, list.size, orders, list.values2);
    int three = (int)fmi3GetOutputDerivatives(trial->three, list.three, list.count, orders, list.values3, list.size);
    if (judged(trial, two, three)) {
        for (size_t i = 0; i < list.size; i++)
            CHECK(isfinite(list.values2[i]), "the rate of %s is not finite", described[list.two[i]].name);
        check_equal(list.values3, list.values2, list.size, "fmi3GetOutputDerivatives");
    }
    free(orders);
    free_list(&list);
}

/* ---- model exchange ---------------------------------------------------------------------------------------------- */

/* No continuous states and one event indicator, or states, those by their references, and no indicator. */
static void continuous(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    fmi2Component two = trial->two;
    fmi3Instance three = trial->three;
    int sets = trial->call == CALL_SetContinuousStates;
    size_t expected = trial->call == CALL_GetEventIndicators ? INDICATORS : MODEL_STATES;
    size_t count = !careless() ? expected : chance(20) ? SIZE_MAX : count_of_elements();
    size_t room = count < 5000 ? count : 1;
    double *values2 = elements(room, sizeof *values2);
    double *values3 = values2 == NULL ? NULL : allocated(room * sizeof *values3);
    must(trial, count == expected ? YES : NO);
    must_be_given(trial, values2, count);
    for (size_t i = 0; values2 != NULL && i < room; i++) {
        values2[i] = values3[i] = careless() ? awkward() : uniform(-1.2, 1.2);
        must(trial, !sets || fabs(values2[i]) <= 1e100 ? YES : NO);
    }
    if (count > 0 && (trial->call == CALL_GetDerivatives || trial->call == CALL_GetContinuousStates))
        must(trial, possible(twin));
    /* Reading absorbed_energy leaves a mark. */
    trial->effect = sets || trial->call == CALL_GetContinuousStates ? CHANGES : LOOKS;
#define BOTH_OF(two_name, three_name) \
    case CALL_##two_name: \
        done = judged(trial, CALL2(trial, fmi2##two_name(two, values2, count)), \
                      (int)fmi3##three_name(three, values3, count)); \
        break;
    int done = 0;
    switch (trial->call) {
    BOTH_OF(SetContinuousStates, SetContinuousStates)
    BOTH_OF(GetContinuousStates, GetContinuousStates)
    BOTH_OF(GetDerivatives, GetContinuousStateDerivatives)
    BOTH_OF(GetEventIndicators, GetEventIndicators)
    BOTH_OF(GetNominalsOfContinuousStates, GetNominalsOfContinuousStates)
    default: FAIL("there is no such call");
    }
    for (size_t i = 0; done && i < expected && possible(twin) == YES; i++)
        CHECK(isfinite(done & DONE2 ? values2[i] : values3[i]), "%s gives %g", rows[trial->call].name, values2[i]);
    for (unsigned i = 0, k = 0; done && sets && i < MODEL_VARIABLES; i++)
        if (strchr("sO", described[i].causality) != NULL)
            twin_set(twin, i, values2[k++]);
    if (done == (DONE2 | DONE3))
        check_equal(values3, values2, expected, rows[trial->call].name);
    free(values2);
    free(values3);
}

static void get_number(Trial *trial)
{
    int states = trial->call == CALL_GetNumberOfContinuousStates;
    size_t number = 77, *to = careless() ? NULL : &number;
    must_be_given(trial, to, 1);
    trial->effect = LOOKS;
    if (judged(trial, NOT_CALLED,
               (int)(states ? fmi3GetNumberOfContinuousStates : fmi3GetNumberOfEventIndicators)(trial->three, to)))
        CHECK(number == (size_t)(states ? MODEL_STATES : INDICATORS), "%s gives %zu", rows[trial->call].name, number);
}

/* ---- co-simulation ----------------------------------------------------------------------------------------------- */

/* A system would take long for other awkward ones, or for more than some hundred internal steps. */
static double size_of_step(const Twin *twin)
{
    static const double quick[] = {NAN, INFINITY, -INFINITY, -1.0, -5e-324, 5e-324, DBL_MAX, 1e18, -0.0};
    if (careless())
        return OF_SYSTEM ? quick[below(sizeof quick / sizeof *quick)] : awkward();
    if (chance(10))
        return 0.0;
    return OF_SYSTEM ? twin->value[variable("step")] * uniform(0.0, chance(90) ? 8.0 : 100.0)
                     : pow(10.0, uniform(-6.0, 1.0));
}

static void do_step(Trial *trial)
{
    Twin *twin = &trial->pair->twin, after = *twin;
    double time = careless() ? awkward() : twin->time, size = size_of_step(twin), last = NAN, reached = time + size;
    fmi3Boolean flags[3] = {1, 1, 1};
    int kept = below(2);
    trace("    time %.17g, size %.17g", time, size);
    must(trial, step_possible(twin, time, size));
    twin_step(&after, time, size);
    int warning = twin_commit(&after);
    if (twin->mode != UNKNOWN && !OF_SYSTEM)
        trial->warnings = MODEL_REAL_TIME ? 0 : twin->interpolated || twin->moved ? -1 : warning;
    else
        trial->warnings = -1;
    int two = (int)fmi2DoStep(trial->two, time, size, kept);
    int three = (int)fmi3DoStep(trial->three, time, size, kept != 0, &flags[0], &flags[1], &flags[2], &last);
    if (judged(trial, two, three)) {
        CHECK(!flags[0] && !flags[1] && !flags[2], "a step ends early");
        check_equal(&last, &reached, 1, "lastSuccessfulTime");
        *twin = after;
    } else if (trial->three != NULL && twin->mode == STEP && !twin->interpolated) {
        check_equal(&last, &twin->time, 1, "lastSuccessfulTime of a refused step");
    }
}

/* All that can be asked is the time of the last step, and whether the FMU wants to end. */
static void status_of_step(Trial *trial)
{
    Twin *twin = &trial->pair->twin;
    int kind = careless() ? (int[]){-1, 4, INT_MAX}[below(3)] : below(4);
    int known = (trial->call == CALL_GetRealStatus && kind == fmi2LastSuccessfulTime) ||
                (trial->call == CALL_GetBooleanStatus && kind == fmi2Terminated);
    void *value = elements(1, sizeof(fmi2String));
    fmi2Status two;
    trial->kept = both(trial->kept, known ? YES : NO);
    trial->effect = LOOKS;
    must_be_given(trial, value, 1);
    switch (trial->call) {
    case CALL_GetStatus: two = fmi2GetStatus(trial->two, (fmi2StatusKind)kind, value); break;
    case CALL_GetRealStatus: two = fmi2GetRealStatus(trial->two, (fmi2StatusKind)kind, value); break;
    case CALL_GetIntegerStatus: two = fmi2GetIntegerStatus(trial->two, (fmi2StatusKind)kind, value); break;
    case CALL_GetBooleanStatus: two = fmi2GetBooleanStatus(trial->two, (fmi2StatusKind)kind, value); break;
    default: two = fmi2GetStringStatus(trial->two, (fmi2StatusKind)kind, value);
    }
    if (judged(trial, (int)two, NOT_CALLED) && twin->mode != UNKNOWN) {
        if (trial->call == CALL_GetRealStatus)
            check_equal(value, &twin->time, 1, "the time of the last step");
        else
            CHECK(*(fmi2Boolean *)value == fmi2False, "the FMU wants to end");
    }
    free(value);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

#define ROW_OF_BOTH(two, three, modes2, modes3, try) {#two, "fmi2" #two, "fmi3" #three, modes2, modes3, try},
#define ROW_OF_TWO(two, modes, try) {#two, "fmi2" #two, NULL, modes, "", try},
#define ROW_OF_THREE(three, modes, try) {#three, NULL, "fmi3" #three, "", modes, try},
const Row rows[CALL_COUNT] = {CALLS(ROW_OF_BOTH, ROW_OF_TWO, ROW_OF_THREE)};

int next_call(const Pair *pair)
{
    static const int forth[][8] = {
        [INSTANTIATED] = {CALL_SetupExperiment, CALL_EnterInitializationMode, CALL_EnterInitializationMode,
                          CALL_EnterInitializationMode, CALL_SetReal, CALL_SetRealInputDerivatives, CALL_SetFMUstate,
                          CALL_DeSerializeFMUstate},
        [INITIALIZATION] = {CALL_SetReal, CALL_GetReal, CALL_ExitInitializationMode, CALL_ExitInitializationMode,
                            CALL_ExitInitializationMode, CALL_ExitInitializationMode, CALL_GetBoolean,
                            CALL_GetDirectionalDerivative},
        [EVENT] = {CALL_NewDiscreteStates, CALL_EnterContinuousTimeMode, CALL_EnterContinuousTimeMode,
                   CALL_EnterContinuousTimeMode, CALL_GetBoolean, CALL_SetReal, CALL_SetTime, CALL_GetReal},
        [CONTINUOUS_TIME] = {CALL_SetTime, CALL_SetReal, CALL_GetReal, CALL_GetEventIndicators,
                             CALL_CompletedIntegratorStep, CALL_CompletedIntegratorStep, CALL_EnterEventMode,
                             CALL_GetDirectionalDerivative},
        [STEP] = {CALL_SetReal, CALL_DoStep, CALL_DoStep, CALL_GetReal, CALL_SetRealInputDerivatives, CALL_GetBoolean,
                  CALL_GetRealOutputDerivatives, CALL_GetDirectionalDerivative},
        [TERMINATED] = {CALL_Reset, CALL_Reset, CALL_GetReal, CALL_GetReal, CALL_SetFMUstate, CALL_GetBoolean,
                        CALL_GetRealStatus, CALL_Reset},
        [UNKNOWN] = {CALL_Reset, CALL_DoStep, CALL_GetReal, CALL_SetReal, CALL_CompletedIntegratorStep,
                     CALL_ExitInitializationMode, CALL_GetDirectionalDerivative, CALL_EnterContinuousTimeMode},
    };
    return chance(60) ? forth[pair->twin.mode][below(8)] : below(CALL_COUNT);
}

void try_call(Pair *pair, int call)
{
    Trial trial = trial_of(pair, call);
    rows[call].try(&trial);
}

void move_on(Pair *pair)
{
    for (int k = 1 + below(5); k > 0; k--) {
        int exchange = pair->twin.exchange;
        if (exchange && pair->twin.mode == EVENT)
            try_call(pair, CALL_EnterContinuousTimeMode);
        if (exchange)
            try_call(pair, CALL_SetTime);
        try_call(pair, CALL_SetReal);
        try_call(pair, exchange ? CALL_CompletedIntegratorStep : CALL_DoStep);
    }
}
