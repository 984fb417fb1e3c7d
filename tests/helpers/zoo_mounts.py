"""Mounts of other classes than the package's own, to see whether an identification is honest about them.

Every mount is force = FE(y) + friction*h(y, t) with y = (displacement - centre)/amplitude; h is of the order of 1, and
each class documents its own. FE is a polynomial that rises. `MOUNTS` draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.signal import fftconvolve, lfilter

from rig import FloatArray, Generator, log_uniform, strokes_of
from strandspring import Spring, SpringParameters

CALIBRATED = 1600  # samples in a cycle of the path that forces are scaled on


@dataclass(frozen=True, kw_only=True)
class Mount:
    """A mount with an elastic force in parallel.

    Parameters
    ----------
    centre, amplitude : float   Middle and half of the range of displacement [m].
    elastic : tuple of float    FE by ascending powers of y [N].
    friction : float            Scale of the hysteretic force [N].
    """

    changes: ClassVar[bool] = False  # from cycle to cycle

    centre: float = 0.0
    amplitude: float = 1.0
    elastic: tuple[float, ...] = (0.0,)
    friction: float = 1.0

    def force(self, displacement: FloatArray, time: FloatArray) -> FloatArray:
        """Force along a path that begins in the virgin state [N], shape (K,); times [s] of equal steps."""
        return sum(self.parts(displacement, time))

    def parts(self, displacement: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic and hysteretic force [N]."""
        y = (displacement - self.centre) / self.amplitude
        return polyval(y, self.elastic) * self.stiffness(y), self.friction * self.hysteretic(y, time)

    def stiffness(self, y: FloatArray) -> FloatArray:
        """Share of FE that acts [-]."""
        return np.ones(y.size)

    def hysteretic(self, y: FloatArray, time: FloatArray) -> FloatArray:
        """h(y, t) [-]."""
        raise NotImplementedError


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


def bouc_wen(y: FloatArray, rho: float, sigma: float, n: float) -> FloatArray:
    """omega of the package's own class along y."""
    return Spring(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0)).response(y)


def integrated(y: FloatArray, slope: Callable[[float, float, float, float], float]) -> tuple[FloatArray, FloatArray]:
    """z of dz = slope(z, y, direction, e)*dy and e, the integral of z*dy, both from 0; Runge-Kutta steps of order 4.

    e is held within a step.
    """
    z = np.zeros(y.size)
    energies = np.zeros(y.size)
    state = energy = 0.0
    positions = y.tolist()
    for k, (at, next_at) in enumerate(pairwise(positions), start=1):
        step = next_at - at
        if step != 0.0:
            direction = 1.0 if step > 0.0 else -1.0
            middle = at + 0.5 * step
            k1 = slope(state, at, direction, energy)
            k2 = slope(state + 0.5 * step * k1, middle, direction, energy)
            k3 = slope(state + 0.5 * step * k2, middle, direction, energy)
            k4 = slope(state + step * k3, next_at, direction, energy)
            moved = state + step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            energy += 0.5 * (state + moved) * step
            state = moved
        z[k], energies[k] = state, energy
    return z, energies


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


@dataclass(frozen=True, kw_only=True)
class Preisach(Mount):
    """Preisach's relays with the density w(r)/cosh((s - s0)/c)^2 over half width r and centre s of the relays.

    By play operators p_r (Krejci 1996; Visintin, Differential Models of Hysteresis, 1994, sec. IV), w lognormal:
    h = y - integral of w(r)*c*tanh((p_r[y] - s0)/c) dr. The force leads the displacement, so that the relays count
    negatively; the elastic force y keeps it rising.
    """

    radius: float
    spread: float
    middle: float
    width: float

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        radii = np.linspace(0.01, 1.2, 80)
        weights = np.exp(-0.5 * (np.log(radii / self.radius) / self.spread) ** 2) / radii
        outputs = self.width * np.tanh((plays(y, radii) - self.middle) / self.width)
        return y - outputs @ (weights / weights.sum())


@dataclass(frozen=True, kw_only=True)
class Iwan(Mount):
    """Jenkins elements in parallel, a spring and a slider each (Iwan 1966; Segalman, J. Appl. Mech. 72, 2005, 752).

    h = sum of w_i*(y - p_ri[y])/r_mean, slip at r_i with the power-law spectrum w ~ r^chi up to r_max and a share of
    elements that slip at r_max together.
    """

    exponent: float
    largest: float
    together: float

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        edges = self.largest * np.linspace(0.0, 1.0, 61)
        radii = 0.5 * (edges[1:] + edges[:-1])
        weights = np.diff(edges ** (self.exponent + 2.0))  # of forces r*w
        weights *= (1.0 - self.together) / weights.sum()
        weights[-1] += self.together
        return ((y[:, None] - plays(y, radii)) / radii) @ weights


