/* The part of Python's stable ABI that the bridge uses, found at run time: one binary serves 3.10 and newer. */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct PyObject PyObject;

enum { OLDEST = 10, NEWEST = 14 }; /* minor versions of Python 3; newer ones are found by their path */

#define PYTHON_FUNCTIONS(F) \
    F(int, Py_IsInitialized, (void)) \
    F(const char *, Py_GetVersion, (void)) \
    F(wchar_t *, Py_DecodeLocale, (const char *, size_t *)) \
    F(void, Py_SetPythonHome, (const wchar_t *)) \
    F(void, Py_InitializeEx, (int)) \
    F(void *, PyEval_SaveThread, (void)) \
    F(void, PyEval_RestoreThread, (void *)) \
    F(int, PyGILState_Ensure, (void)) \
    F(void, PyGILState_Release, (int)) \
    F(void, Py_IncRef, (PyObject *)) \
    F(void, Py_DecRef, (PyObject *)) \
    F(void, PyErr_Clear, (void)) \
    F(PyObject *, PyImport_ImportModule, (const char *)) \
    F(PyObject *, PyObject_CallMethod, (PyObject *, const char *, const char *, ...)) \
    F(PyObject *, Py_BuildValue, (const char *, ...)) \
    F(PyObject *, PyDict_GetItemString, (PyObject *, const char *)) \
    F(PyObject *, PyTuple_GetItem, (PyObject *, ptrdiff_t)) \
    F(PyObject *, PyBytes_FromStringAndSize, (const char *, ptrdiff_t)) \
    F(int, PyBytes_AsStringAndSize, (PyObject *, char **, ptrdiff_t *)) \
    F(long, PyLong_AsLong, (PyObject *))

static struct {
#define MEMBER(Result, name, arguments) Result(*name) arguments;
    PYTHON_FUNCTIONS(MEMBER)
#undef MEMBER
} python;

/* Why a library was not taken, or "". */
typedef struct {
    char text[160];
} Reason;

/* Sentences for the user. */
#define PROCESS_CANNOT_SERVE "The Python of this process cannot be used: %s; the FMU needs Python 3.%d or newer."
#define CHOSEN_CANNOT_SERVE \
    "The library that STRANDSPRING_LIBPYTHON names cannot be used: %s; set it to the path of the shared library of " \
    "Python 3.%d or newer, or unset it."
#define TO_DO \
    "install Python 3.%d or newer with its shared library, or set STRANDSPRING_LIBPYTHON to the path of that library."
#define FOUND_BUT(reason) (reason).text[0] == '\0' ? "" : "; one was found, but ", (reason).text

/* What find_posix.c and find_windows.c provide: the address of a function in a library; */
static void *symbol(void *library, const char *name);

/* telling Python where its standard library lies, which it would end the process for not finding; */
static int set_home(int minor);

/* taking a Python, or a sentence about why there is none; */
static int find(char *problem, size_t size);

/* and a lock that the binaries of all FMUs of a process share. */
static void *lock_process(void);
static void unlock_process(void *lock);

/* The minor version of the loaded library, or -1 if it is not of Python 3. */
static int minor_version(void)
{
    const char *version = python.Py_GetVersion();
    return strncmp(version, "3.", 2) == 0 ? (int)strtol(version + 2, NULL, 10) : -1;
}

/* Takes the functions of a library, and starts its Python if nobody has; 0 with the reason if it cannot serve. */
static int taken(void *library, Reason *reason)
{
#define RESOLVED(Result, name, arguments) \
    void *found_##name = symbol(library, #name); \
    memcpy(&python.name, &found_##name, sizeof found_##name); \
    if (python.name == NULL) \
        return snprintf(reason->text, sizeof reason->text, "it has no function %s", #name), 0;
    PYTHON_FUNCTIONS(RESOLVED)
#undef RESOLVED
    int minor = minor_version();
    if (minor < OLDEST)
        return snprintf(reason->text, sizeof reason->text, "it is Python %.6s", python.Py_GetVersion()), 0;
    if (python.Py_IsInitialized())
        return 1;
    if (!set_home(minor))
        return snprintf(reason->text, sizeof reason->text, "there is no standard library for Python 3.%d",
                        minor), 0;
    /* Without handlers of signals, which are the host's. */
    python.Py_InitializeEx(0);
    python.PyEval_SaveThread();
    return 1;
}

/* Finds Python, once; 0 with a sentence if there is none that can serve. */
static int python_ready(char *problem, size_t size)
{
    static int ready;
    void *lock = lock_process();
    if (!ready && !(ready = find(problem, size)))
        for (char *c = problem; *c != '\0'; c++)
            if (*c < ' ' || *c > '~')
                *c = '?';
    int answer = ready;
    unlock_process(lock);
    return answer;
}
