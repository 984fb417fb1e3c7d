/* Derivatives of outputs and of rates of states, by elements of variables; what both versions of FMI refuse. */
#ifndef FMU_DERIVATIVES_H
#define FMU_DERIVATIVES_H

#include "fmu_instance.h"

/* What derivatives are made of where the path to the displacement set last ends, or where the states are. */
typedef struct {
    SpringGradient of_force, of_stiffness;
    SpringOmegaSlope slope;
    double force;
} Gradients;

/* An unknown must be an output or the rate of a state; a known an input, a state or a parameter. `absorbed_energy` is
 * the sum over a path, of which derivatives by parameters are not kept. */
SPRING_LOCAL FmuStatus fmu_require_unknown(const Instance *instance, unsigned unknown);
SPRING_LOCAL FmuStatus fmu_require_known(const Instance *instance, unsigned known);
SPRING_LOCAL FmuStatus fmu_require_pair(const Instance *instance, unsigned unknown, unsigned known);
SPRING_LOCAL FmuStatus fmu_require_seed(const Instance *instance, unsigned reference, double seed);
/* Sums with huge seeds may overflow. */
SPRING_LOCAL FmuStatus fmu_require_sum(const Instance *instance, unsigned reference, double sum);

SPRING_LOCAL FmuStatus fmu_gradients(Instance *instance, Gradients *at);
SPRING_LOCAL double fmu_partial(const Instance *instance, const Gradients *at, unsigned unknown, unsigned known);

/* Derivatives by time of outputs at the end of the last step, whatever displacement has been set since: first of all
 * whether the output has one of this order, then d(output)/dt. */
SPRING_LOCAL FmuStatus fmu_require_rate(const Instance *instance, unsigned output, int order);
SPRING_LOCAL FmuStatus fmu_gradients_of_path(Instance *instance, Gradients *at);
SPRING_LOCAL double fmu_rate(const Instance *instance, const Gradients *at, unsigned output);

#endif
