/* A host of several native FMUs at once, for the tests of what they share: the process.
 *
 *     many_fmus TASK COUNT (LIBRARY GUID RESOURCES)...
 *
 * together   instances of all FMUs take steps by turns: each gives the bits that it gives alone
 * fork       a child goes on with its copies of all instances and frees them; so does the parent
 * threads    COUNT rounds in each of eight threads with instances of their own; and instances that change threads
 * states     states are freed, and taken, by other instances than their makers, which are gone, as is their memory
 * reload     COUNT times every library is loaded, used and unloaded
 * lives      COUNT instances made and freed; prints resident pages ten times on the way
 *
 * Exit status 1, with the line, if something is not as it must be.
 */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include "host_check.h"

#include <dlfcn.h>
#include <pthread.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

/* Value references of the variable table. */
static const fmi2ValueReference OUTPUTS[] = {1, 2, 3};

enum { FMUS = 6, VALUES = 3, STEPS = 60, THREADS = 8 };

#define FUNCTIONS(F) \
    F(Instantiate) F(FreeInstance) F(SetupExperiment) F(EnterInitializationMode) F(ExitInitializationMode) \
    F(SetReal) F(GetReal) F(DoStep) F(GetFMUstate) F(SetFMUstate) F(FreeFMUstate)

typedef struct {
    const char *path, *guid, *resources;
    void *library;
#define DECLARED(name) fmi2##name##TYPE *name;
    FUNCTIONS(DECLARED)
} Fmu;

static Fmu fmus[FMUS];
static int fmu_count;
static long rounds;

