/* Model exchange in both versions of FMI.
 *
 * In the usual form the spring has no continuous states: its memory changes only where a point of the path is accepted,
 * and between these the force is a function of the displacement. A point is accepted when an integrator step is
 * completed, and once more at the end of event mode, where the displacement may have jumped. Trial evaluations leave no
 * trace.
 *
 * In the form with states there is no memory besides them and no event but that of `extrapolating`: their rates are
 * continuous where the velocity changes its sign, since they are proportional to it.
 */
#ifndef FMU_MODEL_EXCHANGE_H
#define FMU_MODEL_EXCHANGE_H

#include "fmu_instance.h"

SPRING_LOCAL FmuStatus fmu_enter_continuous_time(Instance *instance);

/* Accepts a point; whether `extrapolating`, which is discrete, must change, which it may at events only. */
SPRING_LOCAL FmuStatus fmu_complete_step(Instance *instance, int *needs_event);

SPRING_LOCAL FmuStatus fmu_set_time(Instance *instance, double time);

/* How many event indicators there are, 0 or 1, and their values. */
SPRING_LOCAL size_t fmu_indicators(const Instance *instance);
SPRING_LOCAL double fmu_indicator(const Instance *instance);
SPRING_LOCAL FmuStatus fmu_get_indicators(const Instance *instance, double values[]);

/* How many continuous states there are, and arrays of so many values: of the states in the order of their variables, of
 * their rates, and their nominals: the energy that the hysteretic force takes on a way through the whole range, as
 * identified, and 1. */
SPRING_LOCAL size_t fmu_states(const Instance *instance);
SPRING_LOCAL FmuStatus fmu_set_states(Instance *instance, const double values[]);
SPRING_LOCAL FmuStatus fmu_get_states(Instance *instance, double values[]);
SPRING_LOCAL FmuStatus fmu_get_rates(Instance *instance, double values[]);
SPRING_LOCAL FmuStatus fmu_get_nominals(const Instance *instance, double values[]);

#endif
