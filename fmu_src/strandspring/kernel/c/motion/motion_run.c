#include "motion_parts.h"

#include "../../../core/c/spring/numerics.h"

/* Of a point: the squares of the sizes of acceleration and way from the beginning, then the components of both. */
enum { OF_POINT = 8, SIZES = 2, COURSES = OF_POINT - SIZES };
/* Where of_points of a point holds the greatest of each, and the time of the first; and where the means begin. */
static const int GREATEST_AT[OF_POINT] = {0, 5, 2, 3, 4, 6, 7, 8};
enum { TIME_AT = 1, MEANS_OF_POINT_AT = 9 };

/* What is looked at after each part of a step, in arrays without gaps, whose loops the compiler turns into few
 * instructions.
 *
 * accelerations, sway, start   3 of each point; the sway at the beginning
 * values     of the three last times, the newest last: OF_POINT of each point, the square of the sine of half the tilt
 *            of each body, |rate| of each axis, |force| of each axis, the square of the force of each mount, that of the
 *            force on the base, its components
 * greatest   of each of these, and when
 * low, high  displacement of a spring of each axis, omega of each axis; stroke: where each spring turned last
 * courses    what means are taken of: COURSES of each point; their sums and those of their squares */
typedef struct {
    double time[3];
    int is_sharp[3]; /* no course is smooth where a part of a step ends at a turn, or a load has a corner or jumps */
    size_t watched, averaged;
    int near;                      /* how often the three last values may still hold a peak */
    double weight;                 /* in the means, of the time before the values last taken */
    double turn[MOTION_BODIES][4]; /* at the beginning */
    double *accelerations, *sway, *start, *values[3], *greatest, *at, *low, *high, *stroke, *courses, *sums, *squares;
} Watch;

static size_t count_watched(size_t bodies, size_t mounts, size_t axes, size_t points)
{
    return OF_POINT * points + bodies + 2 * axes + mounts + MOTION_OF_BASE;
}

size_t motion_workspace(size_t bodies, size_t mounts, size_t axes, size_t points)
{
    size_t watched = count_watched(bodies, mounts, axes, points), averaged = COURSES * points;
    return 9 * points + 5 * watched + 5 * axes + 3 * averaged;
}

static double *zeros(Workspace *workspace, size_t count)
{
    return memset(linear_taken(workspace, count), 0, count * sizeof(double));
}

/* ---- extremes ---------------------------------------------------------------------------------------------------- */

/* A peak is at the vertex of the parabola through the last three values, which lies between them where the middle one
 * is the greatest; where an outer one is and has a corner, it may. Where a step has ended early there is no parabola
 * next to a part below LEAST_PART of the other: the error of a damper's force, at a velocity foreseen, over so short
 * a time is no slope. */
static const double LEAST_PART = 0.05;
static void note_greatest(Watch *watch, size_t i)
{
    const double *t = watch->time;
    const int *is_sharp = watch->is_sharp;
    double first = watch->values[0][i], middle = watch->values[1][i], last = watch->values[2][i];
    double greatest = watch->greatest[i];
    if (!((first >= greatest) | (middle >= greatest) | (last >= greatest)))
        return;
    if (last > greatest) {
        watch->greatest[i] = greatest = last;
        watch->at[i] = t[2];
    }
    int may_be_peak = first < middle ? middle > last || is_sharp[2] : is_sharp[0] && first > last;
    if (!may_be_peak || is_sharp[1] || t[1] <= t[0])
        return;
    double before = t[1] - t[0], after = t[2] - t[1];
    if (before < LEAST_PART * after || after < LEAST_PART * before)
        return;
    double left = (middle - first) / before, right = (last - middle) / after;
    double bend = (right - left) / (t[2] - t[0]), slope = left + bend * before;
    double way = -0.5 * slope / bend, vertex = middle + 0.5 * slope * way;
    if (bend < 0.0 && t[0] < t[1] + way && t[1] + way < t[2] && vertex > greatest) {
        watch->greatest[i] = vertex;
        watch->at[i] = t[1] + way;
    }
}

