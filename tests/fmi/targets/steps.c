/* A path of a spring that strandspring has exported, for the host and for targets without an operating system: prints
 * digests of the bits of all outputs, and the most stack that a step takes. */
#include "mount_law.h"

#include "adversary.h"
#include "stack.h"

void target_write(const char *text);

enum { STEPS = 6000, SHOWN = 500, OUTPUTS = 4 };

typedef struct {
    SpringMemory memory;
    double displacement, output[OUTPUTS];
} Step;

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
static void change(void *context)
{
    static SpringLaw stiffer;
    Step *s = context;
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
    char text[18];
    for (int i = 0; i < 16; i++)
        text[i] = "0123456789abcdef"[word >> (60 - 4 * i) & 15];
    text[16] = ' ';
    text[17] = '\0';
    target_write(text);
}

int main(void)
{
    uint64_t digest[OUTPUTS] = {0};
    unsigned most = 0;
    const SpringParameters *p = &mount_law.parameters;
    Step s = {.memory = spring_start(mount_law.parameters.displacement_offset, 0.0)};
    for (int k = 1; k <= STEPS; k++) {
        s.displacement = next_displacement(p->displacement_min, p->displacement_max, s.memory.displacement);
        unsigned used = stack_of(step, &s);
        most = used > most ? used : most;
        if (k % 97 == 0)
            change(&s);
        for (int i = 0; i < OUTPUTS; i++) {
            union {
                double value;
                uint64_t bits;
            } of = {.value = s.output[i]};
            digest[i] = (digest[i] ^ of.bits) * 1099511628211u;
            digest[i] ^= digest[i] >> 29;
        }
        for (int i = 0; k % SHOWN == 0 && i < OUTPUTS; i++)
            write_word(digest[i]);
        if (k % SHOWN == 0)
            target_write("\n");
    }
    target_write("stack ");
    write_word(most);
    target_write("memory ");
    write_word(sizeof(SpringMemory));
    target_write("\n");
    return 0;
}
