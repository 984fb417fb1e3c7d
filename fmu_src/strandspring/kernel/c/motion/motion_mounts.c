/* Mounts: where they are, and their forces. */
#include "motion_parts.h"

/* ---- places ---- */

/* Reach of a mount, and the way to its place from the support's. */
static void reach_of(
    const MotionSystem *system, const MotionMount *mount, const MotionBodyState *bodies, MotionReach *reach,
    double *between)
{
    const MotionBody *body = system->body + (int)mount->body;
    const MotionBodyState *state = bodies + (int)mount->body;
    turn3(state->rotation, mount->place, reach->arm);
    for (int i = 0; i < 3; i++)
        reach->place[i] = body->center[i] + state->x[i] + reach->arm[i];
    if (mount->support < 0.0) {
        for (int i = 0; i < 3; i++)
            between[i] = reach->place[i] - mount->support_place[i];
        return;
    }
    const MotionBody *support = system->body + (int)mount->support;
    const MotionBodyState *under = bodies + (int)mount->support;
    double place[3];
    turn3(under->rotation, mount->support_place, place);
    for (int i = 0; i < 3; i++) {
        reach->support_arm[i] = reach->place[i] - support->center[i] - under->x[i];
        between[i] = reach->support_arm[i] - place[i];
    }
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
        if (is_zero3(state->end_spin))
            return;
        cross3(state->end_spin, reach->place, of_support);
    } else {
        const MotionBodyState *under = state->body + (int)mount->support;
        cross3(under->spin, reach->support_arm, of_support);
        add3(of_support, 1.0, under->V);
    }
    add3(velocity, -1.0, of_support);
}

void motion_set_directions(const MotionSystem *system, MotionState *state)
{
    for (size_t a = 0; a < system->axes; a++)
        memcpy(state->axis[a].direction, system->axis[a].direction, sizeof state->axis[a].direction);
}

void motion_place_axes(const MotionSystem *system, MotionState *state, double *displacements)
{
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        MotionReach *reach = state->reach + m;
        double between[3];
        reach_of(system, mount, state->body, reach, between);
        int first = (int)mount->first, end = first + (int)mount->axes;
        for (int a = first; a < end; a++) {
            double *direction = state->axis[a].direction;
            if (mount->support >= 0.0)
                turn3(state->body[(int)mount->support].rotation, system->axis[a].direction, direction);
            displacements[a] = dot3(direction, between);
        }
    }
}

double motion_stop_force(const MotionAxis *axis, double displacement)
{
    if (displacement > axis->stop_high)
        return axis->stop_stiffness * axis->series * (displacement - axis->stop_high);
    if (displacement < axis->stop_low)
        return axis->stop_stiffness * axis->series * (displacement - axis->stop_low);
    return 0.0;
}

/* Adds a force that a mount exerts at its place. */
void motion_apply(const MotionMount *mount, const MotionReach *reach, const double *force, MotionBodyState *bodies)
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

void motion_clear_forces(const MotionSystem *system, MotionBodyState *bodies)
{
    for (size_t b = 0; b < system->bodies; b++) {
        memset(bodies[b].force, 0, sizeof bodies[b].force);
        memset(bodies[b].torque, 0, sizeof bodies[b].torque);
    }
}

/* ---- coupled friction ---- */

enum { TOGETHER = 3 }; /* axes of a mount at most */
static const double LONGEST_SLIP = 0.1, MOST_PARTS = 1e3; /* of rho times the way, and of a step */

/* The friction of one axis, and where its springs go. */
typedef struct {
    const SpringLaw *law;
    SpringMemory *memory;
    double target;
} Sliding;

/* Changes of omega over a slip rho*dx of each axis by the law of Park, Wen and Ang (1986), with n and sigma of each axis:
 * it is that of one spring along each axis, and keeps the length of omega within 1. */
static void slide(const Sliding *axis, int count, const double *omega, const double *slip, double *change)
{
    double square = 0.0, sizes = 0.0, work = 0.0;
    for (int i = 0; i < count; i++) {
        square += omega[i] * omega[i];
        sizes += fabs(slip[i] * omega[i]);
        work += slip[i] * omega[i];
    }
    double length = fmin(sqrt(square), 1.0);
    for (int i = 0; i < count; i++) {
        const SpringParameters *p = &axis[i].law->parameters;
        double share = length > 0.0 ? spring_power(length, p->n) * omega[i] / square : 0.0;
        change[i] = slip[i] - share * (p->sigma * sizes + (1.0 - p->sigma) * work);
    }
}

