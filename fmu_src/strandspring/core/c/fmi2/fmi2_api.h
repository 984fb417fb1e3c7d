/* The headers of FMI 2.0. Define FMI2_FUNCTION_PREFIX, as for any FMU in source code, to link it statically. */
#ifndef FMI2_API_H
#define FMI2_API_H

#include "fmi2Functions.h"

#ifdef FMI2_FUNCTION_PREFIX
/* Some copies of the header, FMPy's among them, leave the prefix out. */
#undef fmi2FullName
#define FMU_PASTE(prefix, name) prefix##name
#define FMU_PREFIXED(prefix, name) FMU_PASTE(prefix, name)
#define fmi2FullName(name) FMU_PREFIXED(FMI2_FUNCTION_PREFIX, name)
#endif

/* For calls that both versions share: the names of this one. */
#define FMI(name) fmi2##name
#define FMI_PREFIX "fmi2"
typedef fmi2Component FmiInstance;

#endif
