/* The hysteretic springs of strandspring in C, without FMI and without an operating system: nothing is allocated, no
 * global variable changes, no mathematics library is called, and no function that a step takes is recursive or loops
 * without a bound.
 *
 *     #include "mount_law.h"
 *
 *     int main(void)
 *     {
 *         SpringMemory memory = spring_start(0.0, 0.0);    // at a displacement [m], with this omega
 *         double before = spring_force(&mount_law, &memory);
 *         spring_commit(&mount_law, &memory, NULL, 0.001); // a step to another displacement [m]
 *         double after = spring_force(&mount_law, &memory);
 *         return after > before ? 0 : 1;
 *     }
 *
 * mount_law.h and mount_law.c are what `strandspring export mount.json --c` writes beside this file: the constant law
 * and its table, which may lie in flash. Compile them with spring.c, saturation.c and spline.c, as C11 with IEEE doubles,
 * with -ffp-contract=off; then all machines give the same bits. With -ffast-math or -Ofast they do not compile.
 *
 * A spring with a second mechanism or Maxwell branches (branches.h) is the sum of mount_law_first and what it has
 * besides, and has no mount_law. Steps take time, and branches.c is compiled, too. A C program steps it so:
 *
 *     #include "mount_law.h"
 *
 *     static double force(const SpringMemory *first, const SpringAddedMemory *added)
 *     {
 *         return spring_force(&mount_law_first, first)
 *             + spring_added_force(&mount_law_added, &mount_law_second, added);
 *     }
 *
 *     int main(void)
 *     {
 *         const SpringAdded *has = &mount_law_added;
 *         SpringMemory first = spring_start(0.0, 0.0);
 *         SpringAddedMemory added = spring_added_start(0.0, 0.0); // the other mechanism's omega; no force in branches
 *         SpringDecay decays[SPRING_MAXWELLS];                    // over steps of 0.01 s
 *         double before = force(&first, &added);
 *         for (int i = 0; i < has->branches; i++)
 *             decays[i] = spring_decay(0.01 / has->time_constant[i]);
 *         spring_added_commit(has, &mount_law_second, &added, 0, first.displacement, 0.001, 0.01, decays);
 *         spring_commit(&mount_law_first, &first, NULL, 0.001);
 *         return force(&first, &added) > before ? 0 : 1;
 *     }
 *
 * What a step of one mechanism may call, in bounded time, with a stack of less than 512 bytes (units are SI: m, N, N/m, J):
 *
 *     spring_commit           advances the memory along a straight path to a displacement, |displacement| <= 1e9 m and
 *                             finite, which is for the caller to see to; its third argument is NULL. Beyond
 *                             displacement_min .. displacement_max the force is extrapolated.
 *     spring_trial            the memory after such a path, the given one being left as it is: for solvers that try
 *     spring_force            restoring force [N]
 *     spring_stiffness        tangent stiffness in the direction of the last motion [N/m]
 *     spring_absorbed_energy  energy absorbed since spring_start [J]; spring_integrate after it makes the next call
 *                             cheap
 *     memory.omega            the hysteretic state, -1 .. 1
 *     spring_change           goes on with another law at the same displacement and omega
 *
 * SpringMemory is a plain value: a copy of it is a snapshot. Read its displacement and omega, and leave the rest to the
 * functions. One memory belongs to one thread at a time; any number of threads may share a law and its table.
 *
 * Parameters are changed by two laws: outside the deadline write the one that is not in use by spring_prepare (5 kB of
 * stack), then, in a step, call spring_change(in_use, prepared, &memory, NULL) and take the other one from there on.
 * Parameters must be those of a possible spring (spring_problem of the package says what is wrong with others). A law
 * keeps the table of its n and sigma, which any number of laws share; another n or sigma needs another table, which is
 * exported too.
 *
 * A target with a mathematics library can make tables itself, outside the deadline: delete the line that defines
 * SPRING_STEPS_ONLY in spring_local.h, compile saturation_table.c too, and call spring_tabulate(&table, n, sigma,
 * SPRING_WITH_ENERGIES), 0.01 <= n <= 100 and 0.5 <= sigma <= 1000. Their last bits depend on the mathematics library.
 */
#ifndef STRANDSPRING_H
#define STRANDSPRING_H

#include "spring_library.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "spring.h"

#ifdef __cplusplus
}
#endif

#endif
