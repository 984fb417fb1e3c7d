/* Tables of W made for one pair (n, sigma), where SPRING_STEPS_ONLY is not defined: this needs a mathematics library. */
#ifndef SATURATION_TABLE_H
#define SATURATION_TABLE_H

#include "saturation.h"

/* What a table holds besides W and its inverse, each of which takes about half as long to fill again; and how
 * finely. */
enum {
    SPRING_WITH_DERIVATIVES = 1, /* by n and sigma */
    SPRING_WITH_ENERGIES = 2,    /* the blocks */
    SPRING_COARSE = 4            /* to 1e-8 only, in a quarter of the time */
};

/* Fills a table in a fraction of a millisecond; 0.01 <= n <= 100, 0.5 <= sigma <= 1000. */
SPRING_LOCAL void spring_tabulate(SpringTable *table, double n, double sigma, int with);

#endif
