#include "fuzz.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

/* States that the host holds, of instances that may be gone. */
enum { SNAPSHOTS = 6 };

typedef struct {
    fmi2FMUstate state;
    unsigned char *bytes; /* its serialized form */
    Twin twin;
    long blocks;
} Snapshot;

static Snapshot snapshots[SNAPSHOTS];

/* Another FMU, of which nothing must be accepted. */
static struct {
    void *library;
    fmi2Component component;
    fmi2FMUstate state;
    unsigned char *bytes;
    size_t size;
} other;

/* What is no state at all. */
static unsigned char junk[256];

#define OF_OTHER(name) ((fmi2##name##TYPE *)symbol("fmi2" #name))

static void (*symbol(const char *name))(void)
{
    void (*found)(void);
    *(void **)&found = dlsym(other.library, name);
    CHECK(found != NULL, "the other FMU has no %s", name);
    return found;
}

void open_other(const char *library, const char *guid)
{
    static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    other.library = dlopen(library, RTLD_NOW | RTLD_LOCAL);
    CHECK(other.library != NULL, "%s", dlerror());
    other.component = OF_OTHER(Instantiate)("other", fmi2CoSimulation, guid, NULL, &callbacks, 0, 0);
    CHECK(other.component != NULL, "the other FMU cannot be instantiated");
    OF_OTHER(GetFMUstate)(other.component, &other.state);
    OF_OTHER(SerializedFMUstateSize)(other.component, other.state, &other.size);
    other.bytes = allocated(other.size);
    OF_OTHER(SerializeFMUstate)(other.component, other.state, (fmi2Byte *)other.bytes, other.size);
    for (size_t i = 0; i < sizeof junk; i++)
        junk[i] = (unsigned char)below(256);
}

void close_other(void)
{
    OF_OTHER(FreeFMUstate)(other.component, &other.state);
    OF_OTHER(FreeInstance)(other.component);
    free(other.bytes);
    dlclose(other.library);
}

long blocks_of_states(void)
{
    long total = 0;
    for (int i = 0; i < SNAPSHOTS; i++)
        total += snapshots[i].blocks;
    return total;
}

const unsigned char *kept_bytes(void)
{
    return snapshots[below(SNAPSHOTS)].bytes;
}

static void forget(Snapshot *snapshot)
{
    free(snapshot->bytes);
    *snapshot = (Snapshot){.state = NULL};
}

void release_states(Slot *slot)
{
    host_listen(slot, slot->name);
    for (int i = 0; i < SNAPSHOTS; i++) {
        CHECK(fmi2FreeFMUstate(slot->component, &snapshots[i].state) == fmi2OK, "a state is not freed");
        forget(&snapshots[i]);
    }
    check_blocks(0);
}

/* What a careless host may take for a state. */
static fmi2FMUstate no_state(void)
{
    fmi2FMUstate const found[] = {NULL, junk, other.state};
    return found[below(3)];
}

/* A state to use, and the snapshot that holds it or NULL if it is none. */
static fmi2FMUstate some_state(Trial *trial, Snapshot **holder)
{
    Snapshot *snapshot = &snapshots[below(SNAPSHOTS)];
    int wrong = careless() || snapshot->state == NULL;
    *holder = wrong ? NULL : snapshot;
    must(trial, wrong ? NO : YES);
    return wrong ? no_state() : snapshot->state;
}

static unsigned char *bytes_of(const Slot *slot, fmi2FMUstate state)
{
    unsigned char *bytes = allocated(state_size());
    CHECK(fmi2SerializeFMUstate(slot->component, state, (fmi2Byte *)bytes, state_size()) == fmi2OK,
          "a state cannot be serialized");
    return bytes;
}

static void check_bytes(Slot *slot, Snapshot *snapshot)
{
    unsigned char *bytes = bytes_of(slot, snapshot->state);
    CHECK(memcmp(bytes, snapshot->bytes, state_size()) == 0, "a state is not what it was");
    free(bytes);
}

/* Takes the state of the instance, or that of the bytes if there are any, into new memory or over an old state. */
static int take(Trial *trial, const Serialized *from, const Twin *twin)
{
    Slot *slot = trial->slot;
    Snapshot *snapshot = &snapshots[below(SNAPSHOTS)];
    int nowhere = careless() && chance(30), wrong = careless();
    fmi2FMUstate const before = wrong ? (chance(50) ? (fmi2FMUstate)junk : other.state) : snapshot->state;
    fmi2FMUstate state = before;
    must(trial, nowhere || wrong ? NO : YES);
    if (before == NULL) {
        trial->blocks = slot->blocks_per_state;
        starving = slot->blocks_per_state > 0 && careless();
        must(trial, starving ? NO : YES);
    }
    fmi2FMUstate *to = nowhere ? NULL : &state;
    fmi2Status status =
        from == NULL ? fmi2GetFMUstate(trial->component, to)
                     : fmi2DeSerializeFMUstate(trial->component, (const fmi2Byte *)from->bytes, from->size, to);
    starving = 0;
    if (!judged(trial, status, LOOKS)) {
        CHECK(state == before, "a call that failed has changed the pointer to a state");
        return 0;
    }
    CHECK(state != NULL && (before == NULL || state == before), "a state is not where it should be");
    free(snapshot->bytes);
    snapshot->state = state;
    snapshot->bytes = exactly(from == NULL ? slot->bytes : from->bytes, state_size());
    snapshot->twin = *twin;
    snapshot->blocks += trial->blocks;
    check_bytes(slot, snapshot);
    return 1;
}

