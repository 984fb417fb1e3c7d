/* A host of FMUs without Python, for this computer and, by wine, for Windows.
 *
 *     host path 0 (LIBRARY GUID RESOURCES)...
 *
 * exchanges displacements on standard input for force and absorbed energy of each FMU on standard output, a line of them
 * for each displacement, in hexadecimal so that no digit is lost; the first is where the path starts. Not on Windows:
 *
 *     fork       instances of all FMUs take steps by turns: each gives the bits that it gives alone; a child goes on with
 *                its copies of all instances and frees them; so does the parent
 *     threads    COUNT rounds in each of eight threads with instances of their own; and instances that change threads
 *     little stack   the same, where each thread has 48 kB
 *     reload     COUNT times every library is loaded, used and unloaded
 *
 * Exit status 1, with the line, if something is not as it must be.
 */
#define _DEFAULT_SOURCE
#include "fmi2Functions.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
typedef FARPROC Function;
static void *opened(const char *path) { return (void *)LoadLibraryA(path); }
static Function found(void *library, const char *name) { return GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>
typedef void (*Function)(void);
static void *opened(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static Function found(void *library, const char *name)
{
    Function function;
    *(void **)&function = dlsym(library, name);
    return function;
}
#endif

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
            exit(1); \
        } \
    } while (0)
#define OK(call) CHECK((call) == fmi2OK)
#define FUNCTIONS(F) \
    F(Instantiate) F(FreeInstance) F(SetupExperiment) F(EnterInitializationMode) F(ExitInitializationMode) \
    F(SetReal) F(GetReal) F(DoStep) F(Terminate)

typedef struct {
    const char *path, *guid, *resources;
    void *library;
#define DECLARED(name) fmi2##name##TYPE *name;
    FUNCTIONS(DECLARED)
} Fmu;

enum { FMUS = 6, VALUES = 2, STEPS = 60, THREADS = 8 };
static Fmu fmus[FMUS];
static int fmu_count;
static long rounds;
static const double STEP_SIZE = 0x1p-9; /* as in interop/hosts.py */

