/* Stands in for python311.dll: prints the home that the bridge gives it when it is started, and ends the process. */
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

#define EXPORTED __declspec(dllexport)

static const wchar_t *home = L"none";

EXPORTED int Py_IsInitialized(void) { return 0; }
EXPORTED const char *Py_GetVersion(void) { return "3.11.9 (stand-in)"; }
EXPORTED void Py_SetPythonHome(const wchar_t *given) { home = given; }
EXPORTED void Py_InitializeEx(int handlers)
{
    char text[1024];
    WideCharToMultiByte(CP_UTF8, 0, home, -1, text, sizeof text, NULL, NULL);
    printf("started with %s, %d", text, handlers);
    fflush(stdout);
    exit(0);
}

/* What is never called. */
#define UNUSED(name) EXPORTED void name(void) {}
UNUSED(Py_DecodeLocale)
UNUSED(PyEval_SaveThread)
UNUSED(PyEval_RestoreThread)
UNUSED(PyGILState_Ensure)
UNUSED(PyGILState_Release)
UNUSED(Py_IncRef)
UNUSED(Py_DecRef)
UNUSED(PyErr_Clear)
UNUSED(PyImport_ImportModule)
UNUSED(PyObject_CallMethod)
UNUSED(Py_BuildValue)
UNUSED(PyDict_GetItemString)
UNUSED(PyTuple_GetItem)
UNUSED(PyBytes_FromStringAndSize)
UNUSED(PyBytes_AsStringAndSize)
UNUSED(PyLong_AsLong)
