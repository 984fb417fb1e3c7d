/* What the files of motion.h share. */
#ifndef MOTION_PARTS_H
#define MOTION_PARTS_H

#include "motion.h"
#include "vectors.h"

/* Directions of the axes in the nominal pose, which those on the base keep. */
SPRING_LOCAL void motion_set_directions(const MotionSystem *system, MotionState *state);

/* Reach of all mounts, direction of the axes on bodies, and displacement of all axes in the pose of the bodies. */
SPRING_LOCAL void motion_place_axes(const MotionSystem *system, MotionState *state, double *displacements);

SPRING_LOCAL double motion_stop_force(const MotionAxis *axis, double displacement);

/* No forces of mounts; and one more that a mount exerts at its place. */
SPRING_LOCAL void motion_clear_forces(const MotionSystem *system, MotionBodyState *bodies);
SPRING_LOCAL void motion_apply(
    const MotionMount *mount, const MotionReach *reach, const double *force, MotionBodyState *bodies);

/* Takes the springs to new displacements within h [s], and the forces of all mounts and the rates of all axes at the
 * present velocities. */
SPRING_LOCAL void motion_take_forces(
    const MotionSystem *system, MotionState *state, const double *displacements, double h);
SPRING_LOCAL void motion_take_rates(const MotionSystem *system, MotionState *state);

/* The base's acceleration (kind 0) or angular velocity (1) under channel values. */
SPRING_LOCAL void motion_of_base(const MotionSystem *system, const double *values, double kind, double *motion);

/* Gives the base the angular velocity of channel values at once, which dampers and rates feel. */
SPRING_LOCAL void motion_turn_base(const MotionSystem *system, MotionState *state, const double *values);

/* Goes on by `left`, or to where the first spring turns while *turns, which then falls by 1, is above 0. Returns how
 * far; 0 if a displacement is beyond LARGEST_DISPLACEMENT. */
SPRING_LOCAL double motion_part(
    const MotionSystem *system, MotionState *state, const double *values, double left, size_t *turns);

#endif
