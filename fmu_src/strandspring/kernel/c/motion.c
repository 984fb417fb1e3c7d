#include "motion.h"

#include "../../core/c/numerics.h"
#include "linear.h"

#include <math.h>
#include <string.h>

/* Of a step: a turn nearer to its ends than this needs no end of its own. */
static const double NEAR_END = 1e-3;
/* rho times the way beyond a turn that does not matter. */
static const double LEAST_OVERSHOOT = 1e-9;

/* ---- vectors -------------------------------------------------------------------------------------------------------- */

static inline double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const double *a, const double *b, double *c)
{
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    c[0] = x;
    c[1] = y;
    c[2] = z;
}

static inline void add3(double *to, double factor, const double *a)
{
    for (int i = 0; i < 3; i++)
        to[i] += factor * a[i];
}

/* matrix*a and its transpose times a. */
static inline void turn3(const double *matrix, const double *a, double *b)
{
    double x = dot3(matrix, a), y = dot3(matrix + 3, a), z = dot3(matrix + 6, a);
    b[0] = x;
    b[1] = y;
    b[2] = z;
}

static inline void turn_back3(const double *matrix, const double *a, double *b)
{
    for (int i = 0; i < 3; i++)
        b[i] = matrix[i] * a[0] + matrix[3 + i] * a[1] + matrix[6 + i] * a[2];
}

/* The quaternion of a rotation by a vector. */
static inline void quaternion_of(const double *rotation, double *q)
{
    double square = 0.25 * dot3(rotation, rotation), sine, cosine; /* of the half angle; sine over the half angle */
    if (square < 1e-4) {
        sine = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
        cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    } else {
        double half = sqrt(square);
        sine = sin(half) / half;
        cosine = cos(half);
    }
    q[0] = cosine;
    for (int i = 0; i < 3; i++)
        q[1 + i] = 0.5 * sine * rotation[i];
}

static inline void quaternion_product(const double *a, const double *b, double *product)
{
    double c[3], p[4];
    cross3(a + 1, b + 1, c);
    p[0] = a[0] * b[0] - dot3(a + 1, b + 1);
    for (int i = 0; i < 3; i++)
        p[1 + i] = a[0] * b[1 + i] + b[0] * a[1 + i] + c[i];
    memcpy(product, p, sizeof p);
}

/* The unit quaternion nearest to q, and its matrix. */
static inline void set_turn(MotionBodyState *body, const double *q)
{
    double length = sqrt(q[0] * q[0] + dot3(q + 1, q + 1));
    double w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
    const double unit[4] = {w, x, y, z};
    const double matrix[9] = {
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z),       2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),       1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),       2.0 * (y * z + w * x),       1.0 - 2.0 * (x * x + y * y)};
    memcpy(body->turn, unit, sizeof unit);
    memcpy(body->rotation, matrix, sizeof matrix);
}

/* Angular velocity in the base's frame. */
static inline void spin_of(const MotionBody *body, const MotionBodyState *state, const double *L, double *spin)
{
    double own[3];
    turn_back3(state->rotation, L, own);
    turn3(body->inverse_inertia, own, own);
    turn3(state->rotation, own, spin);
}

/* ---- kinematics of mounts ------------------------------------------------------------------------------------------- */

static void reach_of(
    const MotionSystem *system, const MotionMount *mount, const MotionBodyState *bodies, MotionReach *reach)
{
    const MotionBody *body = system->body + (int)mount->body;
    const MotionBodyState *state = bodies + (int)mount->body;
    turn3(state->rotation, mount->place, reach->arm);
    for (int i = 0; i < 3; i++)
        reach->place[i] = body->center[i] + state->x[i] + reach->arm[i];
    if (mount->support < 0.0) {
        for (int i = 0; i < 3; i++)
            reach->between[i] = reach->place[i] - mount->support_place[i];
        return;
    }
    const MotionBody *support = system->body + (int)mount->support;
    const MotionBodyState *under = bodies + (int)mount->support;
    double place[3];
    turn3(under->rotation, mount->support_place, place);
    for (int i = 0; i < 3; i++) {
        reach->support_arm[i] = reach->place[i] - support->center[i] - under->x[i];
        reach->between[i] = reach->support_arm[i] - place[i];
    }
}

static inline void direction_of(
    const MotionMount *mount, const MotionAxis *axis, const MotionBodyState *bodies, double *direction)
{
    if (mount->support < 0.0)
        memcpy(direction, axis->direction, 3 * sizeof *direction);
    else
        turn3(bodies[(int)mount->support].rotation, axis->direction, direction);
}

/* Velocity of the body's place relative to the support. */
static void velocity_between(
    const MotionMount *mount, const MotionReach *reach, const MotionState *state, double *velocity)
{
    const MotionBodyState *body = state->body + (int)mount->body;
    cross3(body->spin, reach->arm, velocity);
    add3(velocity, 1.0, body->V);
    double of_support[3];
    if (mount->support < 0.0) {
        cross3(state->base_spin, reach->place, of_support);
    } else {
        const MotionBodyState *under = state->body + (int)mount->support;
        cross3(under->spin, reach->support_arm, of_support);
        add3(of_support, 1.0, under->V);
    }
    add3(velocity, -1.0, of_support);
}

