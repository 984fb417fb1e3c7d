"""Time integration in the kernel against textbooks, beside those of test_motion.py; figures are derived first."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import least_squares

from bodies_oracle import Course, half_sine, sine
from mounted_examples import (
    COMPRESSION,
    CORNERS,
    NO_WEIGHT,
    UP,
    FloatArray,
    elastic,
    kernel_motion,
    one_mass,
    unit,
)
from strandspring import SpringParameters
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, Point, RigidBody, Vector

pytestmark = pytest.mark.long

GREATEST = 1  # of MotionRecord.of_axes in motion.h


def drop(duration: float, *velocity: float) -> LoadCase:
    x, y, z = velocity
    return LoadCase("thrown", "drop", duration, velocity=(x, y, z))


def shaken(signal: Course, duration: float, direction: Vector = UP, settling: float = 0.0) -> LoadCase:
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, direction)
    return LoadCase("shaken", "sine", duration, (channel,), settling)


@pytest.mark.parametrize("n", [0.3, 1.0, 4.0])
def test_first_peak_on_a_hysteretic_spring_takes_up_the_energy(n: float) -> None:
    """m v^2/2 = W(z), the integral of the force along the monotone path from omega = 0, paper eq. (11) as an ODE."""
    spring, mass, speed = replace(COMPRESSION, n=n), 1.5, 1.2

    def rate(x: float, state: FloatArray) -> list[float]:
        omega = float(state[0])
        FE, FA = (sum(c * x**i for i, c in enumerate(cs)) for cs in (spring.kE, spring.kA))
        return [spring.rho * (1.0 - abs(omega) ** spring.n), FE + spring.kappa_omega * omega * FA]

    def left(_: float, state: FloatArray) -> float:
        return 0.5 * mass * speed**2 - float(state[1])

    left.terminal = True  # type: ignore[attr-defined]
    path = solve_ivp(rate, (0.0, spring.displacement_max), (0.0, 0.0), "DOP853", events=left, rtol=1e-12, atol=1e-15)
    peak = float(path.t_events[0][0])
    found = kernel_motion(one_mass(MountAxis(spring, UP, 0.0), mass), drop(0.04, 0.0, 0.0, speed), 1e-5)
    assert found.figures.of_axes[0, GREATEST] == pytest.approx(peak, rel=1e-6)


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
    spring = SpringParameters(
        (0.0, stiffness), (1.0,), share * stiffness * move, 1e5 / move, 0.5, 10.0, 0.0, -1.0, 1.0
    )  # fmt: skip
    circular = ratio * math.sqrt(stiffness)
    period = 2.0 * math.pi / circular
    signal = sine(-(circular**2) * move, 1.0 / period, 0.5 * math.pi)
    found = kernel_motion(
        one_mass(MountAxis(spring, UP, 0.0)), shaken(signal, 240.0 * period), period / 20_000, every=period / 1000
    )
    displacement = found.histories.displacement[:, 0]
    last, before = displacement[-1000:], displacement[-2000:-1000]
    amplitude = 0.5 * np.ptp(last)
    assert 0.5 * np.ptp(before) == pytest.approx(amplitude, rel=1e-6)  # steady
    assert amplitude / move == pytest.approx(expected, rel=3e-3)


class WhiteNoise:
    """Independent normal averages over steps: a one-sided density [(m/s^2)^2/Hz] that is flat."""

    def __init__(self, density: float, seed: int) -> None:
        self.density, self.seed = density, seed

    def averages(self, step: float, count: int) -> FloatArray:
        return np.random.default_rng(self.seed).normal(0.0, math.sqrt(0.5 * self.density / step), count)


def random_case(density: float, duration: float, seed: int, settling: float = 0.0) -> LoadCase:
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, WhiteNoise(density, seed), UP)
    return LoadCase("random", "random", duration, (channel,), settling)


@pytest.mark.parametrize(
    "axis",
    [
        MountAxis(replace(COMPRESSION, n=0.3), UP, 0.0),
        MountAxis(elastic(0.0, 4000.0), UP, 0.0, damping=20.0),
        MountAxis(SpringParameters((0.0, 4000.0), (1.0,), 12.0, 2e4, 0.5, 8.0, 0.0, -0.5, 0.5), UP, 0.0),
    ],
    ids=["hysteretic", "viscous", "dry friction"],
)
def test_any_spring_under_white_noise_dissipates_a_quarter_of_mass_times_density(axis: MountAxis) -> None:
    """White noise of one-sided density G has the correlation G/2 delta(t), so that by Ito's rule the mean of m v^2/2
    grows by m (G/2)/2 = m G/4 a second whatever the force is: in the mean the mounts dissipate that power.

    The work m a v scatters by m sqrt(G/2 mean(v^2) T) over T; four times that is allowed.
    """
    mass, density, duration, step = 1.5, 4.0, 200.0, 1e-4
    motion = kernel_motion(one_mass(axis, mass), random_case(density, duration, 4), step)
    mean_square = float(np.mean(np.diff(motion.histories.displacement[:, 0]) ** 2)) / step**2
    scatter = 4.0 * mass * math.sqrt(0.5 * density * mean_square * duration)
    expected = 0.25 * mass * density * duration
    assert scatter < 0.2 * expected
    _, kinetic, absorbed, damped = motion.figures.energies[:4].tolist()
    assert kinetic + absorbed + damped == pytest.approx(expected, abs=scatter)
    assert kinetic < 0.02 * expected
    assert motion.imbalance < 1e-5


def test_six_natural_frequencies_by_time_stepping() -> None:
    """K v = omega^2 M v for the displacements of the centre of gravity and the rotations about it; then the same from
    free vibrations of a micrometre, to which six sinusoids are fitted. At 1e-4 s the method's own (omega h)^2/24 is
    3.4e-6 at the highest.
    """
    mass, moments, stiffness = 20.0, (0.25, 0.30, 0.35), np.array([9000.0, 12_000.0, 20_000.0])
    K = np.zeros((6, 6))
    for x, y, z in CORNERS:
        of_place = np.hstack([np.eye(3), -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])])
        K += of_place.T @ np.diag(stiffness) @ of_place
    frequencies = np.sqrt(eigh(K, np.diag([mass] * 3 + list(moments)), eigvals_only=True)) / (2.0 * math.pi)
    published = [5.156998, 5.771394, 10.065842, 10.208627, 13.612062, 14.423525]
    np.testing.assert_allclose(frequencies, published, rtol=1e-6)

    directions: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), UP)
    axes = tuple(MountAxis(elastic(0.0, k), d, 0.0) for k, d in zip(stiffness.tolist(), directions, strict=True))
    body = RigidBody("box", mass, inertia=((0.25, 0.0, 0.0), (0.0, 0.30, 0.0), (0.0, 0.0, 0.35)))
    mounts = tuple(Mount(f"corner {i}", 0, place, axes) for i, place in enumerate(CORNERS))
    points = (Point("one", 0, (0.1, 0.0, 0.05)), Point("another", 0, (0.0, -0.1, 0.2)))
    system = MountedSystem((body,), mounts, points, NO_WEIGHT)
    push = LoadChannel(ChannelKind.FORCE, half_sine(0.05, 0.02), unit(1.0, 2.0, 1.0), 0, (0.1, -0.15, 0.1))
    case = LoadCase("pushed", "force", 4.0, (push,), velocity=(1e-4, 1e-4, 1e-4))
    accelerations = kernel_motion(system, case, 1e-4, every=2e-3).histories.acceleration
    rows = accelerations[15:].reshape(-1, 6)
    time = 2e-3 * np.arange(rows.shape[0])

    def residuals(guess: FloatArray) -> FloatArray:
        phase = 2.0 * math.pi * time[:, None] * guess
        waves = np.hstack([np.cos(phase), np.sin(phase)])
        return ((rows - waves @ np.linalg.lstsq(waves, rows, rcond=None)[0]) / np.abs(rows).max()).ravel()

    fitted = least_squares(residuals, frequencies * (1.0 + 1e-3), xtol=1e-12, ftol=1e-14, gtol=1e-14, x_scale="jac")
    assert np.abs(residuals(fitted.x)).max() < 1e-3
    np.testing.assert_allclose(np.sort(fitted.x), frequencies, rtol=2e-5)


def test_period_of_duffing() -> None:
    """x'' = -omega0^2 x - alpha x^3 from the amplitude A has the period 4 K(m)/Omega, Omega^2 = omega0^2 + alpha A^2,
    m = alpha A^2/(2 Omega^2); the motion begins at 0 with the speed that leads to A.
    """
    square, alpha, A = 4000.0, 4e6, 0.02
    Omega = math.sqrt(square + alpha * A**2)
    period = float(4 * mpmath.ellipk(alpha * A**2 / (2.0 * Omega**2)) / Omega)
    assert period == pytest.approx(0.0872290874, abs=5e-11)

    speed = math.sqrt(square * A**2 + 0.5 * alpha * A**4)
    system = one_mass(MountAxis(elastic(0.0, square, 0.0, alpha), UP, 0.0))
    x = kernel_motion(system, drop(1.0, 0.0, 0.0, speed), 1e-5).histories.displacement[:, 0]
    before = np.flatnonzero((x[:-1] <= 0.0) & (x[1:] > 0.0))
    crossings = 1e-5 * (before + x[before] / (x[before] - x[before + 1]))
    assert crossings.size == 12
    np.testing.assert_allclose(np.diff(crossings), period, atol=1e-7)
