/* Loops over single steps for the tests of spring.c: a call per step through ctypes would take longer than the step. */
#include "spring.h"

#include <stdlib.h>
#include <string.h>

/* A spring and the table of its own that it needs. */
typedef struct {
    SpringTable table;
    SpringLaw law;
} Spring;

Spring *driver_spring(const SpringParameters *parameters);
void driver_free(Spring *spring);
int driver_limit(void);
int driver_taken(const Spring *spring);
int driver_path(const Spring *spring, int count, const double *displacement, double omega_start, double *response);
void driver_gradient(const Spring *spring, int count, const double *displacement, double omega_start,
                     SpringGradient *of_force, SpringGradient *of_stiffness);
void driver_saturation(const SpringTable *table, int count, const double *xi, double *u);

Spring *driver_spring(const SpringParameters *parameters)
{
    Spring *spring = malloc(sizeof *spring);
    if (spring != NULL) {
        spring_tabulate(&spring->table, parameters->n, parameters->sigma,
                        SPRING_WITH_DERIVATIVES | SPRING_WITH_ENERGIES);
        spring_prepare(&spring->law, parameters, &spring->table);
    }
    return spring;
}

void driver_free(Spring *spring)
{
    free(spring);
}

/* Room for pieces of a branch. */
int driver_limit(void)
{
    return SPRING_PIECES;
}

/* What of it the larger of the two branches takes. */
int driver_taken(const Spring *spring)
{
    int rising = spring->table.rising.pieces, falling = spring->table.falling.pieces;
    return rising > falling ? rising : falling;
}

static int same(const SpringMemory *a, const SpringMemory *b)
{
    return a->displacement == b->displacement && a->omega == b->omega && a->start == b->start &&
           a->start_xi == b->start_xi && a->energy_at == b->energy_at && a->energy == b->energy &&
           a->direction == b->direction;
}

/* Rows of omega, force, stiffness and energy at each of `count` displacements; the first is where the path starts. The
 * energy is integrated at every second one, so that the work of a step is asked for from the memory and by a reversal.
 * Returns the number of steps at which a trial and a commit differ, which is none. */
int driver_path(const Spring *spring, int count, const double *displacement, double omega_start, double *response)
{
    const SpringLaw *law = &spring->law;
    SpringMemory memory = spring_start(displacement[0], omega_start);
    int different = 0;
    for (int k = 0; k < count; k++) {
        SpringMemory after = spring_trial(law, &memory, displacement[k]);
        spring_commit(law, &memory, NULL, displacement[k]);
        different += !same(&memory, &after);
        if (k % 2)
            spring_integrate(law, &memory);
        response[k] = memory.omega;
        response[count + k] = spring_force(law, &memory);
        response[2 * count + k] = spring_stiffness(law, &memory);
        response[3 * count + k] = spring_absorbed_energy(law, &memory);
    }
    return different;
}

/* Gradients of force and stiffness at each displacement of a path. */
void driver_gradient(const Spring *spring, int count, const double *displacement, double omega_start,
                     SpringGradient *of_force, SpringGradient *of_stiffness)
{
    SpringMemory memory = spring_start(displacement[0], omega_start);
    SpringSensitivity sensitivity = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < count; k++) {
        spring_commit(&spring->law, &memory, &sensitivity, displacement[k]);
        spring_gradient(&spring->law, &memory, &sensitivity, &of_force[k], &of_stiffness[k]);
    }
}

/* W, elementwise. */
void driver_saturation(const SpringTable *table, int count, const double *xi, double *u)
{
    for (int i = 0; i < count; i++)
        u[i] = spring_saturation(table, xi[i]);
}
