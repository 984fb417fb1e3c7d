/* The FMU of bodies on mounts as one unit. No name but those of FMI's functions leaves it, as with core/c/all.c, but for two of the
 * kernel, which therefore take the prefix of FMI's functions. */
#define SPRING_LOCAL static inline
#define FMU_INSTANCE "../../system_fmu/c/system_instance.h"

#include "../../core/c/fmi2_api.h"

#ifdef FMI2_FUNCTION_PREFIX
#define motion_begin FMU_PREFIXED(FMI2_FUNCTION_PREFIX, motion_begin)
#define motion_rest FMU_PREFIXED(FMI2_FUNCTION_PREFIX, motion_rest)
#define motion_sense FMU_PREFIXED(FMI2_FUNCTION_PREFIX, motion_sense)
#define motion_sizes FMU_PREFIXED(FMI2_FUNCTION_PREFIX, motion_sizes)
#endif

#include "../../core/c/fmi2_arguments.c"
#include "../../core/c/fmi2_fmustate.c"
#include "../../core/c/fmi2_life.c"
#include "../../core/c/fmi2_log.c"
#include "../../core/c/fmu_bytes.c"
#include "../../core/c/fmu_life.c"
#include "../../core/c/fmu_log.c"
#include "../../core/c/fmu_modes.c"
#include "../../core/c/fmu_snapshots.c"
#include "../../core/c/fmu_tables.c"
#include "../../core/c/saturation.c"
#include "../../core/c/saturation_lookup.c"
#include "../../core/c/spline.c"
#include "../../core/c/spring.c"
#include "../../kernel/c/linear.c"
#include "../../kernel/c/motion.c"
#include "../../kernel/c/motion_rest.c"
#include "system_block.c"
#include "system_calls.c"
#include "system_instance.c"
#include "system_state.c"
