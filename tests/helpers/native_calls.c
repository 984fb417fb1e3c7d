/* A host without Python for the tests of the native FMU.
 *
 *     native_calls LIBRARY GUID path       displacements on standard input, forces on standard output, as doubles
 *     native_calls LIBRARY GUID memory     counts what the FMU allocates and frees
 *     native_calls LIBRARY GUID messages   prints what the FMU logs
 *     native_calls LIBRARY GUID threads    instances in several threads at once
 *
 * Exit status 1, with the line, if something is not as it must be.
 */
#define _POSIX_C_SOURCE 200809L
#include "host_check.h"

#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <string.h>

/* Value references of the variable table. */
static const fmi2ValueReference DISPLACEMENT = 0, FORCE = 1, ENERGY = 3, EXTRAPOLATING = 4;

#define FUNCTIONS(F) \
    F(Instantiate) F(FreeInstance) F(SetupExperiment) F(EnterInitializationMode) F(ExitInitializationMode) \
    F(SetReal) F(GetReal) F(GetBoolean) F(DoStep) F(GetFMUstate) F(SetFMUstate) F(FreeFMUstate) \
    F(SerializedFMUstateSize) F(SerializeFMUstate) F(DeSerializeFMUstate) F(GetDirectionalDerivative) \
    F(SetDebugLogging) F(Reset)

#define DECLARED(name) static fmi2##name##TYPE *name;
FUNCTIONS(DECLARED)

static const char *guid;

