/* Model exchange in both versions of FMI.
 *
 * In the usual form the spring has no continuous states: its memory changes only where a point of the path is accepted, and between
 * these the force is a function of the displacement. A point is accepted when an integrator step is completed, and once more
 * at the end of event mode, where the displacement may have jumped. Trial evaluations leave no trace.
 *
 * In the form with states there is no memory besides them and no event but that of `extrapolating`: their rates are
 * continuous where the velocity changes its sign, since they are proportional to it.
 */
#ifndef FMU_MODEL_EXCHANGE_H
#define FMU_MODEL_EXCHANGE_H

#include "fmu_instance.h"

enum { FMU_MOST_STATES = 2 };

SPRING_LOCAL FmuStatus fmu_enter_continuous_time(Instance *instance);

/* Accepts a point; whether `extrapolating`, which is discrete, must change, which it may at events only. */
SPRING_LOCAL FmuStatus fmu_complete_step(Instance *instance, int *needs_event);

SPRING_LOCAL FmuStatus fmu_set_time(Instance *instance, double time);

/* How many there are, 0 or 1, and its value. */
SPRING_LOCAL int fmu_indicators(const Instance *instance);
SPRING_LOCAL double fmu_indicator(const Instance *instance);

/* How many there are, and of each its variable, that of its rate, and its nominal value. */
SPRING_LOCAL int fmu_states(const Instance *instance);
SPRING_LOCAL unsigned fmu_state(int i);
SPRING_LOCAL unsigned fmu_state_rate(const Instance *instance, int i);
SPRING_LOCAL double fmu_state_nominal(int i);

#endif
