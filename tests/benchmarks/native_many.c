/* Many instances of one FMU in one process, which move in turn: set, step, get.
 *
 *     native_many GUID LIBRARY INSTANCES MIDDLE HALF
 *
 * Prints nanoseconds a step, the median of rounds of all instances, and bytes of memory an instance.
 */
#define _POSIX_C_SOURCE 200809L

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum { ROUNDS = 101 };

typedef void (*Function)(void);

static Function function(void *library, const char *name)
{
    Function found;
    *(void **)&found = dlsym(library, name);
    if (found == NULL)
        exit(1);
    return found;
}

#define FROM(library, name) (fmi2##name##TYPE *)function(library, "fmi2" #name)

static void check(fmi2Status status)
{
    if (status != fmi2OK)
        exit(1);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Bytes of physical memory that the process takes. */
static double resident(void)
{
    long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL || fscanf(file, "%*d %ld", &pages) != 1)
        exit(1);
    fclose(file);
    return (double)pages * (double)sysconf(_SC_PAGESIZE);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int count, char **arguments)
{
    static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    static const fmi2ValueReference input = 0, output = 1;
    static double rounds[ROUNDS];
    if (count != 6)
        return 2;
    void *library = dlopen(arguments[2], RTLD_NOW);
    if (library == NULL)
        return 1;
    long instances = atol(arguments[3]);
    double middle = atof(arguments[4]), half = atof(arguments[5]), force, sum = 0.0;
    fmi2SetRealTYPE *set = FROM(library, SetReal);
    fmi2DoStepTYPE *step = FROM(library, DoStep);
    fmi2GetRealTYPE *get = FROM(library, GetReal);
    fmi2Component *all = malloc((size_t)instances * sizeof *all);
    double before = resident();
    for (long i = 0; i < instances; i++) {
        all[i] = (FROM(library, Instantiate))("one", fmi2CoSimulation, arguments[1], "", &callbacks, 0, 0);
        check((FROM(library, SetupExperiment))(all[i], 0, 0.0, 0.0, 0, 0.0));
        check((FROM(library, EnterInitializationMode))(all[i]));
        check(set(all[i], &input, 1, &middle));
        check((FROM(library, ExitInitializationMode))(all[i]));
    }
    for (int round = 0; round < ROUNDS; round++) {
        double begin = seconds(), x = middle + half * sin(0.02 * (round + 1));
        for (long i = 0; i < instances; i++) {
            check(set(all[i], &input, 1, &x));
            check(step(all[i], 0.0, 1.0, fmi2True));
            check(get(all[i], &output, 1, &force));
            sum += force;
        }
        rounds[round] = (seconds() - begin) / (double)instances;
    }
    double memory = resident() - before;
    qsort(rounds, ROUNDS, sizeof *rounds, ascending);
    printf("%.1f %.0f %g\n", 1e9 * rounds[ROUNDS / 2], memory / (double)instances, sum);
    return 0;
}
