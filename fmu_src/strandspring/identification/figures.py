"""How well a spring follows a record: RMSE, RNL, energies of the loops, the omega at which the record starts, and what
residuals say of the noise in it: how much of them is white, how alike they are, and how they grow.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import RecordError
from ..kernel.arrays import BoolArray, FloatArray
from ..kernel.path import PathSolver
from ..loops.cycles import Cycle, MeasuredLoop, find_cycles, measured_loops
from ..loops.loop import LoopFigures
from ..loops.strokes import LEAST_STROKE, find_strokes, noise_level
from ..model.stated_figures import NAMES
from ..records.record import Record
from .refusals import FULL, SURE, Strokes, clipped_samples


def rmse(force: FloatArray, predicted: FloatArray) -> float:
    """Root mean square error [N], paper eq. (32)."""
    return float(np.sqrt(np.mean((force - predicted) ** 2)))


def rnl(force: FloatArray, predicted: FloatArray) -> float:
    """1 - sqrt(sum of squared errors / sum of squared forces), paper eq. (33) with the root it needs.

    Only with the root do the three rows of the paper's Table 1 have one rms force.
    """
    return float(1.0 - np.sqrt(np.sum((predicted - force) ** 2) / np.sum(force**2)))


WITH_RIG = "with what was removed"  # of a prediction with what the rig added


@dataclass(frozen=True, eq=False)
class RecordFit:
    """Prediction of one record.

    Attributes
    ----------
    path : str
    predicted : ndarray, shape (K,)   Force at every sample of the record [N].
    first_sample : int                First sample compared.
    samples : int                     Number of samples compared.
    rmse, rnl : float                 Over the samples compared [N], [-].
    rms_force : float                 Over the samples compared [N].
    energy, predicted_energy : float  Work of the hysteretic force over the samples compared, the integral of
                                      (force - FE) over the displacement, measured and predicted [J].
    omega_start : float               omega at the record's first sample.
    compared : str                    What was compared and where omega_start comes from, in words.
    """

    path: str
    predicted: FloatArray
    first_sample: int
    samples: int
    rmse: float
    rnl: float
    rms_force: float
    energy: float
    predicted_energy: float
    omega_start: float
    compared: str

    @property
    def figures(self) -> dict[str, float]:
        """What the model file and JSON hold of it, in N and J."""
        return {name: getattr(self, name) for name in NAMES}

    def as_json(self, fitted: RecordFit | None = None) -> dict[str, Any]:
        """What model file and JSON say of it, and below it of another prediction, the fit."""
        other = {} if fitted is None else {"fitted": {**fitted.figures, "compared": fitted.compared}}
        own = {"samples": self.samples, **self.figures, "omega_start": self.omega_start, "compared": self.compared}
        return own | other


class Followed:
    """Records as a spring follows them.

    Attributes
    ----------
    fits : tuple of RecordFit   Prediction of each record by the spring alone.
    """

    fits: tuple[RecordFit, ...]

    @cached_property
    def figures(self) -> dict[str, float]:
        """rmse [N], rnl, energy and predicted_energy [J] of the spring alone over all records."""
        return overall_figures(self.fits)

    @property
    def rmse(self) -> float:
        """Root mean square error over all records [N]."""
        return self.figures["rmse"]

    @property
    def rnl(self) -> float:
        """RNL over all records [-]: 1 for a perfect prediction."""
        return self.figures["rnl"]


def predict_record(solver: PathSolver, record: Record, first_sample: int = 0) -> RecordFit:
    """Predict a record along its displacement as recorded, as its FMU does; compared from a sample on.

    The unknown omega at its start is estimated as one bounded scalar.

    Raises
    ------
    RecordError   If no such sample is within the selected displacements, or the force is zero in all of them.
    """
    if is_one_period(record):
        omega_start = _periodic_start(solver, record.displacement)
        compared = "the whole period, omega_start taken from its end"
    else:
        omega_start = estimate_omega_start(solver, record)
        compared = "all samples, omega_start estimated"
    if first_sample:
        compared = f"from sample {first_sample + 1}; earlier samples only initialise the hysteresis state"
    if record.compared is not None:
        compared += ", within the selected displacements"
    if clipped := int(np.count_nonzero(clipped_samples(record.force)[first_sample:])):
        compared += f", {clipped} clipped samples left out"
    force = solver.force(record.displacement, omega_start, record.rising_time)
    return figures_of(solver, record, force, first_sample, omega_start, compared)


def figures_of(
    solver: PathSolver, record: Record, predicted: FloatArray, first_sample: int, omega_start: float, compared: str
) -> RecordFit:
    """A prediction of a record with its figures; the same errors as of `predict_record`."""
    chosen = chosen_samples(record, first_sample)
    if not chosen.any():
        raise RecordError(
            f"{record.path}: no sample from number {first_sample + 1} on, where the steady part begins, is within "
            "the selected displacements; select others."
        )
    force, p = record.force[chosen], predicted[chosen]
    rms_force = float(np.sqrt(np.mean(force**2)))
    if rms_force == 0.0:
        raise RecordError(
            f"{record.path}: the force is 0 N in all samples compared, so that RNL has no value; check that the column "
            "of force was recorded."
        )
    counted = chosen[1:] & chosen[:-1]
    works = [float(np.sum(steps_of_work(solver, record.displacement, f)[counted])) for f in (record.force, predicted)]
    return RecordFit(
        record.path, predicted, first_sample, force.size, rmse(force, p), rnl(force, p), rms_force, works[0], works[1],
        omega_start, compared,
    )  # fmt: skip


def chosen_samples(record: Record, first_sample: int) -> BoolArray:
    """The samples compared, shape (K,): from one on, within the force sensor's range and the selected displacements."""
    chosen = np.arange(len(record)) >= first_sample
    within = chosen & ~clipped_samples(record.force)
    chosen = within if within.any() else chosen
    return chosen if record.compared is None else chosen & record.compared


