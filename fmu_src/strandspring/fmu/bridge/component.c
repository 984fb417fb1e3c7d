/* The Python object behind an instance: questions to it, and how it comes and goes. */

typedef struct {
    struct {
        int mode;
        double time, stop_time; /* where the last step ended, and infinite if there is none [s] */
    } state;
    Log log;
    PyObject *component;
    char name[];
} Instance;

/* One call of the component. */
typedef struct {
    const char *method;
    const char *kind; /* of the variables, passed on unless NULL */
    int arrays; /* how many of the two are passed on */
    const void *first;
    size_t first_size; /* in bytes, like all sizes here */
    const void *second;
    size_t second_size;
    PyObject *state; /* passed on in place of arrays unless NULL */
    void *answer;    /* takes the bytes of the answer, which must be `answer_size` */
    size_t answer_size;
    size_t *size;    /* takes the number of bytes of the answer unless NULL */
    PyObject **kept; /* takes the answer itself unless NULL */
} Question;

/* Runs `resources`/slavemodule.txt's module once per process, and asks it for a component. */
static const char START[] =
    "import importlib, os, sys\n"
    "try:\n"
    "    from urllib.parse import unquote_to_bytes\n"
    "    path = uri[5:] if uri[:5].lower() == b'file:' else uri\n"
    "    if path[:2] == b'//':\n"
    "        host, slash, rest = path[2:].partition(b'/')\n"
    "        path = path if os.name == 'nt' and host.lower() not in (b'', b'localhost') else slash + rest\n"
    "    if os.name == 'nt' and path[2:3] in (b':', b'|'):\n"
    "        path = path[1:2] + b':' + path[3:]\n"
    "    folder = os.fsdecode(unquote_to_bytes(path))\n"
    "    if not os.path.isdir(folder):\n" /* the host has not encoded it */
    "        folder = os.fsdecode(path)\n"
    "    with open(os.path.join(folder, 'slavemodule.txt'), encoding='ascii') as file:\n"
    "        module = file.read().strip()\n"
    "    if module not in sys.modules:\n"
    "        sys.path.insert(0, folder)\n"
    "        try:\n"
    "            importlib.import_module(module)\n"
    "        finally:\n"
    "            sys.path.remove(folder)\n"
    "    answer = importlib.import_module(module).start(folder, name, guid)\n"
    "except BaseException as problem:\n"
    "    text = f'The FMU cannot be loaded from {os.fsdecode(uri)}: {type(problem).__name__}: {problem}'\n"
    "    text = ''.join(c if ' ' <= c <= '~' and c != '#' else '?' for c in ' '.join(text.split()))\n"
    "    answer = 3, None, f'3{text}\\n'.encode('ascii')\n";

/* Takes the lock of Python; an instance must not outlive it. */
static int enter(const Log *log, int *lock)
{
    if (!python.Py_IsInitialized()) {
        FMU_REFUSE(log, "The Python of this process has been shut down; end the simulation before that.");
        return 0;
    }
    *lock = python.PyGILState_Ensure();
    return 1;
}

/* Logs the lines of a reply without the lock, which the host's logger may wait for elsewhere. */
static void report_lines(const Log *log, const char *lines)
{
    void *thread = python.PyEval_SaveThread();
    for (const char *end; (end = strchr(lines, '\n')) != NULL; lines = end + 1)
        fmu_report(log, (fmi2Status)(lines[0] - '0'), "%.*s", (int)(end - lines - 1), lines + 1);
    python.PyEval_RestoreThread(thread);
}

