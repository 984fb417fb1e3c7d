/*     fuzz SEED SEQUENCES [trace]
 *
 * The same for the FMU of a system of bodies on mounts: random calls, judged by the state machine of oracle.c and by
 * what the documentation of this FMU says of its values; a refused call changes no byte of the state, each has one
 * sentence in the log, what is read is finite, copies made by states go on alike, and made-up states do no harm. */
#include "../fuzz.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INSTANCES = 3, KEPT = 4, MOST_REFERENCES = 40 };

typedef struct {
    fmi2Component component;
    char name[16];
    Twin twin;
    unsigned char *bytes; /* its state after the last call */
} System;

typedef struct {
    fmi2FMUstate state;
    Twin twin;
} Kept;

static System systems[INSTANCES];
static Kept kept[KEPT];
static size_t size_of_states;

/* What bytes.c asks for. */
size_t state_size(void)
{
    return size_of_states;
}

double usual_displacement(void)
{
    return uniform(-0.05, 0.05);
}

/* ---- looking ----------------------------------------------------------------------------------------------------- */

static unsigned char *bytes_of(fmi2Component component)
{
    fmi2FMUstate state = NULL;
    CHECK(fmi2GetFMUstate(component, &state) == fmi2OK, "a state cannot be taken");
    if (size_of_states == 0)
        CHECK(fmi2SerializedFMUstateSize(component, state, &size_of_states) == fmi2OK, "a state has no size");
    unsigned char *bytes = allocated(size_of_states);
    CHECK(fmi2SerializeFMUstate(component, state, (fmi2Byte *)bytes, size_of_states) == fmi2OK,
          "a state cannot be serialized");
    CHECK(fmi2FreeFMUstate(component, &state) == fmi2OK, "a state is not freed");
    return bytes;
}

static double value_of(const System *of, const char *name)
{
    return of->twin.value[variable(name)];
}

/* Compares status, messages and state with what may be. */
static int judge(System *of, Call call, Answer may, fmi2Status status, int looks)
{
    trace("    status %d, may %d", (int)status, (int)may);
    statistics.calls++;
    CHECK(status == fmi2OK || status == fmi2Error || status == fmi2Discard, "the status is %d", (int)status);
    CHECK(may == UNSURE || (may == YES) == (status == fmi2OK), "fmi2%s has the status %d", call_names[call],
          (int)status);
    CHECK(messages.errors + messages.discards == (status != fmi2OK), "there are %d messages with the status %d",
          messages.errors + messages.discards, (int)status);
    unsigned char *before = of->bytes;
    of->bytes = bytes_of(of->component);
    if (status != fmi2OK || looks)
        CHECK(memcmp(before, of->bytes, size_of_states) == 0, "the state has changed with the status %d", (int)status);
    free(before);
    ++*(status == fmi2OK        ? statistics.done + call
        : status == fmi2Discard ? statistics.discarded + call
                                : statistics.refused + call);
    return status == fmi2OK;
}

