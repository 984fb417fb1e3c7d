#include "branches.h"

void spring_maxwell_path(double stiffness, double time_constant, size_t count, const double *displacement,
                         const double *time, double *force, double *energy, double *stored)
{
    const SpringMaxwell branch = {stiffness, time_constant};
    double present = 0.0, work = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (i > 0) {
            double travel = displacement[i] - displacement[i - 1];
            SpringDecay decay = spring_decay((time[i] - time[i - 1]) / time_constant);
            work += spring_maxwell_work(&branch, &decay, present, travel);
            present = spring_maxwell_after(&branch, &decay, present, travel);
        }
        force[i] += present;
        if (energy != NULL)
            energy[i] += work;
        if (stored != NULL)
            stored[i] += spring_maxwell_stored(&branch, present);
    }
}

void spring_maxwell_columns(size_t branches, const double *time_constant, size_t count, const double *displacement,
                            const double *time, double *force, double *by_log)
{
    const SpringMaxwell unit = {.stiffness = 1.0};
    for (size_t k = 0; k < branches; k++) {
        double present = 0.0, change = 0.0;
        for (size_t i = 0; i < count; i++) {
            if (i > 0) {
                double travel = displacement[i] - displacement[i - 1], q = (time[i] - time[i - 1]) / time_constant[k];
                SpringDecay decay = spring_decay(q);
                /* d(rest)/d(ln tau) = q*rest and d(mean)/d(ln tau) = mean - rest, without cancellation where q is
                 * small. */
                double of_mean = q < 1.0 ? q * (decay.mean - decay.ramp) : decay.mean - decay.rest;
                change = decay.rest * (change + q * present) + of_mean * travel;
                present = spring_maxwell_after(&unit, &decay, present, travel);
            }
            force[k * count + i] = present;
            if (by_log != NULL)
                by_log[k * count + i] = change;
        }
    }
}
