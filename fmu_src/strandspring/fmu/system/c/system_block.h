/* The block of the binary that holds one system of bodies on mounts.
 *
 * As with core/c/fmu/fmu_block.c a binary is compiled once for all systems, and making an FMU of it means to overwrite the
 * block; fmu/system/system_block.py does so, and writes the same values into system_values.h. Counts stand in front;
 * the values are, one behind the other:
 *
 *     SystemStart
 *     each spring      the four counts of SpringParameters, the values used of its arrays, its scalars; a second
 *                      mechanism is a spring of its own
 *     each added       SpringAdded, what a spring has beside the paper's
 *     each body        MotionBody, which is of numbers only, like the next
 *     each mount       MotionMount
 *     each axis        the numbers of its spring, second mechanism and added, -1 for none; then MotionAxis from there on
 *     each point       MotionPoint
 *     each channel     MotionChannel
 *
 * and the names are those of the variables in the order of their value references, each terminated. */
#ifndef SYSTEM_BLOCK_H
#define SYSTEM_BLOCK_H

#include "../../../core/c/fmi/fmu_bytes.h"
#include "../../../kernel/c/motion/motion.h"

#include <stdint.h>

enum { SYSTEM_VALUES = 32768, SYSTEM_NAMES = 131072, SYSTEM_NAME = 64 };

/* Values of the fixed parameters, in the order of their value references. */
typedef struct {
    double step, omega_start, gravity[3];
} SystemSettings;

enum { SYSTEM_PARAMETERS = sizeof(SystemSettings) / sizeof(double) };

/* Start values, and the bounds of what may be set. */
typedef struct {
    SystemSettings settings, low, high;
} SystemStart;

typedef struct {
    int64_t springs, added, bodies, mounts, axes, points, channels;
} SystemCounts;

/* Little-endian on every platform, without padding. */
typedef struct {
    char magic[16];
    uint32_t size, version;
    char guid[sizeof(Guid)];
    SystemCounts counts;
    double values[SYSTEM_VALUES];
    char names[SYSTEM_NAMES];
} SystemBlock;

SPRING_LOCAL SystemCounts system_counts(void);
SPRING_LOCAL SystemStart system_start(void);

/* Whether a parameter, by its place in SystemSettings, may have a value. */
SPRING_LOCAL int system_is_within(const SystemStart *bounds, unsigned parameter, double value);

/* Whether all parameters are what they may be. */
SPRING_LOCAL int system_are_possible(const SystemSettings *settings);

/* The parts of the system; the laws of axes are of `laws`, whose parameters are filled in. */
SPRING_LOCAL void system_parts(
    SpringLaw *laws, SpringAdded *added, MotionBody *bodies, MotionMount *mounts, MotionAxis *axes, MotionPoint *points,
    MotionChannel *channels);

typedef struct {
    char text[SYSTEM_NAME];
} VariableName;

SPRING_LOCAL VariableName system_name(unsigned reference);

#endif
