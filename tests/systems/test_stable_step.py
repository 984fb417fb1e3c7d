"""The stability limit against steps that blow up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from springs import EXAMPLES
from strandspring import SpringParameters
from strandspring.core.branches import MaxwellBranch
from strandspring.kernel.path import PathSolver
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, RigidBody, Stops
from strandspring.vibration.bodies.small_motion import SmallMotion

INERTIA = ((0.25, 0.01, 0.0), (0.01, 0.30, 0.0), (0.0, 0.0, 0.35))


def box(damping: float) -> MountedSystem:
    """Springs and dampers that do not share their modes."""
    spring = SpringParameters((0.0, 9000.0), (1.0,), 1e-12, 1.0, 0.5, 1.0, 0.0, -0.1, 0.1)
    mounts = []
    for k, place in enumerate([(0.15, 0.1, -0.12), (-0.15, 0.1, -0.12), (0.0, -0.1, -0.1), (0.05, 0.0, 0.1)]):
        axes = tuple(
            MountAxis(spring, tuple(n), 0.0, parallel=1 + k + i, damping=damping * (i + (k == 2)))
            for i, n in enumerate(np.eye(3))
        )
        mounts.append(Mount(f"m{k}", 0, place, axes))
    return MountedSystem((RigidBody("box", 20.0, inertia=INERTIA),), tuple(mounts), gravity=(0.0, 0.0, 0.0))


def largest_after(system: MountedSystem, step: float, count: int) -> float:
    """The largest coordinate after so many steps of velocity Verlet from unit displacements, or when it passes 1e6."""
    motion = SmallMotion.about_nominal(system)
    stiffness = motion.along.T @ (system.laws.steepest[:, None] * motion.along) / motion.mass
    damping = motion.damping / motion.mass
    x, v = np.ones(len(stiffness)), np.zeros(len(stiffness))
    a = -stiffness @ x
    for _ in range(count):
        x = x + step * v + 0.5 * step**2 * a
        before, a = a, -stiffness @ x - damping @ (v + step * a)
        v = v + 0.5 * step * (before + a)
        if np.abs(x).max() > 1e6:
            break
    return float(np.abs(x).max())


@pytest.mark.parametrize("damping", [0.0, 60.0, 3000.0])
def test_below_the_limit_nothing_blows_up_and_above_it_does(damping: float) -> None:
    system = box(damping)
    limit = SmallMotion.about_nominal(system).stable_step()
    assert largest_after(system, 0.999 * limit, 20_000) < 300.0
    assert largest_after(system, 1.001 * limit, 20_000) > 1e6


@pytest.mark.parametrize("damping", [0.0, 60.0, 3000.0])
def test_the_compiled_integrator_has_the_same_limit(damping: float) -> None:
    system = box(damping)
    kernel, limit, count = system.solver, SmallMotion.about_nominal(system).stable_step(), 4000

    def largest(step: float) -> float:
        channels, values, velocity = np.empty((0, 8)), np.empty((0, count)), np.array([1e-9, 2e-9, 1e-9])
        pose, omega = kernel.nominal_pose, np.zeros(kernel.axes)
        found, _ = kernel.run(channels, values, step, np.zeros(3), pose, omega, velocity)
        return float(found.of_axes[:, 1].max())

    assert largest(0.995 * limit) < 1e-9  # [m]
    assert largest(1.005 * limit) > 1e-4


@pytest.mark.parametrize("time_constant", [1e-7, *np.geomspace(1e-4, 0.03, 10), 1.0])
@pytest.mark.parametrize("damping", [0.0, 300.0])
def test_below_the_limit_branches_do_not_blow_up(damping: float, time_constant: float) -> None:
    """From springs to dampers, stiffer than the springs that they are beside."""
    spring = SpringParameters((0.0, 9000.0), (1.0,), 1e-12, 1.0, 0.5, 1.0, 0.0, -0.1, 0.1)
    system = box(damping).with_springs(lambda _: replace(spring, branches=(MaxwellBranch(1e5, time_constant),)))
    kernel, count = system.solver, 20_000
    step = 0.999 * SmallMotion.about_nominal(system).stable_step()
    found, _ = kernel.run(
        np.empty((0, 8)), np.empty((0, count)), step, np.zeros(3), kernel.nominal_pose, np.zeros(kernel.axes),
        np.array([1e-9, 2e-9, 1e-9]),
    )  # fmt: skip
    assert found.of_axes[:, 1].max() < 1e-9  # [m]


def test_one_axis_by_hand() -> None:
    """h^2*k + 4*h*c = 4*m."""
    spring = SpringParameters((0.0, 900.0), (1.0,), 10.0, 50.0, 2.0, 1.0, 0.0, -0.1, 0.1)
    axis = MountAxis(spring, (0.0, 0.0, 1.0), 0.0, parallel=4, series=2, damping=30.0, stops=Stops(-0.05, 0.05, 7e3))
    foot = Mount("foot", 0, (0.0, 0.0, 0.0), (axis,))
    system = MountedSystem((RigidBody("mass", 3.0, motion=MotionKind.AXIS),), (foot,))
    stiffness = 2.0 * (900.0 + 2.0 * 2.0 * 10.0 * 50.0) + 7e3
    expected = (-120.0 + np.sqrt(120.0**2 + 48.0 * stiffness)) / (2.0 * stiffness)
    assert SmallMotion.about_nominal(system).stable_step() == pytest.approx(expected, rel=1e-12)
    assert SmallMotion.about_nominal(system).stable_step(tilted=True) == pytest.approx(expected, rel=1e-12)
    across = replace(foot, axes=(replace(axis, direction=(1.0, 0.0, 0.0)),))
    assert SmallMotion.about_nominal(replace(system, mounts=(across,))).stable_step() == np.inf


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_bound_holds_and_is_near(name: str) -> None:
    spring = EXAMPLES[name]
    axis = MountAxis(spring, (0.0, 0.0, 1.0), spring.displacement_offset)
    system = MountedSystem(
        (RigidBody("mass", 1.0, motion=MotionKind.AXIS),), (Mount("m", 0, (0.0, 0.0, 0.0), (axis,)),)
    )
    bound = float(system.laws.steepest[0])
    rng = np.random.default_rng(5)
    path = rng.uniform(spring.displacement_min, spring.displacement_max, 20_000)
    assert PathSolver(spring).stiffness(path).max() <= bound

    solver, way = PathSolver(spring), 1e-12 * (spring.displacement_max - spring.displacement_min)
    just_turned = [
        float(solver.stiffness(np.array([x, x - omega * way]), omega)[1])
        for x in np.linspace(spring.displacement_min + way, spring.displacement_max - way, 401)
        for omega in (-1.0, 1.0)
    ]
    assert max(just_turned) <= bound
    assert max(just_turned) == pytest.approx(bound, rel=0.1)


def test_tilted_bodies_need_no_smaller_step() -> None:
    """Whatever the rotation, the limit with tilted=True is below the one of the rotated pose."""
    system = box(60.0)
    bound = SmallMotion.about_nominal(system).stable_step(tilted=True)
    for rotation in Rotation.random(40, random_state=3).as_matrix():
        pose = (np.zeros((1, 3)), rotation[None])
        assert bound <= SmallMotion(system, pose).stable_step()
