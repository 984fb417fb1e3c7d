#include "motion_parts.h"

#include "../linear.h"

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
    motion_place_axes(system, state, displacements);
    motion_clear_forces(system, state->body);
    for (size_t m = 0; m < system->mounts; m++) {
        const MotionMount *mount = system->mount + m;
        size_t first = (size_t)mount->first, end = first + (size_t)mount->axes;
        double force[3] = {0.0, 0.0, 0.0};
        for (size_t a = first; a < end; a++) {
            const MotionAxis *axis = system->axis + a;
            double displacement = axis->nominal + displacements[a] / axis->series;
            SpringMemory memory = spring_start(displacement, rest->omega[a]);
            double pull = axis->parallel * spring_force(axis->law, &memory) + motion_stop_force(axis, displacement);
            add3(force, -pull, state->axis[a].direction);
        }
        motion_apply(mount, state->reach + m, force, state->body);
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

/* Derivatives of the residual by central differences, a row for each unknown; lost digits do no harm, since the
 * residual decides. */
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

double motion_sense(const MotionAxis *axis, double force)
{
    static const double ROUNDING = 1e-6; /* relative to the hysteretic force */
    return force < -ROUNDING * axis->parallel * axis->law->parameters.kappa_omega ? -1.0 : 1.0;
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
    motion_set_directions(system, state);
    for (size_t b = 0; b < system->bodies; b++) {
        memset(state->body + b, 0, sizeof *state->body);
        memcpy(state->body[b].x, pose + 7 * b, 3 * sizeof *pose);
        memcpy(state->body[b].turn, pose + 7 * b + 3, sizeof state->body[b].turn);
        rotation_of(state->body[b].turn, state->body[b].rotation);
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
