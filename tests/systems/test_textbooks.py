"""Motion in time against textbooks: what is published is derived here first, and then found by the kernel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mounted_examples import GRAVITY, UP, FloatArray, KernelMotion, elastic, kernel_motion, one_mass
from oracles import sine
from strandspring import SpringParameters
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.parts import MountAxis
from strandspring.vibration.bodies.run_figures import RunFigures

pytestmark = pytest.mark.long


def thrown(axis: MountAxis, speed: float, duration: float, mass: float = 1.0) -> KernelMotion:
    """Onto a mount without a weight."""
    case = LoadCase("thrown", "drop", duration, velocity=(0.0, 0.0, speed))
    return kernel_motion(one_mass(axis, mass), case, 1e-5)


def shaken(signal: Signal, duration: float, settling: float = 0.0) -> LoadCase:
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, UP)
    return LoadCase("shaken", "sine", duration, (channel,), settling)


def test_velocity_step_on_a_damped_isolator() -> None:
    """z'' = -2 zeta omega z' - omega^2 z with z(0) = 0 and z'(0) = V, which is the absolute acceleration.

    With zeta = cos(phi), z is largest at theta = phi, with V/omega exp(-phi cot(phi)), and z'' at theta = 3 phi - pi,
    with V omega exp(-(3 phi - pi) cot(phi)).
    """
    zeta, circular, speed = 0.265, 2.0 * math.pi * 5.0, 1.3
    phi = math.acos(zeta)
    sway, acceleration = math.exp(-phi / math.tan(phi)), math.exp(-(3.0 * phi - math.pi) / math.tan(phi))
    assert (acceleration, sway) == pytest.approx((0.81012, 0.69908), abs=5e-6)
    axis = MountAxis(elastic(0.0, circular**2), UP, 0.0, damping=2.0 * zeta * circular)
    figures = RunFigures.from_motion_figures(thrown(axis, speed, 0.2).figures)
    assert figures.acceleration[0] == pytest.approx(acceleration * speed * circular, rel=1e-6)
    assert figures.sway[0] == pytest.approx(sway * speed / circular, rel=1e-6)


def test_drop_on_a_cubic_spring() -> None:
    """m g height = k z^2/2 + r z^4/4, and a = (k z + r z^3)/m."""
    k, r, mass, height = 2e4, 2e7, 5.0, 0.5
    deflection = math.sqrt((-k + math.sqrt(k * k + 4.0 * r * mass * GRAVITY * height)) / r)
    acceleration = (k * deflection + r * deflection**3) / mass
    assert (1e3 * deflection, acceleration / GRAVITY) == pytest.approx((37.811055, 37.4720), abs=5e-5)
    motion = thrown(MountAxis(elastic(0.0, k, 0.0, r), UP, 0.0), math.sqrt(2.0 * GRAVITY * height), 0.02, mass)
    figures = RunFigures.from_motion_figures(motion.figures)
    assert (figures.acceleration[0], figures.sway[0]) == pytest.approx((acceleration, deflection), rel=1e-6)


def test_period_of_duffing() -> None:
    """x'' = -omega0^2 x - alpha x^3 from the amplitude A has the period 4 K(m)/Omega, Omega^2 = omega0^2 + alpha A^2,
    m = alpha A^2/(2 Omega^2); the motion begins at 0 with the speed that leads to A.
    """
    from scipy.special import ellipk

    square, alpha, A = 4000.0, 4e6, 0.02
    Omega = math.sqrt(square + alpha * A**2)
    period = 4.0 * float(ellipk(alpha * A**2 / (2.0 * Omega**2))) / Omega
    assert period == pytest.approx(0.0872290874, abs=5e-11)
    speed = math.sqrt(square * A**2 + 0.5 * alpha * A**4)
    x = thrown(MountAxis(elastic(0.0, square, 0.0, alpha), UP, 0.0), speed, 1.0).histories.displacement[:, 0]
    before = np.flatnonzero((x[:-1] <= 0.0) & (x[1:] > 0.0))
    crossings = 1e-5 * (before + x[before] / (x[before] - x[before + 1]))
    assert crossings.size == 12
    np.testing.assert_allclose(np.diff(crossings), period, atol=1e-7)


@pytest.mark.parametrize(
    ("ratio", "share", "published"), [(0.8, 0.1, 1.751977), (1.5, 0.2, 1.785124), (2.0, 0.3, 1.324869)]
)
def test_den_hartogs_dry_friction(ratio: float, share: float, published: float) -> None:
    """A mass on k with dry friction F = share k Y, on a base that moves by Y cos(omega t): relative to the base a force
    P = m omega^2 Y acts, and Den Hartog (1931) has amplitude/(P/k) = sqrt(V^2 - (U F/P)^2) without stops, with
    V = 1/(1 - r^2) and U = tan(pi/(2 r))/r. Within 0.3 %, as rho = 1e5/Y and n = 10 leave the friction some elasticity.
    """
    V, U = 1.0 / (1.0 - ratio**2), math.tan(0.5 * math.pi / ratio) / ratio
    expected = ratio**2 * math.sqrt(V**2 - (U * share / ratio**2) ** 2)
    assert expected == pytest.approx(published, abs=5e-7)
    stiffness, move = 400.0, 0.02
    friction = share * stiffness * move
    spring = SpringParameters((0.0, stiffness), (1.0,), friction, 1e5 / move, 0.5, 10.0, 0.0, -1.0, 1.0)
    circular = ratio * math.sqrt(stiffness)
    period = 2.0 * math.pi / circular
    case = shaken(sine(-(circular**2) * move, 1.0 / period, 0.5 * math.pi), 160.0 * period)
    found = kernel_motion(one_mass(MountAxis(spring, UP, 0.0)), case, period / 8000, every=period / 1000)
    displacement = found.histories.displacement[:, 0]
    amplitude = 0.5 * np.ptp(displacement[-1000:])
    assert 0.5 * np.ptp(displacement[-2000:-1000]) == pytest.approx(amplitude, rel=1e-6)  # steady
    assert amplitude / move == pytest.approx(expected, rel=3e-3)


class WhiteNoise:
    """Independent normal averages over steps: a one-sided density [(m/s^2)^2/Hz] that is flat."""

    def __init__(self, density: float) -> None:
        self.density = density

    def averages(self, step: float, count: int) -> FloatArray:
        return np.random.default_rng(4).normal(0.0, math.sqrt(0.5 * self.density / step), count)


def test_miles_with_the_damper() -> None:
    """White noise of one-sided density G on a damped isolator: the absolute acceleration has the mean square
    pi f0 G (1 + 4 zeta^2)/(4 zeta), and the relative motion pi f0 G/(4 zeta omega0^4).

    Over T the estimate of a root scatters by sqrt(1/(zeta omega0 T))/2 of it; four times that is allowed.
    """
    frequency, zeta, density, duration = 20.0, 0.1, 0.04 * GRAVITY**2, 200.0
    circular = 2.0 * math.pi * frequency
    acceleration = math.sqrt(math.pi * frequency * density * (1.0 + 4.0 * zeta**2) / (4.0 * zeta))
    sway = math.sqrt(math.pi * frequency * density / (4.0 * zeta)) / circular**2
    assert (acceleration, 1e3 * sway) == (pytest.approx(25.068, abs=5e-4), pytest.approx(1.5567, abs=1e-4))
    system = one_mass(MountAxis(elastic(0.0, circular**2), UP, 0.0, damping=2.0 * zeta * circular))
    case = shaken(WhiteNoise(density), duration, settling=2.0)
    found = RunFigures.from_motion_figures(kernel_motion(system, case, 2e-4, every=1.0).figures)
    scatter = 2.0 * math.sqrt(1.0 / (zeta * circular * duration))
    assert found.rms_acceleration[0, 2] == pytest.approx(acceleration, rel=scatter)
    assert found.rms_sway[0, 2] == pytest.approx(sway, rel=scatter)
