/* What is not a spring, in words; apart from spring.c because it needs the C library, which a step does not. */
#ifndef SPRING_PROBLEM_H
#define SPRING_PROBLEM_H

#include "spring.h"

#include <stddef.h>

/* The first reason why parameters, which are finite and as many as a spring has, are not a physically possible spring,
 * written into text (always terminated), in the words of spring_parameters() in variables.py. Returns 0 if they are
 * possible, else 1. */
SPRING_LOCAL int spring_problem(const SpringParameters *parameters, char *text, size_t size);

#endif
