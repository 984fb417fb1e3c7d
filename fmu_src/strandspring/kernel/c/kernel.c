/* The compiled kernel of the package as one unit: what travels inside FMUs, and what only the package needs. */
#define SPRING_LOCAL static

#include "../../core/c/saturation.c"
#include "../../core/c/spring.c"
#include "path.c"
