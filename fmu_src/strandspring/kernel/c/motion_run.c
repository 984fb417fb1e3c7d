#include "motion_parts.h"

#include "../../core/c/numerics.h"

/* Of a point: the squares of the sizes of acceleration and way from the beginning, then the components of both. */
enum { WATCHED = 8 };
/* Numbers of a point and of an axis whose means are taken. */
enum { MEANS = 9, MEANS_OF_AXIS = 2 };

typedef struct {
    double now[4][MOTION_AXES], low[2][MOTION_AXES], high[4][MOTION_AXES];
    double rates[MOTION_AXES][2], forces[MOTION_AXES][2]; /* the last two values */
} WatchedAxes;

/* `time` of the two values before and of this; no course is smooth where a part of a step ends at a turn, or a load jumps. */
typedef struct {
    double time[3];
    int is_sharp[3];
    double accelerations[3 * MOTION_POINTS], sway[3 * MOTION_POINTS], start[3 * MOTION_POINTS];
    double turn[MOTION_BODIES][4];
    double points[MOTION_POINTS][WATCHED][2], tilts[MOTION_BODIES][2]; /* the last two values */
    double of_points[MOTION_POINTS][MEANS], of_axes[MOTION_AXES][MEANS_OF_AXIS]; /* the last values whose means are taken */
    WatchedAxes axes;
} Watch;

/* Takes a value. A peak is at the vertex of the parabola through the last three, which lies between them where the middle one is
 * the greatest; where an outer one is and has a corner, it may. */
static inline void watch(const Watch *watched, double *before, double value, double *greatest, double *at)
{
    const double *t = watched->time;
    const int *is_sharp = watched->is_sharp;
    double first = before[0], middle = before[1];
    before[0] = middle;
    before[1] = value;
    if (value > *greatest) {
        *greatest = value;
        *at = t[2];
    }
    int may_be_peak = first < middle ? middle > value || is_sharp[2] : is_sharp[0] && first > value;
    if (!may_be_peak || is_sharp[1] || (first < *greatest && middle < *greatest && value < *greatest) || t[1] <= t[0])
        return;
    double left = (middle - first) / (t[1] - t[0]), right = (value - middle) / (t[2] - t[1]);
    double bend = (right - left) / (t[2] - t[0]), slope = left + bend * (t[1] - t[0]);
    double way = -0.5 * slope / bend, vertex = middle + 0.5 * slope * way;
    if (bend < 0.0 && t[0] < t[1] + way && t[1] + way < t[2] && vertex > *greatest) {
        *greatest = vertex;
        *at = t[1] + way;
    }
}

static void advance_watch(Watch *watched, double time, int is_sharp)
{
    for (int i = 0; i < 2; i++) {
        watched->time[i] = watched->time[i + 1];
        watched->is_sharp[i] = watched->is_sharp[i + 1];
    }
    watched->time[2] = time;
    watched->is_sharp[2] = is_sharp;
}

/* Where of_points of a point holds the greatest of each that is watched; the time of the first follows it. */
static const int GREATEST[WATCHED] = {0, 5, 2, 3, 4, 6, 7, 8};
enum { TIME_OF_GREATEST = 1, MEANS_OF_POINT_AT = 9, MEANS_OF_AXIS_AT = 8 };

static void watch_points(
    const MotionSystem *system, const MotionState *state, const double *loads, Watch *watched, double *of_points)
{
    motion_accelerations(system, state, loads, watched->accelerations);
    motion_sway(system, state, watched->sway);
    for (size_t p = 0; p < system->points; p++) {
        const double *acceleration = watched->accelerations + 3 * p;
        double way[3], at, *found = of_points + MOTION_OF_POINT * p;
        for (int i = 0; i < 3; i++)
            way[i] = watched->sway[3 * p + i] - watched->start[3 * p + i];
        const double sizes[WATCHED] = {
            dot3(acceleration, acceleration), dot3(way, way), fabs(acceleration[0]), fabs(acceleration[1]),
            fabs(acceleration[2]), fabs(way[0]), fabs(way[1]), fabs(way[2])};
        for (int k = 0; k < WATCHED; k++)
            watch(watched, watched->points[p][k], sizes[k], found + GREATEST[k],
                  k == 0 ? found + TIME_OF_GREATEST : &at);
    }
}

