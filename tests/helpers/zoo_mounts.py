"""Mounts of another class than the package's own, to see whether an identification is honest about them.

Every mount is force = FE(y) + friction*h with y = (displacement - centre)/amplitude; a law gives h, of the order of 1.
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

Law = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Mount(Truth):
    """A mount with an elastic force in parallel; its spring is a linear one of its size, without its law."""

    law: Law = np.zeros_like
    elastic: tuple[float, ...] = ()  # FE by ascending powers of y [N]
    friction: float = 0.0  # scale of the hysteretic force [N]

    def parts(self, path: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic and hysteretic force along a path that begins in the virgin state [N]."""
        y = (path - self.spring.displacement_offset) / amplitude_of(self.spring)
        return polyval(y, self.elastic), self.friction * self.law(y)


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


def iwan(generator: Generator) -> Law:
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
    return lambda y: ((y[:, None] - plays(y, radii)) / radii) @ weights


def exponential(generator: Generator) -> Law:
    """Exponential branches that differ by the direction s (Vaiana and Rosati, MSSP 182, 2023, 109539): with the way d

    from the reversal (yP, hP), h = F_s(y) - (F_s(yP) - hP)*exp(-alpha_s*d), F_s = s + k_s*y + b_s*(exp(c_s*y) - 1).
    """
    alpha, k = log_uniform(generator, 3.0, 40.0), generator.uniform(0.1, 0.4)
    up = np.array([alpha, k, generator.uniform(0.0, 0.2), generator.uniform(0.5, 2.0)])
    forms = {1.0: up, -1.0: up * np.exp(generator.uniform(-0.5, 0.5, 4))}

    def law(y: FloatArray) -> FloatArray:
        h = np.zeros(y.size)
        for stroke, sign in strokes(y):
            begin = stroke.start
            alpha, k, b, c = forms[sign]
            limit = sign + k * y[stroke] + b * np.expm1(c * y[stroke])
            h[stroke] = limit - (limit[0] - h[begin]) * np.exp(-alpha * np.abs(y[stroke] - y[begin]))
        return h

    return law


def pinched(generator: Generator) -> Law:
    """Baber and Noori (J. Eng. Mech. 111, 1985, 1010): dz = g*rho*dy*(1 - |z|^n) while it loads, with the pinch

    g = 1 - zeta*exp(-((z*sgn(dy) - q)/w)^2); it unloads as straight as it began. Euler steps.
    """
    rho, n = log_uniform(generator, 3.0, 15.0), log_uniform(generator, 0.7, 3.0)
    slip, middle, width = generator.uniform([0.3, 0.0, 0.1], [0.8, 0.3, 0.4])

    def law(y: FloatArray) -> FloatArray:
        z = np.zeros(y.size)
        for k, step in enumerate(np.diff(y).tolist()):
            along = z[k] * np.sign(step)
            free = 1.0 - slip * np.exp(-(((along - middle) / width) ** 2))
            z[k + 1] = z[k] + free * rho * step * (1.0 - abs(z[k]) ** n if along > 0.0 else 1.0)
        return np.clip(z, -1.0, 1.0)

    return law


def humped(generator: Generator) -> Law:
    """The own class with FA = 1 + a*exp(-((y - y0)/w)^2/2), which is no polynomial."""
    rho, sigma, n = (log_uniform(generator, *ends) for ends in ((4.0, 40.0), (0.5, 4.0), (0.3, 4.0)))
    size, middle, width = generator.uniform([0.4, -0.5, 0.1], [2.0, 0.5, 0.35])
    friction = Spring(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0))
    return lambda y: friction.response(y) * (1.0 + size * np.exp(-0.5 * ((y - middle) / width) ** 2))


LAWS = {law.__name__: law for law in (iwan, exponential, pinched, humped)}


def draw_mount(generator: Generator, name: str) -> Mount:
    """A mount of 10 N to 20 kN and 1 to 50 mm whose half height of the loop is 5 to 40 % of the range of the force."""
    law = LAWS[name](generator)
    reach = log_uniform(generator, 10.0, 20e3)  # half the range of the force [N]
    half_height = 2.0 * reach * log_uniform(generator, 0.05, 0.4)
    phase = np.linspace(0.0, 3.0, 3 * CALIBRATED + 1)
    y = np.sin(2.0 * np.pi * phase)
    h, last = law(y), slice(-CALIBRATED - 1, None)
    friction = half_height / float(np.trapezoid(h[last], y[last]) / 4.0)
    elastic = max(reach - 0.5 * friction * float(np.ptp(h[last])), 0.1 * reach)
    grid = np.linspace(-1.0, 1.0, 201)
    shape = np.array([0.0, 1.0, *generator.uniform([-0.25, 0.0], [0.25, 0.8])])  # rises by 0.5 at least
    shape *= elastic / (0.5 * np.ptp(polyval(grid, shape)))
    amplitude = log_uniform(generator, 1e-3, 50e-3)
    centre = float(generator.uniform(-1.0, 1.0) * amplitude)
    ends = centre - amplitude, centre + amplitude
    kE = float(shape[0]), max(abs(float(shape[1:].sum())), 1e-3 * friction) / amplitude
    size = SpringParameters(kE, (1.0,), friction, 10.0 / amplitude, 1.0, 1.0, centre, *ends)
    return Mount(size, law=law, elastic=tuple(shape.tolist()), friction=friction)