static int is_any_greater(size_t count, const double *restrict last, const double *restrict greatest)
{
    int is_any = 0;
    for (size_t i = 0; i < count; i++)
        is_any |= last[i] > greatest[i];
    return is_any;
}

static void add_means(
    size_t count, double weight, const double *restrict courses, double *restrict sums, double *restrict squares)
{
    for (size_t i = 0; i < count; i++) {
        double part = weight * courses[i];
        sums[i] += part;
        squares[i] += part * courses[i];
    }
}

/* Extremes and sums with the values last taken. This is done when the next are taken: read at once, in pairs, what has
 * just been written one by one would have to be waited for. `next` is the weight of the time after them. */
static void settle(Watch *watch, double next)
{
    if (is_any_greater(watch->watched, watch->values[2], watch->greatest))
        watch->near = 3;
    if (watch->near > 0) {
        watch->near--;
        for (size_t i = 0; i < watch->watched; i++)
            note_greatest(watch, i);
    }
    if (watch->weight + next != 0.0)
        add_means(watch->averaged, 0.5 * (watch->weight + next), watch->courses, watch->sums, watch->squares);
}

/* ---- after each part of a step ----------------------------------------------------------------------------------- */

static void take_points(const MotionSystem *system, const MotionState *state, const double *loads, Watch *watch)
{
    motion_of_points(system, state, loads, watch->accelerations, watch->sway);
    for (size_t p = 0; p < system->points; p++) {
        const double *a = watch->accelerations + 3 * p;
        double *value = watch->values[2] + OF_POINT * p, *course = watch->courses + COURSES * p, *way = course + 3;
        for (int i = 0; i < 3; i++) {
            course[i] = a[i];
            way[i] = watch->sway[3 * p + i] - watch->start[3 * p + i];
            value[SIZES + i] = fabs(a[i]);
            value[SIZES + 3 + i] = fabs(way[i]);
        }
        value[0] = dot3(a, a);
        value[1] = dot3(way, way);
    }
}

static void take_bodies(const MotionSystem *system, const MotionState *state, Watch *watch)
{
    double *value = watch->values[2] + OF_POINT * system->points;
    for (size_t b = 0; b < system->bodies; b++) {
        const double *q = state->body[b].turn, *start = watch->turn[b];
        double back[4] = {start[0], -start[1], -start[2], -start[3]}, turn[4];
        if (system->body[b].turns == 0.0)
            continue;
        quaternion_product(back, q, turn);
        value[b] = dot3(turn + 1, turn + 1);
    }
}

static void widen(Watch *watch, size_t axes, size_t a, double displacement, double omega)
{
    watch->low[a] = fmin(watch->low[a], displacement);
    watch->high[a] = fmax(watch->high[a], displacement);
    watch->low[axes + a] = fmin(watch->low[axes + a], omega);
    watch->high[axes + a] = fmax(watch->high[axes + a], omega);
}

/* Displacement and omega of a spring are extreme where a stroke begins, or at the end. */
static void take_axes(const MotionSystem *system, const MotionState *state, Watch *watch)
{
    size_t axes = system->axes;
    double *rate = watch->values[2] + OF_POINT * system->points + system->bodies, *force = rate + axes;
    for (size_t a = 0; a < axes; a++) {
        const MotionAxisState *own = state->axis + a;
        const SpringMemory *memory = &own->memory;
        if (memory->start != watch->stroke[a]) {
            watch->stroke[a] = memory->start;
            widen(watch, axes, a, memory->start,
                  memory->direction * spring_saturation(system->axis[a].law->table, memory->start_xi));
        }
        rate[a] = fabs(own->rate);
        force[a] = fabs(own->force);
    }
}

