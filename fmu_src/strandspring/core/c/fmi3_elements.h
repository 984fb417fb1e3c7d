/* Variables of FMI 3.0 by their value references, which are those of the model description: for a spring the variables
 * in the order of fmu_variables.h, each array as one, then the time and, but for the form with states, the event
 * indicator, counted from 1: some importers read dependencies, which are value references in FMI 3.0, as the indices
 * that they are in FMI 2.0.
 *
 * Another FMU names with FMU_ELEMENTS the header that defines its fmi3_elements, and defines fmi3_name and
 * fmi3_value_beyond.
 */
#ifndef FMI3_ELEMENTS_H
#define FMI3_ELEMENTS_H

#include "fmi3_states.h"
#include "fmu_own.h"

/* The elements of one variable by their references in FMI 2.0, beyond whose last are the time and the event
 * indicator. */
typedef struct {
    unsigned first, count; /* 0: there is no such variable */
} Elements;

/* The name of the variable that an element belongs to, or of the element where FMI 2.0 has one. */
SPRING_LOCAL VariableName fmi3_name(const Instance *instance, unsigned element);

/* The value of an element beyond the last variable of FMI 2.0. */
SPRING_LOCAL double fmi3_value_beyond(const Instance *instance, unsigned element);

#ifdef FMU_ELEMENTS
#include FMU_ELEMENTS
#else
SPRING_APART Elements fmi3_elements_of_other(const Instance *instance, fmi3ValueReference reference);
static inline Elements fmi3_elements(const Instance *instance, fmi3ValueReference reference)
{
    return reference - 1 < SPRING_FIRST_PARAMETER ? (Elements){reference - 1, 1}
                                                  : fmi3_elements_of_other(instance, reference);
}

/* Neither the time nor the event indicator has derivatives. */
SPRING_LOCAL FmuStatus fmi3_require_derivable(const Instance *instance, unsigned element);
#endif

#endif
