/* What a DLL needs that uses the C runtime of Windows (UCRT) and nothing else.
 *
 * The start code that compilers link into a DLL imports KERNEL32 for constructors, thread-local storage and exit
 * functions. The spring has none of these, so its DLL starts here. Only our own build compiles this file: it is no part
 * of the FMU's sources, which every compiler builds with its own start code.
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

int library_start(void *library, unsigned long reason, void *reserved);

int library_start(void *library, unsigned long reason, void *reserved)
{
    (void)library;
    (void)reason;
    (void)reserved;
    return 1;
}

/* The headers declare what follows, but UCRT exports it under other names or leaves it to the compiler. */

int vsnprintf(char *restrict text, size_t size, const char *restrict format, va_list arguments)
{
    /* As C99 asks: always terminated, and the length that the whole text has. */
    const unsigned long long standard = 2;
    return __stdio_common_vsprintf(standard, text, size, format, NULL, arguments);
}

int snprintf(char *restrict text, size_t size, const char *restrict format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, size, format, arguments);
    va_end(arguments);
    return length;
}

int __isnan(double x) { return __builtin_isnan(x); }

int __fpclassify(double x)
{
    return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x);
}
