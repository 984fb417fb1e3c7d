/* The storage class of every function that is not one of FMI's: none, so that each file can be compiled by itself;
 * fmi2_all.c and the like make it static. */
#ifndef SPRING_LOCAL_H
#define SPRING_LOCAL_H

#if defined __FAST_MATH__ || (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__) || defined _M_FP_FAST
#error "Compile without -ffast-math and -Ofast (/fp:fast): with them a NaN would pass for a number."
#endif

/* Where SPRING_STEPS_ONLY is defined, steps are taken by tables that were made elsewhere: there is no
 * spring_tabulate, which needs a mathematics library, and tables hold no derivatives by n and sigma (those are NaN). */

/* SPRING_APART stands for it where a function must not become part of its caller, whose stack would grow, and
 * SPRING_COLD where it is rarely called besides. */
#if defined(__GNUC__)
#define SPRING_NOINLINE __attribute__((noinline, unused))
#define SPRING_RARE __attribute__((cold))
#else
#define SPRING_NOINLINE
#define SPRING_RARE
#endif

#ifdef SPRING_LOCAL
#define SPRING_APART SPRING_NOINLINE static
#else
#define SPRING_LOCAL
#define SPRING_APART SPRING_NOINLINE
#endif
#define SPRING_COLD SPRING_RARE SPRING_APART

#endif