/* Takes springs of one mount, whose friction acts together, to new displacements in a straight line. */
static void slide_together(const Sliding *axis, int count)
{
    double slip[TOGETHER], way[TOGETHER], omega[TOGETHER], middle[TOGETHER], change[TOGETHER], longest = 0.0;
    for (int i = 0; i < count; i++) {
        way[i] = axis[i].target - axis[i].memory->displacement;
        slip[i] = axis[i].law->parameters.rho * way[i];
        omega[i] = axis[i].memory->omega;
        longest = fmax(longest, fabs(slip[i]));
    }
    int parts = (int)clip(ceil(longest / LONGEST_SLIP), 1.0, MOST_PARTS);
    for (int part = 0; part < parts; part++) {
        double square = 0.0;
        slide(axis, count, omega, slip, change);
        for (int i = 0; i < count; i++)
            middle[i] = omega[i] + 0.5 * change[i] / parts;
        slide(axis, count, middle, slip, change);
        for (int i = 0; i < count; i++) {
            omega[i] += change[i] / parts;
            square += omega[i] * omega[i];
        }
        for (int i = 0; i < count; i++) {
            SpringMemory *memory = axis[i].memory;
            double before = spring_force(axis[i].law, memory);
            omega[i] /= fmax(sqrt(square), 1.0);
            memory->omega = omega[i];
            memory->displacement += way[i] / parts;
            memory->energy += 0.5 * (before + spring_force(axis[i].law, memory)) * way[i] / parts;
        }
    }
    for (int i = 0; i < count; i++) {
        SpringMemory *memory = axis[i].memory;
        memory->displacement = axis[i].target;
        memory->direction = way[i] == 0.0 ? memory->direction : way[i] > 0.0 ? 1 : -1;
        memory->start = memory->energy_at = memory->displacement;
        memory->start_xi = spring_inverse(axis[i].law->table, memory->direction * memory->omega);
    }
}

/* Takes all springs of a mount, the friction of whose axes acts together, that of second mechanisms likewise. */
static void slide_mount(
    const MotionSystem *system, MotionState *state, int first, int end, const double *displacements)
{
    Sliding own[TOGETHER], second[TOGETHER];
    int count = 0, seconds = 0;
    for (int a = first; a < end; a++) {
        const MotionAxis *axis = system->axis + a;
        double target = axis->nominal + displacements[a] / axis->series;
        own[count++] = (Sliding){axis->law, &state->axis[a].memory, target};
        if (axis->second)
            second[seconds++] = (Sliding){axis->second, &state->added[a].second, target};
    }
    slide_together(own, count);
    slide_together(second, seconds);
}

/* ---- forces ---- */

/* Takes what a spring of an axis has beside the paper's to a new displacement within h, and gives its force. */
static double move_added(
    const MotionAxis *axis, const MotionAxisState *own, double to, double h, SpringAddedMemory *memory)
{
    const SpringAdded *added = axis->added;
    double from = axis->nominal + own->displacement / axis->series;
    SpringDecay decays[SPRING_MAXWELLS];
    for (int i = 0; i < added->branches; i++)
        decays[i] = spring_decay(h / added->time_constant[i]);
    spring_added_commit(added, axis->second, memory, 0, from, to, h, decays);
    /* The way is rate*t + bend*t^2/h^2. */
    double bend = to - from - own->rate * h / axis->series;
    for (int i = 0; i < added->branches; i++)
        memory->elongation[i] += (2.0 * decays[i].ramp - decays[i].mean) * bend;
    return spring_added_force(added, axis->second, memory);
}

/* Takes the spring of an axis to a new displacement within h, unless it is there, and its force but for the damper's. */
static void move_spring(const MotionAxis *axis, double displacement, double h, MotionState *state, size_t a)
{
    MotionAxisState *own = state->axis + a;
    double of_spring = axis->nominal + displacement / axis->series;
    spring_commit(axis->law, &own->memory, NULL, of_spring);
    own->force = axis->parallel * spring_force(axis->law, &own->memory) + motion_stop_force(axis, of_spring);
    if (axis->added)
        own->force += axis->parallel * move_added(axis, own, of_spring, h, state->added + a);
    own->displacement = displacement;
}

void motion_take_forces(const MotionSystem *system, MotionState *state, const double *displacements, double h)
{
    motion_clear_forces(system, state->body);
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        int first = (int)mount->first, end = first + (int)mount->axes;
        double velocity[3], x = 0.0, y = 0.0, z = 0.0;
        if (system->coupled)
            slide_mount(system, state, first, end, displacements);
        for (int a = first; a < end; a++)
            move_spring(system->axis + a, displacements[a], h, state, (size_t)a);
        if (state->has_dampers != 0.0) {
            velocity_between(mount, state->reach + m, state, velocity);
            for (int a = first; a < end; a++)
                state->axis[a].force += system->axis[a].damping * dot3(state->axis[a].direction, velocity);
        }
        for (int a = first; a < end; a++) {
            const MotionAxisState *own = state->axis + a;
            x -= own->force * own->direction[0];
            y -= own->force * own->direction[1];
            z -= own->force * own->direction[2];
        }
        const double force[3] = {x, y, z};
        motion_apply(mount, state->reach + m, force, state->body);
        memcpy(state->reach[m].force, force, sizeof force);
    }
}

double motion_absorbed(const MotionSystem *system, const MotionState *state, size_t a)
{
    const MotionAxis *axis = system->axis + a;
    double energy = spring_absorbed_energy(axis->law, &state->axis[a].memory);
    if (axis->added)
        energy += spring_added_energy(axis->added, axis->second, state->added + a);
    return axis->parallel * axis->series * energy;
}

void motion_take_rates(const MotionSystem *system, MotionState *state)
{
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        int first = (int)mount->first, end = first + (int)mount->axes;
        double velocity[3];
        velocity_between(mount, state->reach + m, state, velocity);
        for (int a = first; a < end; a++)
            state->axis[a].rate = dot3(state->axis[a].direction, velocity);
    }
}
