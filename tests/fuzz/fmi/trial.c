#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

Slot slots[SLOTS];
static size_t size_of_states;

size_t state_size(void)
{
    return size_of_states;
}

void look(Slot *slot)
{
    int before = starving;
    starving = 0;
    CHECK(fmi2GetFMUstate(slot->component, &slot->probe) == fmi2OK, "a state cannot be taken");
    if (size_of_states == 0)
        CHECK(fmi2SerializedFMUstateSize(slot->component, slot->probe, &size_of_states) == fmi2OK,
              "a state has no size");
    if (slot->bytes == NULL)
        slot->bytes = allocated(size_of_states);
    CHECK(fmi2SerializeFMUstate(slot->component, slot->probe, (fmi2Byte *)slot->bytes, size_of_states) == fmi2OK,
          "a state cannot be serialized");
    starving = before;
}

void check_blocks(long more)
{
    long known = blocks_of_states() + more, instances = 0;
    for (int i = 0; i < SLOTS; i++) {
        known += slots[i].blocks;
        instances += slots[i].component != NULL;
    }
    CHECK(blocks == known, "%ld blocks of memory are given out, where instances and states have %ld", blocks, known);
    /* Each a table, and the laws of changed parameters. */
    CHECK(tables <= 2 * instances, "%ld instances have %ld tables and laws", instances, tables);
}

Trial trial_of(Slot *slot, Call call)
{
    static const int prediction[] = {[NO] = MAY_ERROR, [YES] = MAY_OK, [UNSURE] = MAY_OK | MAY_ERROR};
    Trial trial = {slot, call, slot->component, prediction[may_call(&slot->twin, call)], 0, 0};
    if (careless() && chance(10)) {
        trial.component = NULL;
        trial.may = MAY_ERROR;
    }
    if (slot->twin.mode == UNKNOWN) {
        trial.warnings = -1;
        trial.may |= trial.may & MAY_OK ? MAY_DISCARD : 0;
    }
    trace("%ld: fmi2%s", (long)(slot - slots), call_names[call]);
    host_listen(slot, slot->name);
    return trial;
}

void must(Trial *trial, Answer condition)
{
    if (condition == NO)
        trial->may = MAY_ERROR;
    else if (condition == UNSURE)
        trial->may |= MAY_ERROR;
}

void or_discard(Trial *trial, Answer condition)
{
    if (condition != YES && trial->may & MAY_OK)
        trial->may |= MAY_DISCARD;
    if (condition == NO)
        trial->may &= ~MAY_OK;
}

static void check_messages(const Trial *trial, fmi2Status status)
{
    const Slot *slot = trial->slot;
    int named = trial->component != NULL; /* without an instance there is no logger */
    int errors = named && slot->errors_logged && status == fmi2Error;
    int discards = named && slot->errors_logged && status == fmi2Discard;
    CHECK(messages.errors == errors && messages.discards == discards,
          "there are %d messages of errors and %d of discards with the status %d", messages.errors, messages.discards,
          (int)status);
    int warnings = status == fmi2OK && slot->warnings_logged ? trial->warnings : 0;
    CHECK(warnings < 0 || messages.warnings == warnings, "there are %d warnings where %d are due", messages.warnings,
          warnings);
}

int judged(Trial *trial, fmi2Status status, int effect)
{
    Slot *slot = trial->slot;
    trace("    status %d of set %d", (int)status, trial->may);
    statistics.calls++;
    CHECK(status == fmi2OK || status == fmi2Discard || status == fmi2Error, "the status is %d", (int)status);
    CHECK(trial->may & 1 << status, "the status is %d where the set %d was predicted", (int)status, trial->may);
    check_messages(trial, status);
    check_blocks(status == fmi2OK ? trial->blocks : 0);
    unsigned char *before = slot->bytes;
    slot->bytes = NULL;
    look(slot);
    if (status != fmi2OK || effect == LOOKS)
        CHECK(memcmp(before, slot->bytes, size_of_states) == 0, "the state has changed with the status %d",
              (int)status);
    free(before);
    long *count = status == fmi2OK        ? statistics.done
                  : status == fmi2Discard ? statistics.discarded
                                          : statistics.refused;
    count[trial->call]++;
    return status == fmi2OK;
}
