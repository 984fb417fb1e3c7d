#include "fuzz.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

static char *copy_of(const char *text)
{
    return text == NULL ? NULL : exactly(text, strlen(text) + 1);
}

static const char *name_of_instance(void)
{
    return !careless() ? "spring" : chance(20) ? NULL : awkward_text();
}

static const char *guid_of_instance(void)
{
    return !careless() ? MODEL_GUID : chance(20) ? NULL : awkward_text();
}

int instantiate(Slot *slot)
{
    static const char *const places[] = {NULL, "", "file:///tmp/%s", "\xff", "../.."};
    char *name = copy_of(name_of_instance()), *guid = copy_of(guid_of_instance());
    char *place = copy_of(places[below(5)]);
    int type = careless()     ? (int[]){-1, 2, INT_MAX, INT_MIN}[below(4)]
               : MODEL_STATES ? fmi2ModelExchange
                              : below(2);
    int counting = chance(80), logging = chance(90), half = careless();
    fmi2CallbackFunctions given = host_callbacks(slot, logging, counting);
    if (half)
        *(chance(50) ? (void **)&given.allocateMemory : (void **)&given.freeMemory) = NULL;
    /* The host may do with its copy what it likes afterwards. */
    fmi2CallbackFunctions *functions = careless() && chance(20) ? NULL : exactly(&given, sizeof given);
    starving = counting && careless();
    int refused = functions == NULL || name == NULL || *name == '\0' || type < 0 ||
                  type > (MODEL_STATES ? 0 : 1) || guid == NULL || strcmp(guid, MODEL_GUID) != 0 ||
                  (half && counting) || starving;
    long before = blocks;
    trace("%ld: fmi2Instantiate, type %d", (long)(slot - slots), type);
    host_listen(slot, NULL);
    fmi2Component component =
        fmi2Instantiate(name, (fmi2Type)type, guid, place, functions, below(2), below(2));
    starving = 0;
    CHECK((component == NULL) == refused, "an instance is %s", refused ? "made of wrong arguments" : "refused");
    CHECK(messages.errors == (refused && functions != NULL && logging) && messages.warnings + messages.discards == 0,
          "there are %d messages of errors", messages.errors);
    statistics.calls++;
    *slot = (Slot){.component = component, .name = copy_of(name), .logger = logging, .errors_logged = logging,
                   .warnings_logged = logging};
    char *const strings[] = {name, guid, place};
    for (int i = 0; i < 3; i++)
        if (strings[i] != NULL) {
            memset(strings[i], '!', strlen(strings[i]));
            free(strings[i]);
        }
    free(functions);
    if (component == NULL) {
        CHECK(blocks == before, "a refused instance keeps memory");
        free(slot->name);
        slot->name = NULL;
        return 0;
    }
    long of_instance = blocks - before;
    slot->twin = twin_of((fmi2Type)type);
    look(slot);
    slot->blocks = blocks - before;
    slot->blocks_per_state = slot->blocks - of_instance;
    return 1;
}

void free_instance(Slot *slot)
{
    trace("%ld: fmi2FreeInstance", (long)(slot - slots));
    host_listen(slot, slot->name);
    CHECK(fmi2FreeFMUstate(slot->component, &slot->probe) == fmi2OK && slot->probe == NULL, "a state is not freed");
    fmi2FreeInstance(slot->component);
    CHECK(messages.errors + messages.warnings + messages.discards == 0, "freeing an instance gives messages");
    free(slot->name);
    free(slot->bytes);
    *slot = (Slot){.component = NULL};
    check_blocks(0);
    statistics.sequences++;
    statistics.calls++;
}

Call next_call(const Slot *slot)
{
    static const Call forth[][8] = {
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
    return chance(60) ? forth[slot->twin.mode][below(8)] : (Call)below(CALL_COUNT);
}

void move_on(Slot *slot)
{
    for (int k = 1 + below(5); k > 0; k--) {
        int exchange = slot->twin.type == fmi2ModelExchange;
        if (exchange && slot->twin.mode == EVENT)
            try_call(slot, CALL_EnterContinuousTimeMode);
        if (exchange)
            try_call(slot, CALL_SetTime);
        try_call(slot, CALL_SetReal);
        try_call(slot, exchange ? CALL_CompletedIntegratorStep : CALL_DoStep);
    }
}
