/* The beginning and end of an instance. */
#include "system_instance.h"

/* Where parts of the memory behind an instance begin. */
typedef struct {
    size_t laws, added, shared, bodies, mounts, axes, points, channels, end;
} Layout;

static size_t room(size_t *end, int64_t count, size_t size)
{
    size_t begin = *end, whole = (size_t)count * size;
    *end = begin + (whole + 7) / 8 * 8;
    return begin;
}

static Layout layout(void)
{
    SystemCounts counts = system_counts();
    Layout at = {.end = 0};
    (void)room(&at.end, 1, sizeof(Instance));
    at.laws = room(&at.end, counts.springs, sizeof(SpringLaw));
    at.added = room(&at.end, counts.added, sizeof(SpringAdded));
    at.shared = room(&at.end, counts.springs, sizeof(SharedSpring *));
    at.bodies = room(&at.end, counts.bodies, sizeof(MotionBody));
    at.mounts = room(&at.end, counts.mounts, sizeof(MotionMount));
    at.axes = room(&at.end, counts.axes, sizeof(MotionAxis));
    at.points = room(&at.end, counts.points, sizeof(MotionPoint));
    at.channels = room(&at.end, counts.channels, sizeof(MotionChannel));
    return at;
}

/* Makes the system of memory that is zero. Returns 0 if the memory for a table is missing. */
static int make_system(Instance *instance)
{
    SystemCounts counts = system_counts();
    Layout at = layout();
    char *memory = (char *)instance;
    MotionBody *bodies = (void *)(memory + at.bodies);
    MotionMount *mounts = (void *)(memory + at.mounts);
    MotionAxis *axes = (void *)(memory + at.axes);
    MotionPoint *points = (void *)(memory + at.points);
    MotionChannel *channels = (void *)(memory + at.channels);
    instance->laws = (void *)(memory + at.laws);
    instance->shared = (void *)(memory + at.shared);
    system_parts(instance->laws, (void *)(memory + at.added), bodies, mounts, axes, points, channels);
    instance->system = (MotionSystem){
        .bodies = (size_t)counts.bodies, .mounts = (size_t)counts.mounts, .axes = (size_t)counts.axes,
        .points = (size_t)counts.points, .channels = (size_t)counts.channels, .body = bodies, .mount = mounts,
        .axis = axes, .point = points, .channel = channels};
    for (; instance->springs < (size_t)counts.springs; instance->springs++) {
        SpringLaw *law = instance->laws + instance->springs;
        SpringParameters parameters = law->parameters;
        const SharedSpring *shared = fmu_acquire(&parameters);
        if (shared == NULL)
            return 0;
        instance->shared[instance->springs] = shared;
        spring_prepare(law, &parameters, &shared->table);
    }
    Groups *first = &instance->first;
    first->acceleration = SYSTEM_FIRST_INPUT + (unsigned)counts.channels;
    first->sway = first->acceleration + 3 * (unsigned)counts.points;
    first->force = first->sway + 3 * (unsigned)counts.points;
    first->displacement = first->force + (unsigned)counts.axes;
    first->tilt = first->displacement + (unsigned)counts.axes;
    first->reaction = first->tilt + (unsigned)counts.bodies;
    first->energy = first->reaction + 3;
    first->parameter = first->energy + 1;
    instance->variables = first->parameter + SYSTEM_PARAMETERS;
    return 1;
}

Instance *fmu_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, int mode)
{
    if (mode != CS_INSTANTIATED)
        return FMU_REFUSE_POINTER(log, "This FMU has a solver of its own; instantiate it for co-simulation.");
    Instance *instance = fmu_new_instance(log, name, guid, guid_name, memory, layout().end);
    if (instance == NULL)
        return NULL;
    instance->log = *log;
    instance->memory = *memory;
    if (!make_system(instance)) {
        (void)FMU_REFUSE(log, "There is not enough memory for the tables of the springs.");
        fmu_free(instance);
        return NULL;
    }
    fmu_begin(instance, mode);
    return instance;
}

void fmu_free(Instance *instance)
{
    if (instance == NULL)
        return;
    for (size_t i = 0; i < instance->springs; i++)
        fmu_release(instance->shared[i]);
    Memory memory = instance->memory;
    fmu_free_instance(instance, &memory);
}
