#include "fmu_snapshots.h"

#include "fmu_bytes.h"
#include "fmu_modes.h"

#include <stdlib.h>

/* Its memory is the C library's: the host of the instance that made it, with its functions for memory, may be gone when
 * another instance frees it. */
typedef struct {
    const void *of; /* the FMU that made it */
    State state;
} Snapshot;

/* Takes the fields of a state from bytes, or writes them, or neither; only the first changes it. Returns the size of
 * the serialized form, which is the same for all states of one FMU. */
static size_t serialize(const State *state, const unsigned char *from, unsigned char *to)
{
    Cursor cursor = {from, to, fmu_fields_at()};
    fmu_state_fields(&cursor, (State *)state);
    return cursor.position;
}

static FmuStatus refuse_null(const Instance *instance, const char *call, const char *name)
{
    return FMU_REFUSE(&instance->log, "`%s` of %s must not be NULL.", name, call);
}

static FmuStatus require_snapshot(const Instance *instance, const char *call, const Snapshot *snapshot)
{
    if (snapshot == NULL)
        return refuse_null(instance, call, "snapshot");
    if (snapshot->of != fmu_identity())
        return FMU_REFUSE(
            &instance->log, "The state given to %s must come from an instance of the same FMU.", call);
    return FMU_OK;
}

/* Keeps a state where `held` points. */
static FmuStatus keep(const Instance *instance, const char *call, const State *state, void **held)
{
    Snapshot *snapshot = *held;
    if (snapshot != NULL && require_snapshot(instance, call, snapshot) != FMU_OK)
        return FMU_ERROR;
    if (snapshot == NULL)
        snapshot = calloc(1, sizeof *snapshot);
    if (snapshot == NULL)
        return FMU_REFUSE(&instance->log, "There is not enough memory for a state.");
    snapshot->of = fmu_identity();
    snapshot->state = *state;
    *held = snapshot;
    return FMU_OK;
}

FmuStatus fmu_take_snapshot(const Instance *instance, const char *call, void **held)
{
    return held == NULL ? refuse_null(instance, call, "state") : keep(instance, call, &instance->state, held);
}

FmuStatus fmu_return_to_snapshot(Instance *instance, const char *call, const void *held)
{
    const Snapshot *snapshot = held;
    if (require_snapshot(instance, call, snapshot) != FMU_OK)
        return FMU_ERROR;
    int kind = fmu_of_kind(instance->state.mode, ANY_MODE);
    if (!(snapshot->state.mode & kind))
        return FMU_REFUSE(&instance->log, "The state must be one of %s, but it is one of %s.",
                          kind == IN_MODEL_EXCHANGE ? "model exchange" : "co-simulation",
                          kind == IN_MODEL_EXCHANGE ? "co-simulation" : "model exchange");
    fmu_restore(instance, &snapshot->state);
    return FMU_OK;
}

FmuStatus fmu_free_snapshot(const Instance *instance, const char *call, void **held)
{
    if (held == NULL || *held == NULL)
        return FMU_OK;
    /* Some hosts, fmusim among them, give the state in place of its address. */
    Snapshot *snapshot = *held == fmu_identity() ? (void *)held : *held;
    if (require_snapshot(instance, call, snapshot) != FMU_OK)
        return FMU_ERROR;
    *held = NULL;
    snapshot->of = NULL;
    free(snapshot);
    return FMU_OK;
}

FmuStatus fmu_size_of_snapshot(const Instance *instance, const char *call, const void *held, size_t *size)
{
    if (require_snapshot(instance, call, held) != FMU_OK)
        return FMU_ERROR;
    if (size == NULL)
        return refuse_null(instance, call, "size");
    *size = serialize(&((const Snapshot *)held)->state, NULL, NULL);
    return FMU_OK;
}

FmuStatus fmu_write_snapshot(
    const Instance *instance, const char *call, const void *held, unsigned char *bytes, size_t size)
{
    const Snapshot *snapshot = held;
    if (require_snapshot(instance, call, snapshot) != FMU_OK)
        return FMU_ERROR;
    if (bytes == NULL)
        return refuse_null(instance, call, "serializedState");
    size_t expected = serialize(&snapshot->state, NULL, NULL);
    if (size != expected)
        return FMU_REFUSE(&instance->log, "A serialized state must have %.0f bytes, got %.0f.", (double)expected,
                          (double)size);
    (void)serialize(&snapshot->state, NULL, bytes);
    fmu_write_head(bytes, size);
    return FMU_OK;
}

FmuStatus fmu_read_snapshot(
    const Instance *instance, const char *call, const unsigned char *bytes, size_t size, void **held)
{
    void *made = NULL;
    char problem[256];
    if (bytes == NULL || held == NULL)
        return refuse_null(instance, call, bytes == NULL ? "serializedState" : "state");
    if (*held != NULL && require_snapshot(instance, call, *held) != FMU_OK)
        return FMU_ERROR;
    const char *foreign = fmu_foreign(bytes, size, serialize(&instance->state, NULL, NULL));
    if (foreign != NULL)
        return FMU_REFUSE(&instance->log, "%s", foreign);
    /* Not on the stack, for which a state is too large in a small thread. */
    if (keep(instance, call, &instance->state, &made) != FMU_OK)
        return FMU_ERROR;
    State *state = &((Snapshot *)made)->state;
    (void)serialize(state, bytes, NULL);
    FmuStatus status = fmu_state_problem(state, problem, sizeof problem) ? FMU_REFUSE(&instance->log, "%s", problem)
                                                                         : keep(instance, call, state, held);
    free(made);
    return status;
}
