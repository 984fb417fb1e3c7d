"""The spring over whole paths, vectorised with NumPy from the same functions as the single step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.law import SpringLaw
from ..core.parameters import SpringParameters, polynomial
from ..core.restoring import amplifier, elastic_force, restoring_force, tangent_stiffness
from ..core.saturation import GAUSS_3, Saturation, falling, rising, saturation, stroke_start
from ..core.work import elastic_work, falling_work, is_narrow, rising_work

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Beyond this the work of the linear continuation may overflow; no spring goes there.
LARGEST_DISPLACEMENT = 1e9


class Vector:
    """Operations on arrays; the twin of `saturation.Scalar`."""

    exp = np.exp
    log = np.log
    log1p = np.log1p
    expm1 = np.expm1
    clip = staticmethod(np.clip)

    where = staticmethod(np.where)

    @staticmethod
    def column(values: Any) -> FloatArray:
        return np.asarray(values, dtype=np.float64)

    @staticmethod
    def locate(edges: FloatArray, value: FloatArray) -> NDArray[np.intp]:
        return np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2)

    @staticmethod
    def combine(weights: list[float], columns: list[FloatArray]) -> FloatArray:
        return np.asarray(np.dot(weights, np.stack(columns)))

    @staticmethod
    def map(function: Any, *columns: Any) -> Any:
        return function(*columns)


@dataclass(frozen=True, eq=False)
class Strokes:
    """Monotone pieces of a path of K samples; the sample at a turning point ends its stroke.

    Attributes
    ----------
    first : ndarray of int, shape (S,)      Sample at which each stroke begins (a turning point or sample 0).
    direction : ndarray of int, shape (S,)  +1 rising, -1 falling displacement.
    of_sample : ndarray of int, shape (K,)  Stroke that leads to each sample; 0 for the first sample.
    first_moved : int                       Number of samples before the first motion; they are in no stroke.
    """

    first: NDArray[np.intp]
    direction: NDArray[np.int64]
    of_sample: NDArray[np.intp]
    first_moved: int


def split_strokes(displacement: FloatArray) -> Strokes:
    """Cut a path at every change of direction; samples that stand still belong to the stroke before them."""
    signs = np.sign(np.diff(displacement))
    moving = np.flatnonzero(signs)
    samples = np.arange(displacement.size)
    if moving.size == 0:
        return Strokes(np.zeros(0, np.intp), np.zeros(0, np.int64), np.zeros_like(samples), displacement.size)
    turns = moving[np.flatnonzero(np.diff(signs[moving])) + 1]
    first = np.concatenate([moving[:1], turns])
    direction = signs[first].astype(np.int64)
    of_sample = np.maximum(np.searchsorted(first, samples, side="left") - 1, 0)
    return Strokes(first, direction, of_sample, int(first[0]) + 1)


def as_path(displacement: ArrayLike) -> FloatArray:
    """Check a displacement path of shape (K,), K >= 1 [m]."""
    path = np.asarray(displacement, dtype=np.float64)
    if path.ndim != 1 or path.size == 0:
        raise ValueError(f"`displacement` must have shape (K,) with K >= 1, got shape {path.shape}.")
    bad = np.flatnonzero(~(np.abs(path) <= LARGEST_DISPLACEMENT))
    if bad.size:
        what = f"within +-{LARGEST_DISPLACEMENT:g}" if np.isfinite(path[bad[0]]) else "finite"
        raise ValueError(f"`displacement` must be {what} [m], got {path[bad[0]]} at index {bad[0]}.")
    return path


def saturation_of(table: Saturation, xi: FloatArray) -> FloatArray:
    """W(xi) elementwise."""
    u = np.empty_like(xi)
    up = xi >= 0.0
    u[up] = rising(table, xi[up], Vector)
    u[~up] = -falling(table, -xi[~up], Vector)
    return u


@lru_cache(maxsize=16)
def tables(n: float, sigma: float) -> tuple[Saturation, Saturation]:
    """The tables of W as arrays, and the same as lists, which are several times faster for one turning point."""
    arrays = Saturation(n, sigma, Vector)
    return arrays, arrays.converted(np.ndarray.tolist)


def stroke_start_xi(
    table: Saturation, rho: float, start: FloatArray, direction: NDArray[np.int64], omega_start: float
) -> FloatArray:
    """xi at the beginning of each of S strokes that begin at the displacements `start`, shape (S,) [m].

    The rest as in `inherited_xi`.
    """
    return inherited_xi(table, rho, np.abs(np.diff(start)), direction, omega_start)


def inherited_xi(
    table: Saturation, rho: float, length: FloatArray, direction: NDArray[np.int64], omega_start: float
) -> FloatArray:
    """xi at the beginning of each of S strokes; sequential, since each inherits from the one before.

    Parameters
    ----------
    table : Saturation                Tables as lists, several times faster here than arrays.
    rho : float                       [1/m]
    length : ndarray                  Of each stroke but the last, which may be there or not [m].
    direction : ndarray, shape (S,)   +1 or -1, alternating.
    omega_start : float               omega at the beginning of the first stroke.
    """
    xis: list[float] = []
    omega = omega_start
    lengths = length.tolist()
    for k, sign in enumerate(direction.tolist()):
        if k:
            omega = -sign * saturation(table, xis[-1] + rho * lengths[k - 1])
        xis.append(stroke_start(table, sign * omega))
    return np.array(xis)


class PathSolver:
    """omega, force, stiffness and energy of one spring along displacement paths of shape (K,) [m].

    The first sample is where a path starts, with omega = `omega_start`.

    Parameters
    ----------
    parameters : SpringParameters
    """

    def __init__(self, parameters: SpringParameters) -> None:
        self.parameters = parameters
        arrays, lists = tables(parameters.n, parameters.sigma)
        self._arrays = SpringLaw(parameters, arrays)
        self._floats = SpringLaw(parameters, lists)

    def omega(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Normalized hysteretic variable at each sample [-]."""
        strokes = split_strokes(path)
        if strokes.direction.size == 0:
            return np.full(path.shape, omega_start)
        xi, _ = self._xi(path, strokes, omega_start)
        omega = strokes.direction[strokes.of_sample] * saturation_of(self._arrays.table, xi)
        omega[: strokes.first_moved] = omega_start
        return omega

    def force(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Restoring force at each sample [N], paper eq. (10)."""
        return np.asarray(restoring_force(self._arrays, self._x(path), self.omega(path, omega_start), Vector))

    def force_with_partials(self, path: FloatArray, omega: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force at samples with this omega [N], and its partial derivatives by displacement [N/m] and by omega [N]."""
        law, x = self._arrays, self._x(path)
        by_omega = self.parameters.kappa_omega * np.asarray(amplifier(law, x, Vector))
        inside = np.clip(x, law.x_min, law.x_max)
        slope = np.where(x == inside, polynomial(law.dFA, inside), 0.0)
        by_displacement = polynomial(law.dFE, inside) + self.parameters.kappa_omega * omega * slope
        return np.asarray(elastic_force(law, x, Vector)) + omega * by_omega, np.asarray(by_displacement), by_omega

    def stiffness(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Tangent stiffness at each sample in the direction that led to it [N/m]; of loading at the first."""
        strokes = split_strokes(path)
        direction = strokes.direction[strokes.of_sample] if strokes.direction.size else np.ones(path.shape)
        direction[: strokes.first_moved] = 1
        omega = self.omega(path, omega_start)
        return np.asarray(tangent_stiffness(self._arrays, self._x(path), omega, direction, Vector))

    def absorbed_energy(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Integral of the force over the displacement from the first sample to each [J]."""
        ends = np.array([self.parameters.displacement_min, self.parameters.displacement_max])
        fine, kept = _with_crossings(path, ends)
        strokes = split_strokes(fine)
        x = self._x(fine)
        elastic = elastic_work(self._arrays, x, Vector)
        work = np.zeros(fine.shape)
        if strokes.direction.size:
            xi, start_xi = self._xi(fine, strokes, omega_start)
            low = np.where(strokes.of_sample[1:] == strokes.of_sample[:-1], xi[:-1], start_xi[strokes.of_sample[1:]])
            direction = strokes.direction
            x_at_zero = x[strokes.first] - direction * start_xi / self.parameters.rho
            of = strokes.of_sample[1:]
            work[1:] = self._work(direction[of], x_at_zero[of], low, xi[1:])
        return np.asarray(elastic - elastic[0] + np.cumsum(work))[kept]

    def _x(self, path: FloatArray) -> FloatArray:
        return path - self.parameters.displacement_offset

    def _xi(self, path: FloatArray, strokes: Strokes, omega_start: float) -> tuple[FloatArray, FloatArray]:
        """xi at each sample and at the start of each stroke; sequential over the strokes only."""
        start = path[strokes.first]
        start_xi = stroke_start_xi(self._floats.table, self.parameters.rho, start, strokes.direction, omega_start)
        of = strokes.of_sample
        return start_xi[of] + self.parameters.rho * np.abs(path - start[of]), start_xi

    def _work(self, direction: Any, x_at_zero: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Hysteretic work of each step, cut at the edges between which the integrand is analytic."""
        edges = self._edges
        first = np.searchsorted(edges, low, side="right")
        last = np.maximum(np.searchsorted(edges, high, side="left"), first)
        pieces = last - first + 1
        step = np.repeat(np.arange(low.size), pieces)
        within = np.arange(step.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        edge = first[step] + within
        begin = np.where(within == 0, low[step], edges[np.minimum(edge - 1, edges.size - 1)])
        end = np.where(within == pieces[step] - 1, high[step], edges[np.minimum(edge, edges.size - 1)])
        up, narrow = begin >= 0.0, is_narrow(self._arrays, begin, end, Vector)
        work = np.zeros(step.size)
        for integral, side in ((rising_work, up), (falling_work, ~up)):
            for rule, chosen in ((GAUSS_3, side & narrow), (self._arrays.work_rule, side & ~narrow)):
                of = step[chosen]
                work[chosen] = integral(
                    self._arrays, direction[of], x_at_zero[of], begin[chosen], end[chosen], rule, Vector
                )
        return np.bincount(step, weights=work, minlength=low.size).astype(np.float64)

    @cached_property
    def _edges(self) -> FloatArray:
        return np.array(self._floats.work_edges)


def _with_crossings(path: FloatArray, levels: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
    """The path with a sample added wherever it crosses a level, and where the original samples are in it."""
    before, after = path[:-1, None], path[1:, None]
    step, level = np.nonzero((np.minimum(before, after) < levels) & (levels < np.maximum(before, after)))
    if step.size == 0:
        return path, np.arange(path.size)
    values = levels[level]
    order = np.lexsort((values * np.sign(np.diff(path))[step], step))
    fine = np.insert(path, step[order] + 1, values[order])
    kept = np.arange(path.size) + np.concatenate([[0], np.cumsum(np.bincount(step, minlength=path.size - 1))])
    return fine, kept.astype(np.intp)
