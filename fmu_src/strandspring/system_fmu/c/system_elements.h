/* Variables of FMI 3.0 by their value references: those of system_instance.h, then the time, counted from 1. */
#ifndef SYSTEM_ELEMENTS_H
#define SYSTEM_ELEMENTS_H

static inline Elements fmi3_elements(const Instance *instance, fmi3ValueReference reference)
{
    return reference - 1 <= instance->variables ? (Elements){reference - 1, 1} : (Elements){0, 0};
}

#endif
