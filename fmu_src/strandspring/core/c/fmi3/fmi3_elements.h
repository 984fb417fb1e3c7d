/* Variables of FMI 3.0 by their value references, which are those of the model description: for a spring the variables
 * in the order of fmu_variables.h, each array as one if there are arrays, then the time and, but for the form with states, the event
 * indicator, counted from 1: some importers read dependencies, which are value references in FMI 3.0, as the indices
 * that they are in FMI 2.0.
 * Those of a spring are in fmi3_elements.c; another FMU defines functions of its own.
 */
#ifndef FMI3_ELEMENTS_H
#define FMI3_ELEMENTS_H

#include "fmi3_states.h"
#include "../fmi/fmu_interface.h"

/* The name of the variable that an element belongs to, or of the element where FMI 2.0 has one. */
SPRING_LOCAL VariableName fmi3_name(const Instance *instance, unsigned element);

/* The value of an element beyond the last variable of FMI 2.0. */
SPRING_LOCAL double fmi3_value_beyond(const Instance *instance, unsigned element);

SPRING_LOCAL Elements fmi3_elements(const Instance *instance, fmi3ValueReference reference);

#endif
