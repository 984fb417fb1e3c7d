#include "system_block.h"

#include <math.h> /* HUGE_VAL, of stops */

/* Volatile, since it is overwritten in the finished binary. */
static const volatile SystemBlock system_block = {
    .magic = "strandspringsys",
    .size = sizeof(SystemBlock),
    .version = 2,
#include "system_values.h"
};

Guid fmu_guid(void)
{
    Guid guid;
    fmu_copy_block(&guid, &system_block.guid, sizeof guid);
    return guid;
}

const void *fmu_identity(void)
{
    return (const void *)&system_block;
}

SystemCounts system_counts(void)
{
    SystemCounts counts;
    fmu_copy_block(&counts, &system_block.counts, sizeof counts);
    return counts;
}

SystemStart system_start(void)
{
    SystemStart start;
    fmu_copy_block(&start, system_block.values, sizeof start);
    return start;
}

int system_is_within(const SystemStart *bounds, unsigned parameter, double value)
{
    return value >= ((const double *)&bounds->low)[parameter] && value <= ((const double *)&bounds->high)[parameter];
}

int system_are_possible(const SystemSettings *settings)
{
    SystemStart bounds = system_start();
    for (unsigned i = 0; i < SYSTEM_PARAMETERS; i++)
        if (!system_is_within(&bounds, i, ((const double *)settings)[i]))
            return 0;
    return 1;
}

/* Copies the next values, and goes on behind them. */
static void take(const volatile double **next, double *to, size_t count)
{
    fmu_copy_block(to, *next, count * sizeof *to);
    *next += count;
}

static int take_count(const volatile double **next)
{
    double count;
    take(next, &count, 1);
    return (int)count;
}

static void take_spring(const volatile double **next, SpringParameters *spring)
{
    *spring = (SpringParameters){0};
    spring->elastic = take_count(next);
    spring->amplifier = take_count(next);
    spring->knots = take_count(next);
    spring->forces = take_count(next);
    take(next, spring->kE, (size_t)spring->elastic);
    take(next, spring->kA, (size_t)spring->amplifier);
    take(next, spring->FE_knots, (size_t)spring->knots);
    take(next, spring->FE_forces, (size_t)spring->forces);
    double *const scalars[] = {
        &spring->kappa_omega,         &spring->rho,              &spring->sigma,           &spring->n,
        &spring->displacement_offset, &spring->displacement_min, &spring->displacement_max};
    for (size_t i = 0; i < sizeof scalars / sizeof *scalars; i++)
        take(next, scalars[i], 1);
}

static void take_added(const volatile double **next, SpringAdded *added)
{
    added->mechanisms = take_count(next);
    added->amplifier = take_count(next);
    added->branches = take_count(next);
    take(next, added->kA, (sizeof *added - offsetof(SpringAdded, kA)) / sizeof(double));
}

void system_parts(SpringLaw *laws, SpringAdded *added, MotionBody *bodies, MotionMount *mounts, MotionAxis *axes,
                  MotionPoint *points, MotionChannel *channels)
{
    enum { OF_AXIS = (sizeof(MotionAxis) - offsetof(MotionAxis, direction)) / sizeof(double) };
    SystemCounts counts = system_counts();
    const volatile double *next = system_block.values + sizeof(SystemStart) / sizeof(double);
    for (int64_t i = 0; i < counts.springs; i++)
        take_spring(&next, &laws[i].parameters);
    for (int64_t i = 0; i < counts.added; i++)
        take_added(&next, added + i);
    take(&next, (double *)bodies, (size_t)counts.bodies * sizeof *bodies / sizeof(double));
    take(&next, (double *)mounts, (size_t)counts.mounts * sizeof *mounts / sizeof(double));
    for (int64_t i = 0; i < counts.axes; i++) {
        axes[i].law = laws + take_count(&next);
        int second = take_count(&next), own = take_count(&next);
        axes[i].second = second < 0 ? NULL : laws + second;
        axes[i].added = own < 0 ? NULL : added + own;
        take(&next, axes[i].direction, OF_AXIS);
    }
    take(&next, (double *)points, (size_t)counts.points * sizeof *points / sizeof(double));
    take(&next, (double *)channels, (size_t)counts.channels * sizeof *channels / sizeof(double));
}

VariableName system_name(unsigned reference)
{
    VariableName name;
    const volatile char *next = system_block.names;
    for (; reference > 0; next++)
        reference -= *next == '\0';
    size_t length = 0;
    while (length < sizeof name.text - 1 && next[length] != '\0') {
        name.text[length] = next[length];
        length++;
    }
    name.text[length] = '\0';
    return name;
}
