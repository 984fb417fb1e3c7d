/* States of the FMU that the host holds. The calls of both versions of FMI are these, once they are allowed. */
#ifndef FMU_SNAPSHOTS_H
#define FMU_SNAPSHOTS_H

#include "fmu_interface.h"

#include <stddef.h>

/* `call` names the call for messages. A state given by the host must be one of this FMU; a state that is taken or read
 * goes where `held` points, into the memory of the one that is there, if any. */
SPRING_LOCAL FmuStatus fmu_take_snapshot(const Instance *instance, const char *call, void **held);
SPRING_LOCAL FmuStatus fmu_return_to_snapshot(Instance *instance, const char *call, const void *held);
SPRING_LOCAL FmuStatus fmu_free_snapshot(const Instance *instance, const char *call, void **held);
SPRING_LOCAL FmuStatus fmu_size_of_snapshot(const Instance *instance, const char *call, const void *held, size_t *size);
SPRING_LOCAL FmuStatus fmu_write_snapshot(
    const Instance *instance, const char *call, const void *held, unsigned char *bytes, size_t size);
SPRING_LOCAL FmuStatus fmu_read_snapshot(
    const Instance *instance, const char *call, const unsigned char *bytes, size_t size, void **held);

#endif
