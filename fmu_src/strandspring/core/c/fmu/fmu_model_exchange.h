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

/* How many event indicators there are, 0 or 1, and its value. */
SPRING_LOCAL size_t fmu_indicators(const Instance *instance);
SPRING_LOCAL double fmu_indicator(const Instance *instance);

/* How many continuous states there are. */
SPRING_LOCAL size_t fmu_states(const Instance *instance);

#endif
