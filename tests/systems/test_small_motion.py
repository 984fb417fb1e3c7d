"""Modes, stable steps and rest of bodies on mounts: textbooks, exact kinematics, and steps that blow up."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from mounted_examples import ASYMMETRIC, CORNERS, GRAVITY, NO_WEIGHT, UP, elastic, one_mass, unit
from springs import EXAMPLES, MOUNT
from strandspring import SpringParameters
from strandspring.core.branches import MaxwellBranch
from strandspring.errors import MountedSystemError
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from strandspring.vibration.bodies.modes import modes
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, RigidBody, Stops, Vector
from strandspring.vibration.bodies.small_motion import SmallMotion

UNIT = np.eye(3)
INERTIA = ((0.25, 0.0, 0.0), (0.0, 0.30, 0.0), (0.0, 0.0, 0.35))


def mount(name: str, place: Vector, stiffness: tuple[float, ...]) -> Mount:
    """Linear springs along x, y and z."""
    return Mount(
        name, 0, place, tuple(MountAxis(elastic(0.0, k), unit(*n), 0.0) for k, n in zip(stiffness, UNIT, strict=True))
    )


def test_published_frequencies_of_a_box_and_a_pendulum() -> None:
    mounts = tuple(mount(f"corner {k}", place, (9000.0, 12000.0, 20000.0)) for k, place in enumerate(CORNERS))
    box = MountedSystem((RigidBody("box", 20.0, inertia=INERTIA),), mounts, gravity=NO_WEIGHT)
    found = modes(SmallMotion.about_nominal(box))
    expected = [5.156998, 5.771394, 10.065842, 10.208627, 13.612062, 14.423525]
    assert [mode.frequency for mode in found] == pytest.approx(expected, abs=1e-6)  # digits given
    # y rolls about x and x about y, because the mounts lie below the centre of gravity.
    assert [mode.words.split(" ")[0] for mode in found] == ["y", "x", "z", "rz", "rx", "ry"]
    assert found[2].words == "z 100 %"
    assert [mode.shares.sum() for mode in found] == pytest.approx([1.0] * 6, rel=1e-12)
    # A body that hangs, and one that stands on the same place.
    height, stiff, weight = 0.4, 1e9, 20.0 * GRAVITY
    top = mount("top", (0.0, 0.0, height), (stiff, stiff, stiff))
    bell = MountedSystem((RigidBody("bell", 20.0, inertia=INERTIA),), (top,))
    pose = (np.array([[0.0, 0.0, -weight / stiff]]), UNIT[None])
    swings = [math.sqrt(weight * height / (i + 20.0 * height**2)) / (2.0 * math.pi) for i in (0.25, 0.30)]
    frequencies = [mode.frequency for mode in modes(SmallMotion(bell, pose))][:3]
    assert frequencies == pytest.approx([0.0, *sorted(swings)], rel=1e-6)  # nothing resists the turn about z
    below = replace(bell, mounts=(replace(top, place=(0.0, 0.0, -height)),))
    with pytest.raises(MountedSystemError, match=r"not stable: a motion of [xyr]+ .*; use stiffer mounts"):
        modes(SmallMotion(below, pose))


def test_damping_of_one_axis_by_tangent_and_secant() -> None:
    system = one_mass(MountAxis(MOUNT, UP, 0.05, parallel=3, series=2, damping=40.0), 5.0)
    motion = SmallMotion.about_nominal(system)
    (tangent,) = modes(motion)
    stiffness = float(system.laws.tangents(motion.springs)[0])
    assert stiffness == pytest.approx(1.5 * PathSolver(MOUNT).stiffness(np.array([0.05]))[0], rel=1e-12)
    assert tangent.frequency == pytest.approx(math.sqrt(stiffness / 5.0) / (2.0 * math.pi), rel=1e-12)
    assert tangent.damping == pytest.approx(40.0 / (2.0 * math.sqrt(stiffness * 5.0)), rel=1e-12)
    loop = steady_loop(PathSolver(MOUNT), 0.05 - 0.006, 0.05 + 0.006).figures
    (secant,) = modes(motion, system.laws.secants(motion.springs, np.array([0.012])))
    k = 1.5 * loop.secant_stiffness
    assert secant.frequency == pytest.approx(math.sqrt(k / 5.0) / (2.0 * math.pi), rel=1e-9)
    assert secant.damping == pytest.approx(20.0 / math.sqrt(k * 5.0) + 0.5 * loop.loss_factor, rel=1e-9)
    with pytest.raises(MountedSystemError, match=r"mount must be finite and > 0 \[m\], got -0.001"):
        system.laws.secants(system.laws.nominal, np.array([-1e-3]))
    # A stop counts where it is touched: from 0.009 to 0.013 over three quarters, from -0.023 to -0.019 likewise.
    stopped = one_mass(MountAxis(elastic(0.0, 20000.0), UP, 0.0, stops=Stops(-0.02, 0.01, 5e4)), 1.0)
    for z, touched in ((0.0, 0.0), (0.011, 1.0), (-0.021, 1.0)):
        springs = SmallMotion(stopped, (np.array([[0.0, 0.0, z]]), UNIT[None])).springs
        assert stopped.laws.tangents(springs) == pytest.approx([20000.0 + 5e4 * touched], rel=1e-9)
        secants = stopped.laws.secants(springs, np.full(1, 0.002)).real
        assert secants == pytest.approx([20000.0 + 5e4 * 0.75 * touched], rel=1e-9)


# ---- stable steps ---------------------------------------------------------------------------------


def uneven(damping: float, *branches: MaxwellBranch) -> MountedSystem:
    """Springs and dampers that do not share their modes."""
    mounts, spring = [], replace(elastic(0.0, 9000.0), branches=branches)
    for k, place in enumerate([(0.15, 0.1, -0.12), (-0.15, 0.1, -0.12), (0.0, -0.1, -0.1), (0.05, 0.0, 0.1)]):
        axes = tuple(
            MountAxis(spring, unit(*n), 0.0, parallel=1 + k + i, damping=damping * (i + (k == 2)))
            for i, n in enumerate(UNIT)
        )
        mounts.append(Mount(f"m{k}", 0, place, axes))
    return MountedSystem((RigidBody("box", 20.0, inertia=ASYMMETRIC),), tuple(mounts), gravity=NO_WEIGHT)


def largest_motion(system: MountedSystem, share: float, count: int = 4000) -> float:
    """Of any spring [m], from micrometres, after so many steps of a share of the stable one."""
    step, kernel = share * SmallMotion.about_nominal(system).stable_step(), system.solver
    nothing, velocity = (np.empty((0, 8)), np.empty((0, count))), np.array([1e-9, 2e-9, 1e-9])
    found, _ = kernel.run(*nothing, step, np.zeros(3), kernel.nominal_pose, np.zeros(kernel.axes), velocity)
    return float(found.of_axes[:, 1].max())


@pytest.mark.parametrize("damping", [0.0, 60.0, 3000.0])
def test_below_the_limit_nothing_blows_up_and_above_it_does(damping: float) -> None:
    from scipy.spatial.transform import Rotation

    system = uneven(damping)
    assert largest_motion(system, 0.995) < 1e-9
    assert largest_motion(system, 1.005) > 1e-4
    # Whatever the rotation, the limit of tilted bodies is below that of the rotated pose.
    bound = SmallMotion.about_nominal(system).stable_step(tilted=True)
    for rotation in Rotation.random(20, random_state=3).as_matrix():
        assert bound <= SmallMotion(system, (np.zeros((1, 3)), rotation[None])).stable_step()
    # With branches from springs to dampers, stiffer than the springs that they are beside.
    for time_constant in (1e-7, 1e-4, 1e-3, 3e-3, 0.03, 1.0):
        assert largest_motion(uneven(damping, MaxwellBranch(1e5, time_constant)), 0.999, 8000) < 1e-9


def test_the_step_of_one_axis_by_hand_and_the_steepest_slope() -> None:
    """h^2*k + 4*h*c = 4*m."""
    spring = SpringParameters((0.0, 900.0), (1.0,), 10.0, 50.0, 2.0, 1.0, 0.0, -0.1, 0.1)
    system = one_mass(MountAxis(spring, UP, 0.0, 4, 2, 30.0, Stops(-0.05, 0.05, 7e3)), 3.0)
    stiffness = 2.0 * (900.0 + 2.0 * 2.0 * 10.0 * 50.0) + 7e3
    expected = (-120.0 + np.sqrt(120.0**2 + 48.0 * stiffness)) / (2.0 * stiffness)
    for tilted in (False, True):
        assert SmallMotion.about_nominal(system).stable_step(tilted=tilted) == pytest.approx(expected, rel=1e-12)
    across = one_mass(replace(system.axes[0], direction=(1.0, 0.0, 0.0)), 3.0)
    assert SmallMotion.about_nominal(across).stable_step() == np.inf
    for name, one in EXAMPLES.items():
        bound = float(one_mass(MountAxis(one, UP, one.displacement_offset), 1.0).laws.steepest[0])
        solver, way = PathSolver(one), 1e-12 * (one.displacement_max - one.displacement_min)
        places = np.linspace(one.displacement_min + way, one.displacement_max - way, 401)
        turns = [(np.array([x, x - omega * way]), omega) for x in places for omega in (-1.0, 1.0)]
        just_turned = max(float(solver.stiffness(turn, omega)[1]) for turn, omega in turns)
        assert 0.9 * bound <= just_turned <= bound, name


# ---- rest -----------------------------------------------------------------------------------------


@settings(max_examples=40, phases=[Phase.generate])
@given(
    st.integers(0, 2**32), st.floats(-8.0, 1.0), st.integers(-20, 20),
    st.sampled_from([NO_WEIGHT, (0.0, 0.0, -GRAVITY), (3.0, -5.0, -8.0)]), st.sampled_from([0.0, 1e-6, 1e-3]),
    st.sampled_from([0.0, 0.5, 1.0]),
)  # fmt: skip
def test_rest_is_found_and_balanced_at_any_scale_of_force(
    seed: int, friction: float, power: int, gravity: Vector, preload: float, share: float
) -> None:
    """Of linear springs with dry friction; a power of two as a factor of all forces changes no bit of the pose."""
    from scipy.spatial.transform import Rotation

    random, mounts = np.random.default_rng(seed), []
    for corner in CORNERS:
        stiffness, directions = 10.0 ** random.uniform(3.5, 5.0, 3), Rotation.random(random_state=random).as_matrix()
        axes = tuple(
            MountAxis(replace(elastic(0.0, k), kappa_omega=10.0**friction, rho=1e3), unit(*n), preload * shift)
            for k, n, shift in zip(stiffness, directions, random.uniform(-1.0, 1.0, 3), strict=True)
        )
        x, y, z = (corner + 0.03 * random.normal(size=3)).tolist()
        mounts.append(Mount("corner", 0, (x, y, z), axes))
    system = MountedSystem((RigidBody("box", 20.0, inertia=ASYMMETRIC),), tuple(mounts), (), gravity)
    omega = share * random.choice([-1.0, 1.0], 12)
    pose, _, is_found = system.solver.rest(np.array(gravity), omega)
    assert is_found
    # Force and moment over 0.2 m, over what rounding may leave of them: 1e-12 of the sum of the magnitudes, and
    # stiffness times ten roundings of a place.
    total, size = np.array([20.0 * np.array(gravity), np.zeros(3)]), 20.0 * GRAVITY * any(gravity)
    for one, axis, own in zip(system.axis_mounts, system.axes, omega.tolist(), strict=True):
        arm = Rotation.from_quat(pose[0, 3:], scalar_first=True).apply(one.place)
        along = axis.nominal + np.dot(axis.direction, pose[0, :3] + arm - one.place)
        pull = axis.spring.kE[1] * along + axis.spring.kappa_omega * own
        total -= pull * np.array([axis.direction, np.cross(arm, axis.direction) / 0.2])
        size += abs(pull) + axis.spring.kappa_omega + 1e-4 * axis.spring.kE[1]
    assert np.abs(total).max() < 1e-12 * size
    factor = 2.0**power  # 1e-6 to 1e6
    scaled = system.with_springs(
        lambda spring: replace(spring, kE=(0.0, factor * spring.kE[1]), kappa_omega=factor * spring.kappa_omega)
    )
    body = replace(system.bodies[0], mass=factor * 20.0, inertia=tuple(map(tuple, factor * np.array(ASYMMETRIC))))
    again = replace(scaled, bodies=(body,)).solver.rest(np.array(gravity), omega)[0]
    np.testing.assert_array_equal(again, pose)