def steps_of_work(solver: PathSolver, path: FloatArray, force: FloatArray) -> FloatArray:
    """Work of a force without FE in each interval of a path, shape (K - 1,) [J], by the trapezoidal rule."""
    p = solver.parameters
    elastic = solver if p.is_plain else PathSolver(p.mechanisms[0])
    hysteretic = force - elastic.force_with_partials(path, np.zeros(path.size))[0]
    return np.asarray(0.5 * (hysteretic[1:] + hysteretic[:-1]) * np.diff(path))


def is_one_period(record: Record) -> bool:
    """Whether a record is one whole period: two or three strokes, which end where they began, in force too."""
    x, r = record.displacement, record.force
    turning = Strokes(record).turning
    if turning.size not in (3, 4):
        return False
    step = 3.0 * float(np.max(np.abs(np.diff(x))))
    noise = 6.0 * noise_level(r, turning[1:-1])
    # The last sample may stop one step short of the first.
    missing = abs(float(r[-1] - r[-2])) + abs(float(r[1] - r[0]))
    return bool(
        abs(x[-1] - x[0]) <= max(step, 0.5 * LEAST_STROKE * np.ptp(x))
        and abs(r[-1] - r[0]) <= max(noise, LEAST_STROKE * np.ptp(r), missing)
    )


def twice(record: Record) -> Record:
    """A period that follows itself, so that its memory is steady from its second pass on."""
    begin = int(record.displacement[-1] == record.displacement[0])
    columns: dict[str, Any] = {
        name: np.concatenate([column, column[begin:]])
        for name in ("displacement", "force", "compared", "time")
        if (column := getattr(record, name)) is not None
    }
    if record.time is not None:
        missing = 0.0 if begin else (record.time[-1] - record.time[0]) / (len(record) - 1)
        columns["time"][len(record) :] += record.time[-1] - record.time[0] + missing
    return replace(record, **columns)


def _periodic_start(solver: PathSolver, path: FloatArray) -> float:
    """The omega at the start of one steady period, which ends with the memory it began with."""
    closed = np.append(path, path[0])  # the last sample may stop one step short of the first
    return float(solver.omega(closed, float(solver.omega(closed)[-1]))[-1])


def estimate_omega_start(solver: PathSolver, record: Record) -> float:
    """The omega at the first sample that follows the first two strokes best, or what is compared of them."""
    end = int(Strokes(record).turning[:3][-1]) + 1
    p, time = solver.parameters, record.rising_time
    path, measured = record.displacement[:end], record.force[:end]
    if p.branches:
        measured = measured - solver.branch_force(path, None if time is None else time[:end])
        solver = PathSolver(replace(p, branches=()))
    chosen = chosen_samples(record, 0)[:end]
    weights = chosen if chosen.any() else np.ones(end)

    def misfit(omega: float) -> float:
        return float(weights @ (solver.force(path, omega) - measured) ** 2)

    best = min((0.0, -1.0, 1.0), key=misfit)
    for halving in range(1, 20):
        near = (best, best - 0.5**halving, best + 0.5**halving)
        best = min((omega for omega in near if abs(omega) <= 1.0), key=misfit)
    return best


def began_at_rest(record: Record) -> bool:
    """Whether a record begins with the spring unloaded: its force is 0 within its noise, or 0.5 % of its range."""
    force = record.force
    return abs(float(force[0])) <= max(3.0 * noise_level(force), 0.005 * float(np.ptp(force)))


def overall_figures(fits: Sequence[RecordFit]) -> dict[str, float]:
    """The figures of a `RecordFit` over several records."""
    squared = sum(fit.samples * fit.rmse**2 for fit in fits)
    power = sum(fit.samples * fit.rms_force**2 for fit in fits)
    count = sum(fit.samples for fit in fits)
    works = (sum(getattr(fit, name) for fit in fits) for name in NAMES[2:])
    return dict(zip(NAMES, (math.sqrt(squared / count), 1.0 - math.sqrt(squared / power), *works), strict=True))


