/* The headers of FMI 3.0. Define FMI3_FUNCTION_PREFIX, as for any FMU in source code, to link it statically. */
#ifndef FMI3_API_H
#define FMI3_API_H

#include "fmi3Functions.h"

#define FMI_PREFIX "fmi3"
#define FMI_ERROR fmi3Error

#endif
