/* The storage class of every function that is not one of FMI's: none, so that each file can be compiled by itself;
 * all.c makes it static. */
#ifndef SPRING_LOCAL_H
#define SPRING_LOCAL_H

#ifndef SPRING_LOCAL
#define SPRING_LOCAL
#endif

#endif
