/* How much stack a function of an FMU takes, as a library for Python.
 *
 * Under Linux on x86-64 and AArch64 integers and pointers are passed apart from doubles, and a function does not see what
 * it has not asked for: so all functions of FMI can be called as one type. */
#define DEPTH 524288
#include "../fmi/targets/stack.h"

#include <stdarg.h>
#include <stddef.h>

enum { WORDS = 14, DOUBLES = 3 };

typedef uintptr_t Function(
    uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t, uintptr_t,
    uintptr_t, uintptr_t, uintptr_t, uintptr_t, double, double, double);

typedef struct {
    Function *function;
    const uintptr_t *word;
    const double *real;
    uintptr_t answer;
} Call;

static void call(void *context)
{
    Call *at = context;
    const uintptr_t *w = at->word;
    at->answer = at->function(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], w[9], w[10], w[11], w[12], w[13],
                              at->real[0], at->real[1], at->real[2]);
}

/* Bytes, with those of the arguments; *answer becomes what the function returns. */
unsigned stack_of_call(Function *function, const uintptr_t *word, const double *real, uintptr_t *answer)
{
    Call at = {.function = function, .word = word, .real = real};
    unsigned bytes = stack_of(call, &at);
    *answer = at.answer;
    return bytes;
}

/* Loggers of FMI 2.0 and 3.0, whose own stack is the host's. */
void hear2(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)message;
}

void hear3(void *environment, int status, const char *category, const char *message)
{
    (void)environment, (void)status, (void)category, (void)message;
}
