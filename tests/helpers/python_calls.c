/* A host without Python for the tests of the Python-backed FMU.
 *
 *     python_calls LIBRARY GUID RESOURCES path       doubles: displacements on standard input, forces on output
 *     python_calls LIBRARY GUID RESOURCES cycles     instances made and freed; prints resident pages on the way
 *     python_calls LIBRARY GUID RESOURCES threads    instances in several threads at once, from the first call on
 *
 * With further LIBRARY GUID RESOURCES before the task, path gives a force of each FMU for each displacement. Exit
 * status 1, with the line, if something is not as it must be.
 */
#define _POSIX_C_SOURCE 200809L
#include "host_check.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <string.h>

/* Value references of the variable table. */
static const fmi2ValueReference DISPLACEMENT = 0, FORCE = 1;

enum { FMUS = 4, CYCLES = 10000, THREADS = 4, ROUNDS = 40 };

#define FUNCTIONS(F) \
    F(Instantiate) F(FreeInstance) F(SetupExperiment) F(EnterInitializationMode) F(ExitInitializationMode) \
    F(SetReal) F(GetReal) F(DoStep) F(GetFMUstate) F(SetFMUstate) F(FreeFMUstate) F(SerializedFMUstateSize) \
    F(SerializeFMUstate) F(DeSerializeFMUstate) F(Terminate) F(Reset)

typedef struct {
    const char *guid, *resources;
#define DECLARED(name) fmi2##name##TYPE *name;
    FUNCTIONS(DECLARED)
} Fmu;

static Fmu loaded(char *arguments[])
{
    void *library = dlopen(arguments[0], RTLD_NOW | RTLD_LOCAL);
    CHECK(library != NULL);
    Fmu fmu = {.guid = arguments[1], .resources = arguments[2]};
#define FOUND(name) \
    *(void **)&fmu.name = dlsym(library, "fmi2" #name); \
    CHECK(fmu.name != NULL);
    FUNCTIONS(FOUND)
    return fmu;
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                          fmi2String format, ...)
{
    va_list arguments;
    (void)environment;
    fprintf(stderr, "%s|%d|%s|", name, (int)status, category);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
}

static fmi2Component initialized(const Fmu *fmu, double start)
{
    static const fmi2CallbackFunctions callbacks = {print_message, NULL, NULL, NULL, NULL};
    fmi2Component instance =
        fmu->Instantiate("one", fmi2CoSimulation, fmu->guid, fmu->resources, &callbacks, fmi2False, fmi2False);
    if (instance == NULL)
        exit(1);
    OK(fmu->SetupExperiment(instance, fmi2False, 0.0, 0.0, fmi2False, 0.0));
    OK(fmu->EnterInitializationMode(instance));
    OK(fmu->SetReal(instance, &DISPLACEMENT, 1, &start));
    OK(fmu->ExitInitializationMode(instance));
    return instance;
}

static double force(const Fmu *fmu, fmi2Component instance)
{
    double found;
    OK(fmu->GetReal(instance, &FORCE, 1, &found));
    return found;
}

static double force_after_step(const Fmu *fmu, fmi2Component instance, double displacement)
{
    OK(fmu->SetReal(instance, &DISPLACEMENT, 1, &displacement));
    OK(fmu->DoStep(instance, 0.0, 1e-3, fmi2True));
    return force(fmu, instance);
}

static void print(double value)
{
    CHECK(fwrite(&value, sizeof value, 1, stdout) == 1);
}

static void follow_path(const Fmu fmus[], int count)
{
    fmi2Component instances[FMUS];
    double displacement;
    CHECK(fread(&displacement, sizeof displacement, 1, stdin) == 1);
    for (int i = 0; i < count; i++) {
        instances[i] = initialized(&fmus[i], displacement);
        print(force(&fmus[i], instances[i]));
    }
    while (fread(&displacement, sizeof displacement, 1, stdin) == 1)
        for (int i = 0; i < count; i++)
            print(force_after_step(&fmus[i], instances[i], displacement));
    for (int i = 0; i < count; i++) {
        OK(fmus[i].Terminate(instances[i]));
        fmus[i].FreeInstance(instances[i]);
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

/* All that an instance can own: states, serialized ones, a slave after a reset. */
static void live_and_die(const Fmu *fmu)
{
    fmi2FMUstate state = NULL, copy = NULL;
    char content[4096];
    size_t size;
    fmi2Component instance = initialized(fmu, 0.02);
    double before = force_after_step(fmu, instance, 0.03);
    OK(fmu->GetFMUstate(instance, &state));
    OK(fmu->GetFMUstate(instance, &state));
    OK(fmu->SerializedFMUstateSize(instance, state, &size));
    CHECK(size <= sizeof content);
    OK(fmu->SerializeFMUstate(instance, state, content, size));
    OK(fmu->DeSerializeFMUstate(instance, content, size, &copy));
    OK(fmu->Reset(instance));
    OK(fmu->SetFMUstate(instance, copy));
    CHECK(force(fmu, instance) == before);
    OK(fmu->FreeFMUstate(instance, &state));
    OK(fmu->FreeFMUstate(instance, &copy));
    fmu->FreeInstance(instance);
}

static void *run_thread(void *argument)
{
    const Fmu *fmu = argument;
    for (int i = 0; i < ROUNDS; i++)
        live_and_die(fmu);
    return NULL;
}

int main(int count, char **arguments)
{
    const char *task = arguments[count - 1];
    Fmu fmus[FMUS];
    const int fmu_count = (count - 2) / 3;
    CHECK(0 < fmu_count && fmu_count <= FMUS && (count - 2) % 3 == 0);
    for (int i = 0; i < fmu_count; i++)
        fmus[i] = loaded(arguments + 1 + 3 * i);
    if (strcmp(task, "path") == 0) {
        follow_path(fmus, fmu_count);
    } else if (strcmp(task, "cycles") == 0) {
        for (int i = 0; i < CYCLES; i++) {
            if (i % (CYCLES / 10) == 0)
                printf("%ld\n", resident_pages());
            live_and_die(&fmus[0]);
        }
        printf("%ld\n", resident_pages());
    } else {
        pthread_t threads[THREADS];
        CHECK(strcmp(task, "threads") == 0);
        for (int i = 0; i < THREADS; i++)
            CHECK(pthread_create(&threads[i], NULL, run_thread, &fmus[i % fmu_count]) == 0);
        for (int i = 0; i < THREADS; i++)
            CHECK(pthread_join(threads[i], NULL) == 0);
    }
    return 0;
}
