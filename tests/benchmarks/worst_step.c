/* Times single steps of the kernel for worst_step.py. */
#include "saturation.c"
#include "saturation_table.c"
#include "spline.c"
#include "spring.c"
#include "ticks.h"

#include <stdlib.h>

typedef struct {
    SpringTable table;
    SpringLaw law;
} Spring;

Spring *worst_spring(const SpringParameters *parameters, int with);
void worst_free(Spring *spring);
double worst_tabulate(const SpringParameters *parameters, int with, int rounds);
double worst_steps(const Spring *spring, int energies, int count, const double *displacement, int rounds,
                   size_t evicted, unsigned *ticks);
void worst_sizes(size_t sizes[3]);

Spring *worst_spring(const SpringParameters *parameters, int with)
{
    Spring *spring = malloc(sizeof *spring);
    if (spring != NULL) {
        spring_tabulate(&spring->table, parameters->n, parameters->sigma, with);
        spring_prepare(&spring->law, parameters, &spring->table);
    }
    return spring;
}

void worst_free(Spring *spring)
{
    free(spring);
}

void worst_sizes(size_t sizes[3])
{
    sizes[0] = sizeof(SpringTable);
    sizes[1] = sizeof(SpringLaw);
    sizes[2] = sizeof(SpringMemory);
}

/* The shortest time that a table and its law take [ns]. */
double worst_tabulate(const SpringParameters *parameters, int with, int rounds)
{
    double least = 1e300;
    for (int round = 0; round < rounds; round++) {
        double start = nanoseconds();
        Spring *spring = worst_spring(parameters, with);
        double taken = nanoseconds() - start;
        worst_free(spring);
        least = taken < least ? taken : least;
    }
    return least;
}

/* The fewest ticks of each step over several rounds along the same path, less those of measuring. With `evicted`, so
 * many bytes of other memory are written before each step. */
double worst_steps(const Spring *spring, int energies, int count, const double *displacement, int rounds,
                   size_t evicted, unsigned *ticks)
{
    const SpringLaw *law = &spring->law;
    double sum = 0.0;
    unsigned long long empty = ticks_of_nothing();
    volatile char *other = evicted ? malloc(evicted) : NULL;
    for (int round = 0; round < rounds; round++) {
        SpringMemory memory = spring_start(displacement[0], 0.0);
        for (int k = 0; k < count; k++) {
            for (size_t i = 0; other != NULL && i < evicted; i += 64)
                other[i]++;
            unsigned long long start = ticks_now();
            spring_commit(law, &memory, NULL, displacement[k]);
            sum += spring_force(law, &memory) + spring_stiffness(law, &memory) + memory.omega;
            if (energies) {
                spring_integrate(law, &memory);
                sum += spring_absorbed_energy(law, &memory);
            }
            unsigned long long taken = ticks_now() - start;
            taken = taken > empty ? taken - empty : 0;
            if (round == 0 || taken < ticks[k])
                ticks[k] = (unsigned)taken;
        }
    }
    free((void *)other);
    return sum;
}
