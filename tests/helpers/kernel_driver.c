/* Loops over single steps for the tests of spring.c: a call per step through ctypes would take longer than the step. */
#include "spring.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* A spring and the table of its own that it needs. */
typedef struct {
    SpringTable table;
    SpringLaw law;
} Spring;

Spring *driver_spring(const SpringParameters *parameters)
{
    Spring *spring = calloc(1, sizeof *spring);
    spring_tabulate(&spring->table, parameters->n, parameters->sigma, SPRING_WITH_DERIVATIVES | SPRING_WITH_ENERGIES);
    spring_prepare(&spring->law, parameters, &spring->table);
    return spring;
}

void driver_free(Spring *spring)
{
    free(spring);
}

/* What of the room for pieces the larger of the two branches takes. */
int driver_taken(const Spring *spring)
{
    int rising = spring->table.rising.pieces, falling = spring->table.falling.pieces;
    return rising > falling ? rising : falling;
}

/* Rows of omega, force, stiffness and energy at each of `count` displacements, and gradients of force and stiffness; the
 * first is where the path starts. The energy is integrated at every second one, so that the work of a step is asked for
 * from the memory and by a reversal. Returns the number of steps at which a trial and a commit differ, which is none. */
int driver_path(const Spring *spring, int count, const double *displacement, double omega_start, double *response,
                SpringGradient *of_force, SpringGradient *of_stiffness)
{
    const SpringLaw *law = &spring->law;
    SpringMemory memory = spring_start(displacement[0], omega_start);
    SpringSensitivity sensitivity = {0.0, 0.0, 0.0, 0.0};
    int different = 0;
    for (int k = 0; k < count; k++) {
        SpringMemory after = spring_trial(law, &memory, displacement[k]);
        SpringSensitivity of_after = spring_trial_sensitivity(law, &memory, &sensitivity, &after);
        spring_commit(law, &memory, &sensitivity, displacement[k]);
        different += memcmp(&after, &memory, offsetof(SpringMemory, direction)) != 0 ||
                     memcmp(&of_after, &sensitivity, sizeof of_after) != 0 || after.direction != memory.direction;
        if (k % 2)
            spring_integrate(law, &memory);
        response[k] = memory.omega;
        response[count + k] = spring_force(law, &memory);
        response[2 * count + k] = spring_stiffness(law, &memory);
        response[3 * count + k] = spring_absorbed_energy(law, &memory);
        spring_gradient(law, &memory, &sensitivity, &of_force[k], &of_stiffness[k]);
    }
    return different;
}

/* W and its inverse, elementwise; the latter of what lies within [-1, 1]. */
void driver_saturation(const Spring *spring, int count, const double *value, double *u, double *xi)
{
    for (int i = 0; i < count; i++) {
        u[i] = spring_saturation(&spring->table, value[i]);
        xi[i] = value[i] >= -1.0 && value[i] <= 1.0 ? spring_inverse(&spring->table, value[i]) : 0.0;
    }
}
