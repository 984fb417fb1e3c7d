/* Runs every function of spring.c and saturation.c over random springs and paths, for the sanitizers to watch; returns
 * 0 if all outputs are finite and omega stays within [-1, 1]. */
#include "spring_problem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned long long state = 1;

/* Uniform between low and high, the same everywhere. */
static double uniform(double low, double high)
{
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return low + (high - low) * ((double)(state >> 11) / 9007199254740992.0);
}

static double within_decades(double low, double high)
{
    return pow(10.0, uniform(low, high));
}

static SpringParameters random_parameters(int trial)
{
    const double corners_n[] = {0.01, 1.0, 2.0, 100.0}, corners_sigma[] = {0.5, 1000.0};
    SpringParameters p = {
        .elastic = 1 + (int)uniform(0.0, SPRING_COEFFICIENTS - 0.001),
        .amplifier = 1 + (int)uniform(0.0, SPRING_AMPLIFIERS - 0.001),
        .kappa_omega = within_decades(-3.0, 6.0),
        .rho = within_decades(-1.0, 4.0),
        .sigma = trial % 3 ? 0.5 + within_decades(-3.0, 2.99) : corners_sigma[trial / 3 % 2],
        .n = trial % 3 ? within_decades(-2.0, 2.0) : corners_n[trial / 6 % 4],
        .displacement_offset = 0.1,
        .displacement_min = 0.1 - uniform(0.0, 1.0),
        .displacement_max = 0.1 + uniform(0.01, 1.0),
    };
    if (trial % 4 == 0) {
        p.elastic = 0;
        p.knots = p.forces = 7 + (int)uniform(0.0, SPRING_KNOTS - 7 + 0.999);
    }
    for (int i = 0; i < p.elastic; i++)
        p.kE[i] = uniform(-10.0, 10.0);
    for (int i = 0; i < p.knots; i++) {
        double share = (i + (i % (p.knots - 1) ? uniform(-0.45, 0.45) : 0.0)) / (p.knots - 1);
        p.FE_knots[i] = p.displacement_min + share * (p.displacement_max - p.displacement_min);
        p.FE_forces[i] = uniform(-10.0, 10.0);
    }
    if (p.knots)
        p.FE_knots[p.knots - 1] = p.displacement_max;
    p.kA[0] = 1.0;
    for (int i = 1; i < p.amplifier; i++)
        p.kA[i] = uniform(-0.99, 0.99) / (p.amplifier - 1);
    return p;
}

static int all_finite(const void *values, size_t size)
{
    for (size_t i = 0; i < size / sizeof(double); i++) {
        double value;
        memcpy(&value, (const char *)values + i * sizeof value, sizeof value);
        if (!isfinite(value))
            return 0;
    }
    return 1;
}

static int shake(const SpringLaw *law, double omega, int steps)
{
    const SpringParameters *p = &law->parameters;
    SpringMemory memory = spring_start(p->displacement_offset, omega);
    SpringSensitivity sensitivity = {0.0, 0.0, 0.0, 0.0};
    SpringGradient of_force, of_stiffness;
    double step = within_decades(-12.0, 0.5);
    for (int k = 0; k < steps; k++) {
        if (k % 16 == 0)
            step = within_decades(-12.0, k % 64 ? 0.5 : 9.0);
        double displacement = memory.displacement + step * uniform(-1.0, 1.0) * (k % 5 != 0);
        if (fabs(displacement) > 3.0 && k % 64 > 3)
            displacement = uniform(p->displacement_min, p->displacement_max);
        SpringMemory after = spring_trial(law, &memory, displacement);
        SpringSensitivity of_after = spring_trial_sensitivity(law, &memory, &sensitivity, &after);
        spring_commit(law, &memory, &sensitivity, displacement);
        if (memcmp(&of_after, &sensitivity, sizeof sensitivity) != 0 || after.omega != memory.omega) {
            printf("n = %.17g, sigma = %.17g, step %d: a trial and a commit differ\n", p->n, p->sigma, k);
            return 1;
        }
        if (k % 3 == 0)
            spring_integrate(law, &memory);
        spring_gradient(law, &memory, &sensitivity, &of_force, &of_stiffness);
        const double outputs[] = {
            spring_force(law, &memory), spring_stiffness(law, &memory), spring_absorbed_energy(law, &memory)};
        if (fabs(memory.omega) > 1.0 || !all_finite(outputs, sizeof outputs) || !all_finite(&of_force, sizeof of_force)
            || !all_finite(&of_stiffness, sizeof of_stiffness)) {
            printf("n = %.17g, sigma = %.17g, step %d: omega %.17g, force %g, stiffness %g, energy %g\n",
                   p->n, p->sigma, k, memory.omega, outputs[0], outputs[1], outputs[2]);
            return 1;
        }
    }
    return 0;
}

int main(int count, char **arguments)
{
    int trials = count > 1 ? atoi(arguments[1]) : 60;
    int steps = count > 2 ? atoi(arguments[2]) : 400;
    SpringTable *table = malloc(sizeof *table);
    SpringLaw *law = malloc(sizeof *law);
    char problem[200];
    int failed = law == NULL || table == NULL;
    for (int trial = 0; trial < trials && !failed; trial++) {
        SpringParameters p = random_parameters(trial);
        if (spring_problem(&p, problem, sizeof problem)) {
            printf("%s\n", problem);
            failed = 1;
            break;
        }
        spring_tabulate(table, p.n, p.sigma, SPRING_WITH_DERIVATIVES | SPRING_WITH_ENERGIES);
        spring_prepare(law, &p, table);
        failed = shake(law, trial % 4 ? uniform(-1.0, 1.0) : trial % 8 / 2.0 - 1.0, steps);
        /* A text that does not fit is cut, not written past its end. */
        p.n = -1.0 / 3.0;
        char small[8];
        failed = failed || !spring_problem(&p, small, sizeof small) || strlen(small) != sizeof small - 1;
    }
    free(law);
    free(table);
    return failed;
}
