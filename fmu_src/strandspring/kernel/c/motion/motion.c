#include "motion_parts.h"

/* Of a step: a turn nearer to its ends than this needs no end of its own. */
static const double NEAR_END = 1e-3;
/* rho times the way beyond a turn that does not matter. */
static const double LEAST_OVERSHOOT = 1e-9;

/* Angular velocity in the base's frame. */
static inline void spin_of(const MotionBody *body, const MotionBodyState *state, const double *L, double *spin)
{
    double own[3];
    turn_back3(state->rotation, L, own);
    turn3(body->inverse_inertia, own, own);
    turn3(state->rotation, own, spin);
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

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
void motion_of_base(const MotionSystem *system, const double *values, double kind, double *motion)
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

static inline void project(const double *projector, const MotionBody *body, double *vector)
{
    if (body->is_free == 0.0)
        turn3(projector, vector, vector);
}

/* Kicks the bodies by the mounts' forces, gravity, the base and the forces from outside over h, and counts the work of
 * the latter three. Writes the change of V and L. */
static void kick(
    const MotionSystem *system, MotionState *state, const double *acceleration, const double *values, double h,
    double (*change)[6])
{
    double force[MOTION_BODIES][3], torque[MOTION_BODIES][3];
    int has_loads = state->has_loads != 0.0;
    if (has_loads)
        loads_of(system, state->body, values, force, torque);
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        MotionBodyState *own = state->body + b;
        double *push = change[b], *moment = change[b] + 3, mean[3], spins[3], after[3], per_mass = 1.0 / body->mass;
        for (int i = 0; i < 3; i++) {
            push[i] = h * (own->force[i] * per_mass + state->gravity[i] - acceleration[i]);
            moment[i] = h * own->torque[i];
        }
        if (has_loads) {
            add3(push, h * per_mass, force[b]);
            add3(moment, h, torque[b]);
        }
        project(body->translations, body, push);
        project(body->rotations, body, moment);
        for (int i = 0; i < 3; i++) {
            mean[i] = own->V[i] + 0.5 * push[i];
            own->V[i] += push[i];
        }
        double of_base = -h * body->mass * dot3(acceleration, mean), of_load = 0.0;
        if (has_loads) {
            spin_of(body, own, own->L, spins);
            add3(own->L, 1.0, moment);
            spin_of(body, own, own->L, after);
            add3(spins, 1.0, after);
            of_load = h * (dot3(force[b], mean) + 0.5 * dot3(torque[b], spins));
        } else {
            add3(own->L, 1.0, moment);
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
    int turns = !is_zero3(state->base_spin);
    if (turns) {
        for (int i = 0; i < 3; i++)
            back[i] = -h * state->base_spin[i];
        quaternion_of(back, q);
        rotation_of(q, base);
        turn3(base, state->gravity, state->gravity);
    }
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        MotionBodyState *own = state->body + b;
        add3(own->x, h, own->V);
        if (body->turns != 0.0) {
            /* The midpoint's angular velocity, where L is constant: in the body's frame L turns by -h/2 times the
             * velocity. */
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
            quaternion_product(own->turn, step, own->turn);
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
            quaternion_product(q, own->turn, own->turn);
        }
        if (turns || body->turns != 0.0)
            next_rotation(own->turn, own->rotation);
    }
}

/* When a displacement that goes on by rate*s + bend*s^2/h passes a limit; h if it is on the same side of it at h. */
static double passage(double displacement, double rate, double bend, double limit, double h)
{
    double before = displacement - limit, square = bend / h;
    if (before * (before + (rate + bend) * h) >= 0.0)
        return h;
    /* The roots of before + rate*s + square*s^2, one of which is on the way. */
    double half = -0.5 * (rate + copysign(sqrt(fmax(rate * rate - 4.0 * square * before, 0.0)), rate));
    double s = before / half;
    return 0.0 < s && s < h ? s : half / square;
}

/* When the first spring turns, or a stop is touched or left, on the way to new displacements, after s < h; h if none
 * does. */
static double first_corner(const MotionSystem *system, const MotionState *state, const double *displacements, double h)
{
    double first = h, per_h = 1.0 / h, from = NEAR_END * h, to = (1.0 - NEAR_END) * h;
    const MotionAxis *axis = system->axis;
    const MotionAxisState *own = state->axis;
    for (size_t a = 0; a < system->axes; a++, axis++, own++) {
        double rate = own->rate, bend = (displacements[a] - own->displacement) * per_h - rate;
        if (axis->stop_stiffness > 0.0) {
            const double stops[2] = {axis->stop_low, axis->stop_high};
            for (int k = 0; k < 2; k++) {
                double s = passage(own->displacement, rate, bend, axis->series * (stops[k] - axis->nominal), h);
                first = from < s && s < to && s < first ? s : first;
            }
        }
        /* The rate at the end is rate + 2*bend. */
        if (rate * (rate + 2.0 * bend) >= 0.0)
            continue;
        double s = -0.5 * rate / bend * h;
        double way = 0.5 * fabs(rate) * s, beyond = fabs(bend) * (h - s) * (h - s) * per_h;
        double least = LEAST_OVERSHOOT * axis->series / axis->law->parameters.rho;
        if (from < s && s < to && s < first && way > least && beyond > least)
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

/* Energy that the dampers take over a step by Simpson's rule: of the rates before and midway at its beginning, and of
 * those after at its end. */
static void dissipate(
    const MotionSystem *system, MotionState *state, const double *displacements, double h, int is_end)
{
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxisState *own = state->axis + a;
        double middle = is_end ? 0.0 : (displacements[a] - own->displacement) / h;
        state->damped += system->axis[a].damping * h / 6.0 * (own->rate * own->rate + 4.0 * middle * middle);
    }
}

/* Goes on by `left`, or to where the first spring turns while *turns, which then falls by 1, is above 0. Returns how
 * far; 0 if a displacement is beyond LARGEST_DISPLACEMENT. */
double motion_part(
    const MotionSystem *system, MotionState *state, const double *values, double left, size_t *turns)
{
    double acceleration[3], moment[3], displacements[MOTION_AXES], change[MOTION_BODIES][6];
    MotionBodyState bodies[MOTION_BODIES];
    size_t all = system->bodies * sizeof *bodies;
    motion_of_base(system, values, 0.0, acceleration);
    int has_dampers = state->has_dampers != 0.0;
    int is_turning = !is_zero3(state->end_spin) || !is_zero3(state->spin_slope);
    if (is_turning)
        moment_on_bodies(system, state, moment);

    MotionState before = *state;
    memcpy(bodies, state->body, all);
    double part = left;
    for (;;) {
        for (int i = 0; i < 3; i++)
            state->base_spin[i] = state->end_spin[i] - (left - 0.5 * part) * state->spin_slope[i];
        kick(system, state, acceleration, values, 0.5 * part, change);
        drift(system, state, part);
        motion_place_axes(system, state, displacements);
        double turn = *turns > 0 ? first_corner(system, state, displacements, part) : part;
        if (turn == part)
            break;
        --*turns;
        part = turn;
        *state = before;
        memcpy(state->body, bodies, all);
    }
    for (size_t a = 0; a < system->axes; a++)
        if (!(fabs(displacements[a]) <= LARGEST_DISPLACEMENT))
            return 0.0;
    add3(state->end_spin, part - left, state->spin_slope);
    if (has_dampers) {
        /* Forces at the velocities foreseen; the kick goes on from those at half the step. */
        memcpy(bodies, state->body, all);
        for (size_t b = 0; b < system->bodies; b++) {
            add3(state->body[b].V, 1.0, change[b]);
            add3(state->body[b].L, 1.0, change[b] + 3);
        }
        set_spins(system, state);
        dissipate(system, state, displacements, part, 0);
    }
    motion_take_forces(system, state, displacements, part);
    for (size_t b = 0; has_dampers && b < system->bodies; b++) {
        memcpy(state->body[b].V, bodies[b].V, sizeof bodies[b].V);
        memcpy(state->body[b].L, bodies[b].L, sizeof bodies[b].L);
    }
    kick(system, state, acceleration, values, 0.5 * part, change);
    set_spins(system, state);
    motion_take_rates(system, state);
    if (has_dampers)
        dissipate(system, state, displacements, part, 1);

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

void motion_turn_base(const MotionSystem *system, MotionState *state, const double *values)
{
    double displacements[MOTION_AXES], spin[3];
    motion_of_base(system, values, 1.0, spin);
    if (memcmp(spin, state->end_spin, sizeof spin) == 0)
        return;
    memcpy(state->end_spin, spin, sizeof spin);
    motion_place_axes(system, state, displacements);
    motion_take_forces(system, state, displacements, 0.0);
    motion_take_rates(system, state);
}

int motion_step(const MotionSystem *system, MotionState *state, const double *values, double h)
{
    size_t turns = system->axes + 1;
    for (double left = h; left > 0.0;) {
        motion_of_base(system, values, 1.0, state->end_spin);
        double part = motion_part(system, state, values, left, &turns);
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
    *state = (MotionState){.body = state->body, .reach = state->reach, .axis = state->axis, .added = state->added};
    memcpy(state->gravity, gravity, sizeof state->gravity);
    motion_set_directions(system, state);
    for (size_t a = 0; a < system->axes; a++)
        if (system->axis[a].damping != 0.0)
            state->has_dampers = 1.0;
    for (size_t c = 0; c < system->channels; c++)
        if (system->channel[c].kind == 2.0)
            state->has_loads = 1.0;
    for (size_t b = 0; b < system->bodies; b++) {
        MotionBodyState *body = state->body + b;
        memset(body, 0, sizeof *body);
        memcpy(body->x, pose + 7 * b, sizeof body->x);
        memcpy(body->turn, pose + 7 * b + 3, sizeof body->turn);
        rotation_of(body->turn, body->rotation);
        turn3(system->body[b].translations, velocity, body->V);
    }
    motion_place_axes(system, state, displacements);
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxis *axis = system->axis + a;
        state->axis[a].displacement = displacements[a];
        state->axis[a].memory = spring_start(axis->nominal + displacements[a] / axis->series, omega[a]);
        if (axis->added)
            state->added[a] = spring_added_start(state->axis[a].memory.displacement, omega[a]);
    }
    motion_take_forces(system, state, displacements, 0.0);
    motion_take_rates(system, state);
}

/* ---- what is asked for ------------------------------------------------------------------------------------------- */

void motion_of_points(
    const MotionSystem *system, const MotionState *state, const double *values, double *accelerations, double *sway)
{
    double force[MOTION_BODIES][3], torque[MOTION_BODIES][3], linear[MOTION_BODIES][3], angular[MOTION_BODIES][3];
    double of_base[3];
    motion_of_base(system, values, 0.0, of_base);
    loads_of(system, state->body, values, force, torque);
    for (size_t b = 0; b < system->bodies; b++) {
        const MotionBody *body = system->body + b;
        const MotionBodyState *own = state->body + b;
        double per_mass = 1.0 / body->mass;
        for (int i = 0; i < 3; i++)
            linear[b][i] = (own->force[i] + force[b][i]) * per_mass + state->gravity[i];
        if (body->is_free == 0.0) {
            add3(linear[b], -1.0, of_base);
            turn3(body->translations, linear[b], linear[b]);
            add3(linear[b], 1.0, of_base);
        }
        memset(angular[b], 0, sizeof angular[b]);
        if (body->turns == 0.0)
            continue;
        /* Euler's equations: moments turn the angular momentum, and the rest of them the body. */
        double gyroscopic[3];
        cross3(own->spin, own->L, gyroscopic);
        add3(torque[b], 1.0, own->torque);
        add3(torque[b], -1.0, gyroscopic);
        spin_of(body, own, torque[b], angular[b]);
    }
    for (size_t p = 0; p < system->points; p++) {
        int b = (int)system->point[p].body;
        const MotionBodyState *own = state->body + b;
        double arm[3], tangential[3], centripetal[3];
        turn3(own->rotation, system->point[p].place, arm);
        cross3(angular[b], arm, tangential);
        cross3(own->spin, arm, centripetal);
        cross3(own->spin, centripetal, centripetal);
        for (int i = 0; i < 3; i++) {
            accelerations[3 * p + i] = linear[b][i] + tangential[i] + centripetal[i];
            sway[3 * p + i] = own->x[i] + arm[i] - system->point[p].place[i];
        }
    }
}

void motion_reaction(const MotionSystem *system, const MotionState *state, double *force)
{
    memset(force, 0, 3 * sizeof *force);
    for (size_t m = 0; m < system->mounts; m++)
        if (system->mount[m].support < 0.0)
            add3(force, -1.0, state->reach[m].force);
}