/* Of all axes, an array for each quantity, whose loops the compiler turns into few instructions. */
static void watch_axes(const MotionSystem *system, const MotionState *state, Watch *watched)
{
    size_t axes = system->axes;
    WatchedAxes *of = &watched->axes;
    double *displacement = of->now[0], *omega = of->now[1], *rate = of->now[2], *force = of->now[3];
    for (size_t a = 0; a < axes; a++) {
        const MotionAxisState *own = state->axis + a;
        displacement[a] = own->memory.displacement;
        omega[a] = own->memory.omega;
        rate[a] = fabs(own->rate);
        force[a] = fabs(own->force);
    }
    for (size_t a = 0; a < axes; a++) {
        of->low[0][a] = displacement[a] < of->low[0][a] ? displacement[a] : of->low[0][a];
        of->high[0][a] = displacement[a] > of->high[0][a] ? displacement[a] : of->high[0][a];
    }
    for (size_t a = 0; a < axes; a++) {
        of->low[1][a] = omega[a] < of->low[1][a] ? omega[a] : of->low[1][a];
        of->high[1][a] = omega[a] > of->high[1][a] ? omega[a] : of->high[1][a];
    }
    for (size_t a = 0; a < axes; a++) {
        double at;
        watch(watched, of->rates[a], rate[a], of->high[2] + a, &at);
        watch(watched, of->forces[a], force[a], of->high[3] + a, &at);
    }
}

