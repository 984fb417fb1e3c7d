/* What both versions of FMI have, whose values agree; no file but fmi2_*.c and fmi3_*.c knows more of either. */
#ifndef FMU_TYPES_H
#define FMU_TYPES_H

/* An int, so that it passes for fmi2Status and fmi3Status. */
typedef int FmuStatus;
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR };

#endif