static void take_mounts(const MotionSystem *system, const MotionState *state, Watch *watch)
{
    double *value = watch->values[2] + OF_POINT * system->points + system->bodies + 2 * system->axes, reaction[3];
    for (size_t m = 0; m < system->mounts; m++)
        *value++ = dot3(state->reach[m].force, state->reach[m].force);
    motion_reaction(system, state, reaction);
    value[0] = dot3(reaction, reaction);
    for (int i = 0; i < 3; i++)
        value[1 + i] = fabs(reaction[i]);
}

/* Takes all values at a time; `weight` is how much of a step has passed since the last, for means. */
static void take(
    const MotionSystem *system, const MotionState *state, const double *loads, double time, int is_sharp, double weight,
    Watch *watch)
{
    settle(watch, weight);
    double *oldest = watch->values[0];
    watch->values[0] = watch->values[1];
    watch->values[1] = watch->values[2];
    watch->values[2] = oldest;
    for (int i = 0; i < 2; i++) {
        watch->time[i] = watch->time[i + 1];
        watch->is_sharp[i] = watch->is_sharp[i + 1];
    }
    watch->time[2] = time;
    watch->is_sharp[2] = is_sharp;
    watch->weight = weight;
    take_points(system, state, loads, watch);
    take_bodies(system, state, watch);
    take_axes(system, state, watch);
    take_mounts(system, state, watch);
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
    const MotionSystem *system, const MotionState *state, const Watch *watch, size_t row, MotionRecord *record)
{
    size_t of_points = 3 * system->points;
    memcpy(record->accelerations + row * of_points, watch->accelerations, of_points * sizeof(double));
    memcpy(record->after_jumps + row * of_points, watch->accelerations, of_points * sizeof(double));
    memcpy(record->sway + row * of_points, watch->sway, of_points * sizeof(double));
    for (size_t a = 0; a < system->axes; a++) {
        record->displacements[row * system->axes + a] = state->axis[a].memory.displacement;
        record->forces[row * system->axes + a] = state->axis[a].force;
    }
}

static void begin(const MotionSystem *system, const MotionState *state, Watch *watch, MotionRecord *record)
{
    static const double UNLOADED[MOTION_CHANNELS] = {0.0};
    size_t points = system->points, axes = system->axes;
    Workspace workspace = {.memory = record->workspace};
    *watch = (Watch){.is_sharp = {0, 0, 1}, .averaged = COURSES * points};
    watch->watched = count_watched(system->bodies, system->mounts, axes, points);
    watch->accelerations = zeros(&workspace, 3 * points);
    watch->sway = zeros(&workspace, 3 * points);
    watch->start = zeros(&workspace, 3 * points);
    for (int i = 0; i < 3; i++)
        watch->values[i] = zeros(&workspace, watch->watched);
    watch->greatest = zeros(&workspace, watch->watched);
    watch->at = zeros(&workspace, watch->watched);
    watch->low = zeros(&workspace, 2 * axes);
    watch->high = zeros(&workspace, 2 * axes);
    watch->stroke = zeros(&workspace, axes);
    watch->courses = zeros(&workspace, watch->averaged);
    watch->sums = zeros(&workspace, watch->averaged);
    watch->squares = zeros(&workspace, watch->averaged);
    motion_of_points(system, state, UNLOADED, watch->accelerations, watch->start);
    for (size_t b = 0; b < system->bodies; b++)
        memcpy(watch->turn[b], state->body[b].turn, sizeof watch->turn[b]);
    for (size_t a = 0; a < axes; a++) {
        const SpringMemory *memory = &state->axis[a].memory;
        record->of_axes[MOTION_OF_AXIS * a + 6] = memory->displacement;
        watch->stroke[a] = memory->start;
        watch->low[a] = watch->high[a] = memory->displacement;
        watch->low[axes + a] = watch->high[axes + a] = memory->omega;
    }
    record->energies[0] = kinetic_energy(system, state);
    record->energies[4] = -stop_energy(system, state);
}

