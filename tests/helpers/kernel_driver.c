/* Loops over paths for the tests of spring.c: a call per step through ctypes would take longer than the step. */
#include "spring.h"

#include <stdlib.h>
#include <string.h>

SpringLaw *driver_law(const SpringParameters *parameters);
void driver_free(SpringLaw *law);
void driver_limits(int limits[2]);
void driver_taken(const SpringLaw *law, int taken[2]);
void driver_saturation(const SpringLaw *law, int count, const double *xi, double *u);
void driver_inverse_saturation(const SpringLaw *law, int count, const double *u, double *xi);
void driver_path(const SpringLaw *law, int count, const double *displacement, double omega_start, double *response);
void driver_gradient(
    const SpringLaw *law, int count, const double *displacement, double omega_start, SpringGradient *of_force,
    SpringGradient *of_stiffness);

/* A law and the table that it needs. */
typedef struct {
    SpringLaw law;
    SpringTable table;
} Whole;

SpringLaw *driver_law(const SpringParameters *parameters)
{
    Whole *whole = malloc(sizeof *whole);
    if (whole == NULL)
        return NULL;
    spring_tabulate(&whole->table, parameters->n, parameters->sigma, SPRING_WITH_DERIVATIVES | SPRING_WITH_MOMENTS);
    spring_prepare(&whole->law, parameters, &whole->table);
    return &whole->law;
}

void driver_free(SpringLaw *law)
{
    free(law);
}

/* Room for pieces and buckets of a branch. */
void driver_limits(int limits[2])
{
    limits[0] = SPRING_PIECES;
    limits[1] = SPRING_BUCKETS;
}

static int buckets_up_to(const SpringIndex *index, double last)
{
    unsigned long long bits;
    memcpy(&bits, &last, sizeof bits);
    return (int)(bits >> 48) - index->first + 1;
}

/* What the larger of the two branches takes of it. */
void driver_taken(const SpringLaw *law, int taken[2])
{
    const SpringBranch *branches[] = {&law->table->rising, &law->table->falling};
    memset(taken, 0, 2 * sizeof *taken);
    for (int i = 0; i < 2; i++) {
        const SpringBranch *branch = branches[i];
        int complemented = branch->complemented < branch->pieces;
        int buckets[] = {
            buckets_up_to(&branch->of_xi, branch->edges[branch->pieces]),
            buckets_up_to(&branch->of_value, branch->values[branch->complemented]),
            complemented ? buckets_up_to(&branch->of_complement, -branch->complements[branch->complemented]) : 0,
        };
        int counts[] = {branch->pieces, 0};
        for (int k = 0; k < 3; k++)
            counts[1] = buckets[k] > counts[1] ? buckets[k] : counts[1];
        for (int k = 0; k < 2; k++)
            taken[k] = counts[k] > taken[k] ? counts[k] : taken[k];
    }
}

void driver_saturation(const SpringLaw *law, int count, const double *xi, double *u)
{
    for (int k = 0; k < count; k++)
        u[k] = spring_saturation(law->table, xi[k]);
}

void driver_inverse_saturation(const SpringLaw *law, int count, const double *u, double *xi)
{
    for (int k = 0; k < count; k++)
        xi[k] = spring_inverse(law->table, u[k]);
}

/* Rows of omega, force, stiffness and energy at each of `count` displacements; the first is where the path starts. The
 * energy is integrated at every second one, so that the work of a step is asked for from the memory and by a reversal. */
void driver_path(const SpringLaw *law, int count, const double *displacement, double omega_start, double *response)
{
    SpringMemory memory = spring_start(displacement[0], omega_start);
    for (int k = 0; k < count; k++) {
        memory = spring_trial(law, &memory, displacement[k]);
        if (k % 2)
            spring_integrate(law, &memory);
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
    SpringMemory memory = spring_start(displacement[0], omega_start);
    SpringSensitivity sensitivity = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < count; k++) {
        SpringMemory after = spring_trial(law, &memory, displacement[k]);
        sensitivity = spring_trial_sensitivity(law, &memory, &sensitivity, &after);
        memory = after;
        spring_gradient(law, &memory, &sensitivity, &of_force[k], &of_stiffness[k]);
    }
}
