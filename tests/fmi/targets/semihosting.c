/* Start and output of QEMU's machines mps2-an500 (Cortex-M7) and virt (Cortex-A53), by semihosting. */
#include <stdint.h>

enum { SYS_WRITE0 = 4, SYS_EXIT = 0x18, FINISHED = 0x20026 };

int main(void);
void target_write(const char *text);

static void host(uintptr_t operation, uintptr_t argument)
{
#ifdef __aarch64__
    register uintptr_t first __asm__("x0") = operation, second __asm__("x1") = argument;
    __asm__ volatile("hlt #0xf000" : "+r"(first) : "r"(second) : "memory");
#else
    register uintptr_t first __asm__("r0") = operation, second __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(first) : "r"(second) : "memory");
#endif
}

void target_write(const char *text)
{
    host(SYS_WRITE0, (uintptr_t)text);
}

/* First the floating-point unit is switched on. */
#ifdef __aarch64__
void target_exit(void);

__asm__(".section .start, \"ax\"\n.global _start\n"
        "_start: ldr x0, =stack_top\nmov sp, x0\nmov x0, #(3 << 20)\nmsr cpacr_el1, x0\nisb\nbl main\nbl target_exit\n");

void target_exit(void)
{
    const uint64_t finished[2] = {FINISHED, 0};
    host(SYS_EXIT, (uintptr_t)finished);
}
#else
extern char stack_top[];
void _start(void);

void _start(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    main();
    host(SYS_EXIT, FINISHED);
    for (;;)
        ;
}

__attribute__((section(".start"), used)) static const void *const vectors[2] = {stack_top,
                                                                                (const void *)(uintptr_t)_start};
#endif
