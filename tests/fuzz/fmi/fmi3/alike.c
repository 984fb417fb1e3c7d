/* Calls that both versions have, done by both. */
#include "pairs.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Calls FMI 3.0 and, where that is legal, FMI 2.0; whether it was done. */
#define BOTH(pair, call, three, two) \
    both_done((pair), CALL3_##call, (three), is_legal((pair), CALL3_##call) ? (int)(two) : NOT_LEGAL, 1)
enum { NOT_LEGAL = -1 };

static int both_done(Pair *pair, Call3 call, fmi3Status three, int two, int same_words)
{
    return settled(pair, call, (int)three, two == NOT_LEGAL ? fmi3Error : two, same_words && two != NOT_LEGAL);
}

static fmi2Status initialize_two(const Pair *pair, double start, int ends, double stop)
{
    fmi2Status status = fmi2SetupExperiment(pair->two, below(2), awkward(), start, ends, stop);
    return status == fmi2OK ? fmi2EnterInitializationMode(pair->two) : status;
}

static void enter_initialization(Pair *pair)
{
    int ends = chance(30);
    double start = careless() ? awkward() : chance(70) ? 0.0 : uniform(-1e3, 1e3);
    double stop = careless() ? awkward() : start + uniform(0.0, 10.0);
    fmi3Status three = fmi3EnterInitializationMode(pair->three, below(2), awkward(), start, ends, stop);
    if (BOTH(pair, EnterInitializationMode, three, initialize_two(pair, start, ends, stop))) {
        pair->mode = INITIALIZATION;
        pair->time = start;
    }
}

static void change_mode(Pair *pair, Call3 call, fmi3Status (*three)(fmi3Instance), fmi2Status (*two)(fmi2Component),
                        Mode mode)
{
    fmi3Status status = three(pair->three);
    if (both_done(pair, call, status, is_legal(pair, call) ? (int)two(pair->two) : NOT_LEGAL, 1))
        pair->mode = mode;
}

static void reset(Pair *pair)
{
    if (BOTH(pair, Reset, fmi3Reset(pair->three), fmi2Reset(pair->two))) {
        pair->mode = INSTANTIATED;
        pair->time = 0.0;
    }
}

/* Of FMI 3.0 alone: FMI 2.0 tells everything here, and so says which warnings are due. */
static void set_debug_logging(Pair *pair)
{
    static const char *const names[] = {"logAll", "logStatusWarning", "logStatusError"};
    fmi3String chosen[4];
    size_t count = (size_t)below(4);
    int on = below(2), known = 1, warnings = count == 0;
    for (size_t i = 0; i < count; i++) {
        int number = below(3), strange = careless();
        chosen[i] = !strange ? names[number] : chance(20) ? NULL : awkward_text();
        known = known && !strange;
        warnings |= number < 2;
    }
    fmi3String *categories = exactly(chosen, count * sizeof *chosen);
    fmi3Status status = fmi3SetDebugLogging(pair->three, on, count, categories);
    if (settled(pair, CALL3_SetDebugLogging, (int)status, known ? fmi3OK : fmi3Error, 0) && warnings)
        pair->warns = pair->logger && on;
    free(categories);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* Whether the event indicator can be asked of FMI 2.0 in this mode. */
static int has_indicator(const Pair *pair)
{
    return is_legal(pair, CALL3_GetEventIndicators);
}

/* FMI 2.0 reads nothing before initialization, so it goes there, and back. */
static fmi2FMUstate go_ahead(Pair *pair)
{
    fmi2FMUstate before = NULL;
    CHECK(pair->mode != INSTANTIATED ||
              (fmi2GetFMUstate(pair->two, &before) == fmi2OK && fmi2EnterInitializationMode(pair->two) == fmi2OK),
          "FMI 2.0 does not go ahead");
    return before;
}

static void go_back(Pair *pair, fmi2FMUstate before)
{
    CHECK(before == NULL ||
              (fmi2SetFMUstate(pair->two, before) == fmi2OK && fmi2FreeFMUstate(pair->two, &before) == fmi2OK),
          "FMI 2.0 does not go back");
}

static fmi2Status read_two(Pair *pair, const List *list, double *values)
{
    fmi2FMUstate before = go_ahead(pair);
    fmi2Status status = fmi2OK;
    for (size_t i = 0; i < list->size && status == fmi2OK; i++) {
        values[i] = pair->time;
        if (list->elements[i] == INDICATOR)
            status = has_indicator(pair) ? fmi2GetEventIndicators(pair->two, &values[i], 1) : fmi2OK;
        else if (list->elements[i] != TIME)
            status = fmi2GetReal(pair->two, &list->elements[i], 1, &values[i]);
    }
    go_back(pair, before);
    return status;
}

static int holds_outputs(const List *list)
{
    for (size_t i = 0; i < list->size; i++)
        if (kind_of(list->elements[i]) == 'o')
            return 1;
    return 0;
}

/* Of a system nothing calculated can be read before initialization mode. */
static void get_float64(Pair *pair)
{
    List list = some_variables("iolpsOrte");
    double *two = allocated(list.size * sizeof *two);
    fmi3FMUState before = NULL;
    /* That energy has been read is part of the state, and FMI 2.0 forgets it on its way back. */
    int returns = pair->mode == INSTANTIATED && holds(&list, ABSORBED_ENERGY);
    CHECK(!returns || fmi3GetFMUState(pair->three, &before) == fmi3OK, "a state cannot be taken");
    fmi3Status three = fmi3GetFloat64(pair->three, list.references, list.count, list.values, list.size);
    int is_early = OF_SYSTEM && pair->mode == INSTANTIATED && holds_outputs(&list);
    fmi2Status status = is_early ? fmi2Error : read_two(pair, &list, two);
    if (returns)
        CHECK(fmi3SetFMUState(pair->three, before) == fmi3OK && fmi3FreeFMUState(pair->three, &before) == fmi3OK,
              "no way back");
    if (both_done(pair, CALL3_GetFloat64, three, (int)status, !is_early))
        for (size_t i = 0; i < list.size; i++) {
            if (list.elements[i] == INDICATOR && !has_indicator(pair))
                two[i] = list.values[i];
            CHECK(isfinite(list.values[i]) || list.elements[i] == ABSORBED_ENERGY, "what is read is not finite");
            check_equal(&list.values[i], &two[i], 1, "fmi3GetFloat64");
        }
    free(two);
    free_list(&list);
}

static void set_float64(Pair *pair)
{
    int any = pair->mode == INSTANTIATED || pair->mode == INITIALIZATION || chance(30);
    List list = some_variables(careless() ? "iolpsOr" : any ? "ipsO" : "is");
    fill_usually(&list);
    fmi3Status three = fmi3SetFloat64(pair->three, list.references, list.count, list.values, list.size);
    BOTH(pair, SetFloat64, three, fmi2SetReal(pair->two, list.elements, list.size, list.values));
    free_list(&list);
}

static void set_displacement(Pair *pair, double value)
{
    fmi3Status three = fmi3SetFloat64(pair->three, (fmi3ValueReference[]){DISPLACEMENT3}, 1, &value, 1);
    BOTH(pair, SetFloat64, three, fmi2SetReal(pair->two, (fmi2ValueReference[]){0}, 1, &value));
}

static void get_boolean(Pair *pair)
{
    /* For no variables FMI 2.0 brings a system to rest, too. */
    size_t count = OF_SYSTEM ? (size_t)(1 + below(3)) : (size_t)below(4);
    fmi3ValueReference references[3] = {EXTRAPOLATING3, EXTRAPOLATING3, EXTRAPOLATING3};
    fmi3Boolean three[3] = {0, 0, 0};
    fmi2Boolean two[3] = {0, 0, 0};
    fmi3Status status = fmi3GetBoolean(pair->three, references, count, three, count);
    int is_early = OF_SYSTEM && pair->mode == INSTANTIATED;
    fmi2FMUstate before = go_ahead(pair);
    fmi2Status expected =
        fmi2GetBoolean(pair->two, (fmi2ValueReference[]){EXTRAPOLATING, EXTRAPOLATING, EXTRAPOLATING}, count, two);
    go_back(pair, before);
    if (!settled(pair, CALL3_GetBoolean, (int)status, is_early ? fmi3Error : (int)expected, !is_early))
        return;
    for (size_t i = 0; i < count; i++)
        CHECK((three[i] != 0) == (two[i] != 0), "`extrapolating` differs");
}

static void set_boolean(Pair *pair)
{
    size_t count = chance(50) ? 0 : 1;
    fmi3Status three =
        fmi3SetBoolean(pair->three, (fmi3ValueReference[]){EXTRAPOLATING3}, count, (fmi3Boolean[]){1}, count);
    BOTH(pair, SetBoolean, three,
         fmi2SetBoolean(pair->two, (fmi2ValueReference[]){EXTRAPOLATING}, count, (fmi2Boolean[]){1}));
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

static double seed_value(void)
{
    return careless()   ? awkward()
           : chance(80) ? uniform(-1.0, 1.0)
           : chance(50) ? 0.0
                        : pow(10.0, uniform(-12.0, 12.0));
}

static fmi3Status directional(Pair *pair, const List *unknowns, const List *knowns, const double *seeds, double *values)
{
    return fmi3GetDirectionalDerivative(pair->three, unknowns->references, unknowns->count, knowns->references,
                                        knowns->count, seeds, knowns->size, values, unknowns->size);
}

/* The transpose has the same products: <w, J s> = <J' w, s>, each up to rounding of the sum of its terms' sizes. */
static void compare_transpose(Pair *pair, const List *unknowns, const List *knowns)
{
    static const double ROUNDING = 1e-12;
    size_t rows = unknowns->size, columns = knowns->size;
    double *weights = exactly(unknowns->values, rows * sizeof *weights),
           *column = exactly(unknowns->values, rows * sizeof *column);
    double *adjoint = exactly(knowns->values, columns * sizeof *adjoint), *unit = calloc(columns, sizeof *unit);
    double sums[2] = {0.0, 0.0}, size = 0.0;
    for (size_t i = 0; i < rows; i++)
        weights[i] = uniform(-1.0, 1.0) * (chance(20) ? 1e6 : 1.0);
    listen(pair);
    fmi3Status status = fmi3GetAdjointDerivative(pair->three, unknowns->references, unknowns->count, knowns->references,
                                                 knowns->count, weights, rows, adjoint, columns);
    settled(pair, CALL3_GetAdjointDerivative, (int)status, fmi3OK, 0);
    CHECK(unit != NULL, "the test has no memory");
    for (size_t k = 0; k < columns; k++) {
        double sum = 0.0, of_terms = 0.0;
        unit[k] = 1.0;
        CHECK(directional(pair, unknowns, knowns, unit, column) == fmi3OK, "a column of the Jacobian is refused");
        unit[k] = 0.0;
        for (size_t i = 0; i < rows; i++) {
            sum += weights[i] * column[i];
            of_terms += fabs(weights[i] * column[i]);
        }
        CHECK(fabs(adjoint[k] - sum) <= ROUNDING * of_terms + DBL_MIN,
              "the adjoint derivative %zu is %.17g, and by columns %.17g", k, adjoint[k], sum);
        sums[0] += adjoint[k] * knowns->values[k];
        size += of_terms * fabs(knowns->values[k]);
    }
    for (size_t i = 0; i < rows; i++)
        sums[1] += weights[i] * unknowns->values[i];
    CHECK(fabs(sums[0] - sums[1]) <= ROUNDING * size + DBL_MIN, "the products of the Jacobian are %.17g and %.17g",
          sums[0], sums[1]);
    statistics3.transposed++;
    free(weights);
    free(column);
    free(adjoint);
    free(unit);
}

static void compare_derivatives(Pair *pair, Call3 call)
{
    /* Of energy there are derivatives by parameters in initialization mode only. */
    int any = pair->mode == INITIALIZATION || MODEL_STATES || chance(70);
    List unknowns = some_variables(careless() ? "iolpsOr" : "oOr");
    List knowns = some_variables(careless() ? "iolpsOr" : any ? "isOp" : "i");
    double *two = allocated(unknowns.size * sizeof *two);
    int plain = 1;
    for (size_t i = 0; i < knowns.size; i++) {
        knowns.values[i] = seed_value();
        plain = plain && fabs(knowns.values[i]) < 1e13;
    }
    fmi3Status three = directional(pair, &unknowns, &knowns, knowns.values, unknowns.values);
    int legal = is_legal(pair, CALL3_GetDirectionalDerivative);
    fmi2Status status = legal ? fmi2GetDirectionalDerivative(pair->two, unknowns.elements, unknowns.size,
                                                             knowns.elements, knowns.size, knowns.values, two)
                              : fmi2Error;
    if (settled(pair, CALL3_GetDirectionalDerivative, (int)three, (int)status, 0)) {
        check_equal(unknowns.values, two, unknowns.size, "fmi3GetDirectionalDerivative");
        if (plain && unknowns.size * knowns.size > 0 && unknowns.size * knowns.size < 200)
            compare_transpose(pair, &unknowns, &knowns);
    } else if (call == CALL3_GetAdjointDerivative && (!legal || (plain && status == fmi2Error))) {
        for (size_t i = 0; i < unknowns.size; i++)
            two[i] = 1.0;
        listen(pair);
        three = fmi3GetAdjointDerivative(pair->three, unknowns.references, unknowns.count, knowns.references,
                                         knowns.count, two, unknowns.size, knowns.values, knowns.size);
        settled(pair, CALL3_GetAdjointDerivative, (int)three, fmi3Error, 0);
    }
    free(two);
    free_list(&unknowns);
    free_list(&knowns);
}

static void compare_rates(Pair *pair)
{
    List list = some_variables(careless() ? "iolpsOr" : "o");
    double *two = allocated(list.size * sizeof *two);
    fmi3Int32 *orders = allocated(list.count * sizeof *orders);
    for (size_t i = 0; i < list.count; i++)
        orders[i] = careless() ? below(4) - 1 : 1;
    fmi3Status three =
        fmi3GetOutputDerivatives(pair->three, list.references, list.count, orders, list.values, list.size);
    /* In FMI 2.0 each element has an order; arrays are refused for what they are. */
    fmi2Integer *orders2 = allocated(list.size * sizeof *orders2);
    for (size_t i = 0; i < list.size; i++)
        orders2[i] = list.size == list.count ? orders[i] : 1;
    int legal = is_legal(pair, CALL3_GetOutputDerivatives);
    fmi2Status status =
        legal ? fmi2GetRealOutputDerivatives(pair->two, list.elements, list.size, orders2, two) : fmi2Error;
    if (settled(pair, CALL3_GetOutputDerivatives, (int)three, (int)status, 0))
        check_equal(list.values, two, list.size, "fmi3GetOutputDerivatives");
    free(two);
    free(orders);
    free(orders2);
    free_list(&list);
}

/* ---- model exchange ---------------------------------------------------------------------------------------------- */

static void evaluate_discrete_states(Pair *pair)
{
    fmi3Status status = fmi3EvaluateDiscreteStates(pair->three);
    settled(pair, CALL3_EvaluateDiscreteStates, (int)status,
            is_legal(pair, CALL3_EvaluateDiscreteStates) ? fmi3OK : fmi3Error, 0);
}

static void update_discrete_states(Pair *pair)
{
    fmi3Boolean flags[5] = {1, 1, 1, 1, 1};
    fmi3Float64 next = NAN;
    fmi2EventInfo two;
    fmi3Status three =
        fmi3UpdateDiscreteStates(pair->three, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4], &next);
    if (BOTH(pair, UpdateDiscreteStates, three, fmi2NewDiscreteStates(pair->two, &two)))
        CHECK(!(flags[0] || flags[1] || flags[2] || flags[3] || flags[4]), "an event leads to another one");
}

static void completed_step(Pair *pair)
{
    fmi3Boolean three_event = 1, three_end = 1;
    fmi2Boolean two_event = 1, two_end = 1;
    fmi3Status three = fmi3CompletedIntegratorStep(pair->three, below(2), &three_event, &three_end);
    if (BOTH(pair, CompletedIntegratorStep, three, fmi2CompletedIntegratorStep(pair->two, 1, &two_event, &two_end)))
        CHECK((three_event != 0) == (two_event != 0) && !three_end, "the ends of an integrator step differ");
}

static void set_time(Pair *pair)
{
    double time =
        careless() ? awkward() : pair->time + uniform(-0.1, 1.0) * (chance(10) ? 0.0 : pow(10.0, uniform(-6.0, 0.0)));
    fmi3Status three = fmi3SetTime(pair->three, time);
    if (BOTH(pair, SetTime, three, fmi2SetTime(pair->two, time)))
        pair->time = time;
}

static void set_continuous_states(Pair *pair)
{
    double states[MODEL_STATES + 1];
    for (size_t i = 0; i <= MODEL_STATES; i++)
        states[i] = careless() ? awkward() : uniform(-1.2, 1.2);
    fmi3Status three = fmi3SetContinuousStates(pair->three, states, MODEL_STATES);
    BOTH(pair, SetContinuousStates, three, fmi2SetContinuousStates(pair->two, states, MODEL_STATES));
}

/* What fills so many doubles in both versions; in initialization mode only FMI 3.0 gives nominal values. */
static void get_vector(Pair *pair, Call3 call, fmi3Status (*three)(fmi3Instance, fmi3Float64 *, size_t),
                       fmi2Status (*two)(fmi2Component, fmi2Real *, size_t), size_t count)
{
    double *values = allocated(count * sizeof *values), *others = allocated(count * sizeof *others);
    int alone = call == CALL3_GetNominalsOfContinuousStates && pair->mode == INITIALIZATION;
    fmi3Status status = three(pair->three, values, count);
    int expected = !is_legal(pair, call) ? NOT_LEGAL : alone ? fmi2OK : (int)two(pair->two, others, count);
    if (both_done(pair, call, status, expected, 1) && !alone)
        check_equal(values, others, count, call3_names[call]);
    free(values);
    free(others);
}

static void get_number(Pair *pair, Call3 call, fmi3Status (*three)(fmi3Instance, size_t *), size_t expected)
{
    size_t number = 77;
    fmi3Status status = three(pair->three, &number);
    if (settled(pair, call, (int)status, is_legal(pair, call) ? fmi3OK : fmi3Error, 0))
        CHECK(number == expected, "fmi3%s gives %zu, not %zu", call3_names[call], number, expected);
}

/* ---- co-simulation ----------------------------------------------------------------------------------------------- */

/* A system would take long for some of them. */
static double awkward_size(void)
{
    static const double quick[] = {NAN, INFINITY, -INFINITY, -1.0, -5e-324, 5e-324, DBL_MAX, 1e18, -0.0};
    return OF_SYSTEM ? quick[below(sizeof quick / sizeof *quick)] : awkward();
}

static void do_step(Pair *pair)
{
    double time = careless() ? awkward() : pair->time;
    double size = careless() ? awkward_size() : chance(5) ? 0.0 : pow(10.0, uniform(-6.0, OF_SYSTEM ? -2.5 : -1.0));
    fmi3Boolean event = 1, end = 1, early = 1;
    double last = NAN, reached = time + size;
    fmi3Status three = fmi3DoStep(pair->three, time, size, below(2), &event, &end, &early, &last);
    int done = BOTH(pair, DoStep, three, fmi2DoStep(pair->two, time, size, 1));
    if (!done && is_legal(pair, CALL3_DoStep))
        check_equal(&last, &pair->time, 1, "lastSuccessfulTime of a refused step");
    if (!done)
        return;
    CHECK(!event && !end && !early, "a step ends early");
    check_equal(&last, &reached, 1, "lastSuccessfulTime");
    pair->time = reached;
}

/* ------------------------------------------------------------------------------------------------------------------ */

void call_both(Pair *pair, Call3 call)
{
    trace("%ld: fmi3%s", (long)(pair - pairs), call3_names[call]);
    listen(pair);
    /* The step with a deadline allocates nothing but states. */
    int of_states = call >= CALL3_GetFMUState && call <= CALL3_DeserializeFMUState;
    starving = MODEL_REAL_TIME && pair->mode != INSTANTIATED && !of_states && chance(20);
    switch (call) {
    case CALL3_EnterInitializationMode: enter_initialization(pair); break;
    case CALL3_ExitInitializationMode:
        change_mode(pair, call, fmi3ExitInitializationMode, fmi2ExitInitializationMode, pair->exchange ? EVENT : STEP);
        break;
    case CALL3_Terminate:
        change_mode(pair, call, fmi3Terminate, fmi2Terminate,
                    pair->mode == INSTANTIATED || pair->mode == INITIALIZATION ? pair->mode : TERMINATED);
        break;
    case CALL3_Reset: reset(pair); break;
    case CALL3_SetDebugLogging: set_debug_logging(pair); break;
    case CALL3_GetFloat64: get_float64(pair); break;
    case CALL3_GetBoolean: get_boolean(pair); break;
    case CALL3_SetFloat64: set_float64(pair); break;
    case CALL3_SetBoolean: set_boolean(pair); break;
    case CALL3_GetDirectionalDerivative: case CALL3_GetAdjointDerivative: compare_derivatives(pair, call); break;
    case CALL3_EnterEventMode: change_mode(pair, call, fmi3EnterEventMode, fmi2EnterEventMode, EVENT); break;
    case CALL3_EvaluateDiscreteStates: evaluate_discrete_states(pair); break;
    case CALL3_UpdateDiscreteStates: update_discrete_states(pair); break;
    case CALL3_EnterContinuousTimeMode:
        change_mode(pair, call, fmi3EnterContinuousTimeMode, fmi2EnterContinuousTimeMode, CONTINUOUS_TIME);
        break;
    case CALL3_CompletedIntegratorStep: completed_step(pair); break;
    case CALL3_SetTime: set_time(pair); break;
    case CALL3_SetContinuousStates: set_continuous_states(pair); break;
    case CALL3_GetContinuousStates:
        get_vector(pair, call, fmi3GetContinuousStates, fmi2GetContinuousStates, MODEL_STATES);
        break;
    case CALL3_GetContinuousStateDerivatives:
        get_vector(pair, call, fmi3GetContinuousStateDerivatives, fmi2GetDerivatives, MODEL_STATES);
        break;
    case CALL3_GetNominalsOfContinuousStates:
        get_vector(pair, call, fmi3GetNominalsOfContinuousStates, fmi2GetNominalsOfContinuousStates, MODEL_STATES);
        break;
    case CALL3_GetEventIndicators:
        get_vector(pair, call, fmi3GetEventIndicators, fmi2GetEventIndicators, INDICATORS);
        break;
    case CALL3_GetNumberOfContinuousStates:
        get_number(pair, call, fmi3GetNumberOfContinuousStates, MODEL_STATES);
        break;
    case CALL3_GetNumberOfEventIndicators:
        get_number(pair, call, fmi3GetNumberOfEventIndicators, INDICATORS);
        break;
    case CALL3_GetOutputDerivatives: compare_rates(pair); break;
    case CALL3_DoStep: do_step(pair); break;
    default: call_states(pair, call);
    }
    starving = 0;
}

void move_pair(Pair *pair)
{
    for (int k = 1 + below(5); k > 0; k--) {
        if (pair->exchange && pair->mode == EVENT)
            call_both(pair, CALL3_EnterContinuousTimeMode);
        if (pair->exchange)
            call_both(pair, CALL3_SetTime);
        listen(pair);
        if (OF_SYSTEM)
            set_float64(pair);
        else
            set_displacement(pair, usual_displacement());
        call_both(pair, pair->exchange ? CALL3_CompletedIntegratorStep : CALL3_DoStep);
    }
}
