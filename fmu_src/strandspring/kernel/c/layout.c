/* Where the compiler has put the fields of the structures that Python shares, which library.py compares with where ctypes
 * has put them. The field of a whole structure is empty, and its bytes are those of its end. */
#include <stddef.h>

typedef struct {
    const char *structure, *field;
    size_t bytes;
} KernelPlace;

#define SIZE(type) {#type, "", sizeof(type)}
#define AT(type, field) {#type, #field, offsetof(type, field)}

static const KernelPlace PLACES[] = {
    SIZE(SpringTable), SIZE(SpringLaw), SIZE(MotionBodyState), SIZE(MotionReach), SIZE(MotionAxisState),
    SIZE(SpringParameters), AT(SpringParameters, elastic), AT(SpringParameters, amplifier), AT(SpringParameters, knots),
    AT(SpringParameters, forces), AT(SpringParameters, kE), AT(SpringParameters, kA), AT(SpringParameters, FE_knots),
    AT(SpringParameters, FE_forces), AT(SpringParameters, kappa_omega), AT(SpringParameters, rho),
    AT(SpringParameters, sigma), AT(SpringParameters, n), AT(SpringParameters, displacement_offset),
    AT(SpringParameters, displacement_min), AT(SpringParameters, displacement_max),
    SIZE(FourierBasis), AT(FourierBasis, harmonics), AT(FourierBasis, samples), AT(FourierBasis, rows),
    SIZE(BalancedAxis), AT(BalancedAxis, law), AT(BalancedAxis, start), AT(BalancedAxis, parallel),
    AT(BalancedAxis, series), AT(BalancedAxis, position), AT(BalancedAxis, damping), AT(BalancedAxis, stop_low), AT(BalancedAxis, stop_high),
    AT(BalancedAxis, stop_stiffness), AT(BalancedAxis, low), AT(BalancedAxis, high),
    SIZE(BalancedSystem), AT(BalancedSystem, degrees), AT(BalancedSystem, axes), AT(BalancedSystem, basis),
    AT(BalancedSystem, axis), AT(BalancedSystem, mass), AT(BalancedSystem, along), AT(BalancedSystem, bend),
    AT(BalancedSystem, load), AT(BalancedSystem, forcing),
    AT(BalancedSystem, workspace),
    SIZE(BalancedMotion), AT(BalancedMotion, of_axes), AT(BalancedMotion, force),
    SIZE(MotionBody), AT(MotionBody, mass), AT(MotionBody, center), AT(MotionBody, translations),
    AT(MotionBody, rotations), AT(MotionBody, inertia), AT(MotionBody, inverse_inertia), AT(MotionBody, turns),
    AT(MotionBody, is_free),
    SIZE(MotionMount), AT(MotionMount, place), AT(MotionMount, support_place), AT(MotionMount, body),
    AT(MotionMount, support), AT(MotionMount, first), AT(MotionMount, axes),
    SIZE(MotionAxis), AT(MotionAxis, law), AT(MotionAxis, direction), AT(MotionAxis, nominal), AT(MotionAxis, parallel),
    AT(MotionAxis, series), AT(MotionAxis, damping), AT(MotionAxis, stop_low), AT(MotionAxis, stop_high),
    AT(MotionAxis, stop_stiffness),
    SIZE(MotionPoint), AT(MotionPoint, place), AT(MotionPoint, body),
    SIZE(MotionChannel), AT(MotionChannel, direction), AT(MotionChannel, place), AT(MotionChannel, kind),
    AT(MotionChannel, body),
    SIZE(MotionSystem), AT(MotionSystem, bodies), AT(MotionSystem, mounts), AT(MotionSystem, axes),
    AT(MotionSystem, points), AT(MotionSystem, channels), AT(MotionSystem, coupled), AT(MotionSystem, body), AT(MotionSystem, mount),
    AT(MotionSystem, axis), AT(MotionSystem, point), AT(MotionSystem, channel),
    SIZE(MotionState), AT(MotionState, body), AT(MotionState, reach), AT(MotionState, axis),
    SIZE(MotionRecord), AT(MotionRecord, of_points), AT(MotionRecord, of_axes), AT(MotionRecord, of_bodies),
    AT(MotionRecord, of_mounts), AT(MotionRecord, of_base), AT(MotionRecord, energies), AT(MotionRecord, accelerations), AT(MotionRecord, sway),
    AT(MotionRecord, displacements), AT(MotionRecord, forces), AT(MotionRecord, workspace), AT(MotionRecord, stride),
    AT(MotionRecord, settled),
    {0},
};

/* Ends with an entry without names. */
const KernelPlace *kernel_layout(void)
{
    return PLACES;
}
