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

/* The calls, by the names that a version of FMI gives them. */
#define FMU_SNAPSHOT_CALLS(take, return_to, release, size_of, write, read) \
    FMU_CALL(take, (FmiInstance c, void **state), fmu_take_snapshot(instance, FMI_PREFIX #take, state)) \
    FMU_CALL(return_to, (FmiInstance c, void *state), fmu_return_to_snapshot(instance, FMI_PREFIX #return_to, state)) \
    FMU_CALL(release, (FmiInstance c, void **state), fmu_free_snapshot(instance, FMI_PREFIX #release, state)) \
    FMU_CALL(size_of, (FmiInstance c, void *state, size_t *size), \
             fmu_size_of_snapshot(instance, FMI_PREFIX #size_of, state, size)) \
    FMU_CALL(write, (FmiInstance c, void *state, FMI(Byte) bytes[], size_t size), \
             fmu_write_snapshot(instance, FMI_PREFIX #write, state, (unsigned char *)bytes, size)) \
    FMU_CALL(read, (FmiInstance c, const FMI(Byte) bytes[], size_t size, void **state), \
             fmu_read_snapshot(instance, FMI_PREFIX #read, (const unsigned char *)bytes, size, state))

#endif
