/* Nanoseconds of one exchange with FMUs that take turns within one process, which has no Python but what an FMU loads.
 *
 *     native_host ROUNDS MIDDLE HALF (GUID LIBRARY RESOURCES STEPS EVERY KINDS)...
 *
 * Displacements lie within MIDDLE +- HALF [m]. Each FMU does so many STEPS in each EVERYth round. KINDS is 2 for an FMU
 * that has model exchange, too, and 1 for others. Prints for each case and FMU: the case, which FMU, the median of the
 * rounds and the ends of their middle half [ns].
 */
#define _POSIX_C_SOURCE 200809L

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

enum { FMUS = 8, PATHS = 3, OUTPUTS = 3, CASES = 2 * PATHS + 1, MOST_ROUNDS = 999, PERIOD = 200, PER_FMU = 6 };

static const double TWO_PI = 6.28318530717958647693, SIZE = 1e-3;

typedef struct {
    const char *guid, *resources;
    long steps;
    int every, kinds;
    void *handle;
    double *paths[PATHS];
    fmi2InstantiateTYPE *instantiate;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2DoStepTYPE *step;
    fmi2SetTimeTYPE *set_time;
    fmi2CompletedIntegratorStepTYPE *completed;
} Fmu;

static const char *const PATH_NAMES[PATHS] = {"stroke", "sine", "reversals"};

