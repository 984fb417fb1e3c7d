/* Start and output of QEMU's machine mps2-an500, a Cortex-M7, by semihosting. */
#include <stdint.h>

enum { SYS_WRITE0 = 4, SYS_EXIT = 0x18, FINISHED = 0x20026 };

extern char stack_top[];
int main(void);
void _start(void);
void target_write(const char *text);

static void host(uintptr_t operation, uintptr_t argument)
{
    register uintptr_t r0 __asm__("r0") = operation, r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void target_write(const char *text)
{
    host(SYS_WRITE0, (uintptr_t)text);
}

void _start(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the floating-point unit */
    __asm__ volatile("dsb\n isb" ::: "memory");
    main();
    host(SYS_EXIT, FINISHED);
    for (;;)
        ;
}

__attribute__((section(".start"), used)) static const void *const vectors[2] = {stack_top,
                                                                                (const void *)(uintptr_t)_start};