static void load(Fmu *fmu)
{
    fmu->library = dlopen(fmu->path, RTLD_NOW | RTLD_LOCAL);
    if (fmu->library == NULL)
        fprintf(stderr, "%s\n", dlerror());
    CHECK(fmu->library != NULL);
#define FOUND(name) \
    *(void **)&fmu->name = dlsym(fmu->library, "fmi2" #name); \
    CHECK(fmu->name != NULL);
    FUNCTIONS(FOUND)
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                          fmi2String format, ...)
{
    (void)environment, (void)name, (void)category;
    if (status != fmi2Warning)
        fprintf(stderr, "%s\n", format);
}

static const fmi2CallbackFunctions CALLBACKS = {print_message, calloc, free, NULL, NULL};

static double position(int step)
{
    return 0.02 + 1e-3 * ((step * 7) % 23 - 11);
}

static void set(const Fmu *fmu, fmi2Component instance, double displacement)
{
    static const fmi2ValueReference DISPLACEMENT = 0;
    OK(fmu->SetReal(instance, &DISPLACEMENT, 1, &displacement));
}

static fmi2Component started(const Fmu *fmu, const fmi2CallbackFunctions *callbacks)
{
    fmi2Component instance =
        fmu->Instantiate("one", fmi2CoSimulation, fmu->guid, fmu->resources, callbacks, fmi2False, fmi2False);
    CHECK(instance != NULL);
    OK(fmu->SetupExperiment(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    OK(fmu->EnterInitializationMode(instance));
    set(fmu, instance, position(0));
    OK(fmu->ExitInitializationMode(instance));
    return instance;
}

static void step(const Fmu *fmu, fmi2Component instance, int number, double values[VALUES])
{
    set(fmu, instance, position(number));
    OK(fmu->DoStep(instance, 1e-3 * number, 1e-3, fmi2True));
    OK(fmu->GetReal(instance, OUTPUTS, VALUES, values));
}

/* What each FMU gives when it is alone. */
static double expected[FMUS][STEPS][VALUES];

static void be_alone(void)
{
    for (int i = 0; i < fmu_count; i++) {
        fmi2Component instance = started(&fmus[i], &CALLBACKS);
        for (int k = 0; k < STEPS; k++)
            step(&fmus[i], instance, k, expected[i][k]);
        fmus[i].FreeInstance(instance);
    }
}

static void go_on(int i, fmi2Component instance, int from, int to)
{
    double values[VALUES];
    for (int k = from; k < to; k++) {
        step(&fmus[i], instance, k, values);
        CHECK(memcmp(values, expected[i][k], sizeof values) == 0);
    }
}

static void start_all(fmi2Component instances[FMUS])
{
    for (int i = 0; i < fmu_count; i++)
        instances[i] = started(&fmus[i], &CALLBACKS);
}

static void end_all(fmi2Component instances[FMUS], int from)
{
    for (int k = from; k < STEPS; k++)
        for (int i = 0; i < fmu_count; i++)
            go_on(i, instances[i], k, k + 1);
    for (int i = 0; i < fmu_count; i++)
        fmus[i].FreeInstance(instances[i]);
}

static void go_together(void)
{
    fmi2Component instances[FMUS];
    start_all(instances);
    end_all(instances, 0);
}

static void go_apart(void)
{
    fmi2Component instances[FMUS];
    int status;
    start_all(instances);
    for (int i = 0; i < fmu_count; i++)
        go_on(i, instances[i], 0, STEPS / 2);
    pid_t child = fork();
    CHECK(child >= 0);
    if (child == 0)
        alarm(60);
    end_all(instances, STEPS / 2);
    go_together();
    if (child == 0)
        _exit(0);
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

typedef struct {
    int fmu, from, to, last;
    fmi2Component instance;
} Share;

static void *take_share(void *argument)
{
    Share *share = argument;
    if (share->instance == NULL)
        share->instance = started(&fmus[share->fmu], &CALLBACKS);
    go_on(share->fmu, share->instance, share->from, share->to);
    if (share->last)
        fmus[share->fmu].FreeInstance(share->instance);
    return NULL;
}

static void *live_often(void *argument)
{
    for (long k = 0; k < rounds; k++) {
        Share whole = {.fmu = *(int *)argument, .from = 0, .to = STEPS, .last = 1};
        take_share(&whole);
    }
    return NULL;
}

static void go_in_threads(void)
{
    pthread_t threads[THREADS];
    int numbers[THREADS];
    for (int i = 0; i < THREADS; i++) {
        numbers[i] = i % fmu_count;
        CHECK(pthread_create(&threads[i], NULL, live_often, &numbers[i]) == 0);
    }
    for (int i = 0; i < THREADS; i++)
        CHECK(pthread_join(threads[i], NULL) == 0);
    /* Made by one thread, taken on by others, freed by the last. */
    for (int i = 0; i < fmu_count; i++) {
        Share share = {.fmu = i};
        for (int k = 0; k < THREADS; k++) {
            share.from = STEPS * k / THREADS;
            share.to = STEPS * (k + 1) / THREADS;
            share.last = k == THREADS - 1;
            CHECK(pthread_create(&threads[0], NULL, take_share, &share) == 0);
            CHECK(pthread_join(threads[0], NULL) == 0);
        }
    }
}

/* Memory of one instance's host, which goes with it: whoever calls its functions or reads it afterwards is stopped. */
typedef struct {
    unsigned char *at;
    size_t used;
} Arena;

enum { ARENA = 1 << 20 };
static Arena arena;

static void *arena_allocate(size_t count, size_t size)
{
    size_t bytes = (count * size + 15) / 16 * 16;
    CHECK(arena.at != NULL && arena.used + bytes <= ARENA);
    arena.used += bytes;
    return arena.at + arena.used - bytes;
}

static void arena_free(void *block)
{
    CHECK(block == NULL || arena.at != NULL);
}

static void outlive_makers(void)
{
    const fmi2CallbackFunctions callbacks = {print_message, arena_allocate, arena_free, NULL, NULL};
    for (int i = 0; i < fmu_count; i++) {
        const Fmu *fmu = &fmus[i];
        fmi2FMUstate first = NULL, second = NULL;
        fmi2Component other = started(fmu, &CALLBACKS);
        arena.at = mmap(NULL, ARENA, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        CHECK(arena.at != MAP_FAILED);
        arena.used = 0;
        fmi2Component maker = started(fmu, &callbacks);
        go_on(i, maker, 0, STEPS / 2);
        OK(fmu->GetFMUstate(maker, &first));
        OK(fmu->GetFMUstate(maker, &second));
        fmu->FreeInstance(maker);
        CHECK(munmap(arena.at, ARENA) == 0);
        arena.at = NULL;
        OK(fmu->SetFMUstate(other, first));
        OK(fmu->FreeFMUstate(other, &first));
        go_on(i, other, STEPS / 2, STEPS);
        OK(fmu->SetFMUstate(other, second));
        go_on(i, other, STEPS / 2, STEPS);
        OK(fmu->FreeFMUstate(other, &second));
        CHECK(first == NULL && second == NULL);
        fmu->FreeInstance(other);
    }
}

static void reload(void)
{
    for (long k = 0; k < rounds; k++) {
        for (int i = 0; i < fmu_count; i++) {
            CHECK(dlclose(fmus[i].library) == 0);
            CHECK(dlopen(fmus[i].path, RTLD_NOW | RTLD_NOLOAD) == NULL);
            load(&fmus[i]);
            fmi2Component instance = started(&fmus[i], &CALLBACKS);
            go_on(i, instance, 0, 3);
            fmus[i].FreeInstance(instance);
        }
    }
}

static long resident_pages(void)
{
    long all, resident;
    FILE *file = fopen("/proc/self/statm", "r");
    CHECK(file != NULL && fscanf(file, "%ld %ld", &all, &resident) == 2);
    fclose(file);
    return resident;
}

static void live(void)
{
    for (long k = 0; k < rounds; k++) {
        for (int i = 0; i < fmu_count; i++) {
            fmi2FMUstate state = NULL;
            fmi2Component instance = started(&fmus[i], &CALLBACKS);
            go_on(i, instance, 0, 3);
            OK(fmus[i].GetFMUstate(instance, &state));
            OK(fmus[i].FreeFMUstate(instance, &state));
            fmus[i].FreeInstance(instance);
        }
        if ((k + 1) % (rounds / 10) == 0)
            printf("%ld\n", resident_pages());
    }
}

int main(int count, char *arguments[])
{
    static const struct {
        const char *name;
        void (*task)(void);
    } TASKS[] = {{"together", go_together}, {"fork", go_apart}, {"threads", go_in_threads},
                 {"states", outlive_makers}, {"reload", reload}, {"lives", live}};
    fmu_count = (count - 3) / 3;
    CHECK(0 < fmu_count && fmu_count <= FMUS && (count - 3) % 3 == 0);
    rounds = atol(arguments[2]);
    for (int i = 0; i < fmu_count; i++) {
        char **given = arguments + 3 + 3 * i;
        fmus[i] = (Fmu){.path = given[0], .guid = given[1], .resources = given[2]};
        load(&fmus[i]);
    }
    be_alone();
    for (size_t i = 0; i < sizeof TASKS / sizeof *TASKS; i++)
        if (strcmp(arguments[1], TASKS[i].name) == 0) {
            TASKS[i].task();
            return 0;
        }
    CHECK(!"a task of this name");
}
