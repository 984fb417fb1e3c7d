#include "motion_parts.h"

#include "../linear.h"

#include <float.h>

/* What rounding may leave of the forces on a body, over the sum of their magnitudes. */
static const double FORCE_ROUNDING = 1e-13;
/* Bodies are at rest when the unbalance is below so many times what rounding may leave. */
static const double ALLOWANCE = 10.0;

typedef struct {
    const MotionSystem *system;
    const double *gravity, *omega;
    double length; /* by which rotations are scaled [m] */
    double reach;  /* largest coordinate of which displacements are differences [m] */
    MotionState state;
    double *displacements; /* of the axes */
    double magnitude[MOTION_BODIES][2]; /* sums of the magnitudes of the forces on a body; of their moments */
    double weight[MOTION_BODIES][2];    /* of each body's forces and moments in the residual */
} RestProblem;

static void add_magnitude(RestProblem *rest, int body, double force, const double *arm)
{
    rest->magnitude[body][0] += force;
    rest->magnitude[body][1] += force * size3(arm) / rest->length;
}

/* Forces, and moments over the length, on each body that is free to follow them, and their magnitudes. */
static void unbalanced(RestProblem *rest, double *residual)
{
    const MotionSystem *system = rest->system;
    MotionState *state = &rest->state;
    double whole[6];
    motion_place_axes(system, state, rest->displacements);
    motion_clear_forces(system, state->body);
    for (size_t b = 0; b < system->bodies; b++) {
        rest->magnitude[b][0] = system->body[b].mass * size3(rest->gravity);
        rest->magnitude[b][1] = 0.0;
    }
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        const MotionReach *reach = state->reach + m;
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        double force[3] = {0.0, 0.0, 0.0}, magnitude = 0.0;
        for (size_t a = first; a < end; a++) {
            const MotionAxis *axis = system->axis + a;
            double displacement = axis->nominal + rest->displacements[a] / axis->series;
            SpringMemory memory = spring_start(displacement, rest->omega[a]);
            double pull = axis->parallel * spring_force(axis->law, &memory) + motion_stop_force(axis, displacement);
            double friction = axis->law->parameters.kappa_omega;
            if (axis->second) {
                pull += axis->parallel * spring_force(axis->second, &memory);
                friction += axis->second->parameters.kappa_omega;
            }
            add3(force, -pull, state->axis[a].direction);
            magnitude += fabs(pull) + axis->parallel * friction * fabs(rest->omega[a]);
        }
        motion_apply(mount, reach, force, state->body);
        add_magnitude(rest, (int)mount->body, magnitude, reach->arm);
        if (mount->support >= 0.0)
            add_magnitude(rest, (int)mount->support, magnitude, reach->support_arm);
    }
    for (size_t b = 0; b < system->bodies; b++) {
        for (int i = 0; i < 3; i++) {
            whole[i] = state->body[b].force[i] + system->body[b].mass * rest->gravity[i];
            whole[3 + i] = state->body[b].torque[i] / rest->length;
        }
        turn3(system->body[b].translations, whole, residual + 6 * b);
        turn3(system->body[b].rotations, whole + 3, residual + 6 * b + 3);
        for (int i = 0; i < 6; i++)
            residual[6 * b + i] *= rest->weight[b][i / 3];
    }
}

/* Moves the bodies by small translations and rotations. */
static void displace(RestProblem *rest, const double *way)
{
    for (size_t b = 0; b < rest->system->bodies; b++) {
        double translation[3], rotation[3], q[4];
        MotionBodyState *own = rest->state.body + b;
        turn3(rest->system->body[b].translations, way + 6 * b, translation);
        turn3(rest->system->body[b].rotations, way + 6 * b + 3, rotation);
        add3(own->x, 1.0, translation);
        for (int i = 0; i < 3; i++)
            rotation[i] /= rest->length;
        quaternion_of(rotation, q);
        quaternion_product(q, own->turn, own->turn);
        rotation_of(own->turn, own->rotation);
    }
}

/* Takes the bodies to a pose, and finds the lengths. Returns a step for differences: a share of the narrowest range. */
static double begin_rest(RestProblem *rest, const double *pose)
{
    const MotionSystem *system = rest->system;
    MotionBodyState *bodies = rest->state.body;
    double step = HUGE_VAL;
    rest->length = rest->reach = 0.0;
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        double length = size3(mount->place);
        rest->length = fmax(rest->length, length);
        rest->reach = fmax(rest->reach, length + size3(system->body[(int)mount->body].center));
    }
    if (rest->length == 0.0)
        rest->length = 1.0;
    for (size_t a = 0; a < system->axes; a++) {
        const MotionAxis *axis = system->axis + a;
        step = fmin(step, 1e-6 * axis->series * (axis->law->x_max - axis->law->x_min));
        rest->reach = fmax(rest->reach, axis->series * fabs(axis->nominal));
    }
    motion_set_directions(system, &rest->state);
    for (size_t b = 0; b < system->bodies; b++) {
        memset(bodies + b, 0, sizeof *bodies);
        memcpy(bodies[b].x, pose + 7 * b, sizeof bodies->x);
        memcpy(bodies[b].turn, pose + 7 * b + 3, sizeof bodies->turn);
        rotation_of(bodies[b].turn, bodies[b].rotation);
    }
    return step;
}

