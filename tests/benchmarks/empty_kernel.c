/* The kernel of the native FMU without its mathematics, each output being the displacement: what is left is the FMI
 * layer. */
#include "spring.h"

#include <string.h>

void spring_tabulate(SpringTable *table, double n, double sigma, int with)
{
    (void)with;
    table->n = n;
    table->curvature = 2.0 * sigma - 1.0;
}

void spring_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table)
{
    law->parameters = *parameters;
    law->table = table;
}

int spring_piece(const SpringBranch *branch, double z)
{
    (void)branch;
    return (int)z;
}

double spring_on_piece(const SpringBranch *branch, int piece, double z)
{
    (void)branch;
    (void)piece;
    return z;
}

double spring_exponential(double y)
{
    return y;
}

double spring_exponential_tail(double y)
{
    return y;
}

SpringMemory spring_start(double displacement, double omega)
{
    return (SpringMemory){.displacement = displacement, .omega = omega};
}

SpringMemory spring_trial(const SpringLaw *law, const SpringMemory *memory, double displacement)
{
    (void)law;
    SpringMemory after = *memory;
    after.displacement = displacement;
    return after;
}

void spring_commit(const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement)
{
    (void)law;
    (void)sensitivity;
    memory->displacement = displacement;
}

double spring_force(const SpringLaw *law, const SpringMemory *memory)
{
    (void)law;
    return memory->displacement;
}

double spring_stiffness(const SpringLaw *law, const SpringMemory *memory)
{
    return spring_force(law, memory);
}

double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory)
{
    return spring_force(law, memory);
}

void spring_integrate(const SpringLaw *law, SpringMemory *memory)
{
    (void)law;
    (void)memory;
}

SpringSensitivity spring_trial_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after)
{
    (void)law;
    (void)before;
    (void)after;
    return *sensitivity;
}

void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness)
{
    (void)law;
    (void)memory;
    (void)sensitivity;
    memset(of_force, 0, sizeof *of_force);
    memset(of_stiffness, 0, sizeof *of_stiffness);
}

SpringOmegaSlope spring_omega_slope(const SpringLaw *law, const SpringMemory *memory)
{
    (void)law;
    (void)memory;
    return (SpringOmegaSlope){0};
}

void spring_change(
    const SpringLaw *before, const SpringLaw *after, SpringMemory *memory, SpringSensitivity *sensitivity)
{
    (void)before;
    (void)after;
    (void)memory;
    (void)sensitivity;
}