/* Reach of all mounts, direction and displacement of all axes. */
static void place_axes(const MotionSystem *system, MotionState *state, double *displacements)
{
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        MotionReach *reach = state->reach + m;
        reach_of(system, mount, state->body, reach);
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        for (size_t a = first; a < end; a++) {
            direction_of(mount, system->axis + a, state->body, state->axis[a].direction);
            displacements[a] = dot3(state->axis[a].direction, reach->between);
        }
    }
}

static inline double stop_force(const MotionAxis *axis, double displacement)
{
    if (displacement > axis->stop_high)
        return axis->stop_stiffness * axis->series * (displacement - axis->stop_high);
    if (displacement < axis->stop_low)
        return axis->stop_stiffness * axis->series * (displacement - axis->stop_low);
    return 0.0;
}

/* Adds a force that a mount exerts at its place. */
static void apply(const MotionMount *mount, const MotionReach *reach, const double *force, MotionBodyState *bodies)
{
    double moment[3];
    MotionBodyState *body = bodies + (int)mount->body;
    cross3(reach->arm, force, moment);
    add3(body->force, 1.0, force);
    add3(body->torque, 1.0, moment);
    if (mount->support < 0.0)
        return;
    MotionBodyState *under = bodies + (int)mount->support;
    cross3(reach->support_arm, force, moment);
    add3(under->force, -1.0, force);
    add3(under->torque, -1.0, moment);
}

static void clear_forces(const MotionSystem *system, MotionBodyState *bodies)
{
    for (size_t b = 0; b < system->bodies; b++) {
        memset(bodies[b].force, 0, sizeof bodies[b].force);
        memset(bodies[b].torque, 0, sizeof bodies[b].torque);
    }
}

/* ---- a step --------------------------------------------------------------------------------------------------------- */

/* Force and moment of the forces from outside on each body. */
static void loads_of(
    const MotionSystem *system, const MotionBodyState *bodies, const double *values, double (*force)[3],
    double (*torque)[3])
{
    memset(force, 0, system->bodies * sizeof *force);
    memset(torque, 0, system->bodies * sizeof *torque);
    for (size_t c = 0; c < system->channels; c++) {
        const MotionChannel *channel = system->channel + c;
        if (channel->kind < 2.0)
            continue;
        int b = (int)channel->body;
        double direction[3], arm[3], moment[3];
        turn3(bodies[b].rotation, channel->direction, direction);
        turn3(bodies[b].rotation, channel->place, arm);
        cross3(arm, direction, moment);
        add3(force[b], values[c], direction);
        add3(torque[b], values[c], moment);
    }
}

/* The base's acceleration or angular velocity. */
static void base_motion(const MotionSystem *system, const double *values, double kind, double *motion)
{
    memset(motion, 0, 3 * sizeof *motion);
    for (size_t c = 0; c < system->channels; c++)
        if (system->channel[c].kind == kind)
            add3(motion, values[c], system->channel[c].direction);
}

static void set_spins(const MotionSystem *system, MotionState *state)
{
    for (size_t b = 0; b < system->bodies; b++)
        if (system->body[b].turns != 0.0)
            spin_of(system->body + b, state->body + b, state->body[b].L, state->body[b].spin);
}

/* Kicks the bodies by the mounts' forces, gravity, the base and the forces from outside over h, and counts the work of the
 * latter three. Writes the change of V and L. */
static void kick(
    const MotionSystem *system, MotionState *state, const double *acceleration, const double *values, double h,
    double (*change)[6])
{
    double force[MOTION_BODIES][3], torque[MOTION_BODIES][3];
    loads_of(system, state->body, values, force, torque);
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        MotionBodyState *own = state->body + b;
        double push[3], moment[3], mean[3], spins[3] = {0.0, 0.0, 0.0}, after[3];
        for (int i = 0; i < 3; i++) {
            push[i] = h * ((own->force[i] + force[b][i]) / body->mass + state->gravity[i] - acceleration[i]);
            moment[i] = h * (own->torque[i] + torque[b][i]);
        }
        turn3(body->translations, push, change[b]);
        turn3(body->rotations, moment, change[b] + 3);
        for (int i = 0; i < 3; i++) {
            mean[i] = own->V[i] + 0.5 * change[b][i];
            own->V[i] += change[b][i];
        }
        double of_load = h * dot3(force[b], mean), of_base = -h * body->mass * dot3(acceleration, mean);
        if (body->turns != 0.0) {
            spin_of(body, own, own->L, spins);
            add3(own->L, 1.0, change[b] + 3);
            spin_of(body, own, own->L, after);
            add3(spins, 1.0, after);
            of_load += 0.5 * h * dot3(torque[b], spins);
        }
        state->gravity_work += h * body->mass * dot3(state->gravity, mean);
        state->base_work += of_base;
        state->load_work += of_load;
        state->exchanged += fabs(of_base + of_load);
    }
}