/* Derivatives of the residual by central differences, a row for each unknown; lost digits do no harm, since the
 * residual decides. */
static void rest_jacobian(RestProblem *rest, size_t count, double step, double *jacobian)
{
    double way[MOTION_UNKNOWNS] = {0.0}, low[MOTION_UNKNOWNS], high[MOTION_UNKNOWNS];
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

/* Stiffness against which a force or moment of the residual acts, in all directions together. */
static double stiffness_of(size_t count, const double *jacobian, size_t j)
{
    double total = 0.0;
    for (size_t i = 0; i < count; i++)
        total += fabs(jacobian[i * count + j]);
    return total;
}

/* Weighs forces and moments by the inverse of the largest stiffness against them, so that neither the heaviest body nor
 * the unit of force decides. */
static void weigh(RestProblem *rest, size_t count, double step, double *jacobian)
{
    for (size_t i = 0; i < 2 * rest->system->bodies; i++)
        rest->weight[i / 2][i % 2] = 1.0;
    rest_jacobian(rest, count, step, jacobian);
    for (size_t i = 0; i < 2 * rest->system->bodies; i++) {
        double largest = 0.0;
        for (size_t j = 3 * i; j < 3 * i + 3; j++)
            largest = fmax(largest, stiffness_of(count, jacobian, j));
        rest->weight[i / 2][i % 2] = largest > 0.0 ? 1.0 / largest : 1.0;
    }
}

/* Whether the residual is at most so many times what rounding may leave: of forces, and of places by the stiffness. */
static int is_balanced(
    const RestProblem *rest, size_t count, const double *residual, const double *jacobian, double times)
{
    for (size_t j = 0; j < count; j++) {
        size_t b = j / 6, kind = j % 6 / 3;
        double least = FORCE_ROUNDING * rest->magnitude[b][kind] * rest->weight[b][kind]
                       + DBL_EPSILON * rest->reach * stiffness_of(count, jacobian, j);
        if (!(fabs(residual[j]) <= times * least))
            return 0;
    }
    return 1;
}

double motion_sense(const MotionAxis *axis, double force)
{
    static const double ROUNDING = 1e-6; /* relative to the hysteretic force */
    return force < -ROUNDING * axis->parallel * axis->law->parameters.kappa_omega ? -1.0 : 1.0;
}

int motion_rest(
    const MotionSystem *system, const double *gravity, const double *omega, MotionState *state, double *pose,
    double *unbalance, double *workspace)
{
    enum { ROUNDS = 200 };
    double residual[MOTION_UNKNOWNS], way[MOTION_UNKNOWNS];
    MotionBodyState bodies[MOTION_BODIES];
    size_t count = 6 * system->bodies, all = system->bodies * sizeof *bodies;
    double *jacobian = workspace, *normal = jacobian + count * count, *matrix = normal + count * count;
    RestProblem rest = {.system = system, .gravity = gravity, .omega = omega, .state = *state,
                        .displacements = matrix + count * count};
    double step = begin_rest(&rest, pose);
    weigh(&rest, count, step, jacobian);
    rest_jacobian(&rest, count, step, jacobian);
    unbalanced(&rest, residual);
    double size = linear_norm(count, residual), damping = 1e-6;
    for (int round = 0; round < ROUNDS && !is_balanced(&rest, count, residual, jacobian, 1.0); round++) {
        memcpy(bodies, state->body, all);
        double largest = 0.0, kept[MOTION_UNKNOWNS], next = size;
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
            size_t order[MOTION_UNKNOWNS];
            memcpy(matrix, normal, count * count * sizeof *matrix);
            for (size_t i = 0; i < count; i++) {
                matrix[i * count + i] += damping * normal[i * count + i] + 1e-14 * largest;
                way[i] = 0.0;
                for (size_t k = 0; k < count; k++)
                    way[i] -= jacobian[i * count + k] * kept[k];
            }
            if (!linear_factor(count, matrix, order))
                continue;
            linear_substitute(count, matrix, order, way);
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
        rest_jacobian(&rest, count, step, jacobian);
    }
    unbalanced(&rest, residual);
    int is_found = is_balanced(&rest, count, residual, jacobian, ALLOWANCE);
    for (size_t b = 0; b < system->bodies; b++) {
        memcpy(pose + 7 * b, state->body[b].x, 3 * sizeof *pose);
        memcpy(pose + 7 * b + 3, state->body[b].turn, 4 * sizeof *pose);
    }
    for (size_t j = 0; j < count; j++)
        residual[j] /= rest.weight[j / 6][j % 6 / 3];
    *unbalance = linear_norm(count, residual);
    return is_found;
}
