"""95 % interval of a single measured force about its prediction: noise, misfit and uncertain coefficients together.

At predicted force F its half-width is q*sqrt(a^2 + (b*F)^2 + e^2). a and b are the additive part (noise and misfit)
and the relative part (noise) of the residuals, and e is the standard error of the prediction, so that the interval
widens where the records determine the force less. The factor q is that with which the interval holds 95 % of the
samples of cycles that were left out of the fit, one cycle at a time. A cycle is left out of the linearised fit, which
takes one solution of the normal equations.

The share of samples held is measured in the same way with q from the other cycles alone, so that no cycle judges an
interval that it has shaped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from ..errors import ModelError
from ..joint import JointCovariance
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from .linearised import Linearised
from .refinement import Samples

LEVEL = 0.95
_GROUPS = 40  # cycles left out one at a time; more are joined
# Standard normal numbers of mean 0 and variance 1, for the noise that averaging over cells has removed.
_NODES = np.array([-1.663, -0.9616, -0.5299, -0.1705, 0.1705, 0.5299, 0.9616, 1.663])
_RIDGE = 1e-9  # share of the diagonal that keeps a fit without one cycle solvable
_STEP = 0.01  # of the differences for the standard error of a prediction, in standard errors of the coefficients
_NORMAL_95 = 1.96  # standard errors to either side
_FIELD = 'field "uncertainty.prediction_interval"'


@dataclass(frozen=True)
class PredictionInterval:
    """95 % interval of a measured force.

    Attributes
    ----------
    factor, additive, relative : float   q [-], a [N], b [-].
    half_width : float                   Root mean square over the records [N].
    coverage : float or None             Share of the samples of left-out cycles inside; None if there was one cycle.
    cycles : int                         Number of cycles left out in turn.
    """

    factor: float
    additive: float
    relative: float
    half_width: float
    coverage: float | None
    cycles: int

    def reach(self, force: FloatArray, error: FloatArray) -> FloatArray:
        """Half-width [N] at predicted forces [N] of these standard errors [N]."""
        return np.asarray(self.factor * np.sqrt(self.additive**2 + (self.relative * force) ** 2 + error**2))

    def as_json(self) -> dict[str, Any]:
        """Content of the model file's field `uncertainty.prediction_interval`."""
        return {
            "level": LEVEL,
            "factor": self.factor,
            "additive": self.additive,
            "relative": self.relative,
            "half_width": self.half_width,
            "held_out_coverage": self.coverage,
            "held_out_cycles": self.cycles,
        }

    @classmethod
    def of(cls, uncertainty: Mapping[str, Any]) -> PredictionInterval | None:
        """The interval in a model file's `uncertainty`; None if it holds none, as older files do.

        Raises
        ------
        ModelError   If it holds anything else.
        """
        given = uncertainty.get("prediction_interval")
        if given is None:
            return None
        if not isinstance(given, Mapping) or given.get("level") != LEVEL:
            raise ModelError(f"{_FIELD} must be an object with the level {LEVEL}; identify the spring again.")
        factor, additive, relative, half_width = (
            _non_negative(given, name) for name in ("factor", "additive", "relative", "half_width")
        )
        coverage = None if given.get("held_out_coverage") is None else _non_negative(given, "held_out_coverage")
        return cls(factor, additive, relative, half_width, coverage, int(_non_negative(given, "held_out_cycles")))


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """The last loop of the fit with the 95 % confidence band of its mean force and the 95 % prediction interval.

    Attributes
    ----------
    displacement, low, force, high : ndarray, shape (B,)   In the order of the path [m], [N].
    reach : ndarray, shape (B,)                            Half-width of the prediction interval [N].
    """

    displacement: FloatArray
    low: FloatArray
    force: FloatArray
    high: FloatArray
    reach: FloatArray

    @classmethod
    def of(cls, linear: Linearised, interval: PredictionInterval) -> PredictionBand:
        """The band on the last two strokes."""
        loops, fit = linear.loops, linear.refinement
        last = loops.stroke >= loops.stroke[-1] - 1
        force, error = fit.backbone.force(fit.omega)[last], linear.force_error[last]
        reach = _NORMAL_95 * error
        return cls(loops.displacement[last], force - reach, force, force + reach, interval.reach(force, error))


