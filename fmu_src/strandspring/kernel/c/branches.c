#include "branches.h"

void spring_maxwell_path(double stiffness, double time_constant, size_t count, const double *displacement,
                         const double *time, double *force, double *energy, double *stored)
{
    double elongation = 0.0, work = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (i > 0) {
            double travel = displacement[i] - displacement[i - 1];
            SpringDecay decay = spring_decay((time[i] - time[i - 1]) / time_constant);
            work += spring_maxwell_work(&decay, elongation, travel);
            elongation = spring_maxwell_after(&decay, elongation, travel);
        }
        force[i] += stiffness * elongation;
        energy[i] += stiffness * work;
        stored[i] += 0.5 * stiffness * elongation * elongation;
    }
}

void spring_maxwell_columns(size_t branches, const double *time_constant, size_t count, const double *displacement,
                            const double *time, double *elongation, double *by_log)
{
    for (size_t k = 0; k < branches; k++) {
        double present = 0.0, change = 0.0;
        for (size_t i = 0; i < count; i++) {
            if (i > 0) {
                double travel = displacement[i] - displacement[i - 1], q = (time[i] - time[i - 1]) / time_constant[k];
                SpringDecay decay = spring_decay(q);
                change = spring_maxwell_by_log(&decay, q, change, present, travel);
                present = spring_maxwell_after(&decay, present, travel);
            }
            elongation[k * count + i] = present;
            by_log[k * count + i] = change;
        }
    }
}
