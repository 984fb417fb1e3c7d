"""Mounts of other classes than the package's own, to see whether an identification is honest about them.

Every mount is force = FE(y) + friction*h with y = (displacement - centre)/amplitude. Each function of `DRAWS` draws a
law, which gives h, of the order of 1, along y and time [s].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyval

from rig import FloatArray, Generator, Truth, amplitude_of, log_uniform, strokes_of
from strandspring import Spring, SpringParameters

CALIBRATED = 1600  # samples in a cycle of the path that forces are scaled on

Law = Callable[[FloatArray, FloatArray], FloatArray]
Draw = Callable[[Generator, float], Law]


@dataclass(frozen=True)
class Mount(Truth):
    """A mount with an elastic force in parallel; its spring is a linear one of its size, without its law."""

    law: Law = lambda y, _: y
    elastic: tuple[float, ...] = ()  # FE by ascending powers of y [N]
    friction: float = 0.0  # scale of the hysteretic force [N]

    def parts(self, path: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic and hysteretic force along a path that begins in the virgin state [N]; times [s] of equal steps."""
        y = (path - self.spring.displacement_offset) / amplitude_of(self.spring)
        return polyval(y, self.elastic), self.friction * self.law(y, time)


def strokes(y: FloatArray) -> Iterator[tuple[slice, float]]:
    """The strokes of a path, each with the reversal before it, and their signs."""
    for begin, end in pairwise(strokes_of(y)):
        yield slice(begin, end + 1), 1.0 if y[end] >= y[begin] else -1.0


def plays(y: FloatArray, radii: FloatArray) -> FloatArray:
    """Play operators of these radii along a path, shape (K, R); at the start they are as near to 0 as they can."""
    outputs = np.empty((y.size, radii.size))
    state = np.clip(0.0, y[0] - radii, y[0] + radii)
    outputs[0] = state
    for stroke, sign in strokes(y):
        piece = y[stroke, None] - sign * radii
        outputs[stroke] = np.maximum(piece, state) if sign > 0.0 else np.minimum(piece, state)
        state = outputs[stroke.stop - 1]
    return outputs


def own_class(y: FloatArray, rho: float, sigma: float, n: float) -> FloatArray:
    """omega of the package's own class along y."""
    return Spring(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0)).response(y)


def berg(y: FloatArray, half_way: float) -> FloatArray:
    """Friction of Berg (Vehicle System Dynamics 30, 1998, 197): from the reversal (ys, fs) with d = |y - ys|

    f = fs + s*d*(1 - s*fs)/(y2*(1 - s*fs) + d), where y2 is `half_way`.
    """
    f = np.zeros(y.size)
    for stroke, sign in strokes(y):
        start = f[stroke.start]
        way, missing = np.abs(y[stroke] - y[stroke.start]), 1.0 - sign * start
        f[stroke] = start + sign * way * missing / (half_way * missing + way + 1e-300)
    return f


def integrated(y: FloatArray, slope: Callable[[float, float, float], float]) -> FloatArray:
    """z of dz = slope(z, y, direction)*dy from 0 by Runge-Kutta steps of order 4."""
    z = [0.0]
    for at, next_at in pairwise(y.tolist()):
        step, state = next_at - at, z[-1]
        side, middle = float(np.sign(step)), at + 0.5 * step
        k1 = slope(state, at, side)
        k2 = slope(state + 0.5 * step * k1, middle, side)
        k3 = slope(state + 0.5 * step * k2, middle, side)
        z.append(state + step * (k1 + 2.0 * k2 + 2.0 * k3 + slope(state + step * k3, next_at, side)) / 6.0)
    return np.array(z)


def draw_law(
    generator: Generator, rho: tuple[float, float] = (4.0, 40.0), n: tuple[float, float] = (0.3, 4.0)
) -> tuple[float, float, float]:
    """rho*amplitude, sigma, n of the own class."""
    return log_uniform(generator, *rho), log_uniform(generator, 0.5, 4.0), log_uniform(generator, *n)


def preisach(generator: Generator, _: float) -> Law:
    """Preisach's relays with the density w(r)/cosh((s - s0)/c)^2 over half width r and centre s of the relays.

    By play operators p_r (Krejci 1996; Visintin, Differential Models of Hysteresis, 1994, sec. IV), w lognormal:
    h = y - integral of w(r)*c*tanh((p_r[y] - s0)/c) dr. The force leads the displacement, so that the relays count
    negatively; the elastic force y keeps it rising.
    """
    radius, spread = log_uniform(generator, 0.05, 0.4), generator.uniform(0.3, 1.0)
    middle, width = generator.uniform(-0.3, 0.3), log_uniform(generator, 0.3, 2.0)
    radii = np.linspace(0.01, 1.2, 80)
    weights = np.exp(-0.5 * (np.log(radii / radius) / spread) ** 2) / radii
    weights /= weights.sum()
    return lambda y, _: y - width * np.tanh((plays(y, radii) - middle) / width) @ weights


def iwan(generator: Generator, _: float) -> Law:
    """Jenkins elements in parallel, a spring and a slider each (Iwan 1966; Segalman, J. Appl. Mech. 72, 2005, 752).

    h = sum of w_i*(y - p_ri[y])/r_mean, slip at r_i with the power-law spectrum w ~ r^chi up to r_max and a share of
    elements that slip at r_max together.
    """
    exponent, largest = generator.uniform(-0.9, 0.5), log_uniform(generator, 0.1, 0.8)
    together = generator.choice([0.0, generator.uniform(0.1, 0.6)])
    edges = largest * np.linspace(0.0, 1.0, 61)
    radii = 0.5 * (edges[1:] + edges[:-1])
    weights = np.diff(edges ** (exponent + 2.0))  # of forces r*w
    weights *= (1.0 - together) / weights.sum()
    weights[-1] += together
    return lambda y, _: ((y[:, None] - plays(y, radii)) / radii) @ weights


