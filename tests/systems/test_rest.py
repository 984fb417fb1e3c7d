"""Rest of bodies on mounts that are nearly linear, at all scales of force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mounted_examples import ASYMMETRIC, CORNERS, GRAVITY, NO_WEIGHT, FloatArray, two_stages, unit
from strandspring import SpringParameters
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, RigidBody, Vector
from strandspring.vibration.bodies.rest import mount_loads, rest

LAW = settings(deadline=None, max_examples=150, phases=[Phase.generate])


def mounted(seed: int, frictions: list[float], factors: list[float], gravity: Vector, preload: float) -> MountedSystem:
    """Bodies of 20 kg times a factor, each on four mounts of three linear springs, whose forces have the same factor,
    with dry friction [N] and preloads [m].
    """
    random = np.random.default_rng(seed)
    bodies, mounts = [], []
    for number, (friction, factor) in enumerate(zip(frictions, factors, strict=True)):
        bodies.append(RigidBody(f"{number}", 20.0 * factor, inertia=inertia(factor)))
        for corner in CORNERS:
            x, y, z = (np.array(corner) + 0.03 * random.normal(size=3)).tolist()
            axes = tuple(
                MountAxis(
                    SpringParameters(
                        (0.0, factor * stiffness), (1.0,), friction * factor, 1e3, 1.0, 1.0, 0.0, -1.0, 1.0
                    ),
                    unit(*direction),
                    preload * random.uniform(-1.0, 1.0),
                )
                for stiffness, direction in zip(
                    10.0 ** random.uniform(3.5, 5.0, 3), Rotation.random(random_state=random).as_matrix(), strict=True
                )
            )
            mounts.append(Mount("corner", number, (x, y, z), axes))
    return MountedSystem(tuple(bodies), tuple(mounts), (), gravity)


def inertia(factor: float) -> tuple[Vector, Vector, Vector]:
    first, second, third = ((factor * a, factor * b, factor * c) for a, b, c in ASYMMETRIC)
    return first, second, third


def unbalance(system: MountedSystem, pose: FloatArray, omega: FloatArray) -> FloatArray:
    """Force and moment over 0.2 m of each body, shape (B, 2, 3), over what rounding may leave of them: 1e-12 of the
    sum of the magnitudes, and stiffness times ten roundings of a place.
    """
    total, sizes = np.zeros((len(system.bodies), 2, 3)), np.zeros(len(system.bodies))
    for number, body in enumerate(system.bodies):
        total[number, 0] = body.mass * np.array(system.gravity)
        sizes[number] = body.mass * GRAVITY if any(system.gravity) else 0.0
    for mount, axis, own in zip(system.axis_mounts, system.axes, omega.tolist(), strict=True):
        x, (w, *v) = pose[mount.body, :3], pose[mount.body, 3:]
        arm = Rotation.from_quat([*v, w]).apply(mount.place)
        stiffness, friction = axis.spring.kE[1], axis.spring.kappa_omega
        pull = stiffness * (axis.nominal + np.dot(axis.direction, x + arm - mount.place)) + friction * own
        force = -pull * np.array(axis.direction)
        total[mount.body] += force, np.cross(arm, force) / 0.2
        sizes[mount.body] += abs(pull) + friction + 1e12 * stiffness * 1e-16
    return total / (1e-12 * sizes[:, None, None])


FACTORS = st.integers(-20, 20).map(lambda power: 2.0**power)  # 1e-6 to 1e6


@LAW
@given(
    st.integers(0, 2**32),
    st.floats(-8.0, 1.0).map(lambda power: 10.0**power),
    st.tuples(FACTORS, FACTORS),
    st.sampled_from([NO_WEIGHT, (0.0, 0.0, -GRAVITY), (3.0, -5.0, -8.0)]),
    st.sampled_from([0.0, 1e-6, 1e-3]),
    st.sampled_from([0.0, 0.5, 1.0]),
)
def test_rest_is_found_at_any_scale_of_force(
    seed: int, friction: float, factors: tuple[float, float], gravity: Vector, preload: float, share: float
) -> None:
    """And a factor of all forces, a power of two, does not change a bit of the pose."""
    one = mounted(seed, [friction], [1.0], gravity, preload)
    both = mounted(seed, [friction] * 2, list(factors), gravity, preload)
    omega = share * np.random.default_rng(seed).choice([-1.0, 1.0], 24)
    pose, _, is_found = both.solver.rest(np.array(gravity), omega)
    assert is_found
    assert np.abs(unbalance(both, pose, omega)).max() < 1.0
    alone, _, is_found = one.solver.rest(np.array(gravity), omega[:12])
    assert is_found
    scaled = mounted(seed, [friction], [factors[0]], gravity, preload)
    np.testing.assert_array_equal(scaled.solver.rest(np.array(gravity), omega[:12])[0], alone)


def test_loads_of_mounts_balance_weights_and_moments() -> None:
    """Of a box on a frame that stands askew on unequal feet, so that the axes of the box' mounts have turned."""
    plain = two_stages()
    feet = tuple(replace(foot, place=(foot.place[0] + 0.03, *foot.place[1:])) for foot in plain.mounts[4:])
    system = replace(plain, mounts=(*plain.mounts[:4], *feet))
    pose = rest(system)
    assert np.linalg.norm(pose.rotations[1] - np.eye(3)) > 1e-3
    loads, weights = mount_loads(system, pose), [np.array([0.0, 0.0, -body.mass * GRAVITY]) for body in system.bodies]
    np.testing.assert_allclose(loads[:4].sum(axis=0), weights[0], atol=1e-9)
    np.testing.assert_allclose(loads[4:].sum(axis=0), weights[0] + weights[1], atol=1e-9)
    arms = np.array([mount.place for mount in system.mounts[:4]]) @ pose.rotations[0].T
    np.testing.assert_allclose(np.cross(arms, loads[:4]).sum(axis=0), 0.0, atol=1e-9)
