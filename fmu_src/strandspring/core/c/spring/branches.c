#include "branches.h"

#include "numerics.h"
#include "spring_library.h"

/* Up to this, rest and mean follow from the series of ramp without cancellation. */
static const double SMALL_DECAY = 0.34;

SpringDecay spring_decay(double q)
{
    SpringDecay decay;
    if (q <= SMALL_DECAY) {
        decay.ramp = spring_exponential_tail(-q);
        decay.mean = 1.0 - q * decay.ramp;
        decay.rest = 1.0 - q * decay.mean;
    } else {
        decay.rest = spring_exponential(-q);
        decay.mean = (1.0 - decay.rest) / q;
        decay.ramp = (1.0 - decay.mean) / q;
    }
    return decay;
}

SpringParameters spring_second(const SpringParameters *first, const SpringAdded *added)
{
    SpringParameters second = {
        .elastic = 1,
        .amplifier = added->amplifier,
        .kappa_omega = added->kappa_omega,
        .rho = added->rho,
        .sigma = added->sigma,
        .n = added->n,
        .displacement_offset = first->displacement_offset,
        .displacement_min = first->displacement_min,
        .displacement_max = first->displacement_max,
    };
    memcpy(second.kA, added->kA, sizeof second.kA);
    return second;
}

SpringAddedMemory spring_added_start(double displacement, double omega)
{
    return (SpringAddedMemory){.second = spring_start(displacement, omega), .sensitivity = {0}};
}

void spring_added_commit(
    const SpringAdded *added, const SpringLaw *second, SpringAddedMemory *memory, int with_derivatives,
    double from, double displacement, double duration, const SpringDecay decays[SPRING_MAXWELLS])
{
    double travel = displacement - from;
    if (added->mechanisms)
        spring_commit(second, &memory->second, with_derivatives ? &memory->sensitivity : NULL, displacement);
    for (int i = 0; i < added->branches; i++) {
        double before = memory->elongation[i];
        memory->work += added->stiffness[i] * spring_maxwell_work(&decays[i], before, travel);
        memory->elongation[i] = spring_maxwell_after(&decays[i], before, travel);
        if (with_derivatives)
            memory->by_log[i] = spring_maxwell_by_log(
                &decays[i], duration / added->time_constant[i], memory->by_log[i], before, travel);
    }
}

/* FA of the second mechanism, and its slope. */
static double second_amplifier(const SpringLaw *second, const SpringMemory *memory, double *slope)
{
    const SpringParameters *p = &second->parameters;
    double x = memory->displacement - p->displacement_offset, inside = clip(x, second->x_min, second->x_max);
    *slope = x == inside ? polynomial(second->dFA, slope_count(p->amplifier), inside) : 0.0;
    return polynomial(p->kA, p->amplifier, inside);
}

double spring_added_force(const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory)
{
    double force = 0.0, slope;
    if (added->mechanisms)
        force = added->kappa_omega * memory->second.omega * second_amplifier(second, &memory->second, &slope);
    for (int i = 0; i < added->branches; i++)
        force += added->stiffness[i] * memory->elongation[i];
    return force;
}

double spring_added_stiffness(const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory)
{
    double stiffness = 0.0;
    if (added->mechanisms) {
        double slope, amplifier = second_amplifier(second, &memory->second, &slope);
        double of_omega = spring_omega_slope(second, &memory->second).value;
        stiffness = added->kappa_omega * (memory->second.omega * slope + amplifier * of_omega);
    }
    for (int i = 0; i < added->branches; i++)
        stiffness += added->stiffness[i];
    return stiffness;
}

double spring_added_energy(const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory)
{
    return (added->mechanisms ? spring_absorbed_energy(second, &memory->second) : 0.0) + memory->work;
}

double spring_added_stored(const SpringAdded *added, const SpringAddedMemory *memory)
{
    double stored = 0.0;
    for (int i = 0; i < added->branches; i++)
        stored += 0.5 * added->stiffness[i] * memory->elongation[i] * memory->elongation[i];
    return stored;
}
