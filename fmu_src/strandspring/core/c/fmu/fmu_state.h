/* Everything an instance remembers, and its serialized form. */
#ifndef FMU_STATE_H
#define FMU_STATE_H

#include "../fmi/fmu_bytes.h"
#include "fmu_watch.h"
#include "../spring/resolution.h"
#include "fmu_variables.h"

/* Plain numbers, so that a copy is a snapshot. */
typedef struct {
    int mode;                           /* one of fmu_modes.h */
    double time, stop_time;             /* [s]; stop_time is infinite if there is none */
    double displacement;                /* as set last [m] */
    double velocity, acceleration;      /* input derivatives for the next step, or the input velocity [m/s], [m/s^2] */
    int interpolated;                   /* whether they were set */
    SpringMemory memory;                /* the committed path, once initialization has ended; or what the states say */
    SpringSensitivity sensitivity;      /* that belongs to it */
    SpringResolver resolver;            /* with input_resolution: where that path is and the friction */
    double rate;                        /* of the displacement at the end of the last step [m/s]; absurd after a jump */
    int energy_wanted;                  /* whether absorbed_energy has been read, so that each step pays for it */
    int side;                           /* where the path ended: -1 below the range, +1 above it, 0 inside */
    int extrapolating;                  /* what the discrete output holds in continuous-time mode */
    ReversalWatch watch;                /* of model exchange */
    SpringAddedMemory added;            /* of a second mechanism and of branches */
    Settings settings;
} State;

/* Reads, writes or counts all that is serialized, in this order behind what stands before the fields of every state
 * (fmu_bytes.h). Only reading changes the state. What is not serialized is unused, or alike in all states. */
SPRING_LOCAL void fmu_state_fields(Cursor *cursor, State *state);

/* Whether no instance can have a state that has been read; the reason is then in `problem`, always terminated. */
SPRING_LOCAL int fmu_state_problem(const State *state, char *problem, size_t size);

#endif