@dataclass(frozen=True, kw_only=True)
class TwoMechanisms(Mount):
    """Two frictions of the package's own class in parallel: h = (1 - w)*omega_1 + w*omega_2."""

    first: tuple[float, float, float]  # rho, sigma, n
    second: tuple[float, float, float]
    share: float

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        return (1.0 - self.share) * bouc_wen(y, *self.first) + self.share * bouc_wen(y, *self.second)


@dataclass(frozen=True, kw_only=True)
class GeneralisedBoucWen(Mount):
    """Song and Der Kiureghian (J. Eng. Mech. 132, 2006, 610): dz = rho*dy*(1 - |z|^n*psi), s = sgn dy,

    psi = b1*sgn(s*z) + b2*sgn(y*s) + b3*sgn(y*z) + b4*s + b5*sgn(z) + b6*sgn(y).
    """

    rho: float
    n: float
    beta: tuple[float, float, float, float, float, float]

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        rho, n = self.rho, self.n
        b1, b2, b3, b4, b5, b6 = self.beta

        def slope(z: float, at: float, s: float, _: float) -> float:
            side, sign = (1.0 if at >= 0.0 else -1.0), (1.0 if z >= 0.0 else -1.0)
            psi = b1 * s * sign + b2 * side * s + b3 * side * sign + b4 * s + b5 * sign + b6 * side
            return rho * (1.0 - abs(z) ** n * psi)

        return integrated(y, slope)[0]


@dataclass(frozen=True, kw_only=True)
class VaianaRosati(Mount):
    """Exponential model of Vaiana, Sessa, Marmo and Rosati (Nonlinear Dyn. 93, 2018, 1647), and its asymmetric form

    (Vaiana and Rosati, MSSP 182, 2023, 109539): on a stroke of sign s from the reversal (yP, hP)
    h = F_s(y) - s*D*exp(-alpha_s*|y - yP|), D = s*(F_s(yP) - hP),
    F_s = s*f_s + k_s*y + b_s*(exp(c_s*y) - 1) + 4*g_s/(1 + exp(-d_s*(y - e_s))) - 2*g_s.

    With equal branches it is of the package's own class: n = 1, sigma = 1.
    """

    rising: tuple[float, ...]  # alpha, f, k, b, c, g, d, e
    falling: tuple[float, ...]

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        h = np.zeros(y.size)
        for stroke, sign in strokes(y):
            alpha, *limit = self.rising if sign > 0.0 else self.falling
            bound = self.bound(y[stroke], sign, *limit)
            missing = bound[0] - h[stroke.start]
            h[stroke] = bound - missing * np.exp(-alpha * np.abs(y[stroke] - y[stroke.start]))
        return h

    @staticmethod
    def bound(
        y: FloatArray, sign: float, f: float, k: float, b: float, c: float, g: float, d: float, e: float
    ) -> FloatArray:
        """F_s."""
        return sign * f + k * y + b * np.expm1(c * y) + 4.0 * g / (1.0 + np.exp(-d * (y - e))) - 2.0 * g


@dataclass(frozen=True, kw_only=True)
class MaxwellRubber(Mount):
    """Rubber: Berg's friction and Maxwell branches, each a spring k_i in series with a dashpot k_i*tau_i [s]."""

    half_way: float
    rubbing: float  # share of the friction
    branches: tuple[tuple[float, float], ...]  # (k_i, tau_i)

    def hysteretic(self, y: FloatArray, time: FloatArray) -> FloatArray:
        step = float(time[1] - time[0])
        h = self.rubbing * berg(y, self.half_way)
        moved = np.diff(y, prepend=y[0])
        for stiffness, relaxation in self.branches:
            keep = np.exp(-step / relaxation)
            gain = stiffness * relaxation / step * (1.0 - keep)  # exact for straight lines between the samples
            h = h + lfilter([gain], [1.0, -keep], moved)
        return h


