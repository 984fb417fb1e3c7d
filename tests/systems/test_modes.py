"""Natural modes against textbooks, and small motion against the exact kinematics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from springs import MOUNT
from strandspring import SpringParameters
from strandspring.core.branches import MaxwellBranch
from strandspring.errors import MountedSystemError
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from strandspring.vibration.bodies.modes import modes
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import BASE, MotionKind, Mount, MountAxis, RigidBody, Stops
from strandspring.vibration.bodies.small_motion import SmallMotion

UNIT = np.eye(3)
INERTIA = ((0.25, 0.0, 0.0), (0.0, 0.30, 0.0), (0.0, 0.0, 0.35))


def linear(stiffness: float) -> SpringParameters:
    """A spring whose hysteresis is nothing: kappa*rho is 1e-12 of the stiffness."""
    return SpringParameters((0.0, stiffness), (1.0,), 1e-12 * stiffness, 1.0, 1.0, 1.0, 0.0, -0.1, 0.1)


def mount(name: str, place: tuple[float, float, float], *stiffness: float, **options: float) -> Mount:
    """Linear springs along x, y and z."""
    axes = tuple(MountAxis(linear(k), tuple(UNIT[i]), **{"nominal": 0.0, **options}) for i, k in enumerate(stiffness))
    return Mount(name, 0, place, axes)


def box(*stiffness: float, **options: float) -> MountedSystem:
    places = [(sx * 0.15, sy * 0.10, -0.12) for sx in (-1, 1) for sy in (-1, 1)]
    mounts = tuple(mount(f"corner {k}", place, *stiffness, **options) for k, place in enumerate(places))
    return MountedSystem((RigidBody("box", 20.0, inertia=INERTIA),), mounts, gravity=(0.0, 0.0, 0.0))


def two_bodies(seed: int) -> tuple[MountedSystem, tuple[np.ndarray, np.ndarray]]:
    """Inclined mounts under and between two bodies, far from the nominal pose."""
    rng = np.random.default_rng(seed)
    bodies = tuple(RigidBody(f"b{k}", 2.0 + k, tuple(rng.normal(0.0, 0.1, 3)), INERTIA) for k in range(2))
    mounts = []
    for k, (body, support) in enumerate([(0, BASE), (0, BASE), (1, 0), (1, 0), (0, 1), (1, BASE)]):
        directions = Rotation.random(random_state=rng).as_matrix()
        axes = tuple(MountAxis(MOUNT, tuple(n), 0.05, series=1 + k % 2, damping=3.0) for n in directions)
        mounts.append(Mount(f"m{k}", body, tuple(rng.normal(0.0, 0.2, 3)), axes, support))
    rotations = Rotation.from_rotvec(rng.normal(0.0, 0.3, (2, 3))).as_matrix()
    return MountedSystem(bodies, tuple(mounts)), (rng.normal(0.0, 0.01, (2, 3)), rotations)


def axis_displacements(system: MountedSystem, displacements: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    """d = (R_A e).(P_B - P_A), axis by axis."""

    def material(body: int, place: np.ndarray) -> np.ndarray:
        if body == BASE:
            return place
        center = np.array(system.bodies[body].center)
        return center + displacements[body] + rotations[body] @ (place - center)

    return np.array(
        [
            (UNIT if one.support == BASE else rotations[one.support])
            @ axis.direction
            @ (material(one.body, np.array(one.place)) - material(one.support, np.array(one.place)))
            for one, axis in zip(system.axis_mounts, system.axes, strict=True)
        ]
    )


def test_six_natural_frequencies() -> None:
    expected = [5.156998, 5.771394, 10.065842, 10.208627, 13.612062, 14.423525]
    found = modes(SmallMotion.about_nominal(box(9000.0, 12000.0, 20000.0)))
    assert [mode.frequency for mode in found] == pytest.approx(expected, abs=1e-6)  # digits given
    # y rolls about x and x about y, because the mounts lie below the centre of gravity.
    assert [mode.words.split(" ")[0] for mode in found] == ["y", "x", "z", "rz", "rx", "ry"]
    assert found[2].words == "z 100 %"
    for mode in found:
        assert mode.shares.sum() == pytest.approx(1.0, rel=1e-12)
        assert mode.damping == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_derivatives_of_the_exact_kinematics(seed: int) -> None:
    system, pose = two_bodies(seed)
    motion = SmallMotion(system, pose)
    series = np.array([axis.series for axis in system.axes])
    forces = np.random.default_rng(seed).normal(0.0, 100.0, series.size)

    def moved(q: np.ndarray) -> np.ndarray:
        of_bodies = (motion.free @ q).reshape(2, 6)
        rotations = Rotation.from_rotvec(of_bodies[:, 3:]).as_matrix() @ pose[1]
        return axis_displacements(system, pose[0] + of_bodies[:, :3], rotations)

    steps = 1e-4 * np.eye(motion.free.shape[1])
    assert motion.springs == pytest.approx(0.05 + moved(0.0 * steps[0]) / series, rel=1e-12)
    gradient = np.array([moved(step) - moved(-step) for step in steps]).T / 2e-4
    assert motion.along == pytest.approx(gradient, abs=1e-7)  # third derivatives times the step's square
    curvature = np.array(
        [[forces @ (moved(a + b) - moved(a - b) - moved(b - a) + moved(-a - b)) for a in steps] for b in steps]
    )
    assert motion.geometric(forces) == pytest.approx(curvature / 4e-8, abs=1e-3)  # of some hundred N/m; rounding
    assert motion.damping == pytest.approx(3.0 * gradient.T @ gradient, abs=1e-5)


def test_a_body_that_hangs_is_a_pendulum() -> None:
    height, stiff = 0.4, 1e9
    weight = 20.0 * 9.80665
    top = mount("top", (0.0, 0.0, height), stiff, stiff, stiff)
    system = MountedSystem((RigidBody("bell", 20.0, inertia=INERTIA),), (top,))
    pose = (np.array([[0.0, 0.0, -weight / stiff]]), UNIT[None])
    found = [mode.frequency for mode in modes(SmallMotion(system, pose))][:3]
    swings = [math.sqrt(weight * height / (i + 20.0 * height**2)) / (2.0 * math.pi) for i in (0.25, 0.30)]
    # Nothing resists the turn about z.
    assert found == pytest.approx([0.0, *sorted(swings)], rel=1e-6)
    below = replace(system, mounts=(replace(top, place=(0.0, 0.0, -height)),))
    with pytest.raises(MountedSystemError, match=r"not stable: a motion of [xyr]+ .*; use stiffer mounts"):
        modes(SmallMotion(below, pose))


def test_two_masses_one_on_the_other() -> None:
    """Chain of masses 3 and 1 kg on springs of 900 and 400 N/m."""
    bodies = tuple(RigidBody(f"stage {k}", mass, motion=MotionKind.AXIS) for k, mass in enumerate((3.0, 1.0)))
    axes = [(MountAxis(linear(k), (0.0, 0.0, 1.0), 0.0, damping=2.0),) for k in (900.0, 400.0)]
    mounts = (Mount("lower", 0, (0.0, 0.0, 0.0), axes[0]), Mount("upper", 1, (0.1, 0.0, 0.0), axes[1], support=0))
    system = MountedSystem(bodies, mounts)
    found = modes(SmallMotion.about_nominal(system))
    circular = np.sqrt(np.linalg.eigvals(np.array([[1300.0 / 3.0, -400.0 / 3.0], [-400.0, 400.0]])))
    assert [mode.frequency for mode in found] == pytest.approx(np.sort(circular) / (2.0 * np.pi), rel=1e-10)
    assert found[0].words == "stage 1 z 54 %, stage 0 z 46 %"
    assert all(0.0 < mode.damping < 0.2 for mode in found)


def test_damping_of_one_axis() -> None:
    axis = MountAxis(MOUNT, (0.0, 0.0, 1.0), 0.05, parallel=3, series=2, damping=40.0)
    mass = RigidBody("mass", 5.0, motion=MotionKind.AXIS)
    system = MountedSystem((mass,), (Mount("foot", 0, (0.0, 0.0, 0.0), (axis,)),))
    motion = SmallMotion.about_nominal(system)
    (tangent,) = modes(motion)
    stiffness = float(system.laws.tangents(motion.springs)[0])
    assert stiffness == pytest.approx(1.5 * PathSolver(MOUNT).stiffness(np.array([0.05]))[0], rel=1e-12)
    assert tangent.frequency == pytest.approx(math.sqrt(stiffness / 5.0) / (2.0 * math.pi), rel=1e-12)
    assert tangent.damping == pytest.approx(40.0 / (2.0 * math.sqrt(stiffness * 5.0)), rel=1e-12)
    loop = steady_loop(PathSolver(MOUNT), 0.05 - 0.006, 0.05 + 0.006).figures
    assert 0.2 * system.laws.free_travel(motion.springs) == pytest.approx([0.012], rel=1e-12)
    (secant,) = modes(motion, system.laws.secants(motion.springs, np.array([0.012])))
    k = 1.5 * loop.secant_stiffness
    assert secant.frequency == pytest.approx(math.sqrt(k / 5.0) / (2.0 * math.pi), rel=1e-9)
    assert secant.damping == pytest.approx(20.0 / math.sqrt(k * 5.0) + 0.5 * loop.loss_factor, rel=1e-9)


@pytest.mark.parametrize("time_constant", [1e-5, 0.01, 10.0])
def test_a_branch_counts_with_its_stiffness_at_the_mode(time_constant: float) -> None:
    """Against the poles of m s^2 + k + c*s*tau/(1 + s*tau), whose loss is small."""
    k, c, mass = 900.0, 30.0, 2.0
    spring = replace(linear(k), branches=(MaxwellBranch(c, time_constant),))
    axis = MountAxis(spring, (0.0, 0.0, 1.0), 0.0, parallel=3, series=2)
    body = RigidBody("mass", mass, motion=MotionKind.AXIS)
    system = MountedSystem((body,), (Mount("foot", 0, (0.0, 0.0, 0.0), (axis,)),))
    (mode,) = modes(SmallMotion.about_nominal(system))
    poles = np.roots([mass * time_constant, mass, 1.5 * (k + c) * time_constant, 1.5 * k])
    pole = poles[np.argmax(poles.imag)]
    assert mode.frequency == pytest.approx(abs(pole) / (2.0 * math.pi), rel=3e-4)  # of second order in the loss
    assert mode.damping == pytest.approx(-pole.real / abs(pole), rel=0.03)


def test_a_stop_counts_where_it_is_touched() -> None:
    stops = Stops(-0.02, 0.01, 5e4)
    system = box(9000.0, 12000.0, 20000.0)
    (one, *others) = system.mounts
    with_stops = replace(one, axes=(*one.axes[:2], replace(one.axes[2], stops=stops)))
    system = replace(system, mounts=(with_stops, *others))
    for z, expected in ((0.0, 20000.0), (0.011, 70000.0), (-0.021, 70000.0)):
        springs = SmallMotion(system, (np.array([[0.0, 0.0, z]]), UNIT[None])).springs
        assert system.laws.tangents(springs)[2] == pytest.approx(expected, rel=1e-9)
        # From 0.009 to 0.013 the stop is touched over three quarters, from -0.023 to -0.019 likewise.
        assert system.laws.secants(springs, np.full(12, 0.002))[2].real == pytest.approx(
            20000.0 + (0.0 if z == 0.0 else 5e4 * 0.75), rel=1e-9
        )


def test_amplitudes_that_are_none() -> None:
    laws = box(9000.0, 12000.0, 20000.0).laws
    with pytest.raises(MountedSystemError, match=r"corner 0 x must be finite and > 0 \[m\], got -0.001"):
        laws.secants(laws.nominal, np.full(12, -1e-3))