/* Free motion of the bodies over h in the inertial frame, in components of the base's frame at its end. */
static void drift(const MotionSystem *system, MotionState *state, double h)
{
    double back[3], q[4], base[9];
    int turns = state->base_spin[0] != 0.0 || state->base_spin[1] != 0.0 || state->base_spin[2] != 0.0;
    if (turns) {
        MotionBodyState frame;
        for (int i = 0; i < 3; i++)
            back[i] = -h * state->base_spin[i];
        quaternion_of(back, q);
        set_turn(&frame, q);
        memcpy(base, frame.rotation, sizeof base);
        turn3(base, state->gravity, state->gravity);
    }
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        MotionBodyState *own = state->body + b;
        add3(own->x, h, own->V);
        double turn[4];
        memcpy(turn, own->turn, sizeof turn);
        if (body->turns != 0.0) {
            /* The midpoint's angular velocity, where L is constant: in the body's frame L turns by -h/2 times the velocity. */
            double momentum[3], spin[3], turned[3], twice[3], step[4];
            turn_back3(own->rotation, own->L, momentum);
            turn3(body->inverse_inertia, momentum, spin);
            cross3(spin, momentum, turned);
            cross3(spin, turned, twice);
            add3(momentum, -0.5 * h, turned);
            add3(momentum, 0.125 * h * h, twice);
            turn3(body->inverse_inertia, momentum, spin);
            for (int i = 0; i < 3; i++)
                spin[i] *= h;
            quaternion_of(spin, step);
            quaternion_product(turn, step, turn);
        }
        if (turns) {
            double place[3];
            for (int i = 0; i < 3; i++)
                place[i] = body->center[i] + own->x[i];
            turn3(base, place, place);
            for (int i = 0; i < 3; i++)
                own->x[i] = place[i] - body->center[i];
            turn3(base, own->V, own->V);
            turn3(base, own->L, own->L);
            quaternion_product(q, turn, turn);
        }
        if (turns || body->turns != 0.0)
            set_turn(own, turn);
    }
}

/* When the first spring turns on the way to new displacements, after s < h; h if none does. */
static double first_turn(const MotionSystem *system, const MotionState *state, const double *displacements, double h)
{
    double first = h;
    for (size_t a = 0; a < system->axes; a++) {
        double rate = state->axis[a].rate, bend = (displacements[a] - state->axis[a].displacement) / h - rate;
        /* The rate at the end is rate + 2*bend. */
        if (rate * (rate + 2.0 * bend) >= 0.0)
            continue;
        double s = -0.5 * rate / bend * h;
        const SpringLaw *law = system->axis[a].law;
        double way = 0.5 * fabs(rate) * s, beyond = fabs(bend) * (h - s) * (h - s) / h;
        double least = LEAST_OVERSHOOT * system->axis[a].series / law->parameters.rho;
        if (NEAR_END * h < s && s < (1.0 - NEAR_END) * h && s < first && way > least && beyond > least)
            first = s;
    }
    return first;
}

/* Moment of the mounts on the base about its origin, less the sign. */
static void moment_on_bodies(const MotionSystem *system, const MotionState *state, double *moment)
{
    memset(moment, 0, 3 * sizeof *moment);
    for (size_t b = 0; b < system->bodies; b++) {
        double place[3], about[3];
        for (int i = 0; i < 3; i++)
            place[i] = system->body[b].center[i] + state->body[b].x[i];
        cross3(place, state->body[b].force, about);
        add3(moment, 1.0, about);
        add3(moment, 1.0, state->body[b].torque);
    }
}

/* Takes the springs to new displacements, and the forces of all mounts at the present velocities. */
static void take_forces(const MotionSystem *system, MotionState *state, const double *displacements)
{
    clear_forces(system, state->body);
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        double force[3] = {0.0, 0.0, 0.0}, velocity[3];
        int is_known = 0;
        for (size_t a = first; a < end; a++) {
            const MotionAxis *axis = system->axis + a;
            MotionAxisState *own = state->axis + a;
            own->displacement = displacements[a];
            double displacement = axis->nominal + displacements[a] / axis->series;
            spring_commit(axis->law, &own->memory, NULL, displacement);
            own->force = axis->parallel * spring_force(axis->law, &own->memory) + stop_force(axis, displacement);
            if (axis->damping != 0.0) {
                if (!is_known)
                    velocity_between(mount, state->reach + m, state, velocity);
                is_known = 1;
                own->force += axis->damping * dot3(own->direction, velocity);
            }
            add3(force, -own->force, own->direction);
        }
        apply(mount, state->reach + m, force, state->body);
    }
}

static void take_rates(const MotionSystem *system, MotionState *state)
{
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        double velocity[3];
        velocity_between(mount, state->reach + m, state, velocity);
        for (size_t a = first; a < end; a++)
            state->axis[a].rate = dot3(state->axis[a].direction, velocity);
    }
}

