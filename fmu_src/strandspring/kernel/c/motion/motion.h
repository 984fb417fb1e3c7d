/* Rigid bodies on hysteretic mounts in time: explicit velocity Verlet with finite rotations, in coordinates fixed to
 * the base.
 *
 * A body has the displacement x of its centre of gravity from the nominal pose and the rotation R from its own frame to
 * the base's. V is the velocity of its centre of gravity less that of the base's origin, L its angular momentum, both
 * inertial and in components of the base's frame. With the base's acceleration a and angular velocity W, the force F
 * and the moment T about the centre of gravity,
 *
 *     V' = F/m + g - a - W x V,   L' = T - W x L,   x' = V - W x (centre + x).
 *
 * A step kicks V and L by half a step, lets the bodies drift freely over it in the inertial frame, turns all vectors
 * back by the base's rotation, and kicks again. a, W and the forces from outside are averages over the step. The
 * damper's force at the end is taken at the velocity V + h*V' foreseen at the beginning. A step ends early where a
 * spring turns or meets or leaves a stop, by the parabola of its displacement, and the rest of it follows: so the error
 * has no jumps and falls with h^2.
 *
 * The axis e of a mount is fixed to what it stands on, and its displacement is d = e.(P - Q), where P is the body's
 * place of the mount and Q the support's. Each spring is at nominal + d/S. The body takes the force -(P*r + c*d' +
 * stop) along e at P, and the support the opposite at the same place. A spring's Maxwell branches are taken over a part
 * of a step along the parabola of its displacement, from the rate at the beginning; they have no force at first.
 *
 * The caller owns all memory. One MotionSystem may be read by any number of threads at once. */
#ifndef MOTION_H
#define MOTION_H

#include "../../../core/c/spring/branches.h"

#include <stddef.h>

enum { MOTION_BODIES = 8, MOTION_AXES = 600, MOTION_POINTS = 64, MOTION_CHANNELS = 64 };
enum { MOTION_UNKNOWNS = 6 * MOTION_BODIES, MOTION_REST = 3 * MOTION_UNKNOWNS * MOTION_UNKNOWNS + MOTION_AXES };
enum { MOTION_OF_POINT = 18, MOTION_OF_AXIS = 8, MOTION_OF_BODY = 2, MOTION_OF_BASE = 4, MOTION_ENERGIES = 9 };

/* Matrices are of rows. What is held has no part in `translations` and `inverse_inertia`. */
typedef struct {
    double mass, center[3];
    double translations[9], rotations[9]; /* projectors on what is free */
    double inertia[9], inverse_inertia[9];
    double turns, is_free; /* 0 if it cannot rotate; 0 if anything is held */
} MotionBody;

/* Places on bodies are from their centres of gravity. `support` is -1 for the base. */
typedef struct {
    double place[3], support_place[3];
    double body, support, first, axes; /* counts */
} MotionMount;

/* What its springs have beside the paper's is NULL where they have nothing, and so is the law of a second mechanism. */
typedef struct {
    const SpringLaw *law, *second;
    const SpringAdded *added;
    double direction[3];
    double nominal, parallel, series;
    double damping, stop_low, stop_high, stop_stiffness;
} MotionAxis;

typedef struct {
    double place[3], body;
} MotionPoint;

/* kind: 0 acceleration of the base [m/s^2], 1 its angular velocity [rad/s], 2 force on a body [N], whose place and
 * direction turn with it. */
typedef struct {
    double direction[3], place[3], kind, body;
} MotionChannel;

/* coupled: whether the friction of the axes of each mount acts together, or each for itself. */
typedef struct {
    size_t bodies, mounts, axes, points, channels, coupled;
    const MotionBody *body;
    const MotionMount *mount;
    const MotionAxis *axis;
    const MotionPoint *point;
    const MotionChannel *channel;
} MotionSystem;

/* turn: unit quaternion, real part first; rotation: its matrix; force and torque: of the mounts, about the centre of
 * gravity; spin: angular velocity in the base's frame. */
typedef struct {
    double x[3], turn[4], V[3], L[3];
    double rotation[9], force[3], torque[3], spin[3];
} MotionBodyState;

typedef struct {
    SpringMemory memory; /* of one spring */
    double displacement, rate, force;
    double direction[3];
} MotionAxisState;

/* Where a mount acts: in the base's frame, from the body's centre of gravity, from the support's. And its force on the
 * body, dampers and stops included. */
typedef struct {
    double place[3], arm[3], support_arm[3], force[3];
} MotionReach;

