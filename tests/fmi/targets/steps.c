/* A path of a spring that strandspring has exported, for the host and for targets without an operating system: prints
 * digests of the bits of all outputs, and the most stack that a step takes. */
#include "mount_law.h"

#include <stdint.h>

void target_write(const char *text);

#if __STDC_HOSTED__
#include <stdio.h>

void target_write(const char *text)
{
    fputs(text, stdout);
}
#endif

enum { STEPS = 6000, SHOWN = 125, OUTPUTS = 4, DEPTH = 16384 };

typedef struct {
    SpringMemory memory;
    double displacement, output[OUTPUTS];
} Step;

/* How much stack a call takes: what lies below is painted before, and looked at after. */
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

/* In [0, 1), the same on every machine. */
static double uniform(void)
{
    static uint64_t state = 16;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

/* Hard for a spring: turns of every length, also out of the range; now and then none. */
static double next_displacement(double low, double high, double last)
{
    double kind = uniform(), length = (high - low) * (2.0 * uniform() - 1.0);
    if (kind < 0.4)
        return low + (high - low) * (1.4 * uniform() - 0.2);
    return kind > 0.98 ? last : last + length * (kind < 0.6 ? 1e-9 : 0.05);
}

/* What a real-time loop does. */
static void step(void *context)
{
    Step *s = context;
    spring_commit(&mount_law, &s->memory, NULL, s->displacement);
    spring_integrate(&mount_law, &s->memory);
    s->output[0] = spring_force(&mount_law, &s->memory);
    s->output[1] = spring_stiffness(&mount_law, &s->memory);
    s->output[2] = spring_absorbed_energy(&mount_law, &s->memory);
    s->output[3] = s->memory.omega;
}

/* Goes on with a law that is prepared here, and back. */
static void change(Step *s)
{
    static SpringLaw stiffer;
    SpringParameters parameters = mount_law.parameters;
    parameters.rho *= 1.5;
    parameters.kappa_omega *= 2.0;
    spring_prepare(&stiffer, &parameters, mount_law.table);
    spring_change(&mount_law, &stiffer, &s->memory, NULL);
    spring_commit(&stiffer, &s->memory, NULL, s->displacement);
    spring_change(&stiffer, &mount_law, &s->memory, NULL);
}

static void write_word(uint64_t word)
{
    char text[18] = {[16] = ' '};
    for (int i = 0; i < 16; i++)
        text[i] = "0123456789abcdef"[word >> (60 - 4 * i) & 15];
    target_write(text);
}

int main(void)
{
    uint64_t digest = 0, bits;
    unsigned most = 0;
    const SpringParameters *p = &mount_law.parameters;
    Step s = {.memory = spring_start(p->displacement_offset, 0.0)};
    for (int k = 1; k <= STEPS; k++) {
        s.displacement = next_displacement(p->displacement_min, p->displacement_max, s.memory.displacement);
        unsigned used = stack_of(step, &s);
        most = used > most ? used : most;
        if (k % 97 == 0)
            change(&s);
        for (int i = 0; i < OUTPUTS; i++) {
            __builtin_memcpy(&bits, &s.output[i], sizeof bits);
            digest = (digest ^ bits) * 1099511628211u;
            digest ^= digest >> 29;
        }
        if (k % SHOWN == 0)
            write_word(digest);
    }
    write_word(most);
    return 0;
}
