#include "fuzz.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Calls that lead from mode to mode, steps, and what remains. */

static void set_debug_logging(Trial *trial)
{
    static const struct {
        const char *name;
        int errors, warnings;
    } categories[] = {{"logAll", 1, 1}, {"logStatusError", 1, 0}, {"logStatusWarning", 0, 1}};
    Slot *slot = trial->slot;
    int on = chance(80), errors = 0, warnings = 0;
    size_t count = chance(30) ? 0 : (size_t)below(4);
    fmi2String *chosen = elements(count, sizeof *chosen);
    must_be_given(trial, chosen, count);
    for (size_t i = 0; chosen != NULL && i < count; i++) {
        int number = below(3), strange = careless();
        chosen[i] = !strange ? categories[number].name : chance(20) ? NULL : awkward_text();
        must(trial, strange ? NO : YES);
        errors |= categories[number].errors;
        warnings |= categories[number].warnings;
    }
    if (judged(trial, fmi2SetDebugLogging(trial->component, on, count, chosen), LOOKS)) {
        int heard = slot->logger && on;
        slot->errors_logged = heard && (count == 0 || errors);
        slot->warnings_logged = heard && (count == 0 || warnings);
    }
    free(chosen);
}

static void setup_experiment(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    int ends = chance(30);
    double start = careless() ? awkward() : chance(70) ? 0.0 : uniform(-1e3, 1e3);
    double stop = careless() ? awkward() : start + uniform(0.0, 10.0);
    must(trial, isfinite(start) ? YES : NO);
    must(trial, !ends || stop >= start ? YES : NO);
    if (judged(trial, fmi2SetupExperiment(trial->component, below(2), awkward(), start, ends, stop), CHANGES)) {
        twin->time = start;
        twin->stop_time = ends ? stop : INFINITY;
    }
}

/* The mode after Terminate. */
static Mode ended(Mode mode)
{
    return mode == INSTANTIATED || mode == INITIALIZATION ? mode : TERMINATED;
}

static void change_mode(Trial *trial, fmi2EnterInitializationModeTYPE *function, Mode mode)
{
    Twin *twin = &trial->slot->twin;
    if (judged(trial, function(trial->component), CHANGES) && twin->mode != UNKNOWN)
        twin->mode = mode;
}

static void reset(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    if (judged(trial, fmi2Reset(trial->component), CHANGES))
        *twin = twin_of(twin->type);
}

/* Calls that commit the path: the excursion that begins by it gives one warning. */
static Twin committed(Trial *trial)
{
    Twin after = trial->slot->twin;
    int warning = twin_commit(&after);
    /* In the form with states a velocity that is not the rate of displacement gives one, too. */
    if (after.mode != UNKNOWN)
        trial->warnings = after.moved || MODEL_STATES ? -1 : warning;
    return after;
}

static void exit_initialization(Trial *trial)
{
    Twin *twin = &trial->slot->twin, after = committed(trial);
    must(trial, possible(twin));
    if (MODEL_STATES && twin->mode != UNKNOWN)
        must(trial, fabs(twin->value[variable("omega")]) <= 1.0 ? YES : NO);
    if (!judged(trial, fmi2ExitInitializationMode(trial->component), CHANGES) || twin->mode == UNKNOWN)
        return;
    *twin = after;
    twin->possible = YES;
    twin->asked = 1;
    twin->mode = twin->type == fmi2ModelExchange ? EVENT : STEP;
}

static void new_discrete_states(Trial *trial)
{
    fmi2EventInfo *information = elements(1, sizeof *information);
    must_be_given(trial, information, 1);
    if (judged(trial, fmi2NewDiscreteStates(trial->component, information), LOOKS))
        CHECK(!information->newDiscreteStatesNeeded && !information->terminateSimulation &&
                  !information->nominalsOfContinuousStatesChanged && !information->valuesOfContinuousStatesChanged &&
                  !information->nextEventTimeDefined,
              "an event leads to another one");
    free(information);
}

static void enter_continuous_time(Trial *trial)
{
    Twin *twin = &trial->slot->twin, after = committed(trial);
    if (!judged(trial, fmi2EnterContinuousTimeMode(trial->component), CHANGES) || twin->mode == UNKNOWN)
        return;
    *twin = after;
    twin->held = twin->side != 0;
    twin->mode = CONTINUOUS_TIME;
}

