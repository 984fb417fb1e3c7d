/* Start and output of QEMU's machine virt with a Cortex-A53, by semihosting. */
#include <stdint.h>

enum { SYS_WRITE0 = 4, SYS_EXIT = 0x18 };

int main(void);
void target_write(const char *text);
void target_exit(void);

__asm__(".section .start, \"ax\"\n"
        ".global _start\n"
        "_start: ldr x0, =stack_top\n"
        "mov sp, x0\n"
        "mov x0, #(3 << 20)\n" /* the floating-point unit */
        "msr cpacr_el1, x0\n"
        "isb\n"
        "bl main\n"
        "bl target_exit\n");

static void host(uintptr_t operation, uintptr_t argument)
{
    register uintptr_t x0 __asm__("x0") = operation, x1 __asm__("x1") = argument;
    __asm__ volatile("hlt #0xf000" : "+r"(x0) : "r"(x1) : "memory");
}

void target_write(const char *text)
{
    host(SYS_WRITE0, (uintptr_t)text);
}

void target_exit(void)
{
    const uint64_t finished[2] = {0x20026, 0};
    host(SYS_EXIT, (uintptr_t)finished);
}
