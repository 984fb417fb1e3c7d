/* Where Python is on Linux and macOS. */
#include <dlfcn.h>
#include <limits.h>
#include <unistd.h>

#ifdef __APPLE__
#define LIBRARY "libpython3.%d.dylib"
static const char *const PLACES[] = {
    LIBRARY,
    "/Library/Frameworks/Python.framework/Versions/3.%d/Python",
    "/opt/homebrew/Frameworks/Python.framework/Versions/3.%d/Python",
    "/usr/local/Frameworks/Python.framework/Versions/3.%d/Python",
};
#else
#define LIBRARY "libpython3.%d.so.1.0"
static const char *const PLACES[] = {LIBRARY};
#endif

/* Paths of the shared libraries of the Pythons that are on PATH, a line each. */
static const char ASK_PATH[] =
    "for python in python3 python3.14 python3.13 python3.12 python3.11 python3.10; do $python -I -c '"
    "import os, sys, sysconfig\n"
    "of = sysconfig.get_config_var\n"
    "folders = [of(\"LIBDIR\"), of(\"PYTHONFRAMEWORKPREFIX\"), os.path.join(sys.base_prefix, \"lib\")]\n"
    "paths = [os.path.join(f, n) for f in folders if f for n in (of(\"INSTSONAME\"), of(\"LDLIBRARY\")) if n]\n"
    "print(next((p for p in paths if os.path.isfile(p) and not p.endswith(\".a\")), \"\"))\n"
    "'; done 2>/dev/null";

static void *symbol(void *library, const char *name)
{
    return dlsym(library, name);
}

/* Whether a folder holds the standard library of a version; also of a build without the global lock. */
static int holds_standard_library(const char *folder, int minor)
{
    static const char *const LANDMARKS[] = {
        "%s/lib/python3.%d/os.py", "%s/lib64/python3.%d/os.py", "%s/lib/python3.%dt/os.py"};
    char path[PATH_MAX];
    for (size_t i = 0; i < sizeof LANDMARKS / sizeof *LANDMARKS; i++)
        if (snprintf(path, sizeof path, LANDMARKS[i], folder, minor) < (int)sizeof path && access(path, R_OK) == 0)
            return 1;
    return 0;
}

static int set_home(int minor)
{
    char folder[PATH_MAX];
    Dl_info library;
    void *address;
    const char *chosen = getenv("PYTHONHOME");
    if (chosen != NULL && holds_standard_library(chosen, minor))
        return 1;
    memcpy(&address, &python.Py_IsInitialized, sizeof address);
    if (dladdr(address, &library) == 0 || realpath(library.dli_fname, folder) == NULL)
        return 0;
    /* The library lies somewhere below; what lies in the root is of another Python. */
    for (char *end; (end = strrchr(folder, '/')) != NULL && end != folder;) {
        *end = '\0';
        if (holds_standard_library(folder, minor)) {
            wchar_t *home = python.Py_DecodeLocale(folder, NULL);
            if (home != NULL)
                python.Py_SetPythonHome(home); /* refers to it or copies it, by version */
            return home != NULL;
        }
    }
    return 0;
}

static int loaded(const char *path, int flags, Reason *reason)
{
    /* Modules of the standard library look for Python's functions in the whole process. */
    void *library = dlopen(path, RTLD_NOW | RTLD_GLOBAL | flags);
    if (library == NULL)
        return 0;
    if (taken(library, reason))
        return 1;
    dlclose(library);
    return 0;
}

static int loaded_by_version(int flags, Reason *reason)
{
    char path[PATH_MAX];
    for (int minor = NEWEST; minor >= OLDEST; minor--)
        for (size_t i = 0; i < sizeof PLACES / sizeof *PLACES; i++) {
            snprintf(path, sizeof path, PLACES[i], minor);
            if (loaded(path, flags, reason))
                return 1;
        }
    return 0;
}

static int loaded_of_path(Reason *reason)
{
    char path[PATH_MAX];
    int found = 0;
    FILE *answers = popen(ASK_PATH, "r");
    if (answers == NULL)
        return 0;
    while (!found && fgets(path, sizeof path, answers) != NULL) {
        path[strcspn(path, "\n")] = '\0';
        found = path[0] != '\0' && loaded(path, 0, reason);
    }
    pclose(answers);
    return found;
}

/* Finds Python once; 0 with a sentence if there is none that can serve. */
static int find(char *problem, size_t size)
{
    Reason reason = {""};
    if (dlsym(RTLD_DEFAULT, "Py_IsInitialized") != NULL) {
        if (taken(RTLD_DEFAULT, &reason))
            return 1;
        snprintf(problem, size, PROCESS_CANNOT_SERVE, reason.text, OLDEST);
        return 0;
    }
    const char *chosen = getenv("STRANDSPRING_LIBPYTHON");
    if (chosen != NULL && chosen[0] != '\0') {
        if (loaded(chosen, 0, &reason))
            return 1;
        snprintf(problem, size, CHOSEN_CANNOT_SERVE, reason.text[0] == '\0' ? dlerror() : reason.text, OLDEST);
        return 0;
    }
    /* One that the host has loaded for itself comes first: two in one process would meet. */
    if (loaded_by_version(RTLD_NOLOAD, &reason) || loaded_by_version(0, &reason) || loaded_of_path(&reason))
        return 1;
    snprintf(problem, size,
             "No Python was found: looked for " LIBRARY " to " LIBRARY " where this system keeps libraries, and for "
             "the shared library of python3 on PATH%s%s; " TO_DO, NEWEST, OLDEST, FOUND_BUT(reason), OLDEST);
    return 0;
}

/* The lock of the standard error, the one lock that all libraries of a process share. */
static void *lock_process(void)
{
    flockfile(stderr);
    return stderr;
}

static void unlock_process(void *file)
{
    funlockfile(file);
}
