/* Functions of the kernel that are not static; they take the prefix of FMI's functions, which FMU_FULL_NAME puts before
 * a name, so that several FMUs can be linked into one program. */
#ifndef SYSTEM_NAMES_H
#define SYSTEM_NAMES_H

#ifdef FMU_FULL_NAME
#define motion_begin FMU_FULL_NAME(motion_begin)
#define motion_rest FMU_FULL_NAME(motion_rest)
#define motion_sense FMU_FULL_NAME(motion_sense)
#endif

#endif
