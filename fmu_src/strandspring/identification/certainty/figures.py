"""How well a model follows a record: RMSE and RNL, and the omega at which the record starts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import RecordError
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.left_out import clipped_samples
from ...loops.noise_levels import noise_level
from ...loops.strokes import Strokes, find_strokes
from ...model.stated_figures import NAMES
from ...records.record import Record

# The memory of omega_start is gone after two strokes; this many samples of them are enough to estimate it.
_START_SAMPLES = 4000
_UNLOADED = 0.005  # share of the range of the force
_SELECTED = ", within the selected displacements"


def rmse(force: FloatArray, predicted: FloatArray) -> float:
    """Root mean square error [N], paper eq. (32)."""
    return float(np.sqrt(np.mean((force - predicted) ** 2)))


def rnl(force: FloatArray, predicted: FloatArray) -> float:
    """1 - sqrt(sum of squared errors / sum of squared forces), paper eq. (33) with the root it needs.

    Only with the root do the three rows of the paper's Table 1 have one rms force.
    """
    return float(1.0 - np.sqrt(np.sum((predicted - force) ** 2) / np.sum(force**2)))


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

    def beside(self, fitted: RecordFit) -> str:
        """What another prediction of the record has that this one, by the spring alone, has not, in words."""
        return fitted.compared.removeprefix(self.compared).removeprefix(", ")


def record_fit(
    solver: PathSolver,
    record: Record,
    path: FloatArray,
    predicted: FloatArray,
    first_sample: int,
    omega_start: float,
    compared: str,
) -> RecordFit:
    """Figures of a prediction from `first_sample` on.

    Parameters
    ----------
    solver : PathSolver               Of the spring whose FE is taken from the forces to have hysteretic ones.
    record : Record
    path : ndarray, shape (K,)        Displacement of the prediction [m].
    predicted : ndarray, shape (K,)   [N]
    first_sample, omega_start, compared   As in `RecordFit`.

    Raises
    ------
    RecordError   If no such sample is within the selected displacements, or the force is zero in all of them.
    """
    chosen = chosen_samples(record, first_sample)
    if record.compared is not None:
        if not chosen.any():
            raise RecordError(
                f"{record.path}: no sample from number {first_sample + 1} on, where the steady part begins, is within "
                "the selected displacements; select others."
            )
        if _SELECTED not in compared:
            compared += _SELECTED
    if clipped := int(np.count_nonzero(clipped_samples(record.force)[first_sample:])):
        left_out = f", {clipped} clipped samples left out"
        compared += "" if left_out in compared else left_out
    force, p = record.force[chosen], predicted[chosen]
    rms_force = float(np.sqrt(np.mean(force**2)))
    if rms_force == 0.0:
        raise RecordError(
            f"{record.path}: the force is 0 N in all samples compared, so that RNL has no value; check that the column "
            "of force was recorded."
        )
    counted = chosen[1:] & chosen[:-1]
    energy, predicted_energy = (
        float(np.sum(steps_of_work(solver, path, course)[counted])) for course in (record.force, predicted)
    )
    return RecordFit(
        record.path, predicted, first_sample, force.size, rmse(force, p), rnl(force, p), rms_force,
        energy, predicted_energy, omega_start, compared,
    )  # fmt: skip


def chosen_samples(record: Record, first_sample: int) -> NDArray[np.bool_]:
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


def predict_record(solver: PathSolver, record: Record) -> RecordFit:
    """Predict a whole record along its displacement as recorded.

    The unknown omega at its start is estimated as one bounded scalar.
    """
    strokes = find_strokes(record.displacement)
    if strokes.turning[min(2, strokes.count)] < _START_SAMPLES:
        # Else samples are left out, and what they do to the memory with them.
        strokes = replace(strokes, displacement=record.displacement)
    omega_start = estimate_omega_start(solver, strokes, record, chosen_samples(record, 0))
    return alone(solver, record, 0, omega_start, "all samples, omega_start estimated")


def alone(solver: PathSolver, record: Record, first_sample: int, omega_start: float, compared: str) -> RecordFit:
    """Prediction by a spring alone, driven by the displacement as recorded: what its FMU gives."""
    path = record.displacement
    force = solver.force(path, omega_start, record.rising_time)
    return record_fit(solver, record, path, force, first_sample, omega_start, compared)


def along_smoothed(solver: PathSolver, record: Record, strokes: Strokes, fit: RecordFit) -> RecordFit:
    """The same along the path without reversals below the noise; the same fit where nothing was smoothed."""
    path = strokes.displacement
    if np.array_equal(path, record.displacement):
        return fit
    force = solver.force(path, fit.omega_start, record.rising_time)
    return record_fit(
        solver, record, path, force, fit.first_sample, fit.omega_start, f"{fit.compared}, along the smoothed path"
    )


def began_at_rest(record: Record) -> bool:
    """Whether a record begins with the spring unloaded, as at rest before a first loading: at the first sample the
    force is 0 within its noise, or within 0.5 % of its range.
    """
    force = record.force
    return abs(float(force[0])) <= max(3.0 * noise_level(force), _UNLOADED * float(np.ptp(force)))


def omega_of_first_force(solver: PathSolver, record: Record) -> float:
    """The omega with which the force at the first sample is the measured one, or nearest to it."""
    at = record.displacement[:1]
    low, high = (float(solver.slow.force(at, end)[0]) for end in (-1.0, 1.0))
    return float(np.clip(2.0 * (record.force[0] - low) / max(high - low, 1e-300) - 1.0, -1.0, 1.0))


def periodic_start(solver: PathSolver, path: FloatArray) -> float:
    """The omega at the start of one steady period, which ends with the memory it began with."""
    closed = np.append(path, path[0])  # the last sample may stop one step short of the first
    return float(solver.omega(closed, float(solver.omega(closed)[-1]))[-1])


def estimate_omega_start(
    solver: PathSolver, strokes: Strokes, record: Record, compared: NDArray[np.bool_] | None = None
) -> float:
    """The omega at the first sample that follows the first two strokes best, or what is compared of them.

    Branches, which have no force there, are taken along all samples: straight motion between few is another one.
    """
    end = int(strokes.turning[min(2, strokes.count)]) + 1
    step = max(1, end // _START_SAMPLES)
    # Turning points stay in the path, or thinning would cut the strokes short.
    chosen = np.union1d(np.arange(0, end, step), strokes.turning[strokes.turning < end])
    p, time = solver.parameters, record.rising_time
    path, measured = strokes.displacement[chosen], record.force[chosen]
    if p.branches:
        begin = slice(0, end)
        times = None if time is None else time[begin]
        branches = solver.branch_force(strokes.displacement[begin], times)
        solver, measured = PathSolver(replace(p, branches=())), measured - branches[chosen]
    weights = np.ones(chosen.size) if compared is None or not compared[chosen].any() else compared[chosen]

    def misfit(omega: float) -> float:
        return float(weights @ (solver.force(path, omega) - measured) ** 2)

    best = 0.0
    for halving in range(21):
        tried = best + np.array([0.0, -1.0, 1.0, -0.5, 0.5]) * 0.5**halving
        best = min(tried.clip(-1.0, 1.0).tolist(), key=misfit)
    return best


def overall(fits: tuple[RecordFit, ...]) -> tuple[float, float]:
    """RMSE [N] and RNL over the compared samples of several records."""
    squared = sum(fit.samples * fit.rmse**2 for fit in fits)
    power = sum(fit.samples * fit.rms_force**2 for fit in fits)
    count = sum(fit.samples for fit in fits)
    return float(np.sqrt(squared / count)), float(1.0 - np.sqrt(squared / power))


def overall_figures(fits: tuple[RecordFit, ...]) -> dict[str, float]:
    """The figures of a `RecordFit` over several records."""
    works = (sum(getattr(fit, name) for fit in fits) for name in NAMES[2:])
    return dict(zip(NAMES, (*overall(fits), *works), strict=True))


def both_figures(fit: RecordFit, other: RecordFit, name: str = "fitted") -> dict[str, Any]:
    """What model file and JSON say of a record: the figures of the spring alone, and below a name those of another
    prediction, such as the fit.
    """
    return {
        **fit.figures,
        "omega_start": fit.omega_start,
        "compared": fit.compared,
        name: {**other.figures, "compared": other.compared},
    }
