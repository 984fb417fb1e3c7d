/* How much stack a call takes: what lies below is painted before, and looked at after. */
#ifndef STACK_H
#define STACK_H

#include <stdint.h>

#ifndef DEPTH
#define DEPTH 16384
#endif

static inline uintptr_t stack_pointer(void)
{
    uintptr_t pointer;
#if defined __x86_64__
    __asm__ volatile("mov %%rsp, %0" : "=r"(pointer));
#else
    __asm__ volatile("mov %0, sp" : "=r"(pointer));
#endif
    return pointer;
}

/* Bytes, with those of the call's return address. */
__attribute__((noinline)) static unsigned stack_of(void (*call)(void *), void *context)
{
    volatile uint32_t *top = (volatile uint32_t *)stack_pointer(), *low = top - DEPTH / 4, *used;
    for (used = low; used < top; used++)
        *used = 0x5ac3a55au;
    call(context);
    for (used = low; used < top && *used == 0x5ac3a55au; used++)
        ;
    return (unsigned)(top - used) * 4;
}

#endif