/* Goes on by `left`, or to where the first spring turns while *turns, which then falls by 1, is above 0. Returns how far; 0 if
 * a displacement is beyond LARGEST_DISPLACEMENT. */
static double part_of_step(
    const MotionSystem *system, MotionState *state, const double *values, double left, size_t *turns)
{
    double acceleration[3], moment[3] = {0.0, 0.0, 0.0}, displacements[MOTION_AXES], change[MOTION_BODIES][6];
    MotionBodyState bodies[MOTION_BODIES];
    size_t all = system->bodies * sizeof *bodies;
    base_motion(system, values, 0.0, acceleration);
    base_motion(system, values, 1.0, state->base_spin);
    int is_turning = dot3(state->base_spin, state->base_spin) > 0.0;
    if (is_turning)
        moment_on_bodies(system, state, moment);

    MotionState before = *state;
    memcpy(bodies, state->body, all);
    double part = left;
    for (;;) {
        kick(system, state, acceleration, values, 0.5 * part, change);
        drift(system, state, part);
        place_axes(system, state, displacements);
        double turn = *turns > 0 ? first_turn(system, state, displacements, part) : part;
        if (turn == part)
            break;
        --*turns;
        part = turn;
        *state = before;
        memcpy(state->body, bodies, all);
    }
    for (size_t a = 0; a < system->axes; a++) {
        MotionAxisState *own = state->axis + a;
        if (!(fabs(displacements[a]) <= LARGEST_DISPLACEMENT))
            return 0.0;
        own->mean_rate = (displacements[a] - own->displacement) / part;
        own->rate_before = own->rate;
    }

    /* Forces at the velocities foreseen; the kick goes on from those at half the step. */
    memcpy(bodies, state->body, all);
    for (size_t b = 0; b < system->bodies; b++) {
        add3(state->body[b].V, 1.0, change[b]);
        add3(state->body[b].L, 1.0, change[b] + 3);
    }
    set_spins(system, state);
    take_forces(system, state, displacements);
    for (size_t b = 0; b < system->bodies; b++) {
        memcpy(state->body[b].V, bodies[b].V, sizeof bodies[b].V);
        memcpy(state->body[b].L, bodies[b].L, sizeof bodies[b].L);
    }
    kick(system, state, acceleration, values, 0.5 * part, change);
    set_spins(system, state);
    take_rates(system, state);

    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxisState *own = state->axis + a;
        if (system->axis[a].damping == 0.0)
            continue;
        double begin = own->rate_before, middle = own->mean_rate, end = own->rate;
        state->damped += system->axis[a].damping * part / 6.0 * (begin * begin + 4.0 * middle * middle + end * end);
    }
    if (is_turning) {
        double after[3];
        moment_on_bodies(system, state, after);
        add3(moment, 1.0, after);
        double work = 0.5 * part * dot3(state->base_spin, moment);
        state->base_work += work;
        state->exchanged += fabs(work);
    }
    return part;
}

int motion_step(const MotionSystem *system, MotionState *state, const double *values, double h)
{
    size_t turns = system->axes + 1;
    for (double left = h; left > 0.0;) {
        double part = part_of_step(system, state, values, left, &turns);
        if (part == 0.0)
            return 0;
        left -= part;
    }
    return 1;
}

void motion_begin(
    const MotionSystem *system, MotionState *state, const double *gravity, const double *pose, const double *omega,
    const double *velocity)
{
    double displacements[MOTION_AXES];
    memset(state->base_spin, 0, sizeof state->base_spin);
    state->damped = state->gravity_work = state->base_work = state->load_work = state->exchanged = 0.0;
    memcpy(state->gravity, gravity, sizeof state->gravity);
    for (size_t b = 0; b < system->bodies; b++) {
        MotionBodyState *body = state->body + b;
        memset(body, 0, sizeof *body);
        memcpy(body->x, pose + 7 * b, sizeof body->x);
        set_turn(body, pose + 7 * b + 3);
        turn3(system->body[b].translations, velocity, body->V);
    }
    place_axes(system, state, displacements);
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxis *axis = system->axis + a;
        state->axis[a].memory = spring_start(axis->nominal + displacements[a] / axis->series, omega[a]);
    }
    take_forces(system, state, displacements);
    take_rates(system, state);
}

/* ---- what is asked for ---------------------------------------------------------------------------------------------- */