static void completed_integrator_step(Trial *trial)
{
    Twin *twin = &trial->slot->twin, after = committed(trial);
    fmi2Boolean *event = elements(1, sizeof *event), *end = elements(1, sizeof *end);
    must_be_given(trial, event, 1);
    must_be_given(trial, end, 1);
    if (judged(trial, fmi2CompletedIntegratorStep(trial->component, below(2), event, end), CHANGES)) {
        CHECK(*end == fmi2False, "the simulation is to end");
        if (twin->mode != UNKNOWN) {
            *twin = after;
            CHECK(*event == ((twin->side != 0) != twin->held), "event mode is asked for: %d", *event);
        }
    }
    free(event);
    free(end);
}

static void set_time(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    double time = careless() ? awkward() : twin->time + (chance(90) ? uniform(0.0, 1e-2) : uniform(-1.0, 1.0));
    must(trial, isfinite(time) ? YES : NO);
    if (judged(trial, fmi2SetTime(trial->component, time), CHANGES))
        twin->time = time;
}

/* There are no continuous states and one event indicator, or two states, omega and absorbed_energy, and none. */
static void continuous(Trial *trial)
{
    static const size_t states = MODEL_STATES ? 2 : 0, indicators = MODEL_STATES ? 0 : 1;
    Twin *twin = &trial->slot->twin;
    int sets = trial->call == CALL_SetContinuousStates;
    size_t expected = trial->call == CALL_GetEventIndicators ? indicators : states;
    size_t count = !careless() ? expected : chance(20) ? SIZE_MAX : count_of_elements();
    size_t room = count < 5000 ? count : 1;
    double *values = elements(room, sizeof *values);
    must(trial, count == expected ? YES : NO);
    must_be_given(trial, values, count);
    for (size_t i = 0; values != NULL && i < room; i++) {
        values[i] = careless() ? awkward() : uniform(-1.0, 1.0);
        if (sets)
            must(trial, fabs(values[i]) <= 1e100 ? YES : NO);
    }
    if (count > 0 && (trial->call == CALL_GetDerivatives || trial->call == CALL_GetContinuousStates))
        must(trial, possible(twin));
    fmi2Status status = fmi2Error;
    switch (trial->call) {
    case CALL_SetContinuousStates: status = fmi2SetContinuousStates(trial->component, values, count); break;
    case CALL_GetDerivatives: status = fmi2GetDerivatives(trial->component, values, count); break;
    case CALL_GetContinuousStates: status = fmi2GetContinuousStates(trial->component, values, count); break;
    case CALL_GetEventIndicators: status = fmi2GetEventIndicators(trial->component, values, count); break;
    default: status = fmi2GetNominalsOfContinuousStates(trial->component, values, count);
    }
    /* Reading absorbed_energy leaves a mark. */
    int effect = sets || trial->call == CALL_GetContinuousStates ? CHANGES : LOOKS;
    if (judged(trial, status, effect))
        for (size_t i = 0; i < expected; i++) {
            CHECK(isfinite(values[i]), "fmi2%s gives %g", call_names[trial->call], values[i]);
            if (sets)
                twin_set(twin, (fmi2ValueReference)variable(i == 0 ? "absorbed_energy" : "omega"), values[i]);
        }
    free(values);
}

static void do_step(Trial *trial)
{
    Twin *twin = &trial->slot->twin, after = *twin;
    double time = careless() ? awkward() : twin->time;
    double size = careless() ? awkward() : chance(10) ? 0.0 : pow(10.0, uniform(-6.0, 1.0));
    trace("    time %.17g, size %.17g", time, size);
    must(trial, twin->mode == UNKNOWN ? UNSURE : step_possible(twin, time, size));
    twin_step(&after, time, size);
    int warning = twin_commit(&after);
    if (twin->mode != UNKNOWN)
        trial->warnings = twin->interpolated || twin->moved ? -1 : warning;
    if (judged(trial, fmi2DoStep(trial->component, time, size, below(2)), CHANGES))
        *twin = after;
}

