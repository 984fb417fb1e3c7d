"""Least-squares refinement of a start to the statistical limit, with weights from the record.

The weights come from the record's noise (additive and relative parts) and, where the model itself is further from the
force than the noise explains, that distance as a constant.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.noise import ForceNoise
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from .projection import Problem, Refinement
from .stages import Hysteresis

# Relative change of the squared misfit at which the iteration ends. With K samples one standard error of a parameter
# changes it by 1/K; without noise it falls by decades per step until rounding ends it.
TOLERANCE = 1e-6
FAIR_TOLERANCE = 1e-3  # where a fair fit is enough, such as before the weights are known
_FIRST_EVALUATIONS = 4
# Share of the rms force within which no polynomial follows a real spring; it keeps relative noise, which vanishes
# where the force crosses zero, from giving all the weight to those few samples.
_FINEST = 0.005
_FINE_MISFIT = 1e-5  # share of the force's standard deviation below which omega to 1e-8 may not be enough
_MEDIAN = 0.455  # of a squared standard normal
ROBUST_ROUNDS = 5  # of reweighting for Huber's loss
HUBER = 1.345  # standard deviations beyond which the robust loss grows linearly: 95 % efficient for normal noise
_WEIGHT_TOLERANCE = 1e-4  # relative accuracy of the constant part of the variance


@dataclass(frozen=True, eq=False)
class Samples:
    """The points that are refined on, with the noise of each record."""

    loops: SamplePoints
    noise: tuple[ForceNoise, ...]

    def noise_variance(self, force: FloatArray) -> FloatArray:
        """Variance of a single sample of this force at every point [N^2]."""
        variance = np.empty(force.size)
        for (_, points), noise in zip(self.loops.by_record, self.noise, strict=True):
            variance[points] = noise.variance(force[points])
        return variance

    @property
    def noise_rms(self) -> float:
        """The weighted rms that noise alone gives the residuals at the points [N]."""
        return float(np.sqrt(self.noise_variance(self.loops.force).sum() / self.loops.weight.sum()))

    def weights(self, fit: Refinement, robust: bool) -> FloatArray:
        """Inverse variance of each point from the noise and from the misfit beyond it.

        With outliers about, the typical misfit decides.
        """
        loops = self.loops
        predicted = fit.backbone.force(fit.omega)
        squared = (loops.force - predicted) ** 2
        variance = self.noise_variance(predicted) / loops.weight
        finest = (_FINEST * loops.rms(loops.force)) ** 2
        for _, points in loops.by_record:
            variance[points] += max(_misfit_variance(squared[points], variance[points], robust), finest)
        return np.asarray(1.0 / variance)


def refine(samples: Samples, basis: Basis, start: Hysteresis, robust: bool = False) -> Refinement:
    """Refine rho, sigma, n, omega_start, FE and FA.

    Parameters
    ----------
    samples : Samples
    basis : Basis        Degrees of FE and FA.
    start : Hysteresis   From `two_stage` or `scan`.
    robust : bool        Huber's loss, by reweighting.
    """
    loops = samples.loops
    problem = Problem(loops, basis, start, coarse=True)
    fit = problem.solve(start, np.zeros(problem.records), loops.weight, FAIR_TOLERANCE, _FIRST_EVALUATIONS)
    if loops.rms(fit.backbone.misfit(loops.force, fit.omega)) < _FINE_MISFIT * loops.force_deviation:
        problem = Problem(loops, basis, start)
    for _ in range(ROBUST_ROUNDS if robust else 1):
        weight = full_weight = samples.weights(fit, robust)
        if robust:
            pull = np.sqrt(full_weight) * np.abs(fit.backbone.misfit(loops.force, fit.omega))
            weight = full_weight * np.minimum(1.0, HUBER / np.maximum(pull, 1e-300))
        fit = problem.solve(fit.hysteresis, fit.omega_start, weight, TOLERANCE)
        fit = replace(fit, full_weight=full_weight)
    return fit


def _misfit_variance(squared: FloatArray, variance: FloatArray, robust: bool) -> float:
    """The constant that, added to the noise's variance, makes the mean squared misfit what it should be.

    With outliers about, the median takes the place of the mean.
    """

    def excess(constant: float) -> float:
        ratios = squared / (variance + constant)
        return float(np.median(ratios)) / _MEDIAN - 1.0 if robust else float(np.mean(ratios)) - 1.0

    least = max(1e-12 * float(np.mean(squared)), 1e-300)
    if excess(least) <= 0.0:
        return least
    return _falling_root(excess, least, float(np.max(squared)) + least)


def _falling_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a falling function of a positive number is zero, to a relative accuracy of 1e-4, by bisecting ln(x)."""
    low, high = math.log(low), math.log(high)
    while high - low > _WEIGHT_TOLERANCE:
        middle = 0.5 * (low + high)
        if function(math.exp(middle)) > 0.0:
            low = middle
        else:
            high = middle
    return math.exp(0.5 * (low + high))
