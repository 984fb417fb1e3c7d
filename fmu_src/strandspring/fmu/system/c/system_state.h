/* Everything that an instance of bodies on mounts remembers, and its serialized form. */
#ifndef SYSTEM_STATE_H
#define SYSTEM_STATE_H

#include "system_block.h"

/* Everything that an instance remembers; `motion` points to the arrays behind it. */
typedef struct {
    int mode; /* one of fmu_modes.h */
    double time, stop_time; /* [s]; stop_time is infinite if there is none */
    SystemSettings settings;
    double inputs[MOTION_CHANNELS], slopes[MOTION_CHANNELS]; /* and their derivatives for the next step */
    int is_interpolated;                                     /* whether these were set */
    int is_at_rest;                                          /* whether the rest of these settings has been found */
    int extrapolating;
    int is_outside[MOTION_AXES]; /* whether a spring was outside its range at the end of the last step */
    double rest_sway[3 * MOTION_POINTS], rest_turn[MOTION_BODIES][4];
    MotionState motion;
    MotionBodyState bodies[MOTION_BODIES];
    MotionReach reach[MOTION_AXES];
    MotionAxisState axes[MOTION_AXES];
    SpringAddedMemory added[MOTION_AXES]; /* unused where no spring has anything */
} State;

/* The part of a state that no motion has, "motion" or "springs", or NULL. */
SPRING_LOCAL const char *system_impossible_motion(const State *state);

/* Reads, writes or counts all that is serialized, in this order behind what stands before the fields of every state
 * (fmu_bytes.h). Only reading changes the state. What is not serialized is unused, or alike in all states. */
SPRING_LOCAL void fmu_state_fields(Cursor *cursor, State *state);

/* Whether no instance can have a state that has been read; the reason is then in `problem`, always terminated. */
SPRING_LOCAL int fmu_state_problem(const State *state, char *problem, size_t size);

#endif
