/* Loops over paths for the tests of spring.c: a call per step through ctypes would take longer than the step. */
#include "spring.h"

#include <stdlib.h>
#include <string.h>

SpringLaw *driver_law(const SpringParameters *parameters);
void driver_free(SpringLaw *law);
void driver_limits(int limits[3]);
void driver_taken(const SpringLaw *law, int taken[3]);
void driver_saturation(const SpringLaw *law, int count, const double *xi, double *u);
void driver_inverse_saturation(const SpringLaw *law, int count, const double *u, double *xi);
void driver_path(const SpringLaw *law, int count, const double *displacement, double omega_start, double *response);
void driver_gradient(
    const SpringLaw *law, int count, const double *displacement, double omega_start, SpringGradient *of_force,
    SpringGradient *of_stiffness);

SpringLaw *driver_law(const SpringParameters *parameters)
{
    SpringLaw *law = malloc(sizeof *law);
    if (law != NULL)
        spring_prepare(law, parameters);
    return law;
}

void driver_free(SpringLaw *law)
{
    free(law);
}

/* Room for nodes, pieces and buckets of a branch. */
void driver_limits(int limits[3])
{
    limits[0] = SPRING_NODES;
    limits[1] = SPRING_PIECES;
    limits[2] = SPRING_BUCKETS;
}

/* What the larger of the two branches takes of it. */
void driver_taken(const SpringLaw *law, int taken[3])
{
    const SpringBranch *branches[] = {&law->table.rising, &law->table.falling};
    memset(taken, 0, 3 * sizeof *taken);
    for (int i = 0; i < 2; i++) {
        unsigned long long last;
        memcpy(&last, &branches[i]->edges[branches[i]->pieces], sizeof last);
        int counts[] = {branches[i]->nodes, branches[i]->pieces, (int)(last >> 48) - branches[i]->first_bucket + 1};
        for (int k = 0; k < 3; k++)
            taken[k] = counts[k] > taken[k] ? counts[k] : taken[k];
    }
}

void driver_saturation(const SpringLaw *law, int count, const double *xi, double *u)
{
    for (int k = 0; k < count; k++)
        u[k] = spring_saturation(&law->table, xi[k]);
}

void driver_inverse_saturation(const SpringLaw *law, int count, const double *u, double *xi)
{
    for (int k = 0; k < count; k++)
        xi[k] = spring_inverse_saturation(&law->table, u[k]);
}

/* Rows of omega, force, stiffness and energy at each of `count` displacements; the first is where the path starts. The
 * energy is settled at every second one, so that the work of a step is asked for from the memory and by a reversal. */
void driver_path(const SpringLaw *law, int count, const double *displacement, double omega_start, double *response)
{
    SpringMemory memory = spring_rest(displacement[0], omega_start);
    for (int k = 0; k < count; k++) {
        memory = spring_advance(law, &memory, displacement[k]);
        if (k % 2)
            memory = spring_settle(law, &memory);
        response[k] = memory.omega;
        response[count + k] = spring_force(law, &memory);
        response[2 * count + k] = spring_stiffness(law, &memory);
        response[3 * count + k] = spring_absorbed_energy(law, &memory);
    }
}

/* Gradients of force and stiffness at each displacement of a path. */
void driver_gradient(
    const SpringLaw *law, int count, const double *displacement, double omega_start, SpringGradient *of_force,
    SpringGradient *of_stiffness)
{
    SpringMemory memory = spring_rest(displacement[0], omega_start);
    SpringSensitivity sensitivity = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < count; k++) {
        SpringMemory after = spring_advance(law, &memory, displacement[k]);
        sensitivity = spring_advance_sensitivity(law, &memory, &sensitivity, &after);
        memory = after;
        spring_gradient(law, &memory, &sensitivity, &of_force[k], &of_stiffness[k]);
    }
}
