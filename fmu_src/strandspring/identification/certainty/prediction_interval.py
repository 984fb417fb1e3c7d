"""95 % interval of a single measured force about its prediction: noise and misfit together.

At predicted force F its half-width is sqrt(q^2*(a^2 + (b*F)^2) + z^2*max(0, e^2 - m^2)). a and b are the additive part
(noise and misfit) and the relative part (noise) of the residuals, and q is calibrated on cycles left out of the fit:
the first half of the cycles and then the second, so that drift shows. Half of the cycles is left out of the linearised
fit, which takes one solution of the normal equations. The last term, with the standard error e of the prediction and
the largest one m along the records, widens the interval where a path asks for more than the records have shown.

The interval holds 95 % of the left-out samples, widened by the ratio of Student's quantile to the normal one where the
correlation of the residuals leaves few independent samples. The share that is held is measured with q from the other
half alone: no cycle judges an interval that it has shaped. Another scale for each place along the stroke makes the
interval narrower by 6 to 24 % on the measured records, but lets it miss up to 8 % more of the samples of cycles not
fitted; so there is one scale.

Fitted on some of a record's cycles, it held these shares of the others: hinge 91 to 98 % (fitted on 1 or 2 cycles),
actuator 91 to 97 % (on 2 to 7 of 10); 30 simulated springs each with noise of first-order autocorrelation 0, 0.9 and
0.99: 95, 96 and 94 % in the mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...model.joint import LEVEL, JointCovariance
from ..least_squares.linearised import Linearised
from ..least_squares.refinement import Samples
from ..least_squares.trust_region import triangle_of
from ..points.sample_points import SamplePoints
from .intervals import NORMAL_95, student_95

_TOO_LITTLE = 0.9  # share of held-out cycles below which the interval is called too narrow
_LEAST_INDEPENDENT = 6.0  # samples; with fewer the interval was found to hold nearly all
_SEED = 0  # of the noise that stands for what averaging over cells has removed
_RANK = 1e-8  # singular value below which half of the cycles leaves a combination of coefficients as it is
_CLOSED = 0.05  # difference of two strokes in a closed loop, share of one
_LEAST_TRIED = 1 / 3  # share of the samples of a half that must count, or nothing is said of held-out cycles
# Of the differences for the standard error of a prediction, in standard errors of the coefficients; the smaller ones
# are for a spring whose FA is nearly zero somewhere.
_STEPS = (0.01, 1e-4, 1e-6)


@dataclass(frozen=True)
class ForceInterval:
    """95 % interval of a measured force.

    Attributes
    ----------
    factor, additive, relative : float   q [-], a [N], b [-].
    error : float                        m, the largest standard error of the prediction along the records [N].
    half_width : float                   Root mean square over the records [N].
    held_out_coverage : float or None    Share of the samples of left-out cycles inside; None if not tried.
    held_out_cycles : int                Number of cycles.
    """

    factor: float
    additive: float
    relative: float
    error: float
    half_width: float
    held_out_coverage: float | None
    held_out_cycles: int

    @property
    def sentence(self) -> str:
        """The interval with what it held, in words."""
        share, cycles = self.held_out_coverage, self.held_out_cycles
        if share is None:
            reason = "half of the cycles does not show what the others need" if cycles > 1 else "there is one only"
            held = f"not tried on held-out cycles, because {reason}"
        else:
            held = f"holds {100.0 * share:.0f} % of held-out cycles (each half of the {cycles:g} in turn)"
            if self.is_too_narrow:
                held += ": it is too narrow"
        return f"95 % prediction interval +- {self.half_width:.2g} N, {held}"

    @property
    def is_too_narrow(self) -> bool:
        """Whether it held clearly less than it says of cycles left out of the fit."""
        return self.held_out_coverage is not None and self.held_out_coverage < _TOO_LITTLE

    def reach(self, force: FloatArray, error: FloatArray) -> FloatArray:
        """Half-width [N] at predicted forces [N] of these standard errors [N]."""
        scale = self.additive**2 + (self.relative * force) ** 2
        beyond = np.maximum(error**2 - self.error**2, 0.0)
        return np.asarray(np.sqrt(self.factor**2 * scale + NORMAL_95**2 * beyond))

    def widened(self, error: float) -> ForceInterval:
        """The interval of a spring that has a further error beside the fit, rms [N]."""
        further = NORMAL_95 * error
        return replace(
            self,
            additive=math.hypot(self.additive, further / self.factor),
            half_width=math.hypot(self.half_width, further),
        )

    def as_json(self) -> dict[str, Any]:
        """Content of the model file's field `uncertainty.prediction_interval`."""
        return {"level": LEVEL, **asdict(self)}

    @classmethod
    def from_uncertainty(cls, uncertainty: Mapping[str, Any]) -> ForceInterval | None:
        """The interval in a checked `uncertainty` of a model file; None if it holds none."""
        given = uncertainty.get("prediction_interval")
        if given is None:
            return None
        return cls(**{field.name: given.get(field.name) for field in fields(cls)})


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """The last closed loop of the fit with the 95 % confidence band of its mean force and the 95 % prediction interval.

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
    def from_interval(cls, linear: Linearised, interval: ForceInterval) -> PredictionBand:
        """The band on the last two strokes that make a closed loop; on the last two if there is none."""
        loops, fit = linear.loops, linear.refinement
        alike = np.abs(loops.length[1:] - loops.length[:-1]) < _CLOSED * loops.length[1:]
        with_points = np.isin(np.arange(loops.length.size), loops.stroke)
        closed = np.flatnonzero(alike & (loops.record[1:] == loops.record[:-1]) & with_points[1:] & with_points[:-1])
        first = closed[-1] if closed.size else loops.stroke[-1] - 1
        last = (loops.stroke == first) | (loops.stroke == first + 1)
        force, error = fit.backbone.force(fit.omega)[last], linear.force_error[last]
        reach = NORMAL_95 * error
        return cls(loops.displacement[last], force - reach, force, force + reach, interval.reach(force, error))


def prediction_interval(samples: Samples, linear: Linearised) -> ForceInterval:
    """The interval of a refined fit, calibrated on cycles left out of it."""
    loops, fit = linear.loops, linear.refinement
    force = fit.backbone.force(fit.omega)
    noise = samples.noise_variance(force)
    misfit = np.maximum(1.0 / fit.full_weight - noise / loops.weight, 0.0)
    sizes = [float(loops.weight[points].sum()) for _, points in loops.by_record]
    relative = float(np.average([level.relative**2 for level in samples.noise], weights=sizes))
    additive = float(np.average([level.additive**2 for level in samples.noise], weights=sizes))
    additive += float(np.average(misfit, weights=loops.weight))
    scale = np.sqrt(additive + relative * force**2)
    half, cycles = _halves(loops)
    is_tried = cycles > 1
    if is_tried:
        residuals, counted = _left_out(linear, half, scale)
        # Of few samples in a selected range, those of one half may lie beside those of the other.
        is_tried = all(counted[half == part].mean() >= _LEAST_TRIED for part in (0, 1))
    if not is_tried:
        # Akaike's final prediction error: of new samples, from the residuals of those that were fitted.
        size, count = linear.jacobian.shape[0], linear.jacobian.shape[1] + int(linear.is_start_free.sum())
        residuals = linear.misfit * math.sqrt((size + count) / max(size - count, 1))
        counted = np.ones(residuals.size, dtype=bool)
    # A sample scatters about the mean of its cell by the noise that the mean has lost.
    removed = np.sqrt(noise * (1.0 - 1.0 / loops.weight))
    if removed.any():
        residuals = residuals + removed * np.random.default_rng(_SEED).standard_normal(removed.size)
    ratio = np.abs(residuals) / scale
    weight = loops.weight
    # Few independent samples show the scatter of others as Student's distribution says.
    independent = np.maximum(ratio.size / linear.estimate.time, _LEAST_INDEPENDENT)
    wider = float(student_95(independent)) / NORMAL_95
    factor = wider * _quantile(ratio[counted], weight[counted])
    coverage = None
    if is_tried:
        first, second = counted & (half == 0), counted & (half == 1)
        held = sum(
            float(weight[part][ratio[part] <= wider * _quantile(ratio[other], weight[other])].sum())
            for part, other in ((first, second), (second, first))
        )
        coverage = held / float(weight[counted].sum())
    return ForceInterval(
        factor, math.sqrt(additive), math.sqrt(relative), float(linear.force_error.max()),
        factor * loops.rms(scale), coverage, cycles,
    )  # fmt: skip


def prediction_error(
    spring: SpringParameters,
    joint: JointCovariance,
    displacement: FloatArray,
    omega_start: float,
    time: FloatArray | None = None,
) -> FloatArray:
    """Standard error of the predicted force along a path, shape (K,) [N], by differences.

    Parameters
    ----------
    spring : SpringParameters
    joint : JointCovariance
    displacement : ndarray, shape (K,)   [m]
    omega_start : float
    time : ndarray, shape (K,), or None   [s]; a spring with branches needs it.

    Raises
    ------
    ModelError   If the covariance is so large that no neighbour of the spring is physically possible.
    """
    changes = [_change(spring, joint, unit, displacement, omega_start, time) for unit in np.eye(len(joint.root))]
    return np.asarray(np.linalg.norm(changes, axis=0))


def _change(
    spring: SpringParameters,
    joint: JointCovariance,
    unit: FloatArray,
    displacement: FloatArray,
    omega_start: float,
    time: FloatArray | None,
) -> FloatArray:
    """Change of the force by one standard deviation in a direction of the covariance, shape (K,) [N]."""
    for step in _STEPS:
        with suppress(ValueError):  # FA not positive: no spring
            ends = [joint.moved(spring, (side * step * unit).tolist()) for side in (1.0, -1.0)]
            forces = [PathSolver(end).force(displacement, omega_start, time) for end in ends]
            return np.asarray((forces[0] - forces[1]) / (2.0 * step))
    raise ModelError(
        f'field "uncertainty.joint" is not possible: at {_STEPS[-1]:g} standard deviations from the spring there is no '
        'other; identify the spring again, or remove the field "uncertainty.joint".'
    )


def _halves(loops: SamplePoints) -> tuple[NDArray[np.intp], int]:
    """Half of the cycles to which each point belongs, 0 or 1, and the number of cycles.

    Records are cut in the middle; those of a single cycle go to either half in turn.
    """
    cycle = loops.cycles()
    half = np.zeros(cycle.size, np.intp)
    single = 0
    for _, points in loops.by_record:
        if points.start == points.stop:  # nothing of this record is left
            continue
        cycle_of_record = cycle[points] - cycle[points.start]
        count = int(cycle_of_record[-1]) + 1
        if count == 1:
            half[points] = single % 2
            single += 1
        else:
            half[points] = cycle_of_record >= (count + 1) // 2
    return half, int(cycle[-1]) + 1


def _left_out(linear: Linearised, half: NDArray[np.intp], scale: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Misfit of each point to the fit without its half [N], and whether the other half shows what is there.

    It does not where its displacement does not reach, and where the force that it predicts is less certain than a
    single sample, whose scatter is `scale` [N]: of a selected range, large loops may show no recovery after a reversal.

    Where a record starts on its loop is known from itself, as in a prediction.
    """
    fit, loops = linear.refinement, linear.loops
    jacobian = linear.jacobian
    weighted = np.column_stack([jacobian, linear.misfit]) * np.sqrt(fit.weight)[:, None]
    residuals = linear.misfit.copy()
    counted = np.zeros(half.size, dtype=bool)
    for left_out in (half == 0, half == 1):
        triangle = triangle_of(weighted[~left_out])
        basis, singular, directions = np.linalg.svd(triangle[:, :-1], full_matrices=False)
        known = singular > _RANK * singular[0]
        errors = jacobian[left_out] @ (directions[known].T / singular[known])
        residuals[left_out] -= errors @ (basis[:, known].T @ triangle[:, -1])
        others = loops.displacement[~left_out]
        counted[left_out] = (
            (loops.displacement[left_out] >= others.min())
            & (loops.displacement[left_out] <= others.max())
            & (np.einsum("ij,ij->i", errors, errors) <= scale[left_out] ** 2)
        )
    return residuals, counted


def _quantile(values: FloatArray, weight: FloatArray) -> float:
    """The value below which the wanted share of the weight lies."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weight[order])
    return float(values[order[min(np.searchsorted(share, LEVEL * share[-1]), order.size - 1)]])