void motion_accelerations(
    const MotionSystem *system, const MotionState *state, const double *values, double *accelerations)
{
    double force[MOTION_BODIES][3], torque[MOTION_BODIES][3], linear[MOTION_BODIES][3], angular[MOTION_BODIES][3];
    loads_of(system, state->body, values, force, torque);
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        const MotionBodyState *own = state->body + b;
        for (int i = 0; i < 3; i++)
            force[b][i] = (own->force[i] + force[b][i]) / body->mass + state->gravity[i];
        turn3(body->translations, force[b], linear[b]);
        memset(angular[b], 0, sizeof angular[b]);
        if (body->turns == 0.0)
            continue;
        /* Euler's equations in the body's frame. */
        double moment[3], momentum[3], spin[3], gyroscopic[3];
        add3(torque[b], 1.0, own->torque);
        turn_back3(own->rotation, torque[b], moment);
        turn_back3(own->rotation, own->spin, spin);
        turn3(body->inertia, spin, momentum);
        cross3(spin, momentum, gyroscopic);
        add3(moment, -1.0, gyroscopic);
        turn3(body->inverse_inertia, moment, moment);
        turn3(own->rotation, moment, angular[b]);
    }
    for (size_t p = 0; p < system->points; p++) {
        int b = (int)system->point[p].body;
        const MotionBodyState *own = state->body + b;
        double arm[3], tangential[3], centripetal[3];
        turn3(own->rotation, system->point[p].place, arm);
        cross3(angular[b], arm, tangential);
        cross3(own->spin, arm, centripetal);
        cross3(own->spin, centripetal, centripetal);
        for (int i = 0; i < 3; i++)
            accelerations[3 * p + i] = linear[b][i] + tangential[i] + centripetal[i];
    }
}

void motion_sway(const MotionSystem *system, const MotionState *state, double *sway)
{
    for (size_t p = 0; p < system->points; p++) {
        const MotionBodyState *own = state->body + (int)system->point[p].body;
        double arm[3];
        turn3(own->rotation, system->point[p].place, arm);
        for (int i = 0; i < 3; i++)
            sway[3 * p + i] = own->x[i] + arm[i] - system->point[p].place[i];
    }
}

/* ---- a run ---------------------------------------------------------------------------------------------------------- */

/* The last three values of something whose greatest is asked for; it is smooth at the last but one unless that is sharp. */
typedef struct {
    double time[3], value[3];
    int is_sharp;
} Recent;

/* Takes a value; where the one before is the greatest of three, the vertex of the parabola through them is compared with
 * the greatest so far. */
static void watch(Recent *recent, double time, double value, int is_sharp, double *greatest, double *at)
{
    double *t = recent->time, *v = recent->value;
    for (int i = 0; i < 2; i++) {
        t[i] = t[i + 1];
        v[i] = v[i + 1];
    }
    t[2] = time;
    v[2] = value;
    if (value > *greatest) {
        *greatest = value;
        *at = time;
    }
    int was_sharp = recent->is_sharp;
    recent->is_sharp = is_sharp;
    if (was_sharp || !(v[1] >= *greatest && v[1] > v[0] && v[1] > v[2] && t[1] > t[0]))
        return;
    double left = (v[1] - v[0]) / (t[1] - t[0]), right = (v[2] - v[1]) / (t[2] - t[1]);
    double bend = (right - left) / (t[2] - t[0]), slope = left + bend * (t[1] - t[0]);
    double way = -0.5 * slope / bend;
    *greatest = v[1] + 0.5 * slope * way;
    *at = t[1] + way;
}

/* Of a point: the sizes of acceleration and way from the beginning, then those of their components. */
enum { WATCHED = 8 };

typedef struct {
    double accelerations[3 * MOTION_POINTS], sway[3 * MOTION_POINTS], start[3 * MOTION_POINTS];
    double turn[MOTION_BODIES][4];
    Recent recent[MOTION_POINTS][WATCHED], force[MOTION_AXES];
} Watch;

/* Where of_points of a point holds the greatest of each that is watched; the time of the first follows it. */
static const int GREATEST[WATCHED] = {0, 5, 2, 3, 4, 6, 7, 8};
enum { TIME_OF_GREATEST = 1, MEANS = 9 };

static double size3(const double *a)
{
    return sqrt(dot3(a, a));
}

static void watch_points(
    const MotionSystem *system, const MotionState *state, const double *loads, double time, int is_sharp, Watch *watched,
    double *of_points)
{
    motion_accelerations(system, state, loads, watched->accelerations);
    motion_sway(system, state, watched->sway);
    for (size_t p = 0; p < system->points; p++) {
        const double *acceleration = watched->accelerations + 3 * p;
        double way[3], at, *found = of_points + MOTION_OF_POINT * p;
        for (int i = 0; i < 3; i++)
            way[i] = watched->sway[3 * p + i] - watched->start[3 * p + i];
        const double sizes[WATCHED] = {size3(acceleration),   size3(way),    fabs(acceleration[0]), fabs(acceleration[1]),
                                       fabs(acceleration[2]), fabs(way[0]),  fabs(way[1]),          fabs(way[2])};
        for (int k = 0; k < WATCHED; k++)
            watch(watched->recent[p] + k, time, sizes[k], is_sharp, found + GREATEST[k],
                  k == 0 ? found + TIME_OF_GREATEST : &at);
    }
}

