/* The FMU of FMI 3.0 of bodies on mounts as one unit, as system_all.c is that of FMI 2.0. */
#ifndef FMU_SHARED_APART
#define SPRING_LOCAL static inline
/* Other names than in system_all.c, beside which it may stand in one program. */
#define FMU_FULL_NAME(name) fmi3FullName(fmi3_##name)
#endif

#include "../../../core/c/fmi3/fmi3_api.h"
#include "system_names.h"
#include "system_instance.h"

#include "../../../core/c/fmi3/fmi3_absent.c"
#include "../../../core/c/fmi3/fmi3_arguments.c"
#include "../../../core/c/fmi3/fmi3_life.c"
#include "system_calls3.c"
#include "system_exchange3.c"
#ifndef FMU_SHARED_APART
#include "system_shared.c"
#endif
