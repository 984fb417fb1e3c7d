/* Steps of an FMU whose sources are linked in: counts what they take from the allocator, and the stack of each call.
 *
 *     fmu_steps GUID LOW HIGH DISPLACEMENT OUTPUT...
 *
 * with value references; every allocation of the program goes through the functions here (those of glibc replaced). */
#if FMI_VERSION == 3
#include "fmi3Functions.h"
#else
#include "fmi2Functions.h"
#endif

#include "adversary.h"
#include "stack.h"

#include <stdio.h>
#include <stdlib.h>

enum { STEPS = 6000, MOST_OUTPUTS = 8, CALLS = 3 };

extern void *__libc_malloc(size_t size), *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void __libc_free(void *memory);

static int counting;
static unsigned long counted;

void *malloc(size_t size)
{
    counted += (unsigned long)counting;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    counted += (unsigned long)counting;
    return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    counted += (unsigned long)counting;
    return __libc_realloc(old, size);
}

void free(void *memory)
{
    counted += (unsigned long)counting;
    __libc_free(memory);
}

#if FMI_VERSION == 3

typedef fmi3Instance Fmu;

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment;
    (void)category;
    if (status > fmi3Warning)
        fprintf(stderr, "%s\n", message);
}

static Fmu begun(const char *guid)
{
    Fmu fmu = fmi3InstantiateCoSimulation(
        "spring", guid, "", false, true, false, false, NULL, 0, NULL, logger, NULL);
    return fmu != NULL && fmi3EnterInitializationMode(fmu, false, 0.0, 0.0, false, 0.0) == fmi3OK ? fmu : NULL;
}

static int set_value(Fmu fmu, const unsigned *reference, const double *value)
{
    return fmi3SetFloat64(fmu, reference, 1, value, 1);
}

static int step_to(Fmu fmu, double time)
{
    static bool event, terminate, early; /* not on the stack that is measured */
    static double last;
    return fmi3DoStep(fmu, time, 1e-3, true, &event, &terminate, &early, &last);
}

static int get_values(Fmu fmu, const unsigned *references, size_t count, double *values)
{
    return fmi3GetFloat64(fmu, references, count, values, count);
}

#define EXIT_INITIALIZATION fmi3ExitInitializationMode
#define FREE fmi3FreeInstance

#else

typedef fmi2Component Fmu;

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...)
{
    (void)environment;
    (void)name;
    (void)category;
    if (status > fmi2Warning)
        fprintf(stderr, "%s\n", message);
}

static Fmu begun(const char *guid)
{
    static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    Fmu fmu = fmi2Instantiate("spring", fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2False);
    return fmu != NULL && fmi2SetupExperiment(fmu, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK &&
                   fmi2EnterInitializationMode(fmu) == fmi2OK
               ? fmu
               : NULL;
}

static int set_value(Fmu fmu, const unsigned *reference, const double *value)
{
    return fmi2SetReal(fmu, reference, 1, value);
}

static int step_to(Fmu fmu, double time)
{
    return fmi2DoStep(fmu, time, 1e-3, fmi2True);
}

static int get_values(Fmu fmu, const unsigned *references, size_t count, double *values)
{
    return fmi2GetReal(fmu, references, count, values);
}

#define EXIT_INITIALIZATION fmi2ExitInitializationMode
#define FREE fmi2FreeInstance

#endif

typedef struct {
    Fmu fmu;
    unsigned input, output[MOST_OUTPUTS];
    size_t outputs;
    double displacement, value[MOST_OUTPUTS], time;
    int status;
} Run;

static void set(void *context)
{
    Run *run = context;
    run->status = set_value(run->fmu, &run->input, &run->displacement);
}

static void do_step(void *context)
{
    Run *run = context;
    run->status = step_to(run->fmu, run->time);
}

static void get(void *context)
{
    Run *run = context;
    run->status = get_values(run->fmu, run->output, run->outputs, run->value);
}

int main(int count, char **arguments)
{
    void (*const calls[CALLS])(void *) = {set, do_step, get};
    unsigned stack[CALLS] = {0};
    Run run = {.fmu = begun(arguments[1])};
    double low = atof(arguments[2]), high = atof(arguments[3]);
    run.input = (unsigned)atoi(arguments[4]);
    for (int i = 5; i < count; i++)
        run.output[run.outputs++] = (unsigned)atoi(arguments[i]);
    run.displacement = 0.5 * (low + high);
    if (run.fmu == NULL)
        return 2;
    set(&run);
    if (EXIT_INITIALIZATION(run.fmu) != 0)
        return 3;
    for (int k = 0; k < STEPS; k++) {
        run.displacement = next_displacement(low, high, run.displacement);
        for (int i = 0; i < CALLS; i++) {
            counting = 1;
            unsigned used = stack_of(calls[i], &run);
            counting = 0;
            if (run.status > 1)
                return 4;
            stack[i] = used > stack[i] ? used : stack[i];
        }
        run.time += 1e-3;
    }
    printf("%lu %u %u %u\n", counted, stack[0], stack[1], stack[2]);
    FREE(run.fmu);
    return 0;
}