static void watch_axes(
    const MotionSystem *system, const MotionState *state, double time, int is_sharp, Watch *watched, double *of_axes)
{
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxisState *own = state->axis + a;
        double *found = of_axes + MOTION_OF_AXIS * a, at;
        double displacement = own->memory.displacement, omega = own->memory.omega, rate = fabs(own->rate);
        found[0] = displacement < found[0] ? displacement : found[0];
        found[1] = displacement > found[1] ? displacement : found[1];
        watch(watched->force + a, time, fabs(own->force), is_sharp, found + 2, &at);
        found[3] = omega < found[3] ? omega : found[3];
        found[4] = omega > found[4] ? omega : found[4];
        found[7] = rate > found[7] ? rate : found[7];
    }
}

/* Sine of half the angle from the beginning. */
static void watch_bodies(
    const MotionSystem *system, const MotionState *state, double time, const Watch *watched, double *of_bodies)
{
    for (size_t b = 0; b < system->bodies; b++) {
        const double *q = state->body[b].turn, *start = watched->turn[b];
        double back[4] = {start[0], -start[1], -start[2], -start[3]}, turn[4];
        if (system->body[b].turns == 0.0)
            continue;
        quaternion_product(back, q, turn);
        double sine = size3(turn + 1), *found = of_bodies + MOTION_OF_BODY * b;
        if (sine > found[0]) {
            found[0] = sine;
            found[1] = time;
        }
    }
}

static double kinetic_energy(const MotionSystem *system, const MotionState *state)
{
    double total = 0.0;
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBodyState *own = state->body + b;
        total += 0.5 * (system->body[b].mass * dot3(own->V, own->V) + dot3(own->L, own->spin));
    }
    return total;
}

static double stop_energy(const MotionSystem *system, const MotionState *state)
{
    double total = 0.0;
    for (size_t a = 0; a < system->axes; a++)
        if (system->axis[a].stop_stiffness > 0.0) {
            double force = stop_force(system->axis + a, state->axis[a].memory.displacement);
            total += 0.5 * force * force / system->axis[a].stop_stiffness;
        }
    return total;
}

static void write_row(
    const MotionSystem *system, const MotionState *state, const Watch *watched, size_t row, MotionRecord *record)
{
    size_t of_points = 3 * system->points;
    if (record->accelerations != NULL)
        memcpy(record->accelerations + row * of_points, watched->accelerations, of_points * sizeof(double));
    if (record->sway != NULL)
        memcpy(record->sway + row * of_points, watched->sway, of_points * sizeof(double));
    for (size_t a = 0; a < system->axes; a++) {
        if (record->displacements != NULL)
            record->displacements[row * system->axes + a] = state->axis[a].memory.displacement;
        if (record->forces != NULL)
            record->forces[row * system->axes + a] = state->axis[a].force;
    }
}

static void begin_record(const MotionSystem *system, const MotionState *state, Watch *watched, MotionRecord *record)
{
    memset(record->of_points, 0, MOTION_OF_POINT * system->points * sizeof(double));
    memset(record->of_axes, 0, MOTION_OF_AXIS * system->axes * sizeof(double));
    memset(record->of_bodies, 0, MOTION_OF_BODY * system->bodies * sizeof(double));
    memset(watched->recent, 0, sizeof watched->recent);
    memset(watched->force, 0, sizeof watched->force);
    motion_sway(system, state, watched->start);
    for (size_t b = 0; b < system->bodies; b++)
        memcpy(watched->turn[b], state->body[b].turn, sizeof watched->turn[b]);
    for (size_t a = 0; a < system->axes; a++) {
        double *found = record->of_axes + MOTION_OF_AXIS * a;
        found[0] = found[1] = found[6] = state->axis[a].memory.displacement;
        found[3] = found[4] = state->axis[a].memory.omega;
    }
    record->energies[0] = kinetic_energy(system, state);
    record->energies[4] = -stop_energy(system, state);
}

static void add_means(const MotionSystem *system, const MotionState *state, const Watch *watched, MotionRecord *record)
{
    for (size_t p = 0; p < system->points; p++) {
        double *sums = record->of_points + MOTION_OF_POINT * p + MEANS;
        for (int i = 0; i < 3; i++) {
            double acceleration = watched->accelerations[3 * p + i];
            double way = watched->sway[3 * p + i] - watched->start[3 * p + i];
            sums[i] += acceleration * acceleration;
            sums[3 + i] += way;
            sums[6 + i] += way * way;
        }
    }
    for (size_t a = 0; a < system->axes; a++) {
        double *found = record->of_axes + MOTION_OF_AXIS * a, displacement = state->axis[a].memory.displacement - found[6];
        found[8] += displacement;
        found[9] += displacement * displacement;
    }
}

