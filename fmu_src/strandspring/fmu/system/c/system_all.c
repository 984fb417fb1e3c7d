/* The FMU of bodies on mounts as one unit. No name but those of FMI's functions leaves it, as with core/c/fmi2_all.c,
 * but for those of system_names.h. */
#ifndef FMU_SHARED_APART /* as in our own build, whose one binary for both versions of FMI has system_shared.c once */
#define SPRING_LOCAL static inline
#define FMU_FULL_NAME fmi2FullName
#endif

#include "../../../core/c/fmi2/fmi2_api.h"
#include "system_names.h"
#include "system_instance.h"

#include "../../../core/c/fmi2/fmi2_life.c"
#include "system_calls.c"
#ifndef FMU_SHARED_APART
#include "system_shared.c"
#endif
