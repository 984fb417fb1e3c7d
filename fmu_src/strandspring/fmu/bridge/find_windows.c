/* Where Python is on Windows. */
#define WIN32_LEAN_AND_MEAN
#define PSAPI_VERSION 2
#include <windows.h>

#include <psapi.h>

enum { PATH_SIZE = 1024, MODULES = 2048 };

static void *symbol(void *library, const char *name)
{
    FARPROC function = GetProcAddress(library, name);
    void *address;
    memcpy(&address, &function, sizeof address);
    return address;
}

/* Appends plain ASCII; 0 if there is no room. */
static int append(wchar_t path[PATH_SIZE], const char *text)
{
    size_t length = wcslen(path);
    if (length + strlen(text) >= PATH_SIZE)
        return 0;
    do
        path[length++] = (wchar_t)*text;
    while (*text++ != '\0');
    return 1;
}

static int holds_standard_library(const wchar_t folder[PATH_SIZE])
{
    wchar_t path[PATH_SIZE];
    wcscpy(path, folder);
    return append(path, "\\Lib\\os.py") && GetFileAttributesW(path) != INVALID_FILE_ATTRIBUTES;
}

/* The value of an environment variable; 0 if it is empty, too long or not there. */
static int environment(const wchar_t *name, wchar_t value[PATH_SIZE])
{
    DWORD length = GetEnvironmentVariableW(name, value, PATH_SIZE);
    return 0 < length && length < PATH_SIZE;
}

static int set_home(int minor)
{
    static wchar_t home[PATH_SIZE];
    HMODULE library;
    const DWORD flags = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
    LPCWSTR address;
    (void)minor; /* the library and the standard library lie in one folder */
    if (environment(L"PYTHONHOME", home) && holds_standard_library(home))
        return 1;
    memcpy(&address, &python.Py_IsInitialized, sizeof address);
    if (!GetModuleHandleExW(flags, address, &library) || GetModuleFileNameW(library, home, PATH_SIZE) >= PATH_SIZE)
        return 0;
    wchar_t *end = wcsrchr(home, L'\\');
    if (end == NULL)
        return 0;
    *end = L'\0';
    if (!holds_standard_library(home))
        return 0;
    python.Py_SetPythonHome(home);
    return 1;
}

static int loaded(const wchar_t *path, DWORD flags, Reason *reason)
{
    HMODULE library = LoadLibraryExW(path, NULL, flags);
    if (library == NULL)
        return 0;
    if (taken(library, reason))
        return 1;
    FreeLibrary(library);
    return 0;
}

/* By the search of LoadLibrary, which takes in PATH. */
static int loaded_by_name(int minor, Reason *reason)
{
    char name[32];
    wchar_t path[PATH_SIZE] = L"";
    snprintf(name, sizeof name, "python3%d.dll", minor);
    return append(path, name) && loaded(path, 0, reason);
}

/* Where an installation says that it is. */
static int loaded_by_registry(HKEY root, int minor, Reason *reason)
{
    char text[80];
    wchar_t key[PATH_SIZE] = L"", path[PATH_SIZE];
    DWORD size = sizeof path;
    snprintf(text, sizeof text, "Software\\Python\\PythonCore\\3.%d\\InstallPath", minor);
    if (!append(key, text) || RegGetValueW(root, key, NULL, RRF_RT_REG_SZ, NULL, path, &size) != ERROR_SUCCESS)
        return 0;
    snprintf(text, sizeof text, "\\python3%d.dll", minor);
    return append(path, text) && loaded(path, LOAD_WITH_ALTERED_SEARCH_PATH, reason);
}

static HMODULE python_of_process(void)
{
    static HMODULE modules[MODULES];
    DWORD size = 0;
    if (!EnumProcessModules(GetCurrentProcess(), modules, sizeof modules, &size))
        return NULL;
    for (size_t i = 0; i < size / sizeof *modules && i < MODULES; i++)
        if (symbol(modules[i], "Py_IsInitialized") != NULL)
            return modules[i];
    return NULL;
}

static int find(char *problem, size_t size)
{
    Reason reason = {""};
    wchar_t chosen[PATH_SIZE];
    HMODULE present = python_of_process();
    if (present != NULL) {
        if (taken(present, &reason))
            return 1;
        snprintf(problem, size, PROCESS_CANNOT_SERVE, reason.text, OLDEST);
        return 0;
    }
    if (environment(L"STRANDSPRING_LIBPYTHON", chosen)) {
        if (loaded(chosen, LOAD_WITH_ALTERED_SEARCH_PATH, &reason))
            return 1;
        if (reason.text[0] == '\0')
            snprintf(reason.text, sizeof reason.text, "it cannot be loaded");
        snprintf(problem, size, CHOSEN_CANNOT_SERVE, reason.text, OLDEST);
        return 0;
    }
    for (int minor = NEWEST; minor >= OLDEST; minor--)
        if (loaded_by_name(minor, &reason) || loaded_by_registry(HKEY_CURRENT_USER, minor, &reason) ||
            loaded_by_registry(HKEY_LOCAL_MACHINE, minor, &reason))
            return 1;
    snprintf(problem, size,
             "No Python was found: looked for python3%d.dll to python3%d.dll on PATH and where the registry says that "
             "Python is installed%s%s; " TO_DO, NEWEST, OLDEST, FOUND_BUT(reason), OLDEST);
    return 0;
}

static void *lock_process(void)
{
    char text[48];
    wchar_t name[PATH_SIZE] = L"";
    snprintf(text, sizeof text, "Local\\strandspring-python-%lu", GetCurrentProcessId());
    append(name, text);
    HANDLE mutex = CreateMutexW(NULL, FALSE, name);
    WaitForSingleObject(mutex, INFINITE);
    return mutex;
}

static void unlock_process(void *mutex)
{
    ReleaseMutex(mutex);
    CloseHandle(mutex);
}