static void end_record(
    const MotionSystem *system, const MotionState *state, size_t steps, MotionRecord *record)
{
    double per_step = 1.0 / (double)(steps > 0 ? steps : 1), absorbed = 0.0;
    for (size_t p = 0; p < system->points; p++)
        for (int i = 0; i < 9; i++)
            record->of_points[MOTION_OF_POINT * p + MEANS + i] *= per_step;
    for (size_t a = 0; a < system->axes; a++) {
        double *found = record->of_axes + MOTION_OF_AXIS * a;
        const MotionAxis *axis = system->axis + a;
        found[5] = axis->parallel * axis->series * spring_absorbed_energy(axis->law, &state->axis[a].memory);
        found[8] *= per_step;
        found[9] *= per_step;
        absorbed += found[5];
    }
    for (size_t b = 0; b < system->bodies; b++)
        record->of_bodies[MOTION_OF_BODY * b] = 2.0 * asin(clip(record->of_bodies[MOTION_OF_BODY * b], 0.0, 1.0));
    double *energies = record->energies;
    energies[1] = kinetic_energy(system, state);
    energies[2] = absorbed;
    energies[3] = state->damped;
    energies[4] += stop_energy(system, state);
    energies[5] = state->gravity_work;
    energies[6] = state->base_work;
    energies[7] = state->load_work;
    energies[8] = state->exchanged;
}

size_t motion_run(
    const MotionSystem *system, MotionState *state, size_t count, double h, const double *values, MotionRecord *record)
{
    Watch watched;
    double now[MOTION_CHANNELS], begin[MOTION_CHANNELS], end[MOTION_CHANNELS] = {0.0}, loads[MOTION_CHANNELS];
    size_t k = 0, averaged = 0;
    begin_record(system, state, &watched, record);
    for (size_t c = 0; c < system->channels; c++)
        end[c] = count > 0 ? values[c * count] : 0.0;
    watch_points(system, state, end, 0.0, 1, &watched, record->of_points);
    watch_axes(system, state, 0.0, 1, &watched, record->of_axes);
    write_row(system, state, &watched, 0, record);
    for (; k < count; k++) {
        /* Of a force from outside the accelerations show its course between the averages of the steps. */
        for (size_t c = 0; c < system->channels; c++) {
            const double *row = values + c * count;
            now[c] = row[k];
            begin[c] = end[c];
            end[c] = k + 1 < count ? 0.5 * (row[k] + row[k + 1]) : row[k];
        }
        size_t turns = system->axes + 1;
        for (double left = h; left > 0.0;) {
            double part = part_of_step(system, state, now, left, &turns);
            if (part == 0.0)
                goto diverged;
            left -= part;
            double share = 1.0 - left / h, time = h * ((double)k + share);
            for (size_t c = 0; c < system->channels; c++)
                loads[c] = begin[c] + share * (end[c] - begin[c]);
            watch_points(system, state, loads, time, left > 0.0, &watched, record->of_points);
            watch_axes(system, state, time, left > 0.0, &watched, record->of_axes);
            watch_bodies(system, state, time, &watched, record->of_bodies);
        }
        if (k >= record->settled) {
            add_means(system, state, &watched, record);
            averaged++;
        }
        if ((k + 1) % record->stride == 0)
            write_row(system, state, &watched, (k + 1) / record->stride, record);
    }
diverged:
    end_record(system, state, averaged, record);
    return k;
}

/* ---- rest ----------------------------------------------------------------------------------------------------------- */

enum { UNKNOWNS = 6 * MOTION_BODIES };

typedef struct {
    const MotionSystem *system;
    const double *gravity, *omega;
    double length; /* by which rotations are scaled [m] */
    MotionState state;
} RestProblem;

/* Forces, and moments over the length, on each body that is free to follow them. */
static void unbalanced(RestProblem *rest, double *residual)
{
    const MotionSystem *system = rest->system;
    MotionState *state = &rest->state;
    double displacements[MOTION_AXES], whole[6];
    place_axes(system, state, displacements);
    clear_forces(system, state->body);
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        double force[3] = {0.0, 0.0, 0.0};
        for (size_t a = first; a < end; a++) {
            const MotionAxis *axis = system->axis + a;
            double displacement = axis->nominal + displacements[a] / axis->series;
            SpringMemory memory = spring_start(displacement, rest->omega[a]);
            double pull = axis->parallel * spring_force(axis->law, &memory) + stop_force(axis, displacement);
            add3(force, -pull, state->axis[a].direction);
        }
        apply(mount, state->reach + m, force, state->body);
    }
    for (size_t b = 0; b < system->bodies; b++) {
        for (int i = 0; i < 3; i++) {
            whole[i] = state->body[b].force[i] + system->body[b].mass * rest->gravity[i];
            whole[3 + i] = state->body[b].torque[i] / rest->length;
        }
        turn3(system->body[b].translations, whole, residual + 6 * b);
        turn3(system->body[b].rotations, whole + 3, residual + 6 * b + 3);
    }
}

/* Moves the bodies by small translations and rotations. */
static void displace(RestProblem *rest, const double *way)
{
    for (size_t b = 0; b < rest->system->bodies; b++) {
        double translation[3], rotation[3], q[4], turn[4];
        turn3(rest->system->body[b].translations, way + 6 * b, translation);
        turn3(rest->system->body[b].rotations, way + 6 * b + 3, rotation);
        add3(rest->state.body[b].x, 1.0, translation);
        for (int i = 0; i < 3; i++)
            rotation[i] /= rest->length;
        quaternion_of(rotation, q);
        quaternion_product(q, rest->state.body[b].turn, turn);
        set_turn(rest->state.body + b, turn);
    }
}

