/* Everything an instance remembers, and its serialized form. */
#ifndef FMU_STATE_H
#define FMU_STATE_H

#include "fmu_reversal.h"
#include "fmu_variables.h"
#include "spring_number.h"
#include "spring_problem.h"

#include <stddef.h>

/* Plain numbers, so that a copy is a snapshot. */
typedef struct {
    int mode;                               /* one of fmu_modes.h */
    double time, stop_time;                 /* [s]; stop_time is infinite if there is none */
    double displacement;                    /* as set last [m] */
    double velocity, acceleration;          /* input derivatives for the next step, or the input velocity [m/s], [m/s^2] */
    int interpolated;                       /* whether they were set */
    SpringMemory memory;                    /* the committed path, once initialization has ended; or what the states say */
    SpringSensitivity sensitivity;          /* that belongs to it */
    double rate;                            /* of the displacement at the end of the last step [m/s]; absurd after a jump */
    int energy_wanted;                      /* whether absorbed_energy has been read, so that each step pays for it */
    int side;                               /* where the path ended: -1 below the range, +1 above it, 0 inside */
    int extrapolating;                      /* what the discrete output holds in continuous-time mode */
    ReversalWatch watch;                    /* of model exchange */
    Settings settings;
} State;

/* The size of the serialized form, which is the same for all states of one FMU. */
SPRING_LOCAL size_t fmu_state_size(void);

SPRING_LOCAL void fmu_state_write(const State *state, unsigned char *bytes);

/* Reads a state written by the same FMU, and checks that it can be one. Returns 0, or 1 with the reason in `problem`
 * (always terminated) if it is none; *state is then undefined. */
SPRING_LOCAL int fmu_state_read(
    State *state, const unsigned char *bytes, size_t size, char *problem, size_t problem_size);

#endif