static void end(const MotionSystem *system, const MotionState *state, Watch *watch, size_t steps, MotionRecord *record)
{
    settle(watch, 0.0);
    size_t points = system->points, bodies = system->bodies, axes = system->axes;
    double per_step = 1.0 / (double)(steps > 0 ? steps : 1), absorbed = 0.0;
    const double *greatest = watch->greatest, *at = watch->at, *sums = watch->sums, *squares = watch->squares;
    for (size_t p = 0; p < points; p++) {
        double *found = record->of_points + MOTION_OF_POINT * p;
        for (int i = 0; i < OF_POINT; i++)
            found[GREATEST_AT[i]] = i < SIZES ? sqrt(greatest[OF_POINT * p + i]) : greatest[OF_POINT * p + i];
        found[TIME_AT] = at[OF_POINT * p];
        for (int i = 0; i < 3; i++) {
            found[MEANS_OF_POINT_AT + i] = per_step * squares[COURSES * p + i];
            found[MEANS_OF_POINT_AT + 3 + i] = per_step * sums[COURSES * p + 3 + i];
            found[MEANS_OF_POINT_AT + 6 + i] = per_step * squares[COURSES * p + 3 + i];
        }
    }
    greatest += OF_POINT * points;
    at += OF_POINT * points;
    for (size_t b = 0; b < bodies; b++) {
        record->of_bodies[MOTION_OF_BODY * b] = 2.0 * asin(clip(sqrt(greatest[b]), 0.0, 1.0));
        record->of_bodies[MOTION_OF_BODY * b + 1] = at[b];
    }
    greatest += bodies;
    for (size_t a = 0; a < axes; a++) {
        double energy = motion_absorbed(system, state, a);
        double start = record->of_axes[MOTION_OF_AXIS * a + 6];
        widen(watch, axes, a, state->axis[a].memory.displacement, state->axis[a].memory.omega);
        const double found[MOTION_OF_AXIS] = {
            watch->low[a], watch->high[a], greatest[axes + a], watch->low[axes + a], watch->high[axes + a],
            energy, start, greatest[a]};
        memcpy(record->of_axes + MOTION_OF_AXIS * a, found, sizeof found);
        absorbed += energy;
    }
    greatest += 2 * axes;
    for (size_t m = 0; m < system->mounts; m++)
        record->of_mounts[m] = sqrt(*greatest++);
    record->of_base[0] = sqrt(greatest[0]);
    memcpy(record->of_base + 1, greatest + 1, (MOTION_OF_BASE - 1) * sizeof *greatest);
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

/* ---- a run ------------------------------------------------------------------------------------------------------- */

/* Of the changes of a channel beside a corner. */
static const double CORNER_ROUNDING = 1e-6;

/* The change of a channel over step k: the difference to the average before or after, on whose side the channel is the
 * straighter, so that corners and jumps between steps stay where they are; near the ends the smaller of the two. */
static double change_over(const double *averages, size_t k, size_t count)
{
    const double *at = averages + k;
    if (count < 2)
        return 0.0;
    if (k == 0)
        return at[1] - at[0];
    double before = at[0] - at[-1];
    if (k + 1 == count)
        return before;
    double after = at[1] - at[0], bend_before = fabs(before), bend_after = fabs(after);
    if (k > 1 && k + 2 < count) {
        bend_before = fabs(before - (at[-1] - at[-2]));
        bend_after = fabs(after - (at[2] - at[1]));
    }
    return bend_before < bend_after ? before : after;
}

/* The changes of all channels over a step, or over the last one. */
static void changes_over(const MotionSystem *system, const double *values, size_t k, size_t count, double *changes)
{
    for (size_t c = 0; c < system->channels; c++)
        changes[c] = change_over(values + c * count, k < count ? k : count - 1, count);
}

/* Whether a channel jumps between steps k and k + 1, by more than it changes beside. */
static int is_jump(
    const MotionSystem *system, const double *values, size_t k, size_t count, const double *change, const double *next)
{
    for (size_t c = 0; c < system->channels && k + 1 < count; c++) {
        const double *row = values + c * count;
        double jump = row[k + 1] - row[k] - 0.5 * (change[c] + next[c]);
        if (fabs(jump) > fabs(change[c]) + fabs(next[c]))
            return 1;
    }
    return 0;
}

/* Whether a channel has a corner there: its changes, of four steps, differ by more than those beside, and rounding. */
static int is_corner(const MotionSystem *system, double *const changes[4])
{
    for (size_t c = 0; c < system->channels; c++) {
        double change = changes[1][c], next = changes[2][c];
        double beside = fabs(change - changes[0][c]) + fabs(changes[3][c] - next);
        if (fabs(next - change) > beside + CORNER_ROUNDING * (fabs(change) + fabs(next)))
            return 1;
    }
    return 0;
}

size_t motion_run(
    const MotionSystem *system, MotionState *state, size_t count, double h, const double *values, MotionRecord *record)
{
    Watch watch;
    double now[MOTION_CHANNELS], loads[MOTION_CHANNELS] = {0.0}, course[MOTION_CHANNELS];
    double room[4][MOTION_CHANNELS], *changes[4] = {room[0], room[1], room[2], room[3]}; /* of steps k - 1 to k + 2 */
    size_t k = 0, averaged = 0, row = 0, since_row = 0;
    int is_after_jump = 0;
    begin(system, state, &watch, record);
    for (size_t i = 0; i < 4 && count > 0; i++)
        changes_over(system, values, i > 0 ? i - 1 : 0, count, changes[i]);
    for (size_t c = 0; c < system->channels && count > 0; c++)
        loads[c] = values[c * count] - 0.5 * changes[1][c];
    motion_turn_base(system, state, loads);
    take(system, state, loads, 0.0, 1, 0.0, &watch);
    write_row(system, state, &watch, row, record);
    for (; k < count; k++) {
        /* The course of the channels over the step, for velocities of the base and accelerations at its end. */
        const double *change = changes[1];
        for (size_t c = 0; c < system->channels; c++) {
            now[c] = values[c * count + k];
            loads[c] = now[c] + 0.5 * change[c];
        }
        if (is_after_jump) {
            for (size_t c = 0; c < system->channels; c++)
                course[c] = now[c] - 0.5 * change[c];
            motion_turn_base(system, state, course);
            take(system, state, course, h * (double)k, 1, 0.0, &watch);
            if (since_row == 0)
                memcpy(record->after_jumps + 3 * system->points * row, watch.accelerations,
                       3 * system->points * sizeof(double));
        }
        is_after_jump = is_jump(system, values, k, count, change, changes[2]);
        int is_sharp = is_after_jump || is_corner(system, changes);
        motion_of_base(system, change, 1.0, state->spin_slope);
        for (int i = 0; i < 3; i++)
            state->spin_slope[i] /= h;
        size_t turns = record->turns;
        for (double left = h; left > 0.0;) {
            motion_of_base(system, loads, 1.0, state->end_spin);
            double part = motion_part(system, state, now, left, &turns);
            if (part == 0.0)
                goto diverged;
            left -= part;
            double share = 1.0 - left / h;
            for (size_t c = 0; c < system->channels; c++)
                course[c] = now[c] + (share - 0.5) * change[c];
            take(system, state, course, h * ((double)k + share), left > 0.0 || is_sharp,
                 k >= record->settled ? part / h : 0.0, &watch);
        }
        averaged += k >= record->settled;
        double *oldest = changes[0];
        memmove(changes, changes + 1, 3 * sizeof *changes);
        changes[3] = oldest;
        changes_over(system, values, k + 3, count, oldest);
        if (++since_row == record->stride) {
            since_row = 0;
            write_row(system, state, &watch, ++row, record);
        }
    }
diverged:
    end(system, state, &watch, averaged, record);
    return k;
}
