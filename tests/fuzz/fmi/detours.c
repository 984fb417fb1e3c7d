#include "fuzz.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Detours of an instance from its life, after which it goes back to where it was. */

enum { MOST_ANSWERS = 12 + 9 * MODEL_VARIABLES };

/* What an instance answers while something is done with it. */
typedef struct {
    fmi2Status status[MOST_ANSWERS];
    double value[MOST_ANSWERS];
    int count;
} Answers;

/* The value is NULL if there is none; the call may not have been made yet when it is passed on. */
static void note(Answers *answers, fmi2Status status, const double *value)
{
    answers->status[answers->count] = status;
    answers->value[answers->count++] = status == fmi2OK && value != NULL ? *value : 0.0;
}

static void read_all(fmi2Component component, Answers *answers)
{
    static const fmi2Integer first = 1;
    static const double seed = 1.0;
    fmi2ValueReference const force = (fmi2ValueReference)variable("force");
    for (fmi2ValueReference i = 0; i < MODEL_VARIABLES; i++) {
        double value = 0.0, slope = 0.0, rate = 0.0;
        fmi2Status status = fmi2GetReal(component, &i, 1, &value);
        note(answers, status, &value);
        if (status == fmi2OK && strcmp(described[i].name, "omega") == 0 && !MODEL_STATES)
            CHECK(fabs(value) <= 1.0, "omega is %g", value);
        status = fmi2GetDirectionalDerivative(component, &force, 1, &i, 1, &seed, &slope);
        note(answers, status, &slope);
        status = fmi2GetRealOutputDerivatives(component, &i, 1, &first, &rate);
        note(answers, status, &rate);
        CHECK(isfinite(value) && isfinite(slope) && isfinite(rate), "%s, its rate or a derivative by it is not finite",
              described[i].name);
    }
}

static Answers answers_of(Slot *slot, double displacement)
{
    Answers answers = {.count = 0};
    fmi2ValueReference input = (fmi2ValueReference)variable("displacement");
    fmi2Component component = slot->component;
    fmi2Boolean event = 0, end = 0;
    double indicator = 0.0;
    host_listen(slot, slot->name);
    read_all(component, &answers);
    for (int k = 0; k < 2; k++) {
        note(&answers, fmi2SetReal(component, &input, 1, &displacement), NULL);
        fmi2Status status = fmi2GetEventIndicators(component, &indicator, 1);
        note(&answers, status, &indicator);
        CHECK(isfinite(indicator), "the event indicator is %g", indicator);
        note(&answers, fmi2DoStep(component, 0.0, 0.25, 0), NULL);
        note(&answers, fmi2ExitInitializationMode(component), NULL);
        note(&answers, fmi2EnterContinuousTimeMode(component), NULL);
        note(&answers, fmi2CompletedIntegratorStep(component, 0, &event, &end), NULL);
        read_all(component, &answers);
        displacement = described[input].start;
    }
    look(slot);
    return answers;
}

/* The instance goes back to a state that it was in. */
static void go_back(Slot *slot, fmi2FMUstate state, const unsigned char *bytes)
{
    host_listen(slot, slot->name);
    CHECK(fmi2SetFMUstate(slot->component, state) == fmi2OK, "an instance cannot go back");
    look(slot);
    CHECK(memcmp(slot->bytes, bytes, state_size()) == 0, "an instance has not gone back");
}

void live_through_a_made_up_state(Slot *slot)
{
    fmi2FMUstate home = NULL, strange = NULL;
    unsigned char *start = exactly(slot->bytes, state_size());
    Serialized made = made_up(start, kept_bytes());
    trace("%ld: a made-up state", (long)(slot - slots));
    host_listen(slot, slot->name);
    CHECK(fmi2GetFMUstate(slot->component, &home) == fmi2OK, "a state cannot be taken");
    fmi2Status status =
        fmi2DeSerializeFMUstate(slot->component, (const fmi2Byte *)made.bytes, made.size, &strange);
    CHECK(status == fmi2OK || status == fmi2Error, "the status is %d", (int)status);
    ++*(status == fmi2OK ? &statistics.crafted_taken : &statistics.crafted_refused);
    if (status == fmi2OK && fmi2SetFMUstate(slot->component, strange) == fmi2OK) {
        look(slot);
        CHECK(memcmp(slot->bytes, made.bytes, made.size) == 0, "a state is not that of its bytes");
        answers_of(slot, usual_displacement());
        go_back(slot, home, start);
    }
    host_listen(slot, slot->name);
    CHECK(fmi2FreeFMUstate(slot->component, &home) == fmi2OK && fmi2FreeFMUstate(slot->component, &strange) == fmi2OK,
          "a state is not freed");
    free(made.bytes);
    free(start);
    check_blocks(0);
}

void compare_with_a_copy(Slot *slot)
{
    Slot copy = {.name = slot->name};
    fmi2CallbackFunctions functions = host_callbacks(&copy, slot->logger, 0);
    fmi2FMUstate state = NULL;
    double displacement = usual_displacement();
    trace("%ld: compared with a copy", (long)(slot - slots));
    statistics.copies++;
    unsigned char *start = exactly(slot->bytes, state_size());
    host_listen(&copy, copy.name);
    copy.component = fmi2Instantiate(copy.name, slot->twin.type, MODEL_GUID, NULL, &functions, 0, 0);
    CHECK(copy.component != NULL, "an instance is refused");
    CHECK(fmi2DeSerializeFMUstate(copy.component, (fmi2Byte *)start, state_size(), &state) == fmi2OK &&
              fmi2SetFMUstate(copy.component, state) == fmi2OK,
          "the copy of an instance is refused");
    Answers first = answers_of(slot, displacement), second = answers_of(&copy, displacement);
    CHECK(memcmp(&first, &second, sizeof first) == 0 && memcmp(slot->bytes, copy.bytes, state_size()) == 0,
          "an instance and its copy go different ways");
    go_back(slot, state, start);
    host_listen(&copy, copy.name);
    CHECK(fmi2FreeFMUstate(copy.component, &state) == fmi2OK && fmi2FreeFMUstate(copy.component, &copy.probe) == fmi2OK,
          "a state is not freed");
    fmi2FreeInstance(copy.component);
    free(copy.bytes);
    free(start);
}