static Answer both(Answer one, Answer other)
{
    return one == NO || other == NO ? NO : one == YES && other == YES ? YES : UNSURE;
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

typedef struct {
    size_t count;
    fmi2ValueReference at[MOST_REFERENCES];
    int sound; /* all are of the type asked for */
} Chosen;

static Chosen choose(char type, const char *causalities)
{
    Chosen chosen = {.count = (size_t)below(chance(10) ? MOST_REFERENCES : 4), .sound = 1};
    for (size_t i = 0; i < chosen.count; i++) {
        fmi2ValueReference reference = (fmi2ValueReference)below(MODEL_VARIABLES + 1);
        for (int k = 0; k < 1000 && !careless() &&
                        (reference >= MODEL_VARIABLES || strchr(causalities, described[reference].causality) == NULL ||
                         described[reference].type != type); k++)
            reference = (fmi2ValueReference)below(MODEL_VARIABLES);
        if (careless() && chance(10))
            reference = UINT32_MAX;
        chosen.at[i] = reference;
        chosen.sound &= reference < MODEL_VARIABLES && described[reference].type == type;
    }
    return chosen;
}

static double usual_value(fmi2ValueReference reference)
{
    if (careless() || reference >= MODEL_VARIABLES)
        return awkward();
    const char *name = described[reference].name;
    if (strcmp(name, "step") == 0)
        return MODEL_LARGEST_STEP * pow(10.0, uniform(-2.0, 0.2));
    if (strcmp(name, "omega_start") == 0)
        return chance(50) ? below(3) - 1.0 : uniform(-1.1, 1.1);
    if (strncmp(name, "gravity_", 8) == 0)
        return chance(80) ? described[reference].start * uniform(0.5, 1.5) : uniform(-30.0, 30.0);
    return uniform(-1.0, 1.0) * (strncmp(name, "load_", 5) == 0 ? 1e3 : 1e2);
}

static Answer may_set(const System *of, fmi2ValueReference reference, double value)
{
    if (described[reference].causality == 'i')
        return isfinite(value) ? YES : NO;
    if (described[reference].causality != 'p')
        return NO;
    if (of->twin.mode != UNKNOWN && of->twin.mode != INSTANTIATED && of->twin.mode != INITIALIZATION)
        return of->twin.value[reference] == value ? YES : NO;
    const char *name = described[reference].name;
    double low = strcmp(name, "step") == 0 ? 1e-12 : strcmp(name, "omega_start") == 0 ? -1.0 : -1e4;
    double high = strcmp(name, "step") == 0 ? MODEL_LARGEST_STEP : -low;
    return !(value >= low && value <= high) ? NO : of->twin.mode == UNKNOWN ? UNSURE : YES;
}

static void set_values(System *of, Answer may)
{
    double values[MOST_REFERENCES];
    Chosen chosen = choose('R', "ip");
    may = both(may, chosen.sound ? YES : NO);
    for (size_t i = 0; i < chosen.count; i++) {
        values[i] = usual_value(chosen.at[i]);
        if (chosen.sound)
            may = both(may, may_set(of, chosen.at[i], values[i]));
    }
    if (judge(of, CALL_SetReal, may, fmi2SetReal(of->component, chosen.at, chosen.count, values), chosen.count == 0))
        for (size_t i = 0; i < chosen.count; i++)
            of->twin.value[chosen.at[i]] = values[i];
}

static void get_values(System *of, Answer may)
{
    double values[MOST_REFERENCES];
    Chosen chosen = choose('R', "iop");
    may = both(may, chosen.sound ? YES : NO);
    for (size_t i = 0; i < chosen.count && chosen.sound; i++)
        if (described[chosen.at[i]].causality == 'o' && of->twin.mode == INITIALIZATION)
            may = both(may, UNSURE); /* the bodies may find no rest */
    /* In initialization mode it finds the rest. */
    int looks = of->twin.mode != INITIALIZATION && of->twin.mode != UNKNOWN;
    if (judge(of, CALL_GetReal, may, fmi2GetReal(of->component, chosen.at, chosen.count, values), looks))
        for (size_t i = 0; i < chosen.count; i++) {
            CHECK(of->twin.mode == UNKNOWN || isfinite(values[i]), "%s is %g", described[chosen.at[i]].name, values[i]);
            if (described[chosen.at[i]].causality != 'o' && of->twin.mode != UNKNOWN && !of->twin.moved)
                CHECK(values[i] == of->twin.value[chosen.at[i]], "%s is %g", described[chosen.at[i]].name, values[i]);
        }
}

static void get_boolean(System *of, Answer may)
{
    fmi2Boolean values[MOST_REFERENCES];
    Chosen chosen = choose('B', "l");
    may = both(may, chosen.sound ? YES : NO);
    int looks = of->twin.mode != INITIALIZATION && of->twin.mode != UNKNOWN;
    if (!looks && may == YES)
        may = UNSURE;
    if (judge(of, CALL_GetBoolean, may, fmi2GetBoolean(of->component, chosen.at, chosen.count, values), looks))
        for (size_t i = 0; i < chosen.count; i++)
            CHECK(values[i] == fmi2True || values[i] == fmi2False, "a Boolean is %d", values[i]);
}

static void set_derivatives(System *of, Answer may)
{
    fmi2Integer orders[MOST_REFERENCES];
    double values[MOST_REFERENCES];
    Chosen chosen = choose('R', "i");
    may = both(may, chosen.sound ? YES : NO);
    for (size_t i = 0; i < chosen.count; i++) {
        orders[i] = careless() ? below(4) - 1 : 1;
        values[i] = careless() ? awkward() : uniform(-1e4, 1e4);
        if (chosen.sound && (described[chosen.at[i]].causality != 'i' || orders[i] != 1 || !isfinite(values[i])))
            may = NO;
    }
    fmi2Status status = fmi2SetRealInputDerivatives(of->component, chosen.at, chosen.count, orders, values);
    if (judge(of, CALL_SetRealInputDerivatives, may, status, chosen.count == 0) && chosen.count > 0)
        of->twin.moved = 1;
}

static void get_derivatives(System *of, Answer may, Call call)
{
    fmi2Integer orders[MOST_REFERENCES] = {0};
    double values[MOST_REFERENCES], seeds[MOST_REFERENCES] = {0.0};
    Chosen chosen = choose('R', "o");
    may = both(may, chosen.sound && chosen.count == 0 ? YES : NO);
    fmi2Status status = call == CALL_GetRealOutputDerivatives
                            ? fmi2GetRealOutputDerivatives(of->component, chosen.at, chosen.count, orders, values)
                            : fmi2GetDirectionalDerivative(of->component, chosen.at, chosen.count, chosen.at,
                                                           chosen.count, seeds, values);
    judge(of, call, may, status, 1);
}

/* Some hundred internal steps at most, or so many that they are refused. */
static double usual_size(const System *of)
{
    double step = value_of(of, "step");
    if (careless())
        return (double[]){NAN, INFINITY, -INFINITY, -1.0, -5e-324, 5e-324, DBL_MAX, 1e18, -0.0}[below(9)];
    return chance(10) ? 0.0 : step * (chance(90) ? uniform(0.0, 8.0) : uniform(0.0, 100.0));
}

static Answer may_step(const System *of, double time, double size)
{
    double end = time + size, stop = of->twin.stop_time;
    if (!isfinite(time) || !(size >= 0.0) || !isfinite(end) || size > 1.001e8 * value_of(of, "step"))
        return NO;
    if (isfinite(stop) && end > stop)
        return end > stop + 1e-6 * fmax(fabs(end), fabs(stop)) ? NO : UNSURE;
    return UNSURE; /* it may diverge */
}

static void do_step(System *of, Answer may)
{
    double time = careless() ? awkward() : of->twin.time, size = usual_size(of);
    trace("    time %.17g, size %.17g", time, size);
    may = both(may, of->twin.mode == UNKNOWN ? UNSURE : may_step(of, time, size));
    if (judge(of, CALL_DoStep, may, fmi2DoStep(of->component, time, size, below(2)), 0))
        of->twin.time = time + size;
}

static void setup(System *of, Answer may)
{
    int ends = chance(30);
    double start = careless() ? awkward() : 0.0, stop = careless() ? awkward() : start + uniform(0.0, 1.0);
    may = both(may, isfinite(start) && (!ends || stop >= start) ? YES : NO);
    fmi2Status status = fmi2SetupExperiment(of->component, below(2), awkward(), start, ends, stop);
    if (judge(of, CALL_SetupExperiment, may, status, 0)) {
        of->twin.time = start;
        of->twin.stop_time = ends ? stop : INFINITY;
    }
}

static void change_mode(System *of, Call call, Answer may)
{
    fmi2Status status = call == CALL_EnterInitializationMode  ? fmi2EnterInitializationMode(of->component)
                        : call == CALL_ExitInitializationMode ? fmi2ExitInitializationMode(of->component)
                        : call == CALL_Terminate              ? fmi2Terminate(of->component)
                                                              : fmi2Reset(of->component);
    Mode after = call == CALL_EnterInitializationMode  ? INITIALIZATION
                 : call == CALL_ExitInitializationMode ? STEP
                 : call != CALL_Terminate              ? INSTANTIATED
                 : of->twin.mode == STEP               ? TERMINATED
                                                       : of->twin.mode;
    if (call == CALL_ExitInitializationMode)
        may = both(may, UNSURE);
    if (!judge(of, call, may, status, 0))
        return;
    if (call == CALL_Reset)
        of->twin = twin_of(fmi2CoSimulation);
    if (of->twin.mode != UNKNOWN)
        of->twin.mode = after;
}

static void status_of_step(System *of, Call call, Answer may)
{
    fmi2StatusKind kind = (fmi2StatusKind)below(4);
    char value[sizeof(fmi2String)];
    int known = (call == CALL_GetRealStatus && kind == fmi2LastSuccessfulTime) ||
                (call == CALL_GetBooleanStatus && kind == fmi2Terminated);
    void *to = value;
    fmi2Status status = call == CALL_GetStatus          ? fmi2GetStatus(of->component, kind, to)
                        : call == CALL_GetRealStatus    ? fmi2GetRealStatus(of->component, kind, to)
                        : call == CALL_GetIntegerStatus ? fmi2GetIntegerStatus(of->component, kind, to)
                        : call == CALL_GetBooleanStatus ? fmi2GetBooleanStatus(of->component, kind, to)
                                                        : fmi2GetStringStatus(of->component, kind, to);
    judge(of, call, both(may, known ? YES : NO), status, 1);
}

static void use_states(System *of, Call call)
{
    Kept *one = kept + below(KEPT);
    if (call == CALL_GetFMUstate) {
        if (judge(of, call, YES, fmi2GetFMUstate(of->component, &one->state), 1))
            one->twin = of->twin;
    } else if (call == CALL_FreeFMUstate) {
        judge(of, call, YES, fmi2FreeFMUstate(of->component, &one->state), 1);
    } else if (call == CALL_SetFMUstate) {
        if (judge(of, call, one->state == NULL ? NO : YES, fmi2SetFMUstate(of->component, one->state), 0))
            of->twin = one->twin;
    } else {
        Serialized made = serialized_from(of->bytes, of->bytes, size_of_states);
        fmi2FMUstate state = NULL;
        Answer may = made.quality == SOUND ? YES : made.quality == BROKEN ? NO : UNSURE;
        fmi2Status status =
            fmi2DeSerializeFMUstate(of->component, (const fmi2Byte *)made.bytes, made.size, &state);
        if (judge(of, call, may, status, 1)) {
            unsigned char *home = exactly(of->bytes, size_of_states);
            host_listen(of, of->name);
            CHECK(fmi2SetFMUstate(of->component, state) == fmi2OK, "a state cannot be set");
            free(of->bytes);
            of->bytes = bytes_of(of->component);
            CHECK(memcmp(of->bytes, made.bytes, size_of_states) == 0, "a state is not that of its bytes");
            free(home);
            if (made.quality == CRAFTED) {
                statistics.crafted_taken++;
                of->twin.mode = UNKNOWN;
            }
        } else if (made.quality == CRAFTED) {
            statistics.crafted_refused++;
        }
        host_listen(of, of->name);
        CHECK(fmi2FreeFMUstate(of->component, &state) == fmi2OK, "a state is not freed");
        free(made.bytes);
    }
}

static void call_one(System *of)
{
    static const Call forth[][6] = {
        [INSTANTIATED] = {CALL_SetupExperiment, CALL_EnterInitializationMode, CALL_EnterInitializationMode,
                          CALL_SetReal, CALL_SetFMUstate, CALL_DeSerializeFMUstate},
        [INITIALIZATION] = {CALL_SetReal, CALL_GetReal, CALL_ExitInitializationMode, CALL_ExitInitializationMode,
                            CALL_GetBoolean, CALL_ExitInitializationMode},
        [STEP] = {CALL_SetReal, CALL_DoStep, CALL_DoStep, CALL_GetReal, CALL_SetRealInputDerivatives, CALL_GetBoolean},
        [TERMINATED] = {CALL_Reset, CALL_Reset, CALL_GetReal, CALL_GetReal, CALL_SetFMUstate, CALL_Reset},
        [UNKNOWN] = {CALL_Reset, CALL_DoStep, CALL_GetReal, CALL_SetReal, CALL_GetBoolean, CALL_DoStep},
    };
    static const Call others[] = {
        CALL_SetDebugLogging, CALL_SetupExperiment, CALL_EnterInitializationMode, CALL_ExitInitializationMode,
        CALL_Terminate, CALL_Reset, CALL_GetReal, CALL_GetBoolean, CALL_SetReal, CALL_GetFMUstate, CALL_SetFMUstate,
        CALL_FreeFMUstate, CALL_DeSerializeFMUstate, CALL_GetDirectionalDerivative, CALL_SetRealInputDerivatives,
        CALL_GetRealOutputDerivatives, CALL_DoStep, CALL_GetStatus, CALL_GetRealStatus, CALL_GetIntegerStatus,
        CALL_GetBooleanStatus, CALL_GetStringStatus};
    Call call = chance(70) ? forth[of->twin.mode][below(6)] : others[below(sizeof others / sizeof *others)];
    Answer may = may_call(&of->twin, call);
    trace("%ld: fmi2%s in mode %d", (long)(of - systems), call_names[call], (int)of->twin.mode);
    host_listen(of, of->name);
    switch (call) {
    case CALL_SetDebugLogging: judge(of, call, may, fmi2SetDebugLogging(of->component, 1, 0, NULL), 1); break;
    case CALL_SetupExperiment: setup(of, may); break;
    case CALL_EnterInitializationMode: case CALL_ExitInitializationMode: case CALL_Terminate: case CALL_Reset:
        change_mode(of, call, may); break;
    case CALL_GetReal: get_values(of, may); break;
    case CALL_GetBoolean: get_boolean(of, may); break;
    case CALL_SetReal: set_values(of, may); break;
    case CALL_SetRealInputDerivatives: set_derivatives(of, may); break;
    case CALL_GetDirectionalDerivative: case CALL_GetRealOutputDerivatives: get_derivatives(of, may, call); break;
    case CALL_DoStep: do_step(of, may); break;
    case CALL_GetStatus: case CALL_GetRealStatus: case CALL_GetIntegerStatus: case CALL_GetBooleanStatus:
    case CALL_GetStringStatus: status_of_step(of, call, may); break;
    default: use_states(of, call);
    }
}

/* ---- lives ------------------------------------------------------------------------------------------------------- */

static fmi2Component made(System *of, const fmi2CallbackFunctions *functions)
{
    snprintf(of->name, sizeof of->name, "system %d", (int)(of - systems) % 100);
    host_listen(of, NULL);
    return fmi2Instantiate(of->name, fmi2CoSimulation, MODEL_GUID, NULL, functions, below(2), below(2));
}

/* An instance, or a refusal where the arguments are wrong or the memory is missing. */
static int instantiate_one(System *of)
{
    fmi2CallbackFunctions functions = host_callbacks(of, 1, chance(70));
    if (careless()) {
        int counting = functions.allocateMemory != NULL, type = below(3) - 1;
        const char *guid = chance(50) ? MODEL_GUID : awkward_text(), *name = chance(50) ? "one" : awkward_text();
        starving = counting && chance(50);
        int right = type == fmi2CoSimulation && strcmp(guid, MODEL_GUID) == 0 && name[0] != '\0' && !starving;
        host_listen(of, NULL);
        fmi2Component found = fmi2Instantiate(name, (fmi2Type)type, guid, NULL, &functions, 0, 0);
        starving = 0;
        CHECK((found != NULL) == right && messages.errors == !right, "an instance is wrongly %s",
              right ? "refused" : "made");
        if (found != NULL)
            fmi2FreeInstance(found);
        return 0;
    }
    of->component = made(of, &functions);
    CHECK(of->component != NULL, "an instance is refused");
    of->twin = twin_of(fmi2CoSimulation);
    of->bytes = bytes_of(of->component);
    return 1;
}

static void free_one(System *of)
{
    host_listen(of, of->name);
    fmi2FreeInstance(of->component);
    CHECK(messages.errors + messages.warnings == 0, "freeing an instance gives messages");
    free(of->bytes);
    *of = (System){.component = NULL};
    statistics.sequences++;
}

/* A copy made by its state must go on like the instance, which then goes back. */
static void compare_copies(System *of)
{
    static System copy;
    fmi2CallbackFunctions functions = host_callbacks(&copy, 1, 0);
    fmi2FMUstate state = NULL, home = NULL;
    unsigned char *start = exactly(of->bytes, size_of_states);
    copy.component = made(&copy, &functions);
    CHECK(copy.component != NULL, "an instance is refused");
    host_listen(&copy, copy.name);
    CHECK(fmi2DeSerializeFMUstate(copy.component, (fmi2Byte *)start, size_of_states, &state) == fmi2OK &&
              fmi2SetFMUstate(copy.component, state) == fmi2OK,
          "the copy of an instance is refused");
    CHECK(fmi2FreeFMUstate(copy.component, &state) == fmi2OK, "a state is not freed");
    host_listen(of, of->name);
    CHECK(fmi2GetFMUstate(of->component, &home) == fmi2OK, "a state cannot be taken");
    double size = 3.0 * value_of(of, "step");
    for (int k = 0; k < 4 && size < 0.01; k++) {
        host_listen(of, of->name);
        fmi2Status one = fmi2DoStep(of->component, 0.0, size, 0);
        host_listen(&copy, copy.name);
        CHECK(fmi2DoStep(copy.component, 0.0, size, 0) == one, "an instance and its copy differ");
    }
    unsigned char *of_one = bytes_of(of->component), *of_copy = bytes_of(copy.component);
    CHECK(memcmp(of_one, of_copy, size_of_states) == 0, "an instance and its copy go different ways");
    fmi2FreeInstance(copy.component);
    CHECK(fmi2SetFMUstate(of->component, home) == fmi2OK && fmi2FreeFMUstate(of->component, &home) == fmi2OK,
          "an instance cannot go back");
    free(of_one);
    free(of_copy);
    free(start);
    statistics.copies++;
}

static void run(long sequences)
{
    long begun = 0;
    for (int alive = 0; begun < sequences || alive > 0;) {
        System *of = systems + below(INSTANCES);
        carelessness = chance(60) ? 0 : 15;
        if (of->component == NULL) {
            if (begun < sequences && instantiate_one(of)) {
                begun++;
                alive++;
            }
        } else if (chance(3)) {
            host_listen(of, of->name);
            for (int i = 0; alive == 1 && begun == sequences && i < KEPT; i++)
                CHECK(fmi2FreeFMUstate(of->component, &kept[i].state) == fmi2OK, "a state is not freed");
            free_one(of);
            alive--;
        } else if (chance(2) && of->twin.mode != UNKNOWN) {
            compare_copies(of);
        } else {
            call_one(of);
        }
    }
    CHECK(blocks + tables == 0, "%ld blocks of memory are never returned", blocks + tables);
}

int main(int count, char **arguments)
{
    if (count < 3)
        return 2;
    tracing = count > 3 && strcmp(arguments[count - 1], "trace") == 0;
    do_runs(arguments[1], atol(arguments[2]), run);
    print_statistics();
    return 0;
}
