"""The paper's two stages by linear least squares over whole strokes: no iteration, no initial values.

Stage 1 (paper eqs. 12-20) fits FE and G = kappa_omega*FA where omega is known, in the steady section: +1 on loading, -1
on unloading rows. Each branch is used wherever it alone is steady, so that the whole range is covered:

    r = FE(x) + omega*G(x).

Stage 2 (eqs. 21-25) extracts omega = (r - FE)/G. Instead of differentiating it at three points, eq. (22) is integrated
along the strokes: with u = omega in the direction of motion and the way s,

    u(s) = u(0) + a*[s - integral over u > 0 of u^n ds] + b*integral over u < 0 of (-u)^n ds,
    a = rho,   b = rho*(2*sigma - 1),

which is linear in a, b and the u(0) of each stroke for a given n, and n comes from a scan of its whole range. Where the
steady section begins is not known: both stages are run for a few distances from the reversal, and a closing linear fit
with each omega gives FE and G from all rows and says which is best.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..core.parameters import SIGMA_RANGE
from ..core.polynomials import least_value
from ..findings import Finding, IdentificationError, Outcome
from ..identification.figures import rmse
from ..identification.method import Fitted
from ..identification.refusals import FULL
from ..identification.samples import Samples
from ..kernel.arrays import FloatArray, IndexArray
from ..loops.strokes import noise_level
from .options import TwoStageOptions
from .periods import Hysteresis, polynomial_spring

_DEGREES = ((1, 0), (2, 1), (3, 2), (4, 3), (5, 3), (6, 4), (8, 6))  # candidates, the leanest first
_STEADY = (0.1, 0.25, 0.45, 0.65, 0.8)  # where the steady section may begin, of the longest stroke
_N = np.geomspace(0.05, 20.0, 19)  # that are tried; the best one's surroundings are finer
_CELLS = 160  # of a stroke, over which rows are averaged for stage 2


def candidates(options: TwoStageOptions, samples: Samples, where: str) -> Iterator[Fitted]:
    """The spring, then such of lower degrees unless they are given."""
    for degrees in (options.degrees,) if options.degrees else (None, *reversed(_DEGREES[:-2])):
        yield _fitted(degrees, samples, where)


def _fitted(degrees: tuple[int, int] | None, samples: Samples, where: str) -> Fitted:
    """Identify without start values; the degree of FA is lowered until FA is positive."""
    least = sum(degrees or _DEGREES[0]) + 2 + 3 + len(samples.records) + 1  # one more than parameters
    if samples.rows.size < least:
        numbers = {"found": samples.rows.size, "needed": least}
        raise IdentificationError(Outcome.TOO_FEW_SAMPLES, where, numbers)
    samples = _on_whole_strokes(samples)
    stages = _Stages(samples)
    solution = stages.solve(degrees) if degrees else stages.choose()
    if solution is None:
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    elastic, amplifier = solution.degrees
    low, high = samples.reach
    for degree in range(amplifier, -1, -1):
        solved = _solved(stages.matrix((elastic, degree), solution.omega), samples.r)
        FE, G = (np.asarray(legendre.leg2poly(part), np.float64) for part in np.split(solved, [elastic + 1]))
        if least_value(tuple(G.tolist()), -1.0, 1.0)[0] > 1e-3 * abs(float(G[0])):  # a margin for rounding
            break
    else:
        raise IdentificationError(Outcome.BRANCHES_CROSS, where)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    spring = polynomial_spring(where, (low, high), middle, half, FE, G, solution.hysteresis)
    findings = [*stages.findings(solution)]
    if degree < amplifier:
        findings.append(Finding(Outcome.AMPLIFIER_REDUCED, {"degree": degree}))
    return Fitted(spring, tuple(findings), {"degrees": (elastic, degree), "steady_section_from": solution.share})


def _on_whole_strokes(samples: Samples) -> Samples:
    """All samples of some cycles in place of a few of each stroke, along which stage 2 could not be integrated."""
    rows, stroke = samples.rows, samples.stroke_of_row
    strokes = np.unique(stroke).size
    spacing = min(round(samples.displacement.size / rows.size), strokes // 8)  # four cycles at least
    if spacing < 2 or rows.size > _CELLS * strokes:
        return samples
    chosen = np.unique(stroke[stroke // 2 % spacing == 0])
    first, last = rows[np.searchsorted(stroke, chosen)], rows[np.searchsorted(stroke, chosen, side="right") - 1]
    return replace(samples, rows=np.concatenate([np.arange(*ends) for ends in zip(first, last, strict=True)]))


class _Solution(NamedTuple):
    """Both stages at some degrees; `error` is the rms of the closing fit [N]."""

    error: float
    degrees: tuple[int, int]
    share: float
    hysteresis: Hysteresis
    omega: FloatArray


class _Stages:
    """The rows of records on their strokes, and both stages on them."""

    def __init__(self, samples: Samples) -> None:
        self.samples = samples
        stroke, ends = samples.stroke_of_row, samples.displacement[samples.strokes]
        length = np.abs(ends[:, 1] - ends[:, 0])
        begun = (np.cumsum(length) - length)[stroke]
        self.length = length[stroke]
        self.side = np.where(ends[:, 1] >= ends[:, 0], 1.0, -1.0)[stroke]
        # Noise turns back within a stroke, the way does not.
        self.way = np.maximum.accumulate(begun + np.clip(self.side * (samples.x - ends[stroke, 0]), 0.0, self.length))
        self.travel = self.way - begun
        # Samples at reversals may be of either stroke. Cells are narrow after these, where the force bends most.
        self.moved = self.travel > 0.0
        place = _CELLS * np.sqrt(np.minimum(self.travel / self.length, 1.0))
        cells = stroke * _CELLS + np.minimum(place.astype(np.intp), _CELLS - 1)
        distinct, self.cell, self.count = np.unique(cells[self.moved], return_inverse=True, return_counts=True)
        of_cell = distinct // _CELLS
        self.first = np.flatnonzero(np.diff(of_cell, prepend=-1))
        # Each stroke begins with the reversal of the one before: dry friction switches between two samples.
        later = self.first[1:]
        is_next = np.diff(of_cell[self.first]) == 1
        self.turns = later[is_next & ~np.isin(samples.strokes[of_cell[later], 0], samples.begins)]
        self.turn_way = (np.cumsum(length) - length)[of_cell[self.turns]]

    def matrix(self, degrees: tuple[int, int], omega: FloatArray) -> FloatArray:
        """Columns of FE and G: Legendre polynomials of the place in the range, well conditioned."""
        low, high = self.samples.reach
        columns = legendre.legvander((2.0 * self.samples.x - low - high) / (high - low), max(degrees))
        return np.hstack([columns[:, : degrees[0] + 1], omega[:, None] * columns[:, : degrees[1] + 1]])

    def solve(self, degrees: tuple[int, int]) -> _Solution | None:
        """Both stages for each steady section, the best one by the closing fit; None if there is none."""
        solutions = []
        r, matrix, terms = self.samples.r, self.matrix(degrees, self.side), degrees[0] + 1
        for share in _STEADY:
            steady = self.travel >= share * self.length.max()
            if np.count_nonzero(steady) < 2 * matrix.shape[1]:
                continue
            solved = _solved(matrix[steady], r[steady], 1e-6)  # the branches may hardly overlap
            G = self.side * (matrix[:, terms:] @ solved[terms:])
            if (read := self._second_stage(matrix[:, :terms] @ solved[:terms], G)) is None:
                continue
            omega = self.samples.points.omega_by_rate(np.array([read.rho]), read.sigma, read.n)[0]
            if min(omega.max(), -omega.min()) >= 0.6:  # less does not tell FE from FA
                closing = self.matrix(degrees, omega)
                error = rmse(r, closing @ _solved(closing, r))
                solutions.append(_Solution(error, degrees, share, read, omega))
        return min(solutions, key=lambda solution: solution.error, default=None)

    def _second_stage(self, FE: FloatArray, G: FloatArray) -> Hysteresis | None:
        """rho, sigma, n; None without a positive loop or a rho > 0."""
        middle = float(np.median(G))
        if middle <= 0.0:
            return None
        G = np.maximum(G, 0.1 * middle)  # where the loop is lower, noise over G would be all
        columns = ((self.samples.r - FE) / G, self.side, self.way, G)
        omega, side, way, root = (np.bincount(self.cell, column[self.moved]) / self.count for column in columns)
        # Until a hundredth of noise is left, over a twentieth of a stroke at most.
        half_width = min(0.5 * (noise_level(omega) / 0.01) ** 2, 0.5 * 0.05 * omega.size / self.first.size)
        # Without some of what noise adds to |u|, a saturated branch would have a mean of 1 - u^n above 0.
        u = (side * moving_mean(omega, int(half_width), self.first)).clip(-1.1, 1.1)
        rows = (
            self.first + np.searchsorted(self.turns, self.first),
            np.insert(way, self.turns, self.turn_way),
            np.insert(u, self.turns, -u[self.turns - 1]),
            np.insert(root * np.sqrt(self.count), self.turns, root[self.turns]),
        )
        finer = _line(*rows, _N)[2] * (_N[1] / _N[0]) ** np.linspace(-0.75, 0.75, 7)
        rho, slope, n = _line(*rows, finer.clip(_N[0], _N[-1]))
        if not rho > 0.0:
            return None
        return Hysteresis(rho, float(np.clip(0.5 * (1.0 + slope / rho), *SIGMA_RANGE)), n)

    def choose(self) -> _Solution | None:
        """The leanest that predicts held-out rows about as well as richer ones; None if there is none.

        What counts is the median over the folds: the mean would be that of amplitudes left out, where polynomials
        extrapolate. An error of half a per cent is as good as none: richer degrees would imitate the hysteresis.
        """
        r, floor = self.samples.r, 0.005 * float(np.std(self.samples.r))
        best, least = None, math.inf
        for solution in filter(None, map(self.solve, _DEGREES)):
            matrix = self.matrix(solution.degrees, solution.omega)
            fits = ((held, _solved(matrix[~held], r[~held])) for held in self.samples.folds)
            error = max(float(np.median([rmse(r[held], matrix[held] @ solved) for held, solved in fits])), floor)
            if error < 0.95 * least:
                best, least = solution, error
        return best

    def findings(self, solution: _Solution) -> Iterator[Finding]:
        """What the records show too little of."""
        reached = float(np.abs(solution.omega[self.length >= FULL * self.length.max()]).max())
        if reached < 0.9:
            yield Finding(Outcome.NO_STEADY_SECTION, {"omega": reached})
        if solution.hysteresis.n in (_N[0], _N[-1]):
            yield Finding(Outcome.N_AT_BOUND, {"n": solution.hysteresis.n})
        if solution.hysteresis.sigma in SIGMA_RANGE:
            yield Finding(Outcome.SIGMA_AT_BOUND, {"sigma": solution.hysteresis.sigma})


def _solved(matrix: FloatArray, target: FloatArray, rcond: float = 1e-13) -> FloatArray:
    """Linear least squares by the normal equations, quick where rows are many, without eigenvalues below `rcond` of the
    largest, which are noise.
    """
    return np.asarray(np.linalg.lstsq(matrix.T @ matrix, matrix.T @ target, rcond=rcond)[0])


def _line(first: IndexArray, way: FloatArray, u: FloatArray, root: FloatArray, n: FloatArray) -> Sequence[float]:
    """a, b [1/m] and n of the line u(s) that is closest to the strokes; between rows u is taken as straight.

    Parameters
    ----------
    first : ndarray of int, shape (S,)   First row of each stroke.
    way, u, root : ndarray, shape (P,)   s [m], u, and the roots of the weights [N].
    n : ndarray, shape (N,)              Those that are tried.
    """
    lengths, weights = np.diff(first, append=way.size), np.add.reduceat(root**2, first)

    def free(values: FloatArray) -> FloatArray:
        """Weighted values without the mean of each stroke, as its u(0) is free."""
        means = np.add.reduceat(root**2 * values, first, axis=-1) / weights
        return np.asarray(root * (values - np.repeat(means, lengths, axis=-1)))

    step, change = np.diff(way), np.diff(u)
    is_flat = np.abs(change) < 1e-9  # whose quotients would be rounding
    powers = np.abs(u) ** n[:, None]
    integrals = np.zeros((2, *powers.shape))
    for integral, part in zip(integrals, (np.maximum(u, 0.0), np.minimum(u, 0.0)), strict=True):
        mean = np.diff(part * powers) / (n[:, None] + 1.0) / np.where(is_flat, 1.0, change)
        mean = np.where(is_flat, (part != 0.0)[1:] * powers[:, 1:], mean)
        np.cumsum(step * mean, axis=1, out=integral[:, 1:])
    d, e, y = free(way - integrals[0]), free(integrals[1]), free(u)
    dd, de, ee = (np.einsum("np,np->n", *pair) for pair in ((d, d), (d, e), (e, e)))
    dy, ey = d @ y, e @ y
    with np.errstate(divide="ignore", invalid="ignore"):
        b = (dd * ey - de * dy) / (dd * ee - de**2)
        b = np.where(b >= 0.0, b, 0.0)  # sigma >= 1/2
        a = (dy - b * de) / dd
        squares = np.sum((y - a[:, None] * d - b[:, None] * e) ** 2, axis=1)
    best = int(np.argmin(np.where(a > 0.0, squares, np.inf)))
    return float(a[best]), float(b[best]), float(n[best])


def moving_mean(values: FloatArray, half_width: int, first: IndexArray) -> FloatArray:
    """Mean over 2*half_width + 1 values within runs that begin at `first`; the window shrinks evenly at their ends."""
    position, lengths = np.arange(values.size), np.diff(first, append=values.size)
    begin = np.repeat(first, lengths)
    reach = np.minimum(half_width, np.minimum(position - begin, begin + np.repeat(lengths, lengths) - 1 - position))
    sums = np.append(0.0, np.cumsum(values))
    return np.asarray((sums[position + reach + 1] - sums[position - reach]) / (2 * reach + 1))