def recorded_loops(records: Sequence[Record], fits: Sequence[RecordFit]) -> tuple[MeasuredLoop, ...]:
    """The loops of the samples compared, with those predicted along the same path, in ascending order of amplitude.

    A record without a full cycle stands as one of 0 cycles, from its one end to the other. Where many strokes belong to
    no cycle, as in a sweep of the amplitude, they stand beside, without energy.
    """
    parts, predicted, others = [], [], []
    for record, fit in zip(records, fits, strict=True):
        # The first sample compared is the one behind a reversal, with which a cycle begins.
        compared = np.arange(len(record)) >= fit.first_sample - 1
        part = replace(record, compared=compared if record.compared is None else compared & record.compared)
        if cycles := find_cycles(part):
            parts.append(part)
            # Clipped forces make no difference.
            predicted.append(np.where(clipped_samples(record.force), record.force, fit.predicted))
        else:
            others.append(_as_one(record, fit))
        others += _lone_strokes(part, cycles)
    loops = (*measured_loops(parts, predicted), *others)
    return tuple(sorted(loops, key=lambda loop: loop.figures.amplitude))


def _lone_strokes(record: Record, cycles: Sequence[Cycle]) -> Iterator[MeasuredLoop]:
    """Strokes within a record that belong to no cycle, where these are more than a quarter: one for each amplitude."""
    turning = find_strokes(record.displacement).turning[1:-1]
    used = np.ones(len(record), bool) if record.compared is None else record.compared
    strokes = [(int(a), int(b)) for a, b in pairwise(turning) if used[a : b + 1].all()]
    lone = [
        (a, b) for a, b in strokes if not any(cycle.first_sample <= a and b <= cycle.last_sample for cycle in cycles)
    ]
    x, force, least = record.displacement, record.force, math.inf
    for a, b in sorted(lone, key=lambda ends: -abs(x[ends[1]] - x[ends[0]])) if 4 * len(lone) > len(strokes) else ():
        if abs(x[b] - x[a]) >= least:
            continue
        least = FULL * abs(x[b] - x[a])
        low, high = (a, b) if x[a] < x[b] else (b, a)
        ends = (float(x[low]), float(x[high]), float(force[low]), float(force[high]))
        figures = LoopFigures(*ends, math.nan, min(ends[2:]), max(ends[2:]), math.nan)
        yield MeasuredLoop(record.path, figures, None, 0, None)


def _as_one(record: Record, fit: RecordFit) -> MeasuredLoop:
    """A record as if it were one loop, with the work of forces without FE as its energy."""
    x, used = record.displacement, chosen_samples(record, fit.first_sample)
    places = np.flatnonzero(used)[[np.argmin(x[used]), np.argmax(x[used])]]
    low, high = x[places].tolist()
    measured, predicted = (
        LoopFigures(low, high, float(force[places[0]]), float(force[places[1]]), float(force[used].mean()),
                    float(force[used].min()), float(force[used].max()), energy)
        for force, energy in ((record.force, fit.energy), (fit.predicted, fit.predicted_energy))
    )  # fmt: skip
    steps = np.diff(x)[used[1:] & used[:-1]]
    noise = Strokes(record).noise * float(np.linalg.norm(steps))
    return MeasuredLoop(record.path, measured, None, 0, None, noise=noise, predicted=predicted)


# -- noise


def white_variance(residuals: FloatArray) -> float:
    """Variance of what differs from row to row, shape (P,): half the mean squared difference of neighbours."""
    return 0.5 * float(np.mean(np.diff(residuals) ** 2))


def autocorrelation_time(residuals: FloatArray) -> float:
    """1 + 2*(c_1 + c_2 + ...) in rows, at least 1, up to where the lag exceeds five times the sum (Sokal 1997)."""
    power = float(residuals @ residuals)
    if power == 0.0:
        return 1.0
    size = 1 << (2 * residuals.size - 1).bit_length()
    correlation = np.fft.irfft(np.abs(np.fft.rfft(residuals, size)) ** 2, size)[: residuals.size] / power
    sums = 2.0 * np.cumsum(correlation) - 1.0
    beyond = np.flatnonzero(np.arange(residuals.size) >= 5.0 * sums)
    return max(1.0, float(sums[beyond[0]] if beyond.size else sums[-1]))


def growing_variance(force: FloatArray, residuals: FloatArray) -> tuple[float, float]:
    """a^2 and b^2 of residuals whose variance is a^2 + (b*force)^2; b = 0 where it is not seen.

    Squared residuals are regressed on the squared force, each over the variance that the regression before gave.
    """
    squares = residuals**2
    mean = max(float(squares.mean()), 1e-300)
    columns = np.stack([np.ones(force.size), force**2 / max(float(np.mean(force**2)), 1e-300)], axis=1)
    variance = np.full(force.size, mean)
    for _ in range(3):
        H = (columns / variance[:, None] ** 2).T @ columns + 1e-9 / mean**2 * np.eye(2)
        a, b = np.linalg.solve(H, columns.T @ (squares / variance**2)).tolist()
        variance = np.maximum(columns @ [a, b], 0.01 * mean)
    # The variance of a squared residual is 2*variance^2.
    if b < SURE * float(np.sqrt(2.0 * np.linalg.inv(H)[1, 1])):
        return mean, 0.0
    return max(a, 0.01 * mean), b / float(np.mean(force**2))