/* The square of the sine of half the angle from the beginning. */
static void watch_bodies(
    const MotionSystem *system, const MotionState *state, Watch *watched, double *of_bodies)
{
    for (size_t b = 0; b < system->bodies; b++) {
        const double *q = state->body[b].turn, *start = watched->turn[b];
        double back[4] = {start[0], -start[1], -start[2], -start[3]}, turn[4];
        if (system->body[b].turns == 0.0)
            continue;
        quaternion_product(back, q, turn);
        double *found = of_bodies + MOTION_OF_BODY * b;
        watch(watched, watched->tilts[b], dot3(turn + 1, turn + 1), found, found + 1);
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
            double force = motion_stop_force(system->axis + a, state->axis[a].memory.displacement);
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
    memset(watched, 0, sizeof *watched);
    watched->is_sharp[2] = 1;
    motion_sway(system, state, watched->start);
    for (size_t b = 0; b < system->bodies; b++)
        memcpy(watched->turn[b], state->body[b].turn, sizeof watched->turn[b]);
    for (size_t a = 0; a < system->axes; a++) {
        const SpringMemory *memory = &state->axis[a].memory;
        record->of_axes[MOTION_OF_AXIS * a + 6] = memory->displacement;
        watched->axes.low[0][a] = watched->axes.high[0][a] = memory->displacement;
        watched->axes.low[1][a] = watched->axes.high[1][a] = memory->omega;
    }
    record->energies[0] = kinetic_energy(system, state);
    record->energies[4] = -stop_energy(system, state);
}

/* Adds `weight` times the sum of present and last values to their sums. */
static inline void add_pair(double weight, const double *now, double *last, int count, double *sums)
{
    for (int i = 0; i < count; i++) {
        sums[i] += weight * (last[i] + now[i]);
        last[i] = now[i];
    }
}

/* By the trapezoidal rule; weight: half of what the way from the last values is of a step. */
static void add_means(const MotionSystem *system, double weight, Watch *watched, MotionRecord *record)
{
    for (size_t p = 0; p < system->points; p++) {
        double now[MEANS];
        for (int i = 0; i < 3; i++) {
            double acceleration = watched->accelerations[3 * p + i];
            double way = watched->sway[3 * p + i] - watched->start[3 * p + i];
            now[i] = acceleration * acceleration;
            now[3 + i] = way;
            now[6 + i] = way * way;
        }
        add_pair(weight, now, watched->of_points[p], MEANS, record->of_points + MOTION_OF_POINT * p + MEANS_OF_POINT_AT);
    }
    for (size_t a = 0; a < system->axes; a++) {
        double *found = record->of_axes + MOTION_OF_AXIS * a, way = watched->axes.now[0][a] - found[6];
        const double now[MEANS_OF_AXIS] = {way, way * way};
        add_pair(weight, now, watched->of_axes[a], MEANS_OF_AXIS, found + MEANS_OF_AXIS_AT);
    }
}

static void end_record(
    const MotionSystem *system, const MotionState *state, const Watch *watched, size_t steps, MotionRecord *record)
{
    double per_step = 1.0 / (double)(steps > 0 ? steps : 1), absorbed = 0.0;
    for (size_t p = 0; p < system->points; p++) {
        double *found = record->of_points + MOTION_OF_POINT * p;
        for (int k = 0; k < 2; k++)
            found[GREATEST[k]] = sqrt(found[GREATEST[k]]);
        for (int i = 0; i < MEANS; i++)
            found[MEANS_OF_POINT_AT + i] *= per_step;
    }
    for (size_t a = 0; a < system->axes; a++) {
        double *found = record->of_axes + MOTION_OF_AXIS * a;
        const MotionAxis *axis = system->axis + a;
        found[0] = watched->axes.low[0][a];
        found[1] = watched->axes.high[0][a];
        found[2] = watched->axes.high[3][a];
        found[3] = watched->axes.low[1][a];
        found[4] = watched->axes.high[1][a];
        found[7] = watched->axes.high[2][a];
        found[5] = axis->parallel * axis->series * spring_absorbed_energy(axis->law, &state->axis[a].memory);
        for (int i = 0; i < MEANS_OF_AXIS; i++)
            found[MEANS_OF_AXIS_AT + i] *= per_step;
        absorbed += found[5];
    }
    for (size_t b = 0; b < system->bodies; b++)
        record->of_bodies[MOTION_OF_BODY * b] = 2.0 * asin(clip(sqrt(record->of_bodies[MOTION_OF_BODY * b]), 0.0, 1.0));
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

/* The change of a channel over step k: the smaller of the differences to the averages of its neighbours, so that a jump
 * between steps stays where it is. */
static double change_over(const double *averages, size_t k, size_t count)
{
    double before = k > 0 ? averages[k] - averages[k - 1] : INFINITY;
    double after = k + 1 < count ? averages[k + 1] - averages[k] : INFINITY;
    double smaller = fabs(before) < fabs(after) ? before : after;
    return count > 1 ? smaller : 0.0;
}

/* Whether a channel jumps at the end of step k, by more than it changes beside: courses have corners or jumps there. */
static int is_jump(const MotionSystem *system, const double *values, size_t k, size_t count)
{
    for (size_t c = 0; c < system->channels && k + 1 < count; c++) {
        const double *row = values + c * count;
        double before = change_over(row, k, count), after = change_over(row, k + 1, count);
        double jump = row[k + 1] - row[k] - 0.5 * (before + after);
        if (fabs(jump) > fabs(before) + fabs(after))
            return 1;
    }
    return 0;
}

size_t motion_run(
    const MotionSystem *system, MotionState *state, size_t count, double h, const double *values, MotionRecord *record)
{
    Watch watched;
    double now[MOTION_CHANNELS], change[MOTION_CHANNELS], loads[MOTION_CHANNELS] = {0.0}, course[MOTION_CHANNELS];
    size_t k = 0, averaged = 0;
    begin_record(system, state, &watched, record);
    for (size_t c = 0; c < system->channels && count > 0; c++)
        loads[c] = values[c * count] - 0.5 * change_over(values + c * count, 0, count);
    watch_points(system, state, loads, &watched, record->of_points);
    watch_axes(system, state, &watched);
    watch_bodies(system, state, &watched, record->of_bodies);
    add_means(system, 0.0, &watched, record);
    write_row(system, state, &watched, 0, record);
    int is_after_jump = 0;
    for (; k < count; k++) {
        /* The course of the channels over the step, for velocities of the base and accelerations at its end. */
        for (size_t c = 0; c < system->channels; c++) {
            now[c] = values[c * count + k];
            change[c] = change_over(values + c * count, k, count);
            loads[c] = now[c] + 0.5 * change[c];
        }
        if (is_after_jump) {
            for (size_t c = 0; c < system->channels; c++)
                course[c] = now[c] - 0.5 * change[c];
            advance_watch(&watched, h * (double)k, 1);
            watch_points(system, state, course, &watched, record->of_points);
            watch_axes(system, state, &watched);
            watch_bodies(system, state, &watched, record->of_bodies);
            add_means(system, 0.0, &watched, record);
        }
        is_after_jump = is_jump(system, values, k, count);
        motion_of_base(system, change, 1.0, state->spin_slope);
        for (int i = 0; i < 3; i++)
            state->spin_slope[i] /= h;
        size_t turns = system->axes + 1;
        for (double left = h; left > 0.0;) {
            motion_of_base(system, loads, 1.0, state->end_spin);
            double part = motion_part(system, state, now, left, &turns);
            if (part == 0.0)
                goto diverged;
            left -= part;
            double share = 1.0 - left / h, time = h * ((double)k + share);
            for (size_t c = 0; c < system->channels; c++)
                course[c] = now[c] + (share - 0.5) * change[c];
            advance_watch(&watched, time, left > 0.0 || is_after_jump);
            watch_points(system, state, course, &watched, record->of_points);
            watch_axes(system, state, &watched);
            watch_bodies(system, state, &watched, record->of_bodies);
            add_means(system, k >= record->settled ? 0.5 * part / h : 0.0, &watched, record);
        }
        averaged += k >= record->settled;
        if ((k + 1) % record->stride == 0)
            write_row(system, state, &watched, (k + 1) / record->stride, record);
    }
diverged:
    end_record(system, state, &watched, averaged, record);
    return k;
}
