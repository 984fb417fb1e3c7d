"""The largest force of each mount and of all mounts on the base, against histories and against the bodies' momentum."""

from __future__ import annotations

import numpy as np
import pytest

from mounted_examples import FloatArray, inclined_box, kernel_motion, plane_box, two_stages, unit
from reference_motion import half_sine, reference_motion
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import BASE, Point
from strandspring.vibration.bodies.run_figures import RunFigures

SHOCK = LoadChannel(ChannelKind.BASE_ACCELERATION, half_sine(150.0, 0.011), unit(1.0, 2.0, 3.0))
TURN = LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, half_sine(2.0, 0.02), unit(1.0, 0.0, 1.0))
SYSTEMS = {"leaning, dampers": inclined_box(), "two stages, dampers": two_stages()}


def largest(forces: FloatArray) -> FloatArray:
    """Of forces of shape (K, 3): the largest magnitude, and those of the components."""
    return np.array([np.linalg.norm(forces, axis=1).max(), *np.abs(forces).max(axis=0)])


@pytest.mark.parametrize(
    ("system", "channels"),
    [(inclined_box(), (SHOCK, TURN)), (two_stages(), (SHOCK, TURN)), (plane_box(), (SHOCK,))],
    ids=["leaning", "two stages", "stops"],
)
def test_largest_forces_are_those_of_the_histories(system: MountedSystem, channels: tuple[LoadChannel, ...]) -> None:
    """The axes of a mount are perpendicular, and those on the base do not turn. A peak of 100 Hz between two steps is
    at most (2 pi 100 Hz h)^2/8 = 2e-5 above both.
    """
    motion = kernel_motion(system, LoadCase("c", "pulse", 0.05, channels), 2e-5)
    found = RunFigures.from_motion_figures(motion.figures)
    mounts, forces = system.axis_mounts, motion.histories.force
    of_mounts = [
        np.linalg.norm(forces[:, [k for k, mount in enumerate(mounts) if mount is one]], axis=1).max()
        for one in system.mounts
    ]
    on_base = np.array(
        [np.array(axis.direction) * (mount.support == BASE) for mount, axis in zip(mounts, system.axes, strict=True)]
    )
    np.testing.assert_allclose(found.mount_force, of_mounts, rtol=2e-5)
    np.testing.assert_allclose(found.reaction, largest(forces @ on_base), rtol=2e-5)


@pytest.mark.parametrize("name", SYSTEMS)
def test_reaction_is_the_rate_of_momentum_of_the_reference(name: str) -> None:
    """The mounts on the base carry sum of m*(a - g), with accelerations of the centres of gravity that the reference
    gives every 0.05 ms, between which a peak of 100 Hz is at most 1.3e-4 higher.
    """
    system = SYSTEMS[name]
    case = LoadCase("c", "pulse", 0.04, (SHOCK,))
    centers = tuple(Point(body.name, k, body.center) for k, body in enumerate(system.bodies))
    observed = MountedSystem(system.bodies, system.mounts, centers, system.gravity)
    accelerations = reference_motion(observed, case, np.linspace(0.0, 0.04, 801), rtol=1e-8).acceleration
    masses = np.array([body.mass for body in system.bodies])
    carried = np.einsum("b,kbi->ki", masses, accelerations - np.array(system.gravity))
    found = RunFigures.from_motion_figures(kernel_motion(system, case, 2e-5).figures)
    np.testing.assert_allclose(found.reaction, largest(carried), rtol=2e-4)


def test_reaction_at_rest_is_the_weight() -> None:
    system = two_stages()
    found = RunFigures.from_motion_figures(kernel_motion(system, LoadCase("c", "pulse", 1e-3), 1e-4).figures)
    weight = sum(body.mass for body in system.bodies) * 9.80665
    np.testing.assert_allclose(found.reaction, [weight, 0.0, 0.0, weight], atol=1e-9 * weight)
