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

/* What compilers call with the size of a frame above one page in rax: touches each page of it, since Windows adds pages
 * to a stack only one after the other. All registers are kept. */
void ___chkstk_ms(void);
__attribute__((naked)) void ___chkstk_ms(void)
{
    /* NOLINTNEXTLINE(portability-no-assembler): no C can do it */
    __asm__("pushq %rcx\n\t"
            "pushq %rax\n\t"
            "leaq 24(%rsp), %rcx\n" /* the caller's stack pointer */
            "1:\n\t"
            "cmpq $4096, %rax\n\t"
            "jb 2f\n\t"
            "subq $4096, %rcx\n\t"
            "testq %rcx, (%rcx)\n\t"
            "subq $4096, %rax\n\t"
            "jmp 1b\n"
            "2:\n\t"
            "subq %rax, %rcx\n\t"
            "testq %rcx, (%rcx)\n\t"
            "popq %rax\n\t"
            "popq %rcx\n\t"
            "retq");
}
