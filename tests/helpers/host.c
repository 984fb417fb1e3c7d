/* A host of FMUs without Python, for this computer and, by wine, for Windows.
 *
 *     host path (LIBRARY GUID RESOURCES)...
 *
 * exchanges displacements on standard input for force and absorbed energy of each FMU on standard output, a line of them
 * for each displacement, in hexadecimal so that no digit is lost; the first is where the path starts. Not on Windows:
 *
 *     fork           instances of all FMUs take steps by turns: each gives the bits that it gives alone; a child goes on
 *                    with its copies of all instances and frees them; so does the parent
 *     threads        instances of all FMUs in eight threads at a time; other threads go on with them and free them
 *     little stack   the same, where each thread has 48 kB
 *
 * Exit status 1, with the line, if something is not as it must be.
 */
#define _DEFAULT_SOURCE
#include "fmi2Functions.h"

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
#define FUNCTION(fmu, name) ((fmi2##name##TYPE *)found((fmu)->library, "fmi2" #name))

typedef struct {
    const char *guid, *resources;
    void *library;
} Fmu;

enum { FMUS = 6, VALUES = 2, STEPS = 60, THREADS = 8 };
static Fmu fmus[FMUS];
static int fmu_count;
static const double STEP_SIZE = 0x1p-9; /* as in interop/hosts.py */
static const fmi2CallbackFunctions CALLBACKS = {NULL, calloc, free, NULL, NULL};

static void set(const Fmu *fmu, fmi2Component instance, double displacement)
{
    static const fmi2ValueReference DISPLACEMENT = 0;
    OK(FUNCTION(fmu, SetReal)(instance, &DISPLACEMENT, 1, &displacement));
}

static void get(const Fmu *fmu, fmi2Component instance, double values[VALUES])
{
    static const fmi2ValueReference OUTPUTS[] = {1, 3}; /* force, absorbed_energy */
    OK(FUNCTION(fmu, GetReal)(instance, OUTPUTS, VALUES, values));
}

static fmi2Component started(const Fmu *fmu, double displacement)
{
    fmi2Component instance = FUNCTION(fmu, Instantiate)("one", fmi2CoSimulation, fmu->guid, fmu->resources, &CALLBACKS,
                                                        fmi2False, fmi2False);
    CHECK(instance != NULL);
    OK(FUNCTION(fmu, SetupExperiment)(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    OK(FUNCTION(fmu, EnterInitializationMode)(instance));
    set(fmu, instance, displacement);
    OK(FUNCTION(fmu, ExitInitializationMode)(instance));
    return instance;
}

static void step(const Fmu *fmu, fmi2Component instance, double displacement, long number, double values[VALUES])
{
    set(fmu, instance, displacement);
    OK(FUNCTION(fmu, DoStep)(instance, STEP_SIZE * (double)number, STEP_SIZE, fmi2True));
    get(fmu, instance, values);
}

static void end(const Fmu *fmu, fmi2Component instance)
{
    OK(FUNCTION(fmu, Terminate)(instance));
    FUNCTION(fmu, FreeInstance)(instance);
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
    for (int i = 0; i < fmu_count; i++)
        end(&fmus[i], instances[i]);
}

#ifndef _WIN32

/* What each FMU gives when it is alone. */
static double expected[FMUS][STEPS][VALUES];

static double position(long step)
{
    return 0.02 + 1e-3 * (double)((step * 7) % 23 - 11);
}

/* An instance and some of its steps; NULL begins, and the last step ends. */
typedef struct {
    int fmu, from, to;
    fmi2Component instance;
} Share;

static void *take(void *argument)
{
    Share *share = argument;
    const Fmu *fmu = &fmus[share->fmu];
    double values[VALUES];
    if (share->instance == NULL)
        share->instance = started(fmu, position(0));
    for (int k = share->from; k < share->to; k++) {
        step(fmu, share->instance, position(k), k, values);
        CHECK(memcmp(values, expected[share->fmu][k], sizeof values) == 0);
    }
    if (share->to == STEPS)
        end(fmu, share->instance);
    return NULL;
}

static void go_apart(void)
{
    Share shares[FMUS] = {{0}};
    int status;
    pid_t child = 0;
    for (int k = 0; k < STEPS; k++) {
        if (k == STEPS / 2 && (child = fork()) == 0)
            alarm(60);
        for (int i = 0; i < fmu_count; i++) {
            shares[i] = (Share){i, k, k + 1, shares[i].instance};
            take(&shares[i]);
        }
    }
    if (child == 0)
        _exit(0);
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static void go_in_threads(size_t stack)
{
    pthread_attr_t attributes;
    pthread_t threads[THREADS];
    Share shares[THREADS] = {{0}};
    CHECK(pthread_attr_init(&attributes) == 0);
    CHECK(stack == 0 || pthread_attr_setstacksize(&attributes, stack) == 0);
    for (int from = 0; from < STEPS; from += STEPS / 4) {
        for (int i = 0; i < THREADS; i++) {
            shares[i] = (Share){i % fmu_count, from, from + STEPS / 4, shares[i].instance};
            CHECK(pthread_create(&threads[i], &attributes, take, &shares[i]) == 0);
        }
        for (int i = 0; i < THREADS; i++)
            CHECK(pthread_join(threads[i], NULL) == 0);
    }
}

#endif

int main(int count, char *arguments[])
{
    const char *task = arguments[1];
    fmu_count = (count - 2) / 3;
    CHECK(0 < fmu_count && fmu_count <= FMUS && (count - 2) % 3 == 0);
    for (int i = 0; i < fmu_count; i++) {
        char **given = arguments + 2 + 3 * i;
        fmus[i] = (Fmu){given[1], given[2], opened(given[0])};
        CHECK(fmus[i].library != NULL);
    }
    if (strcmp(task, "path") == 0) {
        follow_path();
        return 0;
    }
#ifndef _WIN32
    for (int i = 0; i < fmu_count; i++) {
        fmi2Component instance = started(&fmus[i], position(0));
        for (int k = 0; k < STEPS; k++)
            step(&fmus[i], instance, position(k), k, expected[i][k]);
        end(&fmus[i], instance);
    }
    if (strcmp(task, "fork") == 0)
        go_apart();
    else
        go_in_threads(strcmp(task, "threads") == 0 ? 0 : 49152);
#endif
    return 0;
}