static void fail(const char *what)
{
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

static void check(fmi2Status status, const char *what)
{
    if (status != fmi2OK)
        fail(what);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void log_message(
    fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...)
{
    (void)environment;
    fprintf(stderr, "%s, status %d, %s: %s\n", name, (int)status, category, text);
}

static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};

#define FROM(fmu, name) (fmi2##name##TYPE *)function(fmu, "fmi2" #name)

typedef void (*Function)(void);

/* NULL if the library has none of that name. */
static Function function(const Fmu *fmu, const char *name)
{
    Function found;
    *(void **)&found = dlsym(fmu->handle, name);
    return found;
}

/* One stroke; a sine; a turn at each step. */
static void make_paths(Fmu *fmu, double middle, double half)
{
    for (int i = 0; i < PATHS; i++)
        if ((fmu->paths[i] = malloc((size_t)fmu->steps * sizeof **fmu->paths)) == NULL)
            fail("memory");
    srand(1);
    for (long k = 0; k < fmu->steps; k++) {
        double share = (double)rand() / RAND_MAX, side = k % 2 ? 1.0 : -1.0;
        fmu->paths[0][k] = middle + half * (2.0 * (double)k / (double)fmu->steps - 1.0);
        fmu->paths[1][k] = middle + half * sin(TWO_PI * (double)k / PERIOD);
        fmu->paths[2][k] = middle + half * side * share;
    }
}

static Fmu loaded(char **arguments)
{
    Fmu fmu = {.guid = arguments[0], .resources = arguments[2]};
    fmu.steps = atol(arguments[3]);
    fmu.every = atoi(arguments[4]);
    fmu.kinds = atoi(arguments[5]);
    fmu.handle = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (fmu.handle == NULL)
        fail(dlerror());
    fmu.instantiate = FROM(&fmu, Instantiate);
    fmu.set = FROM(&fmu, SetReal);
    fmu.get = FROM(&fmu, GetReal);
    fmu.step = FROM(&fmu, DoStep);
    fmu.set_time = FROM(&fmu, SetTime);
    fmu.completed = FROM(&fmu, CompletedIntegratorStep);
    return fmu;
}

static fmi2Component initialized(const Fmu *fmu, fmi2Type type, double displacement)
{
    static const fmi2ValueReference input = 0;
    fmi2Component instance =
        fmu->instantiate("benchmark", type, fmu->guid, fmu->resources, &callbacks, fmi2False, fmi2False);
    if (instance == NULL)
        fail("fmi2Instantiate");
    check((FROM(fmu, SetupExperiment))(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check((FROM(fmu, EnterInitializationMode))(instance), "fmi2EnterInitializationMode");
    check(fmu->set(instance, &input, 1, &displacement), "fmi2SetReal");
    check((FROM(fmu, ExitInitializationMode))(instance), "fmi2ExitInitializationMode");
    if (type == fmi2ModelExchange)
        check((FROM(fmu, EnterContinuousTimeMode))(instance), "fmi2EnterContinuousTimeMode");
    return instance;
}

static void finish(const Fmu *fmu, fmi2Component instance)
{
    check((FROM(fmu, Terminate))(instance), "fmi2Terminate");
    (FROM(fmu, FreeInstance))(instance);
}

/* Seconds of one exchange of co-simulation: set, step, get. */
static double co_simulation(const Fmu *fmu, const double *path, size_t outputs)
{
    static const fmi2ValueReference input = 0, output[OUTPUTS] = {1, 2, 3};
    double values[OUTPUTS];
    fmi2Component instance = initialized(fmu, fmi2CoSimulation, path[0]);
    int failed = 0;
    double begin = seconds();
    for (long k = 0; k < fmu->steps; k++) {
        failed |= fmu->set(instance, &input, 1, &path[k]) != fmi2OK;
        failed |= fmu->step(instance, (double)k * SIZE, SIZE, fmi2True) != fmi2OK;
        failed |= fmu->get(instance, output, outputs, values) != fmi2OK;
    }
    double each = (seconds() - begin) / (double)fmu->steps;
    if (failed)
        fail("a step");
    finish(fmu, instance);
    return each;
}

/* Seconds of one evaluation of model exchange, time, set and get; every fourth becomes an accepted step, as solvers of
 * variable step do. */
static double model_exchange(const Fmu *fmu, const double *path)
{
    static const fmi2ValueReference input = 0, output = 1;
    double force;
    fmi2Component instance = initialized(fmu, fmi2ModelExchange, path[0]);
    fmi2Boolean event, end;
    int failed = 0;
    double begin = seconds();
    for (long k = 0; k < fmu->steps; k++) {
        failed |= fmu->set_time(instance, (double)k * SIZE) != fmi2OK;
        failed |= fmu->set(instance, &input, 1, &path[k]) != fmi2OK;
        failed |= fmu->get(instance, &output, 1, &force) != fmi2OK;
        if (k % 4 == 0)
            failed |= fmu->completed(instance, fmi2True, &event, &end) != fmi2OK;
    }
    double each = (seconds() - begin) / (double)fmu->steps;
    if (failed)
        fail("an evaluation");
    finish(fmu, instance);
    return each;
}

static int has_case(const Fmu *fmu, int number)
{
    return number < 2 * PATHS || fmu->kinds == 2;
}

static double measured(const Fmu *fmu, int number)
{
    if (number < 2 * PATHS)
        return co_simulation(fmu, fmu->paths[number / 2], number % 2 ? OUTPUTS : 1);
    return model_exchange(fmu, fmu->paths[1]);
}

static void print_name(int number)
{
    if (number < 2 * PATHS)
        printf("%s,%s", PATH_NAMES[number / 2], number % 2 ? "all" : "force");
    else
        printf("exchange,force");
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int count, char **arguments)
{
    static double rounds[CASES][FMUS][MOST_ROUNDS];
    Fmu fmus[FMUS];
    int loads = (count - 4) / PER_FMU;
    if (loads < 1 || loads > FMUS)
        fail("usage");
    int turns = atoi(arguments[1]);
    if (turns < 1 || turns > MOST_ROUNDS)
        fail("usage");
    for (int i = 0; i < loads; i++) {
        fmus[i] = loaded(arguments + 4 + PER_FMU * i);
        make_paths(&fmus[i], atof(arguments[2]), atof(arguments[3]));
    }
    for (int turn = 0; turn < turns; turn++)
        for (int number = 0; number < CASES; number++)
            for (int i = 0; i < loads; i++)
                if (has_case(&fmus[i], number) && turn % fmus[i].every == 0)
                    rounds[number][i][turn / fmus[i].every] = 1e9 * measured(&fmus[i], number);
    for (int number = 0; number < CASES; number++)
        for (int i = 0; i < loads; i++) {
            double *of = rounds[number][i];
            int done = (turns - 1) / fmus[i].every + 1;
            qsort(of, (size_t)done, sizeof *of, ascending);
            if (has_case(&fmus[i], number)) {
                print_name(number);
                printf(",%d,%.2f,%.2f,%.2f\n", i, of[done / 2], of[done / 4], of[done - 1 - done / 4]);
            }
        }
    return 0;
}
