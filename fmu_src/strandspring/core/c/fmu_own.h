/* What an FMU has of its own, for the files that the FMU of a spring and that of a system share: by default a spring's.
 *
 * FMU_INSTANCE names the header that defines
 *
 *     Instance            with `log`, `variables` and `state`
 *     State               with `mode`, `time` and `stop_time`; a copy of it is a snapshot
 *     fmu_type, fmu_variable_name, fmu_identity
 *     fmu_begin, fmu_end_initialization, fmu_read, fmu_read_extrapolating, fmu_restore
 *     fmu_state_size, fmu_state_write, fmu_state_read
 */
#ifndef FMU_OWN_H
#define FMU_OWN_H

#ifdef FMU_INSTANCE
#include FMU_INSTANCE
#else
#include "fmu_instance.h"
#endif

#endif