/* The status in a reply (status, answer, lines to be logged), which is borrowed, and its answer. */
static fmi2Status unpacked(const Log *log, PyObject *reply, PyObject **answer)
{
    char *lines = NULL;
    long status = -1;
    ptrdiff_t length;
    if (reply != NULL) {
        status = python.PyLong_AsLong(python.PyTuple_GetItem(reply, 0));
        *answer = python.PyTuple_GetItem(reply, 1);
        python.PyBytes_AsStringAndSize(python.PyTuple_GetItem(reply, 2), &lines, &length);
    }
    if (status < 0 || lines == NULL) {
        python.PyErr_Clear();
        return FMU_REFUSE(log, "Python failed before the call reached the spring; it may be out of memory.");
    }
    if (lines[0] != '\0')
        report_lines(log, lines);
    return (fmi2Status)status;
}

static PyObject *bytes(const void *content, size_t size)
{
    return python.PyBytes_FromStringAndSize(size == 0 ? "" : content, (ptrdiff_t)size);
}

/* Copies the answer to where the question wants it. */
static fmi2Status delivered(const Instance *instance, const Question *question, PyObject *answer)
{
    char *content = NULL;
    ptrdiff_t size = 0;
    if (question->kept != NULL) {
        python.Py_IncRef(answer);
        *question->kept = answer;
        return fmi2OK;
    }
    if (python.PyBytes_AsStringAndSize(answer, &content, &size) != 0) {
        python.PyErr_Clear();
        return FMU_REFUSE(&instance->log, "`%s` of the FMU's Python code gave no bytes.", question->method);
    }
    if (question->size != NULL) {
        *question->size = (size_t)size;
    } else if ((size_t)size != question->answer_size) {
        return FMU_REFUSE(&instance->log, "The array for the answer must have %.0f bytes, got %.0f.", (double)size,
                          (double)question->answer_size);
    } else if (size > 0) {
        memcpy(question->answer, content, (size_t)size);
    }
    return fmi2OK;
}

static fmi2Status ask(const Instance *instance, const Question *question)
{
    static const char *const FORMATS[] = {"s", "sN"}, *const OF_VARIABLES[] = {"", "ssN", "ssNN"};
    int lock;
    PyObject *reply, *answer = NULL;
    if (!enter(&instance->log, &lock))
        return fmi2Error;
    if (question->state != NULL) {
        reply = python.PyObject_CallMethod(instance->component, "call", "sO", question->method, question->state);
    } else {
        PyObject *first = question->arrays > 0 ? bytes(question->first, question->first_size) : NULL;
        PyObject *second = question->arrays > 1 ? bytes(question->second, question->second_size) : NULL;
        if (question->kind != NULL)
            reply = python.PyObject_CallMethod(instance->component, "call", OF_VARIABLES[question->arrays],
                                               question->method, question->kind, first, second);
        else
            reply = python.PyObject_CallMethod(
                instance->component, "call", FORMATS[question->arrays], question->method, first);
    }
    fmi2Status status = unpacked(&instance->log, reply, &answer);
    if (status == fmi2OK)
        status = delivered(instance, question, answer);
    python.Py_DecRef(reply);
    python.PyGILState_Release(lock);
    return status;
}

static void released(const Instance *instance, PyObject *object)
{
    int lock;
    if (!enter(&instance->log, &lock))
        return;
    python.Py_DecRef(object);
    python.PyGILState_Release(lock);
}

/* A component for a new instance, or NULL. */
static PyObject *started(const Log *log, const char *guid, const char *resources)
{
    int lock;
    PyObject *component = NULL;
    if (!enter(log, &lock))
        return NULL;
    PyObject *builtins = python.PyImport_ImportModule("builtins");
    PyObject *scope = python.Py_BuildValue("{s:y,s:y,s:y}", "uri", resources, "name", log->instance_name, "guid", guid);
    PyObject *done = python.PyObject_CallMethod(builtins, "exec", "sO", START, scope);
    PyObject *reply = done == NULL ? NULL : python.PyDict_GetItemString(scope, "answer");
    if (unpacked(log, reply, &component) == fmi2OK)
        python.Py_IncRef(component);
    else
        component = NULL;
    python.Py_DecRef(done);
    python.Py_DecRef(scope);
    python.Py_DecRef(builtins);
    python.PyGILState_Release(lock);
    return component;
}
