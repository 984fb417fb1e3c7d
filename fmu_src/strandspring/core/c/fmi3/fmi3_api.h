/* The headers of FMI 3.0. Define FMI3_FUNCTION_PREFIX, as for any FMU in source code, to link it statically. */
#ifndef FMI3_API_H
#define FMI3_API_H

#include "fmi3Functions.h"

/* For calls that both versions share: the names of this one. */
#define FMI(name) fmi3##name
#define FMI_PREFIX "fmi3"
typedef fmi3Instance FmiInstance;

#endif