/* Derivatives of the residual by central differences, a row for each unknown; lost digits do no harm, since the residual
 * decides. */
static void rest_jacobian(RestProblem *rest, size_t count, double step, double *jacobian)
{
    double way[UNKNOWNS] = {0.0}, low[UNKNOWNS], high[UNKNOWNS];
    MotionBodyState bodies[MOTION_BODIES];
    size_t all = rest->system->bodies * sizeof *bodies;
    memcpy(bodies, rest->state.body, all);
    for (size_t i = 0; i < count; i++) {
        way[i] = step;
        displace(rest, way);
        unbalanced(rest, high);
        memcpy(rest->state.body, bodies, all);
        way[i] = -step;
        displace(rest, way);
        unbalanced(rest, low);
        memcpy(rest->state.body, bodies, all);
        way[i] = 0.0;
        for (size_t j = 0; j < count; j++)
            jacobian[i * count + j] = (high[j] - low[j]) / (2.0 * step);
    }
}

void motion_sizes(size_t *bytes)
{
    const size_t sizes[] = {sizeof(MotionBody),   sizeof(MotionMount), sizeof(MotionAxis),      sizeof(MotionPoint),
                            sizeof(MotionChannel), sizeof(MotionSystem), sizeof(MotionBodyState), sizeof(MotionReach),
                            sizeof(MotionAxisState), sizeof(MotionState), sizeof(MotionRecord)};
    memcpy(bytes, sizes, sizeof sizes);
}

int motion_rest(
    const MotionSystem *system, const double *gravity, const double *omega, MotionState *state, double *pose,
    double *unbalance)
{
    enum { ROUNDS = 200 };
    double jacobian[UNKNOWNS * UNKNOWNS], normal[UNKNOWNS * UNKNOWNS], residual[UNKNOWNS], way[UNKNOWNS];
    MotionBodyState bodies[MOTION_BODIES];
    size_t count = 6 * system->bodies, all = system->bodies * sizeof *bodies;
    RestProblem rest = {.system = system, .gravity = gravity, .omega = omega, .length = 0.0, .state = *state};
    double weight = 0.0, damping = 1e-6, step = INFINITY;
    for (size_t m = 0; m < system->mounts; m++)
        rest.length = fmax(rest.length, size3(system->mount[m].place));
    if (rest.length == 0.0)
        rest.length = 1.0;
    for (size_t b = 0; b < system->bodies; b++) {
        memset(state->body + b, 0, sizeof *state->body);
        memcpy(state->body[b].x, pose + 7 * b, 3 * sizeof *pose);
        set_turn(state->body + b, pose + 7 * b + 3);
        weight = fmax(weight, system->body[b].mass * size3(gravity));
    }
    /* A share of the narrowest range; and the largest force of a spring, where there is no weight. */
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxis *axis = system->axis + a;
        step = fmin(step, 1e-6 * axis->series * (axis->law->x_max - axis->law->x_min));
        weight = fmax(weight, axis->parallel * axis->law->parameters.kappa_omega);
    }
    unbalanced(&rest, residual);
    double size = linear_norm(count, residual);
    for (int round = 0; round < ROUNDS && size > 1e-13 * weight; round++) {
        rest_jacobian(&rest, count, step, jacobian);
        memcpy(bodies, state->body, all);
        double largest = 0.0, kept[UNKNOWNS], next = size;
        for (size_t i = 0; i < count; i++)
            for (size_t j = 0; j < count; j++) {
                double sum = 0.0;
                for (size_t k = 0; k < count; k++)
                    sum += jacobian[i * count + k] * jacobian[j * count + k];
                normal[i * count + j] = sum;
                largest = i == j ? fmax(largest, sum) : largest;
            }
        memcpy(kept, residual, sizeof kept);
        int is_better = 0;
        for (; !is_better && damping < 1e12; damping *= is_better ? 0.1 : 10.0) {
            double matrix[UNKNOWNS * UNKNOWNS];
            memcpy(matrix, normal, count * count * sizeof *matrix);
            for (size_t i = 0; i < count; i++) {
                matrix[i * count + i] += damping * normal[i * count + i] + 1e-14 * largest;
                way[i] = 0.0;
                for (size_t k = 0; k < count; k++)
                    way[i] -= jacobian[i * count + k] * kept[k];
            }
            if (!linear_solve(count, matrix, way))
                continue;
            displace(&rest, way);
            unbalanced(&rest, residual);
            next = linear_norm(count, residual);
            is_better = next < size;
            if (!is_better)
                memcpy(state->body, bodies, all);
        }
        if (!is_better)
            break;
        damping = fmax(damping, 1e-15);
        size = next;
    }
    for (size_t b = 0; b < system->bodies; b++) {
        memcpy(pose + 7 * b, state->body[b].x, 3 * sizeof *pose);
        memcpy(pose + 7 * b + 3, state->body[b].turn, 4 * sizeof *pose);
    }
    *unbalance = size;
    return size <= 1e-9 * weight;
}
