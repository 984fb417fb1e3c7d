/* A simulator without Python: loads binaries of FMUs, exchanges displacements on standard input for forces and absorbed
 * energies on standard output, a line of them for each displacement, in hexadecimal so that no digit is lost.
 *
 *     portable_host GUID RESOURCES LIBRARY [LIBRARY]
 *
 * RESOURCES is the URI of the unpacked FMU's folder of resources; FMUs without any take an empty one.
 * The first displacement is where the path starts. Exit status 1 with a message if anything fails.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
typedef FARPROC Function;
static void *opened(const char *path) { return (void *)LoadLibraryA(path); }
static Function found(void *library, const char *name) { return GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
typedef void (*Function)(void);
static void *opened(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static Function found(void *library, const char *name)
{
    Function function;
    *(void **)&function = dlsym(library, name);
    return function;
}
#endif

static void fail(const char *what)
{
    fprintf(stderr, "%s failed\n", what);
    exit(1);
}

static void check(fmi2Status status, const char *what)
{
    if (status != fmi2OK) {
        fail(what);
    }
}

static void log_message(
    fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...)
{
    va_list arguments;
    (void)environment;
    fprintf(stderr, "%s, status %d, %s: ", name, (int)status, category);
    va_start(arguments, text);
    vfprintf(stderr, text, arguments);
    va_end(arguments);
    fprintf(stderr, "\n");
}

#define FROM(library, name) (fmi2##name##TYPE *)found(library, "fmi2" #name)

typedef struct {
    fmi2Component instance;
    fmi2ExitInitializationModeTYPE *exit_initialization;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2DoStepTYPE *step;
    fmi2TerminateTYPE *terminate;
    fmi2FreeInstanceTYPE *free;
} Spring;

static Spring initializing(const char *path, const char *guid, const char *resources)
{
    static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    void *library = opened(path);
    if (library == NULL) {
        fail("loading the library");
    }
    fmi2InstantiateTYPE *instantiate = FROM(library, Instantiate);
    fmi2SetupExperimentTYPE *setup = FROM(library, SetupExperiment);
    fmi2EnterInitializationModeTYPE *enter = FROM(library, EnterInitializationMode);
    Spring spring = {
        instantiate("spring", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2True),
        FROM(library, ExitInitializationMode),
        FROM(library, SetReal),
        FROM(library, GetReal),
        FROM(library, DoStep),
        FROM(library, Terminate),
        FROM(library, FreeInstance),
    };
    if (spring.instance == NULL) {
        fail("fmi2Instantiate");
    }
    check(setup(spring.instance, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check(enter(spring.instance), "fmi2EnterInitializationMode");
    return spring;
}

static void respond(const Spring *spring, double displacement, long step)
{
    static const fmi2ValueReference input = 0, outputs[] = {1, 3}; /* force, absorbed_energy */
    const double size = 0x1p-9; /* as in interop/hosts/motion.py */
    double values[2];
    check(spring->set(spring->instance, &input, 1, &displacement), "fmi2SetReal");
    if (step == 0) {
        check(spring->exit_initialization(spring->instance), "fmi2ExitInitializationMode");
    } else {
        check(spring->step(spring->instance, (double)(step - 1) * size, size, fmi2True), "fmi2DoStep");
    }
    check(spring->get(spring->instance, outputs, 2, values), "fmi2GetReal");
    printf("%a %a ", values[0], values[1]);
}

int main(int count, char **arguments)
{
    Spring springs[2];
    const int loaded = count - 3;
    if (loaded < 1 || loaded > 2) {
        fail("usage");
    }
    for (int i = 0; i < loaded; ++i) {
        springs[i] = initializing(arguments[3 + i], arguments[1], arguments[2]);
    }
    double displacement;
    for (long step = 0; scanf("%lf", &displacement) == 1; ++step) {
        for (int i = 0; i < loaded; ++i) {
            respond(&springs[i], displacement, step);
        }
        printf("\n");
    }
    for (int i = 0; i < loaded; ++i) {
        check(springs[i].terminate(springs[i].instance), "fmi2Terminate");
        springs[i].free(springs[i].instance);
    }
    return 0;
}