@dataclass(frozen=True, kw_only=True)
class FractionalRubber(Mount):
    """Rubber: Berg's friction and a spring-pot, b*d^a y/d(t/unit)^a, by the sum of Gruenwald and Letnikov.

    Sjoeberg and Kari, Vehicle System Dynamics 37, 2002, 217.
    """

    half_way: float
    rubbing: float
    order: float
    gain: float
    unit: float  # [s]

    def hysteretic(self, y: FloatArray, time: FloatArray) -> FloatArray:
        step = float(time[1] - time[0]) / self.unit
        weights = np.cumprod(np.concatenate([[1.0], 1.0 - (self.order + 1.0) / np.arange(1, y.size)]))
        springpot = fftconvolve(weights, y - y[0])[: y.size] / step**self.order
        return self.rubbing * berg(y, self.half_way) + self.gain * springpot


@dataclass(frozen=True, kw_only=True)
class Degrading(Mount):
    """Baber and Wen (J. Eng. Mech. Div. 107, 1981, 1069): dz = rho*dy*(1 - nu*|z|^n*(b*sgn(z*dy) + 1 - b))/eta,

    nu = 1 + d_nu*e, eta = 1 + d_eta*e with e the integral of z*dy; FE falls as 1/(1 + d_k*e).
    """

    changes: ClassVar[bool] = True

    rho: float
    n: float
    beta: float
    strength: float
    yielding: float
    softening: float

    def both(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        rho, n, beta, strength, yielding = self.rho, self.n, self.beta, self.strength, self.yielding

        def slope(z: float, _: float, s: float, e: float) -> float:
            share = beta if s * z >= 0.0 else -beta
            return rho * (1.0 - (1.0 + strength * e) * abs(z) ** n * (share + 1.0 - beta)) / (1.0 + yielding * e)

        return integrated(y, slope)

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        return self.both(y)[0]

    def stiffness(self, y: FloatArray) -> FloatArray:
        return 1.0 / (1.0 + self.softening * self.both(y)[1])


@dataclass(frozen=True, kw_only=True)
class Pinching(Mount):
    """Baber and Noori (J. Eng. Mech. 111, 1985, 1010) in Foliente's form: dz = g(z)*rho*dy*(1 - |z|^n*(...)),

    g = 1 - zeta*(1 - exp(-p*e))*exp(-((z*sgn(dy) - q)/width)^2).
    """

    changes: ClassVar[bool] = True

    rho: float
    n: float
    beta: float
    slip: float
    onset: float
    middle: float
    width: float

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        rho, n, beta = self.rho, self.n, self.beta

        def slope(z: float, _: float, s: float, e: float) -> float:
            share = beta if s * z >= 0.0 else -beta
            depth = self.slip * -float(np.expm1(-self.onset * e))
            free = 1.0 - depth * float(np.exp(-(((s * z - self.middle) / self.width) ** 2)))
            return free * rho * (1.0 - abs(z) ** n * (share + 1.0 - beta))

        return integrated(y, slope)[0]


@dataclass(frozen=True, kw_only=True)
class HardeningWithCycles(Mount):
    """Friction of the own class and FE that both grow with the way: 1 + a*(1 - exp(-c/c0)), c = way/(4*amplitude)."""

    changes: ClassVar[bool] = True

    law: tuple[float, float, float]
    friction_gain: float
    stiffness_gain: float
    cycles: float

    def grown(self, y: FloatArray) -> FloatArray:
        return -np.expm1(-np.cumsum(np.abs(np.diff(y, prepend=y[0]))) / (4.0 * self.cycles))

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        return bouc_wen(y, *self.law) * (1.0 + self.friction_gain * self.grown(y))

    def stiffness(self, y: FloatArray) -> FloatArray:
        return 1.0 + self.stiffness_gain * self.grown(y)


@dataclass(frozen=True, kw_only=True)
class Chatter(Mount):
    """Friction of the own class and a slider with static and kinetic friction behind an elastic drive k.

    The slider's load q = k*(y - slider) drops from q_s to q_s - drop/(1 + |v|/v_s) whenever it reaches q_s (Rabinowicz;
    Stribeck's fall with the velocity), a slip that takes no time.
    """

    law: tuple[float, float, float]
    share: float
    stiffness_of_drive: float
    drop: float
    slow: float  # v_s [1/s]

    def hysteretic(self, y: FloatArray, time: FloatArray) -> FloatArray:
        step = float(time[1] - time[0])
        loads = np.zeros(y.size)
        load = 0.0
        for k, moved in enumerate(np.diff(y).tolist(), start=1):
            load += self.stiffness_of_drive * moved
            if abs(load) >= 1.0:
                left = 1.0 - self.drop / (1.0 + abs(moved) / step / self.slow)
                load = left if load > 0.0 else -left
            loads[k] = load
        return (1.0 - self.share) * bouc_wen(y, *self.law) + self.share * loads


@dataclass(frozen=True, kw_only=True)
class Amplified(Mount):
    """The own class with an amplifier FA that is no polynomial.

    FA = 1 + a*exp(-((y - y0)/w)^2/2) for a hump, 1 + a*tanh((y - y0)/w) for a step.
    """

    law: tuple[float, float, float]
    is_hump: bool
    size: float
    middle: float
    width: float

    def hysteretic(self, y: FloatArray, _: FloatArray) -> FloatArray:
        place = (y - self.middle) / self.width
        shape = np.exp(-0.5 * place**2) if self.is_hump else np.tanh(place)
        return bouc_wen(y, *self.law) * (1.0 + self.size * shape)


# Drawing


def draw_law(
    generator: Generator, rho: tuple[float, float] = (4.0, 40.0), n: tuple[float, float] = (0.3, 4.0)
) -> tuple[float, float, float]:
    """rho*amplitude, sigma, n of the own class."""
    return log_uniform(generator, *rho), log_uniform(generator, 0.5, 4.0), log_uniform(generator, *n)


def _preisach(generator: Generator, _: float) -> Mount:
    return Preisach(
        radius=log_uniform(generator, 0.05, 0.4), spread=generator.uniform(0.3, 1.0),
        middle=generator.uniform(-0.3, 0.3), width=log_uniform(generator, 0.3, 2.0),
    )  # fmt: skip


def _iwan(generator: Generator, _: float) -> Mount:
    return Iwan(
        exponent=generator.uniform(-0.9, 0.5), largest=log_uniform(generator, 0.1, 0.8),
        together=generator.choice([0.0, generator.uniform(0.1, 0.6)]),
    )  # fmt: skip


def _two_mechanisms(generator: Generator, _: float) -> Mount:
    rho, *form = draw_law(generator, (2.0, 8.0))
    _rho, *other_form = draw_law(generator)
    ratio = log_uniform(generator, 3.0, 30.0)
    return TwoMechanisms(
        first=(rho, *form), second=(ratio * rho, *other_form), share=generator.uniform(0.25, 0.75)
    )  # fmt: skip


def _generalised(generator: Generator, _: float) -> Mount:
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
    return GeneralisedBoucWen(rho=rho, n=n, beta=tuple(beta.tolist()))


def _vaiana_rosati(generator: Generator, _: float) -> Mount:
    y = np.linspace(-1.1, 1.1, 101)
    while True:
        alpha = log_uniform(generator, 3.0, 40.0)
        exponential = generator.uniform(0.0, 0.3), generator.uniform(0.5, 2.5)
        rising = alpha, 1.0, 0.3, *exponential, generator.uniform(0.0, 0.3), generator.uniform(2.0, 8.0), 0.2
        falling = rising
        if generator.random() < 0.7:
            factors = np.exp(generator.uniform(-0.6, 0.6, 7))
            falling = *(np.array(rising[:7]) * factors).tolist(), float(generator.uniform(-0.4, 0.4))
        up, down = (VaianaRosati.bound(y, s, *f[1:]) for s, f in ((1.0, rising), (-1.0, falling)))
        if (up - down).min() > 0.5:
            return VaianaRosati(rising=rising, falling=falling)


def _maxwell(generator: Generator, frequency: float) -> Mount:
    count = int(generator.integers(1, 4))
    return MaxwellRubber(
        half_way=log_uniform(generator, 0.05, 0.4), rubbing=1.0,
        branches=tuple(
            (log_uniform(generator, 0.2, 3.0) / count, log_uniform(generator, 0.02, 1.5) / frequency)
            for _ in range(count)
        ),
    )  # fmt: skip


def _fractional(generator: Generator, frequency: float) -> Mount:
    return FractionalRubber(
        half_way=log_uniform(generator, 0.05, 0.4), rubbing=1.0, order=generator.uniform(0.1, 0.5),
        gain=log_uniform(generator, 0.3, 4.0), unit=0.5 / np.pi / frequency,
    )  # fmt: skip


_EXPECTED = 25.0  # the integral of z*dy over a usual test


def _degrading(generator: Generator, _: float) -> Mount:
    rho, _sigma, n = draw_law(generator, n=(0.7, 3.0))
    left = generator.uniform(0.3, 0.9)
    return Degrading(
        rho=rho, n=n, beta=generator.uniform(0.4, 0.9), strength=(left**-n - 1.0) / _EXPECTED,
        yielding=generator.uniform(0.0, 1.0) / _EXPECTED, softening=generator.uniform(0.03, 0.6) / _EXPECTED,
    )  # fmt: skip


def _pinching(generator: Generator, _: float) -> Mount:
    return Pinching(
        rho=log_uniform(generator, 3.0, 15.0), n=log_uniform(generator, 0.7, 3.0), beta=generator.uniform(0.4, 0.9),
        slip=generator.uniform(0.5, 0.95), onset=log_uniform(generator, 0.3, 3.0), middle=generator.uniform(0.0, 0.3),
        width=generator.uniform(0.1, 0.4),
    )  # fmt: skip


def _hardening(generator: Generator, _: float) -> Mount:
    return HardeningWithCycles(
        law=draw_law(generator), friction_gain=generator.uniform(0.1, 0.8), stiffness_gain=generator.uniform(0.0, 0.3),
        cycles=log_uniform(generator, 1.0, 8.0),
    )  # fmt: skip


def _chatter(generator: Generator, frequency: float) -> Mount:
    return Chatter(
        law=draw_law(generator), share=generator.uniform(0.1, 0.5),
        stiffness_of_drive=log_uniform(generator, 10.0, 60.0), drop=generator.uniform(0.1, 0.5),
        slow=log_uniform(generator, 0.5, 20.0) * frequency,
    )  # fmt: skip


def _hump(generator: Generator, _: float) -> Mount:
    size = generator.uniform(0.4, 2.0) if generator.random() < 0.6 else generator.uniform(-0.7, -0.3)
    return Amplified(
        law=draw_law(generator), is_hump=True, size=size, middle=generator.uniform(-0.5, 0.5),
        width=log_uniform(generator, 0.1, 0.35),
    )  # fmt: skip


def _step(generator: Generator, _: float) -> Mount:
    return Amplified(
        law=draw_law(generator), is_hump=False, size=generator.choice([-1.0, 1.0]) * generator.uniform(0.15, 0.6),
        middle=generator.uniform(-0.5, 0.5), width=log_uniform(generator, 0.05, 0.3),
    )  # fmt: skip


DRAWS: dict[str, Callable[[Generator, float], Mount]] = {
    "preisach": _preisach,
    "iwan": _iwan,
    "two mechanisms": _two_mechanisms,
    "generalised bouc-wen": _generalised,
    "vaiana-rosati": _vaiana_rosati,
    "maxwell rubber": _maxwell,
    "fractional rubber": _fractional,
    "degrading": _degrading,
    "pinching": _pinching,
    "hardening": _hardening,
    "chatter": _chatter,
    "hump": _hump,
    "step": _step,
}


def draw_mount(name: str, generator: Generator, frequency: float) -> Mount:
    """A mount of 10 N to 20 kN and 1 to 50 mm whose half height of the loop is 5 to 40 % of the range of the force.

    Parameters
    ----------
    name : str           Of `DRAWS`.
    generator : Generator
    frequency : float    Of the test [Hz].
    """
    mount = DRAWS[name](generator, frequency)
    reach = log_uniform(generator, 10.0, 20e3)  # half the range of the force [N]
    half_height = 2.0 * reach * log_uniform(generator, 0.05, 0.4)
    phase = np.linspace(0.0, 3.0, 3 * CALIBRATED + 1)
    y = np.sin(2.0 * np.pi * phase)
    h = mount.hysteretic(y, phase / frequency)
    last = slice(-CALIBRATED - 1, None)
    friction = half_height / float(np.trapezoid(h[last], y[last]) / 4.0)
    least = 0.1 * reach
    elastic = max(reach - 0.5 * friction * float(np.ptp(h[last])), least)
    grid = np.linspace(-1.0, 1.0, 201)
    while True:
        shape = np.array([0.0, 1.0, *generator.uniform([-0.25, 0.0], [0.25, 0.8])])[: int(generator.integers(2, 5))]
        if polyval(grid, np.arange(1, shape.size) * shape[1:]).min() > 0.2:
            break
    shape *= elastic / (0.5 * np.ptp(polyval(grid, shape)))
    amplitude = log_uniform(generator, 1e-3, 50e-3)
    return replace(
        mount, amplitude=amplitude, centre=float(generator.uniform(-1.0, 1.0) * amplitude),
        elastic=tuple(shape.tolist()), friction=friction,
    )  # fmt: skip
