/* The little that a step takes from the C library: what compilers build in where there is none (-ffreestanding), as on
 * targets without an operating system. They may still call memcpy and memset, which such a target must have. */
#ifndef SPRING_LIBRARY_H
#define SPRING_LIBRARY_H

#if __STDC_HOSTED__
#include <math.h>
#include <string.h>
#else
#include <stddef.h>
#define HUGE_VAL __builtin_inff()
#define NAN __builtin_nanf("")
#define fabs __builtin_fabs
#define memcpy __builtin_memcpy
#define memset __builtin_memset
#endif

#endif