static void load(Fmu *fmu)
{
    fmu->library = opened(fmu->path);
    CHECK(fmu->library != NULL);
#define FOUND(name) \
    fmu->name = (fmi2##name##TYPE *)found(fmu->library, "fmi2" #name); \
    CHECK(fmu->name != NULL);
    FUNCTIONS(FOUND)
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                          fmi2String format, ...)
{
    va_list arguments;
    (void)environment;
    if (status == fmi2Warning)
        return;
    fprintf(stderr, "%s|%d|%s|", name, (int)status, category);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
}

static const fmi2CallbackFunctions CALLBACKS = {print_message, calloc, free, NULL, NULL};

static void set(const Fmu *fmu, fmi2Component instance, double displacement)
{
    static const fmi2ValueReference DISPLACEMENT = 0;
    OK(fmu->SetReal(instance, &DISPLACEMENT, 1, &displacement));
}

static fmi2Component started(const Fmu *fmu, double displacement)
{
    fmi2Component instance =
        fmu->Instantiate("one", fmi2CoSimulation, fmu->guid, fmu->resources, &CALLBACKS, fmi2False, fmi2False);
    CHECK(instance != NULL);
    OK(fmu->SetupExperiment(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    OK(fmu->EnterInitializationMode(instance));
    set(fmu, instance, displacement);
    OK(fmu->ExitInitializationMode(instance));
    return instance;
}

static void get(const Fmu *fmu, fmi2Component instance, double values[VALUES])
{
    static const fmi2ValueReference OUTPUTS[] = {1, 3}; /* force, absorbed_energy */
    OK(fmu->GetReal(instance, OUTPUTS, VALUES, values));
}

static void step(const Fmu *fmu, fmi2Component instance, double displacement, long number, double values[VALUES])
{
    set(fmu, instance, displacement);
    OK(fmu->DoStep(instance, STEP_SIZE * (double)number, STEP_SIZE, fmi2True));
    get(fmu, instance, values);
}

static void follow_path(void)
{
    fmi2Component instances[FMUS];
    double displacement, values[VALUES];
    for (long k = 0; scanf("%lf", &displacement) == 1; k++) {
        for (int i = 0; i < fmu_count; i++) {
            if (k == 0) {
                instances[i] = started(&fmus[i], displacement);
                get(&fmus[i], instances[i], values);
            } else {
                step(&fmus[i], instances[i], displacement, k - 1, values);
            }
            printf("%a %a ", values[0], values[1]);
        }
        printf("\n");
    }
    for (int i = 0; i < fmu_count; i++) {
        OK(fmus[i].Terminate(instances[i]));
        fmus[i].FreeInstance(instances[i]);
    }
}

#ifndef _WIN32

static double position(long step)
{
    return 0.02 + 1e-3 * (double)((step * 7) % 23 - 11);
}

/* What each FMU gives when it is alone. */
static double expected[FMUS][STEPS][VALUES];

static void go_on(int i, fmi2Component instance, int from, int to)
{
    double values[VALUES];
    for (int k = from; k < to; k++) {
        step(&fmus[i], instance, position(k), k, values);
        CHECK(memcmp(values, expected[i][k], sizeof values) == 0);
    }
}

static void be_alone(void)
{
    for (int i = 0; i < fmu_count; i++) {
        fmi2Component instance = started(&fmus[i], position(0));
        for (int k = 0; k < STEPS; k++)
            step(&fmus[i], instance, position(k), k, expected[i][k]);
        fmus[i].FreeInstance(instance);
    }
}

static void go_apart(void)
{
    fmi2Component instances[FMUS];
    int status;
    pid_t child = 0;
    for (int i = 0; i < fmu_count; i++)
        instances[i] = started(&fmus[i], position(0));
    for (int k = 0; k < STEPS; k++) {
        if (k == STEPS / 2 && (child = fork()) == 0)
            alarm(60);
        for (int i = 0; i < fmu_count; i++)
            go_on(i, instances[i], k, k + 1);
    }
    for (int i = 0; i < fmu_count; i++)
        fmus[i].FreeInstance(instances[i]);
    if (child == 0)
        _exit(0);
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

typedef struct {
    int fmu, from, to;
    fmi2Component instance;
} Share;

static void *take_share(void *argument)
{
    Share *share = argument;
    if (share->instance == NULL)
        share->instance = started(&fmus[share->fmu], position(0));
    go_on(share->fmu, share->instance, share->from, share->to);
    if (share->to == STEPS)
        fmus[share->fmu].FreeInstance(share->instance);
    return NULL;
}

static void *live_often(void *argument)
{
    for (long k = 0; k < rounds; k++) {
        Share whole = {.fmu = *(int *)argument, .to = STEPS};
        take_share(&whole);
    }
    return NULL;
}

static void go_in_threads(size_t stack)
{
    pthread_attr_t attributes;
    CHECK(pthread_attr_init(&attributes) == 0);
    CHECK(stack == 0 || pthread_attr_setstacksize(&attributes, stack) == 0);
    pthread_t threads[THREADS];
    int numbers[THREADS];
    for (int i = 0; i < THREADS; i++) {
        numbers[i] = i % fmu_count;
        CHECK(pthread_create(&threads[i], &attributes, live_often, &numbers[i]) == 0);
    }
    for (int i = 0; i < THREADS; i++)
        CHECK(pthread_join(threads[i], NULL) == 0);
    /* Made by one thread, taken on by others, freed by the last. */
    for (int i = 0; i < fmu_count; i++) {
        Share share = {.fmu = i};
        for (int k = 0; k < THREADS; k++) {
            share.from = STEPS * k / THREADS;
            share.to = STEPS * (k + 1) / THREADS;
            CHECK(pthread_create(&threads[0], &attributes, take_share, &share) == 0);
            CHECK(pthread_join(threads[0], NULL) == 0);
        }
    }
}

static void reload(void)
{
    for (long k = 0; k < rounds; k++) {
        for (int i = 0; i < fmu_count; i++) {
            CHECK(dlclose(fmus[i].library) == 0);
            CHECK(dlopen(fmus[i].path, RTLD_NOW | RTLD_NOLOAD) == NULL);
            load(&fmus[i]);
            fmi2Component instance = started(&fmus[i], position(0));
            go_on(i, instance, 0, 3);
            fmus[i].FreeInstance(instance);
        }
    }
}

#endif

int main(int count, char *arguments[])
{
    const char *task = arguments[1];
    fmu_count = (count - 3) / 3;
    CHECK(0 < fmu_count && fmu_count <= FMUS && (count - 3) % 3 == 0);
    rounds = atol(arguments[2]);
    for (int i = 0; i < fmu_count; i++) {
        char **given = arguments + 3 + 3 * i;
        fmus[i] = (Fmu){.path = given[0], .guid = given[1], .resources = given[2]};
        load(&fmus[i]);
    }
    if (strcmp(task, "path") == 0) {
        follow_path();
        return 0;
    }
#ifndef _WIN32
    be_alone();
    if (strcmp(task, "fork") == 0)
        go_apart();
    else if (strcmp(task, "threads") == 0)
        go_in_threads(0);
    else if (strcmp(task, "little stack") == 0)
        go_in_threads(49152);
    else if (strcmp(task, "reload") == 0)
        reload();
    else
#endif
        CHECK(!"a task of this name");
    return 0;
}
