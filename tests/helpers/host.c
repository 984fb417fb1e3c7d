/* A host of FMUs without Python, for this computer and, by wine, for Windows.
 *
 *     host task (LIBRARY GUID RESOURCES)...
 *
 * exchanges displacements on standard input for force and absorbed energy of each FMU on standard output, a line of them
 * for each displacement, in hexadecimal so that no digit is lost; the first is where the path starts. Their instances
 * take the steps by turns. A task other than `path` has them follow the path once more, which must give the same bits;
 * not on Windows:
 *
 *     fork           a child goes on with its copies of all instances half way, and frees them; so does the parent
 *     threads        in eight threads at a time; other threads go on with the instances and free them
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

enum { FMUS = 6, VALUES = 2, MOST = 1 << 21, THREADS = 8 };
static Fmu fmus[FMUS];
static int fmu_count, steps;
static double path[MOST], responses[FMUS][MOST][VALUES];
static const double STEP_SIZE = 0x1p-9; /* as in interop/hosts.py */

/* An instance and some of its steps; NULL begins, and the last step ends. */
typedef struct {
    int fmu, from, to, is_first;
    fmi2Component instance;
} Share;

static void *take(void *argument)
{
    static const fmi2CallbackFunctions CALLBACKS = {NULL, calloc, free, NULL, NULL};
    static const fmi2ValueReference DISPLACEMENT = 0, OUTPUTS[] = {1, 3}; /* force, absorbed_energy */
    Share *share = argument;
    const Fmu *fmu = &fmus[share->fmu];
    double values[VALUES];
    if (share->instance == NULL) {
        share->instance = FUNCTION(fmu, Instantiate)("one", fmi2CoSimulation, fmu->guid, fmu->resources, &CALLBACKS,
                                                     fmi2False, fmi2False);
        CHECK(share->instance != NULL);
        OK(FUNCTION(fmu, SetupExperiment)(share->instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
        OK(FUNCTION(fmu, EnterInitializationMode)(share->instance));
    }
    for (int k = share->from; k < share->to; k++) {
        OK(FUNCTION(fmu, SetReal)(share->instance, &DISPLACEMENT, 1, &path[k]));
        if (k == 0)
            OK(FUNCTION(fmu, ExitInitializationMode)(share->instance));
        else
            OK(FUNCTION(fmu, DoStep)(share->instance, STEP_SIZE * (k - 1), STEP_SIZE, fmi2True));
        OK(FUNCTION(fmu, GetReal)(share->instance, OUTPUTS, VALUES, values));
        if (share->is_first)
            memcpy(responses[share->fmu][k], values, sizeof values);
        CHECK(memcmp(responses[share->fmu][k], values, sizeof values) == 0);
    }
    if (share->to == steps) {
        OK(FUNCTION(fmu, Terminate)(share->instance));
        FUNCTION(fmu, FreeInstance)(share->instance);
    }
    return NULL;
}

static void take_by_turns(Share shares[], int from, int to)
{
    for (int k = from; k < to; k++) {
        for (int i = 0; i < fmu_count; i++) {
            shares[i].from = k;
            shares[i].to = k + 1;
            take(&shares[i]);
        }
    }
}

#ifndef _WIN32

static void go_apart(Share shares[])
{
    int status;
    take_by_turns(shares, 0, steps / 2);
    pid_t child = fork();
    if (child == 0)
        alarm(60);
    take_by_turns(shares, steps / 2, steps);
    if (child == 0)
        _exit(0);
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static void go_in_threads(Share shares[], size_t stack)
{
    pthread_attr_t attributes;
    pthread_t threads[THREADS];
    CHECK(pthread_attr_init(&attributes) == 0);
    CHECK(stack == 0 || pthread_attr_setstacksize(&attributes, stack) == 0);
    for (int from = 0; from < steps; from += steps / 4) {
        for (int i = 0; i < THREADS; i++) {
            shares[i] = (Share){i % fmu_count, from, from + steps / 4, 0, shares[i].instance};
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
    Share shares[THREADS], again[THREADS] = {{0}};
    fmu_count = (count - 2) / 3;
    CHECK(0 < fmu_count && fmu_count <= FMUS && (count - 2) % 3 == 0);
    while (steps < MOST && scanf("%lf", &path[steps]) == 1)
        steps++;
    for (int i = 0; i < fmu_count; i++) {
        char **given = arguments + 2 + 3 * i;
        fmus[i] = (Fmu){given[1], given[2], opened(given[0])};
        CHECK(fmus[i].library != NULL);
        shares[i] = (Share){.fmu = i, .is_first = 1};
        again[i].fmu = i;
    }
    take_by_turns(shares, 0, steps);
    for (int k = 0; k < steps; k++) {
        for (int i = 0; i < fmu_count; i++)
            printf("%a %a ", responses[i][k][0], responses[i][k][1]);
        printf("\n");
    }
#ifndef _WIN32
    if (strcmp(task, "fork") == 0)
        go_apart(again);
    else if (strcmp(task, "path") != 0)
        go_in_threads(again, strcmp(task, "threads") == 0 ? 0 : 49152);
#endif
    return 0;
}
