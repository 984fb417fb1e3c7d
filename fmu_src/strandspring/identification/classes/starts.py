"""Where to begin: what one more branch or mechanism would explain of the residuals of a fit.

The residuals and every column tried are reduced to what the fit's own derivatives do not reach, so that one linear
least-squares problem says how much a branch of a time constant, or a mechanism of rho, sigma and n, would take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TypeVar

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.projection import RHO_BOUNDS
from ..least_squares.stages import Hysteresis
from .problem import Along, ClassProblem, Shape, time_bounds

Start = TypeVar("Start")

_TIMES = 14  # time constants tried
_RATES = 10  # values of rho tried
_RATE_BOUNDS = (3.0, 3e3)  # of rho times the longest stroke
_SIGMAS, _EXPONENTS = (0.6, 2.0), (0.4, 1.0, 3.0)
# Of a grid in all of a class, and how many of its points are refined.
_COARSE_RATES, _COARSE_TIMES, _COARSE_EXPONENTS, _ANEW = 6, 8, (0.5, 2.0), 2
_DEGREE = 2  # of the amplifier of a mechanism that is tried


@dataclass(frozen=True, eq=False)
class Residuals:
    """Weighted residuals of a fit beside what its own coefficients reach.

    Attributes
    ----------
    frame : ndarray, shape (P, p)   Orthonormal columns of what they reach.
    misfit : ndarray, shape (P,)
    """

    frame: FloatArray
    misfit: FloatArray

    @classmethod
    def of(cls, problem: ClassProblem, along: Along) -> Residuals:
        """Those of a fit at the points of a problem."""
        columns = along.jacobian * problem.root[:, None]
        columns = columns[:, np.abs(columns).max(axis=0) > 0.0]
        frame, singular, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
        frame = frame[:, singular > 1e-10 * singular[0]]
        misfit = problem.root * (problem.loops.force - along.force)
        return cls(frame, misfit - frame @ (frame.T @ misfit))

    def taken(self, columns: FloatArray) -> float:
        """Share of the squared residuals that weighted columns would take, shape (P, k)."""
        beside = columns - self.frame @ (self.frame.T @ columns)
        length = np.linalg.norm(columns, axis=0)
        beside = beside[:, np.linalg.norm(beside, axis=0) > 1e-6 * length]
        if not beside.size:
            return 0.0
        q, _ = np.linalg.qr(beside / np.linalg.norm(beside, axis=0))
        along = q.T @ self.misfit
        return float(along @ along) / max(float(self.misfit @ self.misfit), 1e-300)


def branch_starts(problem: ClassProblem, residuals: Residuals) -> list[tuple[float, float]]:
    """Time constants [s] at which a branch would take most, with the share of the squared residuals, the most first."""
    times = np.geomspace(*time_bounds(problem.rig), _TIMES)
    taken = [
        residuals.taken((problem.branch(log_time)[0] * problem.root)[:, None]) for log_time in np.log(times).tolist()
    ]
    return _peaks(np.array(taken), times.tolist())


def mechanism_starts(problem: ClassProblem, residuals: Residuals) -> list[tuple[float, Hysteresis]]:
    """A second mechanism that would take most, for every range of rho; the most first."""
    loops = problem.loops
    longest = float(loops.length.max())
    low, high = (max(_RATE_BOUNDS[0], RHO_BOUNDS[0]), min(_RATE_BOUNDS[1], RHO_BOUNDS[1]))
    rates = np.geomspace(low, high, _RATES) / longest
    wide = problem.amplifier_columns(_DEGREE) * problem.root[:, None]
    taken = np.zeros(_RATES)
    best = [Hysteresis(rate, 1.0, 1.0) for rate in rates.tolist()]
    for sigma, n in product(_SIGMAS, _EXPONENTS):
        for k, omega in enumerate(loops.points.omega_by_rate(rates, sigma, n)):
            share = residuals.taken(omega[:, None] * wide)
            if share > taken[k]:
                taken[k], best[k] = share, Hysteresis(float(rates[k]), sigma, n)
    return _peaks(taken, best)


def _peaks(taken: FloatArray, starts: Sequence[Start]) -> list[tuple[float, Start]]:
    """Starts at the maxima of what they take, the largest first."""
    padded = np.concatenate([[-np.inf], taken, [-np.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    return [(float(taken[k]), starts[k]) for k in peaks[np.argsort(-taken[peaks], kind="stable")].tolist()]


def anew(problem: ClassProblem, leaner: Shape, omega_start: FloatArray) -> list[Shape]:
    """Shapes of a class from a grid in all of it: a leaner one may have imitated what the class adds by its own.

    Parameters
    ----------
    problem : ClassProblem       With one mechanism or branch more than the leaner class.
    leaner : Shape
    omega_start : ndarray, shape (R,)
    """
    rates = np.geomspace(*_RATE_BOUNDS, _COARSE_RATES) / float(problem.loops.length.max())
    single = [Hysteresis(rate, 1.0, n) for rate in rates.tolist() for n in _COARSE_EXPONENTS]
    if len(problem.degrees) > len(leaner.hysteresis):
        shapes = [Shape(pair, leaner.times) for pair in combinations(single, 2) if pair[0].rho < pair[1].rho]
    elif len(problem.degrees) == 1:
        times = np.geomspace(*time_bounds(problem.rig), _COARSE_TIMES).tolist()
        shapes = [Shape((h,), (*leaner.times, time)) for h, time in product(single, times)]
    else:
        return []
    fits = sorted((problem.linear(shape, omega_start).squares, k) for k, shape in enumerate(shapes))
    return [shapes[k] for _, k in fits[:_ANEW]]