def two_mechanisms(generator: Generator, _: float) -> Law:
    """Two frictions of the package's own class in parallel: h = (1 - w)*omega_1 + w*omega_2."""
    rho, *form = draw_law(generator, (2.0, 8.0))
    _rho, *other = draw_law(generator)
    ratio, share = log_uniform(generator, 3.0, 30.0), generator.uniform(0.25, 0.75)
    return lambda y, _: (1.0 - share) * own_class(y, rho, *form) + share * own_class(y, ratio * rho, *other)


def generalised(generator: Generator, _: float) -> Law:
    """Song and Der Kiureghian (J. Eng. Mech. 132, 2006, 610): dz = rho*dy*(1 - |z|^n*psi), s = sgn dy,

    psi = b1*sgn(s*z) + b2*sgn(y*s) + b3*sgn(y*z) + b4*s + b5*sgn(z) + b6*sgn(y).
    """
    # sgn y, sgn dy, sgn z while z grows, and while it returns.
    growing = np.array([[1, 1, 1], [1, -1, -1], [-1, -1, -1], [-1, 1, 1]])
    returning = growing * [1, 1, -1]
    psi = [np.stack([s * z, y * s, y * z, s, z, y], axis=1) for y, s, z in (growing.T, returning.T)]
    while True:
        beta = np.array([generator.uniform(0.4, 0.9), *generator.uniform(-0.25, 0.25, 5)])
        bounded, back = (terms @ beta for terms in psi)
        # z is bounded by 1/psi^(1/n), and must come back from there after a reversal.
        if bounded.min() > 0.25 and back.max() < 0.8 * bounded.min():
            break
    rho, _sigma, n = draw_law(generator, n=(0.5, 3.0))
    b1, b2, b3, b4, b5, b6 = beta.tolist()

    def slope(z: float, at: float, s: float) -> float:
        side, sign = (1.0 if at >= 0.0 else -1.0), (1.0 if z >= 0.0 else -1.0)
        psi = b1 * s * sign + b2 * side * s + b3 * side * sign + b4 * s + b5 * sign + b6 * side
        return rho * (1.0 - abs(z) ** n * psi)

    return lambda y, _: integrated(y, slope)


def maxwell_rubber(generator: Generator, frequency: float) -> Law:
    """Rubber: Berg's friction and Maxwell branches, each a spring k_i in series with a dashpot k_i*tau_i [s]."""
    count = int(generator.integers(1, 4))
    half_way = log_uniform(generator, 0.05, 0.4)
    branches = [
        (log_uniform(generator, 0.2, 3.0) / count, log_uniform(generator, 0.02, 1.5) / frequency) for _ in range(count)
    ]

    def law(y: FloatArray, time: FloatArray) -> FloatArray:
        from scipy.signal import lfilter

        step = float(time[1] - time[0])
        h, moved = berg(y, half_way), np.diff(y, prepend=y[0])
        for stiffness, relaxation in branches:
            keep = np.exp(-step / relaxation)
            gain = stiffness * relaxation / step * (1.0 - keep)  # exact for straight lines between the samples
            h = h + lfilter([gain], [1.0, -keep], moved)
        return h

    return law


DRAWS: dict[str, Draw] = {
    "preisach": preisach, "iwan": iwan, "two mechanisms": two_mechanisms, "generalised bouc-wen": generalised,
    "maxwell rubber": maxwell_rubber,
}  # fmt: skip


def draw_mount(name: str, generator: Generator, frequency: float) -> Mount:
    """A mount of 10 N to 20 kN and 1 to 50 mm whose half height of the loop is 5 to 40 % of the range of the force;

    its name is one of `DRAWS`, the frequency that of the test [Hz].
    """
    law = DRAWS[name](generator, frequency)
    reach = log_uniform(generator, 10.0, 20e3)  # half the range of the force [N]
    half_height = 2.0 * reach * log_uniform(generator, 0.05, 0.4)
    phase = np.linspace(0.0, 3.0, 3 * CALIBRATED + 1)
    y = np.sin(2.0 * np.pi * phase)
    h = law(y, phase / frequency)
    last = slice(-CALIBRATED - 1, None)
    friction = half_height / float(np.trapezoid(h[last], y[last]) / 4.0)
    elastic = max(reach - 0.5 * friction * float(np.ptp(h[last])), 0.1 * reach)
    grid = np.linspace(-1.0, 1.0, 201)
    while True:
        shape = np.array([0.0, 1.0, *generator.uniform([-0.25, 0.0], [0.25, 0.8])])[: int(generator.integers(2, 5))]
        if polyval(grid, np.arange(1, shape.size) * shape[1:]).min() > 0.2:
            break
    shape *= elastic / (0.5 * np.ptp(polyval(grid, shape)))
    amplitude = log_uniform(generator, 1e-3, 50e-3)
    centre = float(generator.uniform(-1.0, 1.0) * amplitude)
    ends = centre - amplitude, centre + amplitude
    kE = float(shape[0]), max(abs(float(shape[1:].sum())), 1e-3 * friction) / amplitude
    size = SpringParameters(kE, (1.0,), friction, 10.0 / amplitude, 1.0, 1.0, centre, *ends)
    return Mount(size, law=law, elastic=tuple(shape.tolist()), friction=friction)