/* All that can be asked is the time of the last step, and whether the FMU wants to end. */
static void status_of_step(Trial *trial)
{
    Twin *twin = &trial->slot->twin;
    int kind = careless() ? (int[]){-1, 4, INT_MAX}[below(3)] : below(4);
    int known = (trial->call == CALL_GetRealStatus && kind == fmi2LastSuccessfulTime) ||
                (trial->call == CALL_GetBooleanStatus && kind == fmi2Terminated);
    void *value = elements(1, sizeof(fmi2String));
    fmi2Status status;
    if (!known && trial->may & MAY_OK)
        trial->may = (trial->may & ~MAY_OK) | MAY_DISCARD;
    must_be_given(trial, value, 1);
    switch (trial->call) {
    case CALL_GetStatus: status = fmi2GetStatus(trial->component, (fmi2StatusKind)kind, value); break;
    case CALL_GetRealStatus: status = fmi2GetRealStatus(trial->component, (fmi2StatusKind)kind, value); break;
    case CALL_GetIntegerStatus: status = fmi2GetIntegerStatus(trial->component, (fmi2StatusKind)kind, value); break;
    case CALL_GetBooleanStatus: status = fmi2GetBooleanStatus(trial->component, (fmi2StatusKind)kind, value); break;
    default: status = fmi2GetStringStatus(trial->component, (fmi2StatusKind)kind, value);
    }
    if (judged(trial, status, LOOKS) && twin->mode != UNKNOWN) {
        if (trial->call == CALL_GetRealStatus)
            CHECK(memcmp(value, &twin->time, sizeof twin->time) == 0, "the time is %.17g, not %.17g", *(double *)value,
                  twin->time);
        else
            CHECK(*(fmi2Boolean *)value == fmi2False, "the FMU wants to end");
    }
    free(value);
}

void try_call(Slot *slot, Call call)
{
    Trial trial = trial_of(slot, call);
    switch (call) {
    case CALL_SetDebugLogging: set_debug_logging(&trial); break;
    case CALL_SetupExperiment: setup_experiment(&trial); break;
    case CALL_EnterInitializationMode: change_mode(&trial, fmi2EnterInitializationMode, INITIALIZATION); break;
    case CALL_ExitInitializationMode: exit_initialization(&trial); break;
    case CALL_Terminate: change_mode(&trial, fmi2Terminate, ended(slot->twin.mode)); break;
    case CALL_EnterEventMode: change_mode(&trial, fmi2EnterEventMode, EVENT); break;
    case CALL_CancelStep: change_mode(&trial, fmi2CancelStep, slot->twin.mode); break;
    case CALL_Reset: reset(&trial); break;
    case CALL_GetReal: get_real(&trial); break;
    case CALL_GetInteger: get_others(&trial, 'I'); break;
    case CALL_GetBoolean: get_others(&trial, 'B'); break;
    case CALL_GetString: get_others(&trial, 'S'); break;
    case CALL_SetReal: set_real(&trial); break;
    case CALL_SetInteger: set_others(&trial, 'I'); break;
    case CALL_SetBoolean: set_others(&trial, 'B'); break;
    case CALL_SetString: set_others(&trial, 'S'); break;
    case CALL_GetDirectionalDerivative: directional_derivative(&trial); break;
    case CALL_SetRealInputDerivatives: input_derivatives(&trial); break;
    case CALL_GetRealOutputDerivatives: output_derivatives(&trial); break;
    case CALL_NewDiscreteStates: new_discrete_states(&trial); break;
    case CALL_EnterContinuousTimeMode: enter_continuous_time(&trial); break;
    case CALL_CompletedIntegratorStep: completed_integrator_step(&trial); break;
    case CALL_SetTime: set_time(&trial); break;
    case CALL_SetContinuousStates: case CALL_GetDerivatives: case CALL_GetEventIndicators:
    case CALL_GetContinuousStates: case CALL_GetNominalsOfContinuousStates: continuous(&trial); break;
    case CALL_DoStep: do_step(&trial); break;
    case CALL_GetStatus: case CALL_GetRealStatus: case CALL_GetIntegerStatus: case CALL_GetBooleanStatus:
    case CALL_GetStringStatus: status_of_step(&trial); break;
    default: try_states(&trial);
    }
}
