"""What records say of loops that were not recorded if the mount may be of a wider class than the spring.

Beside FE, FA, rho, sigma and n there may be further friction mechanisms, here stop operators whose force may grow with
the displacement, and an amplifier of any form, here straight between knots. All of it is linear about a fit. What the
records do not decide is bounded by a prior: each may add a share of the hysteretic force. The posterior of this linear
problem says by how much loops differ from the spring's, and how far that is known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.projection import Problem, Refinement
from ..least_squares.trust_region import triangle_of
from ..points.residuals import autocorrelation_time
from ..points.sample_points import SamplePoints
from ..rig.corrected import Corrected
from ..rig.other_mounts import stop_operators
from .small_loops import AMPLITUDE

_THRESHOLDS = 0.7 * 0.6 ** np.arange(8)  # of stop operators, shares of the amplitude
_KNOTS = 9  # of the amplifier
_PRIOR = 0.5  # standard deviation of each further force, share of the hysteretic force (rms)
_CYCLES = 40  # until a loop is steady
_POINTS = 48  # in a stroke
_ERRORS = 2.0  # standard errors that count
_WORTH = 0.03  # difference on nested loops that is reported, share of the force's standard deviation
_NOTHING = 1e-12  # rms of a column in that of the largest up to which it is zero
_ROUNDS = 2  # of estimating the noise that is left
# Reversals of nested loops after a full cycle, in amplitudes.
_NESTED = (0.0, 1.0, -1.0, 0.6, -0.2, 0.6, -0.3, 0.3, -0.3, 0.3, 0.2, 0.8, 0.2, 0.8)
_BEFORE_NESTED = 3  # strokes


@dataclass(frozen=True)
class Unrecorded:
    """Loops that were not recorded, against those of the spring.

    Attributes
    ----------
    energy, energy_error : float   Mean and standard deviation of the energy at AMPLITUDE, shares of the spring's [-].
    nested, nested_error : float   rms of the force on nested loops less the spring's, of its mean and of its standard
                                   deviation, shares of the standard deviation of the recorded force [-].
    """

    energy: float
    energy_error: float
    nested: float
    nested_error: float

    @property
    def is_far(self) -> bool:
        """Whether nested loops may differ from the spring's by what counts."""
        return math.hypot(self.nested, _ERRORS * self.nested_error) > _WORTH

    @property
    def energies(self) -> tuple[float, float]:
        """Ends of the range of the energy, shares of the spring's [-]."""
        return self.energy - _ERRORS * self.energy_error, self.energy + _ERRORS * self.energy_error

    def sentence(self, mount: str) -> str:
        """The figures in words, given the class of mount that explains the records best."""
        share = 100.0 * math.hypot(self.nested, self.nested_error)
        return f"{mount}; on nested loops the force may differ by {share:.0f} % of its standard deviation"


def unrecorded(state: Corrected) -> Unrecorded:
    """What the records that a spring was fitted to say of loops that they do not hold."""
    loops, fit = state.loops, state.fit.refinement
    residuals = fit.backbone.misfit(loops.force, fit.omega)
    columns, coefficients = _columns(state, loops, fit)
    own = fit.derivatives[3] * fit.backbone.G
    mean, root = _posterior(loops, columns, coefficients, own, residuals, loops.rms(fit.omega * fit.backbone.G))
    low, high = loops.reach
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    small = _through(middle + AMPLITUDE * half * np.resize([1.0, -1.0], 2 * _CYCLES + 2), 2 * _CYCLES - 1)
    there = _along(state, small)
    at_small, _ = _columns(state, small, there)
    energy = small.work(there.omega * there.backbone.G)
    gradient = np.array([small.work(column) for column in at_small.T])
    nested = _through(middle + half * np.array(_NESTED), _BEFORE_NESTED)
    at_nested, _ = _columns(state, nested, _along(state, nested))
    deviation = max(loops.force_deviation, 1e-300)
    scale = max(abs(energy), 1e-300)
    return Unrecorded(
        energy=1.0 + float(gradient @ mean) / scale,
        energy_error=float(np.linalg.norm(gradient @ root)) / scale,
        nested=float(np.sqrt(np.mean((at_nested @ mean) ** 2))) / deviation,
        nested_error=float(np.sqrt(np.mean(np.sum((at_nested @ root) ** 2, axis=1)))) / deviation,
    )