static void deserialize(Trial *trial)
{
    Slot *slot = trial->slot;
    const Snapshot *kept = &snapshots[below(SNAPSHOTS)], *part = &snapshots[below(SNAPSHOTS)];
    int from_kept = kept->state != NULL && chance(50), of_other = part->state == NULL || chance(50);
    Twin twin = from_kept ? kept->twin : slot->twin;
    Serialized made = serialized_from(from_kept ? kept->bytes : slot->bytes, of_other ? other.bytes : part->bytes,
                                      of_other ? other.size : state_size());
    trace("    quality %d, %zu bytes", made.quality, made.size);
    must(trial, made.quality == SOUND ? YES : made.quality == BROKEN ? NO : UNSURE);
    if (made.quality == CRAFTED)
        twin.mode = UNKNOWN;
    int taken = take(trial, &made, &twin);
    if (made.quality == CRAFTED)
        ++*(taken ? &statistics.crafted_taken : &statistics.crafted_refused);
    free(made.bytes);
}

static void restore(Trial *trial)
{
    Slot *slot = trial->slot;
    Snapshot *snapshot;
    fmi2FMUstate state = some_state(trial, &snapshot);
    if (snapshot != NULL && snapshot->twin.mode == UNKNOWN)
        must(trial, UNSURE);
    else if (snapshot != NULL)
        must(trial, snapshot->twin.type == slot->twin.type ? YES : NO);
    if (!judged(trial, fmi2SetFMUstate(trial->component, state), CHANGES))
        return;
    CHECK(memcmp(slot->bytes, snapshot->bytes, state_size()) == 0, "an instance is not in the state it was taken to");
    fmi2Type type = slot->twin.type;
    slot->twin = snapshot->twin;
    slot->twin.type = type;
}

static void release(Trial *trial)
{
    Snapshot *snapshot = &snapshots[below(SNAPSHOTS)];
    int nowhere = careless() && chance(30), wrong = careless();
    fmi2FMUstate const before = wrong ? (chance(50) ? (fmi2FMUstate)junk : other.state) : snapshot->state;
    fmi2FMUstate state = before;
    int done = !nowhere && !wrong;
    must(trial, wrong && !nowhere ? NO : YES);
    trial->blocks = done ? -snapshot->blocks : 0;
    if (!judged(trial, fmi2FreeFMUstate(trial->component, nowhere ? NULL : &state), LOOKS) || nowhere) {
        CHECK(state == before, "a call that does nothing has changed the pointer to a state");
        return;
    }
    CHECK(state == NULL, "the pointer to a freed state is left");
    forget(snapshot);
}

static void size_of_state(Trial *trial)
{
    Snapshot *snapshot;
    size_t size = 0, *to = elements(1, sizeof size);
    fmi2FMUstate state = some_state(trial, &snapshot);
    must_be_given(trial, to, 1);
    if (judged(trial, fmi2SerializedFMUstateSize(trial->component, state, to), LOOKS))
        CHECK(*to == state_size(), "a state has %zu bytes, another one %zu", *to, state_size());
    free(to);
}

static void serialize(Trial *trial)
{
    Snapshot *snapshot;
    fmi2FMUstate state = some_state(trial, &snapshot);
    size_t size = !careless() ? state_size() : (size_t)below(2 * (int)state_size());
    void *to = elements(size, 1);
    must(trial, size == state_size() ? YES : NO);
    must_be_given(trial, to, size);
    if (judged(trial, fmi2SerializeFMUstate(trial->component, state, to, size), LOOKS))
        CHECK(memcmp(to, snapshot->bytes, size) == 0, "a state has changed while it was kept");
    free(to);
}

void try_states(Trial *trial)
{
    switch (trial->call) {
    case CALL_GetFMUstate: take(trial, NULL, &trial->slot->twin); break;
    case CALL_SetFMUstate: restore(trial); break;
    case CALL_FreeFMUstate: release(trial); break;
    case CALL_SerializedFMUstateSize: size_of_state(trial); break;
    case CALL_SerializeFMUstate: serialize(trial); break;
    case CALL_DeSerializeFMUstate: deserialize(trial); break;
    default: FAIL("there is no such call");
    }
}