def prediction_interval(samples: Samples, linear: Linearised) -> PredictionInterval:
    """The interval of a refined fit, calibrated on cycles left out of it."""
    loops, fit = linear.loops, linear.refinement
    force, error = fit.backbone.force(fit.omega), linear.force_error
    noise = samples.noise_variance(force)
    misfit = np.maximum(1.0 / fit.full_weight - noise / loops.weight, 0.0)
    sizes = [float(loops.weight[points].sum()) for _, points in loops.by_record()]
    relative = float(np.average([each.relative**2 for each in samples.noise], weights=sizes))
    additive = float(np.average([each.additive**2 for each in samples.noise], weights=sizes))
    additive += float(np.average(misfit, weights=loops.weight))
    shape = PredictionInterval(1.0, math.sqrt(additive), math.sqrt(relative), 0.0, None, 0)
    scale = shape.reach(force, error)
    cycle = loops.cycles()
    cycles = int(cycle.max()) + 1
    group = cycle if cycles <= _GROUPS else cycle * _GROUPS // cycles
    count = int(group.max()) + 1
    if count > 1:
        residuals, counted = _left_out(linear, group)
    else:
        # The fit has followed part of the noise: its variance is that of the residuals and the prediction's together.
        lost = 2.0 * float(np.mean(error**2)) / max(float(np.mean(linear.misfit**2)), 1e-300)
        residuals, counted = linear.misfit * math.sqrt(1.0 + lost), np.ones(group.size, dtype=bool)
    # A sample scatters about the mean of its cell by the noise that the mean has lost.
    removed = np.sqrt(noise * (1.0 - 1.0 / loops.weight))
    nodes = _NODES if removed.any() else np.zeros(1)
    ratio = (np.abs(residuals[:, None] + removed[:, None] * nodes) / scale[:, None])[counted].ravel()
    weight = np.repeat(loops.weight[counted] / nodes.size, nodes.size)
    owner = np.repeat(group[counted], nodes.size)
    order = np.argsort(ratio)
    ratio, weight, owner = ratio[order], weight[order], owner[order]
    factor = _quantile(ratio, weight)
    coverage = None
    if count > 1:
        held = 0.0
        for k in np.unique(owner):
            own = owner == k
            held += float(weight[own & (ratio <= _quantile(ratio[~own], weight[~own]))].sum())
        coverage = held / float(weight.sum())
    half_width = factor * loops.rms(scale)
    return PredictionInterval(factor, shape.additive, shape.relative, half_width, coverage, count)


def prediction_error(
    spring: SpringParameters, joint: JointCovariance, displacement: FloatArray, omega_start: float
) -> FloatArray:
    """Standard error of the predicted force along a path, shape (K,) [N], by differences.

    Parameters
    ----------
    spring : SpringParameters
    joint : JointCovariance
    displacement : ndarray, shape (K,)   [m]
    omega_start : float
    """
    size = len(joint.root)
    variance = np.zeros(displacement.size)
    for unit in np.eye(size) * _STEP:
        ends = [PathSolver(joint.moved(spring, side * unit)).force(displacement, omega_start) for side in (1.0, -1.0)]
        variance += ((ends[0] - ends[1]) / (2.0 * _STEP)) ** 2
    return np.asarray(np.sqrt(variance))


def _non_negative(content: Mapping[str, Any], name: str) -> float:
    value = content.get(name)
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0.0 <= value < math.inf:
        raise ModelError(
            f"{_FIELD}: {name} must be a finite number >= 0, got {value!r:.60}; identify the spring again."
        )
    return float(value)


def _left_out(linear: Linearised, group: NDArray[np.intp]) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Misfit of each point to the fit without its cycle [N], and whether the other cycles reach that far.

    Where a record starts on its loop is known from itself, as in a prediction.
    """
    fit, loops = linear.refinement, linear.loops
    jacobian = linear.jacobian[:, : linear.column(3)]
    weighted = jacobian * fit.weight[:, None]
    normal = weighted.T @ jacobian
    normal += np.diag(_RIDGE * np.diag(normal) + 1e-300)
    residuals = linear.misfit.copy()
    counted = np.zeros(group.size, dtype=bool)
    for k in range(int(group.max()) + 1):
        own = group == k
        without = normal - weighted[own].T @ jacobian[own]
        change = np.linalg.lstsq(without, weighted[own].T @ linear.misfit[own], rcond=None)[0]
        residuals[own] += jacobian[own] @ change
        others = loops.displacement[~own]
        counted[own] = (loops.displacement[own] >= others.min()) & (loops.displacement[own] <= others.max())
    return residuals, counted


def _quantile(ascending: FloatArray, weight: FloatArray) -> float:
    """The value below which the wanted share of the weight lies."""
    share = np.cumsum(weight)
    return float(ascending[min(np.searchsorted(share, LEVEL * share[-1]), ascending.size - 1)])