def _posterior(
    loops: SamplePoints,
    columns: FloatArray,
    coefficients: int,
    own: FloatArray,
    residuals: FloatArray,
    hysteretic: float,
) -> tuple[FloatArray, FloatArray]:
    """Mean and a root of the covariance of the coefficients, of which the first are the spring's own.

    Parameters
    ----------
    loops : SamplePoints
    columns : ndarray, shape (P, C)
    coefficients : int              Columns of the spring itself.
    own : ndarray, shape (P,)       Derivative by the omega_start of the record, which is left to each record.
    residuals : ndarray, shape (P,) [N]
    hysteretic : float              rms hysteretic force [N].
    """
    scale = np.array([loops.rms(column) for column in columns.T])
    scale[scale <= _NOTHING * scale.max()] = np.inf  # no point shows it
    root = np.sqrt(loops.weight)
    triangle = triangle_of(
        loops.beside_starts(np.column_stack([columns / scale, residuals]) * root[:, None], own * root)
    )
    matrix, target = triangle[:, :-1], triangle[:, -1]
    prior = np.zeros(scale.size)
    prior[coefficients:] = 1.0 / (_PRIOR * hysteretic)
    independent = residuals.size / autocorrelation_time(root * residuals)
    left = target
    for _ in range(_ROUNDS):
        noise = np.sqrt(left @ left / independent) + 1e-9 * hysteretic
        inverse = np.linalg.pinv(np.vstack([matrix / noise, np.diag(prior)]), rcond=1e-9)
        mean = inverse[:, : target.size] @ (target / noise)
        left = target - matrix @ mean
    return mean / scale, inverse / scale[:, None]


def _columns(state: Corrected, loops: SamplePoints, fit: Refinement) -> tuple[FloatArray, int]:
    """Derivatives of the force by the spring's own parameters and by what a wider class has, and how many are own.

    Parameters
    ----------
    state : Corrected   Of which they are derivatives.
    loops : SamplePoints   Its own points, or others.
    fit : Refinement    At these points.
    """
    basis = state.fit.basis.columns(loops.displacement)
    yielding = (fit.derivatives[:3] * fit.backbone.G).T
    low, high = state.loops.reach
    place = (2.0 * loops.displacement - low - high) / (high - low)
    thresholds = np.asarray(0.5 * (high - low) * _THRESHOLDS)
    stops = stop_operators(loops, thresholds) / thresholds
    knots = np.linspace(-1.0, 1.0, _KNOTS)
    hats = np.maximum(1.0 - np.abs(place[:, None] - knots) / (knots[1] - knots[0]), 0.0)
    parts = [
        basis.elastic, fit.omega[:, None] * basis.amplifier, yielding, stops, place[:, None] * stops,
        fit.omega[:, None] * hats,
    ]  # fmt: skip
    return np.hstack(parts), sum(part.shape[1] for part in parts[:3])


def _along(state: Corrected, loops: SamplePoints) -> Refinement:
    """The fit along another path."""
    fit = state.fit.refinement
    start = np.zeros(int(loops.record[-1]) + 1)
    return Problem(loops, state.fit.basis, fit.hysteresis, coarse=True).at(replace(fit, omega_start=start))


def _through(turns: FloatArray, first: int) -> SamplePoints:
    """Strokes through these reversals [m], with points on those from `first` on."""
    count = turns.size - 1
    moved = np.diff(turns)
    share = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, _POINTS)))
    stroke = np.repeat(np.arange(first, count), _POINTS)
    travel = np.abs(moved)[stroke] * np.tile(share, count - first)
    direction = np.where(moved >= 0.0, 1, -1).astype(np.int64)
    displacement = turns[:-1][stroke] + direction[stroke] * travel
    size = stroke.size
    return SamplePoints(
        displacement, np.zeros(size), np.ones(size), travel, stroke, np.arange(float(size)), direction, turns[:-1],
        np.abs(moved), np.zeros(count, np.intp),
    )  # fmt: skip