typedef struct {
    double gravity[3];
    /* The base's angular velocity: its average over a part of a step; at the end of what is left of the step; its
     * slope. */
    double base_spin[3], end_spin[3], spin_slope[3];
    /* Since the beginning [J]: dissipated by dampers; work of gravity, of the base and of forces from outside; sum of
     * the absolute values of the latter two. */
    double damped, gravity_work, base_work, load_work, exchanged;
    double has_dampers, has_loads; /* 0 if there are none */
    MotionBodyState *body;
    MotionReach *reach; /* of each mount */
    MotionAxisState *axis;
    SpringAddedMemory *added; /* of one spring of each axis; may be NULL where no spring has anything */
} MotionState;

/* The state at rest in a pose of bodies (x and turn of each), with omega of each axis' springs, of both mechanisms; bodies move with a
 * velocity relative to the base's origin. */
void motion_begin(
    const MotionSystem *system, MotionState *state, const double *gravity, const double *pose, const double *omega,
    const double *velocity);

/* One step of h [s] under channel values that are averages over it. Returns 0 if a displacement is beyond
 * LARGEST_DISPLACEMENT. */
SPRING_LOCAL int motion_step(const MotionSystem *system, MotionState *state, const double *values, double h);

/* Of each point, 3 each: absolute acceleration [m/s^2] under channel values, where what is held moves with the base;
 * place in the base's frame less that in the nominal pose [m]. */
SPRING_LOCAL void motion_of_points(
    const MotionSystem *system, const MotionState *state, const double *values, double *accelerations, double *sway);

/* The pose in which all bodies rest under gravity while each axis has its omega: Levenberg and Marquardt's method from
 * the pose given, which is replaced; `state` is workspace, and so are the MOTION_REST doubles, too many for the stack
 * of a small thread. `unbalance` is what remains of the forces, and of the moments over the largest distance of a mount
 * [N]. Returns 1 if that is rounding: at most 1e-12 of the sum of the magnitudes of the forces on each body, and ten
 * roundings of a place times the stiffness. */
int motion_rest(
    const MotionSystem *system, const double *gravity, const double *omega, MotionState *state, double *pose,
    double *unbalance, double *workspace);

/* What a run gives, over all its steps; the caller's arrays.
 *
 * of_points   MOTION_OF_POINT each: largest absolute acceleration and its time; largest |ax|, |ay|, |az|; largest
 *             distance from the place at the beginning, and its three largest components; mean squares of ax, ay, az,
 *             means of the three components of the way from the beginning, and their mean squares [SI]
 * of_axes     MOTION_OF_AXIS each: least and greatest displacement of one spring; largest |force| of the axis; least
 *             and greatest omega; energy absorbed by all springs; displacement of one spring at the beginning; largest
 *             |rate|
 * of_bodies   MOTION_OF_BODY each: largest angle of rotation from the pose at the beginning [rad] and its time
 * of_mounts   largest force of each mount, its axes together
 * of_base     MOTION_OF_BASE: largest force of all mounts on the base together, and its three largest components
 * energies    kinetic at the beginning and the end, absorbed by springs, damped, in stops, work of gravity, of the
 *             base, of forces; sum of the absolute values of what was exchanged
 * accelerations, sway (3 per point), displacements (of one spring), forces (of the axis) at the beginning and every
 * `stride` steps; after_jumps: the accelerations once a channel has jumped there
 * workspace   motion_workspace doubles
 *
 * Means are taken from step `settled` on, by the trapezoidal rule. A step may end early at so many `turns` of springs. */
typedef struct {
    double *of_points, *of_axes, *of_bodies, *of_mounts, *of_base, *energies;
    double *accelerations, *after_jumps, *sway, *displacements, *forces, *workspace;
    size_t stride, settled, turns;
} MotionRecord;

/* Doubles of workspace of a record. */
size_t motion_workspace(size_t bodies, size_t mounts, size_t axes, size_t points);

/* `count` steps of h; values: a row of `count` for each channel. Returns the number of steps done: fewer if the motion
 * diverges. */
size_t motion_run(
    const MotionSystem *system, MotionState *state, size_t count, double h, const double *values, MotionRecord *record);

/* Force of the mounts on the base. */
SPRING_LOCAL void motion_reaction(const MotionSystem *system, const MotionState *state, double *force);

/* Energy absorbed by all springs of an axis since the beginning, what they hold included [J]. */
SPRING_LOCAL double motion_absorbed(const MotionSystem *system, const MotionState *state, size_t axis);

/* The sense of a static force: -1, or 1 also where rounding is all there is. */
double motion_sense(const MotionAxis *axis, double force);

#endif