static void load(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    CHECK(library != NULL);
#define FOUND(name) \
    *(void **)&name = dlsym(library, "fmi2" #name); \
    CHECK(name != NULL);
    FUNCTIONS(FOUND)
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                          fmi2String format, ...)
{
    va_list arguments;
    (void)environment;
    printf("%s|%d|%s|", name, (int)status, category);
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
}

/* Counted memory; allocation number `failing` from now on fails. */
static int live, allocations, failing;

static void *counted_allocate(size_t count, size_t size)
{
    if (++allocations == failing)
        return NULL;
    live++;
    return calloc(count, size);
}

static void counted_free(void *memory)
{
    live -= memory != NULL;
    free(memory);
}

static const fmi2CallbackFunctions OWN_MEMORY = {print_message, NULL, NULL, NULL, NULL};
static const fmi2CallbackFunctions COUNTED = {print_message, counted_allocate, counted_free, NULL, NULL};

static fmi2Component new_instance(const char *name, const fmi2CallbackFunctions *callbacks)
{
    return Instantiate(name, fmi2CoSimulation, guid, "", callbacks, fmi2False, fmi2False);
}

/* An instance that tells nothing of its excursions. */
static fmi2Component new_silent_instance(void)
{
    fmi2Component instance = new_instance("silent", &OWN_MEMORY);
    OK(SetDebugLogging(instance, fmi2False, 0, NULL));
    return instance;
}

static void initialize(fmi2Component instance, double start)
{
    OK(SetupExperiment(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    OK(EnterInitializationMode(instance));
    OK(SetReal(instance, &DISPLACEMENT, 1, &start));
    OK(ExitInitializationMode(instance));
}

static double force_at(fmi2Component instance, double displacement)
{
    double force;
    OK(SetReal(instance, &DISPLACEMENT, 1, &displacement));
    OK(GetReal(instance, &FORCE, 1, &force));
    return force;
}

static double force_after_step(fmi2Component instance, double displacement, double size)
{
    OK(SetReal(instance, &DISPLACEMENT, 1, &displacement));
    OK(DoStep(instance, 0.0, size, fmi2True));
    return force_at(instance, displacement);
}

/* Uniform in [0, 1). */
static double draw(unsigned long long *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) / 9007199254740992.0;
}

/* Another instance in the serialized state of this one, which is freed. */
static fmi2Component reborn(fmi2Component instance)
{
    fmi2FMUstate state = NULL, copy = NULL;
    size_t size;
    fmi2Component other = new_silent_instance();
    OK(GetFMUstate(instance, &state));
    OK(SerializedFMUstateSize(instance, state, &size));
    char *content = malloc(size);
    OK(SerializeFMUstate(instance, state, content, size));
    OK(FreeFMUstate(instance, &state));
    FreeInstance(instance);
    OK(DeSerializeFMUstate(other, content, size, &copy));
    OK(SetFMUstate(other, copy));
    OK(FreeFMUstate(other, &copy));
    free(content);
    return other;
}

/* Steps and comes back. */
static void wander(fmi2Component instance, double near, unsigned long long *random)
{
    fmi2FMUstate state = NULL;
    OK(GetFMUstate(instance, &state));
    for (int i = 0; i < 3; i++)
        force_after_step(instance, near + 0.01 * (draw(random) - 0.5), 1.0);
    OK(SetFMUstate(instance, state));
    OK(FreeFMUstate(instance, &state));
}

static void follow_path(void)
{
    unsigned long long random = 1;
    double displacement, force;
    CHECK(fread(&displacement, sizeof displacement, 1, stdin) == 1);
    fmi2Component instance = new_silent_instance();
    initialize(instance, displacement);
    force = force_at(instance, displacement);
    CHECK(fwrite(&force, sizeof force, 1, stdout) == 1);
    for (long step = 1; fread(&displacement, sizeof displacement, 1, stdin) == 1; step++) {
        if (draw(&random) < 0.3)
            force_at(instance, displacement + 0.02 * (draw(&random) - 0.5));
        if (step % 97 == 0)
            wander(instance, displacement, &random);
        if (step % 9973 == 0)
            instance = reborn(instance);
        double size = draw(&random) < 0.1 ? 0.0 : pow(10.0, 6.0 * draw(&random) - 5.0);
        force = force_after_step(instance, displacement, size);
        CHECK(fwrite(&force, sizeof force, 1, stdout) == 1);
    }
    FreeInstance(instance);
}

static void count_memory(void)
{
    fmi2FMUstate state = NULL, copy = NULL;
    const fmi2CallbackFunctions half = {print_message, counted_allocate, NULL, NULL, NULL};
    CHECK(new_instance("half", &half) == NULL);
    CHECK(allocations == 0);
    failing = 1;
    CHECK(new_instance("poor", &COUNTED) == NULL);
    failing = 0;

    fmi2Component instance = new_instance("counted", &COUNTED);
    CHECK(live == 1);
    /* The table that instances share outlives their hosts: it asks none of them for memory. */
    allocations = 0;
    failing = 1;
    initialize(instance, 0.02);
    failing = 0;
    CHECK(allocations == 0 && live == 1);
    OK(Reset(instance));
    fmi2Component other = new_instance("other", &COUNTED);
    initialize(other, 0.02);
    CHECK(live == 2);
    FreeInstance(other);
    CHECK(live == 1);
    allocations = 0;
    initialize(instance, 0.02);
    for (int i = 0; i < 1000; i++) {
        double energy, derivative, one = 1.0;
        fmi2Boolean outside;
        force_after_step(instance, 0.02 + 0.04 * sin(0.1 * i), 1e-3);
        OK(GetReal(instance, &ENERGY, 1, &energy));
        OK(GetBoolean(instance, &EXTRAPOLATING, 1, &outside));
        OK(GetDirectionalDerivative(instance, &FORCE, 1, &DISPLACEMENT, 1, &one, &derivative));
    }
    OK(Reset(instance));
    initialize(instance, 0.02);
    CHECK(allocations == 0);

    /* States outlive the hosts of those that made them, too. */
    failing = 1;
    OK(GetFMUstate(instance, &state));
    OK(GetFMUstate(instance, &state));
    size_t size;
    OK(SerializedFMUstateSize(instance, state, &size));
    char *content = malloc(size);
    OK(SerializeFMUstate(instance, state, content, size));
    CHECK(DeSerializeFMUstate(instance, content, size - 1, &copy) == fmi2Error);
    CHECK(copy == NULL);
    OK(DeSerializeFMUstate(instance, content, size, &copy));
    OK(FreeFMUstate(instance, &copy));
    OK(FreeFMUstate(instance, &state));
    CHECK(state == NULL && copy == NULL && allocations == 0 && live == 1);
    FreeInstance(instance);
    CHECK(live == 0);
    free(content);
}

static void log_messages(void)
{
    const fmi2String categories[] = {"100 %s%n%d"};
    double nan_value = NAN, outside = 0.06;
    CHECK(Instantiate("%s%n", fmi2CoSimulation, "{%s%n}", "", &OWN_MEMORY, fmi2False, fmi2True) == NULL);
    fmi2Component instance = new_instance("50 %s%n", &OWN_MEMORY);
    initialize(instance, 0.02);
    CHECK(SetDebugLogging(instance, fmi2True, 1, categories) == fmi2Error);
    CHECK(SetReal(instance, &DISPLACEMENT, 1, &nan_value) == fmi2Error);
    force_after_step(instance, outside, 1.0);
    FreeInstance(instance);

    /* A host may have no logger. */
    const fmi2CallbackFunctions silent = {NULL, NULL, NULL, NULL, NULL};
    instance = new_instance("silent", &silent);
    initialize(instance, 0.02);
    CHECK(SetReal(instance, &DISPLACEMENT, 1, &nan_value) == fmi2Error);
    FreeInstance(instance);
}

enum { THREADS = 4, INSTANCES = 5, STEPS = 2000 };

/* The sum of the forces of several instances with their own parameters and paths, which move in turn. */
static void *run_instances(void *sum)
{
    unsigned long long random = 7;
    const fmi2ValueReference rho = 14; /* of the spring of the tests */
    fmi2Component instances[INSTANCES];
    for (int i = 0; i < INSTANCES; i++) {
        double value = 100.0 + 50.0 * i;
        instances[i] = new_silent_instance();
        OK(SetReal(instances[i], &rho, 1, &value));
        initialize(instances[i], 0.02);
    }
    for (int step = 0; step < STEPS; step++)
        for (int i = 0; i < INSTANCES; i++)
            *(double *)sum += force_after_step(instances[i], 0.06 * draw(&random), 1e-3);
    for (int i = 0; i < INSTANCES; i++)
        FreeInstance(instances[i]);
    return NULL;
}

static void run_threads(void)
{
    double alone = 0.0, sums[THREADS] = {0.0};
    pthread_t threads[THREADS];
    run_instances(&alone);
    for (int i = 0; i < THREADS; i++)
        CHECK(pthread_create(&threads[i], NULL, run_instances, &sums[i]) == 0);
    for (int i = 0; i < THREADS; i++)
        CHECK(pthread_join(threads[i], NULL) == 0);
    for (int i = 0; i < THREADS; i++)
        CHECK(sums[i] == alone);
}

int main(int count, char **arguments)
{
    CHECK(count == 4);
    load(arguments[1]);
    guid = arguments[2];
    if (strcmp(arguments[3], "path") == 0)
        follow_path();
    else if (strcmp(arguments[3], "memory") == 0)
        count_memory();
    else if (strcmp(arguments[3], "messages") == 0)
        log_messages();
    else if (strcmp(arguments[3], "threads") == 0)
        run_threads();
    else
        CHECK(!"a known task");
    return 0;
}
