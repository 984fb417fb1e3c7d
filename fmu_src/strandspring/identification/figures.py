"""How well a model follows a record: RMSE and RNL, and the omega at which the record starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.strokes import Strokes, find_strokes
from ..records.record import Record

# The memory of omega_start is gone after two strokes; this many samples of them are enough to estimate it.
_START_SAMPLES = 4000


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
    omega_start: float
    compared: str


def record_fit(
    record: Record, predicted: FloatArray, first_sample: int, omega_start: float, compared: str
) -> RecordFit:
    """Figures of a prediction from `first_sample` on."""
    chosen = np.arange(len(record)) >= first_sample
    if record.compared is not None:
        if not (chosen & record.compared).any():
            raise RecordError(
                f"{record.path}: no sample from number {first_sample + 1} on, where the steady part begins, is within "
                "the selected displacements; select others."
            )
        chosen &= record.compared
        compared += ", within the selected displacements"
    force, p = record.force[chosen], predicted[chosen]
    rms_force = float(np.sqrt(np.mean(force**2)))
    figures = (rmse(force, p), rnl(force, p), rms_force)
    return RecordFit(record.path, predicted, first_sample, force.size, *figures, omega_start, compared)


def predict_record(solver: PathSolver, record: Record) -> RecordFit:
    """Predict a whole record; the unknown omega at its start is estimated as one bounded scalar.

    Reversals below the noise of the displacement are taken out of the path first, as in identification.
    """
    strokes = find_strokes(record.displacement)
    omega_start = estimate_omega_start(solver, strokes, record.force, record.compared)
    predicted = solver.force(strokes.displacement, omega_start)
    return record_fit(record, predicted, 0, omega_start, "all samples, omega_start estimated")


def periodic_start(solver: PathSolver, path: FloatArray) -> float:
    """The omega at the start of one steady period, which ends with the memory it began with."""
    return float(solver.omega(path, float(solver.omega(path)[-1]))[-1])


def estimate_omega_start(
    solver: PathSolver, strokes: Strokes, force: FloatArray, compared: NDArray[np.bool_] | None = None
) -> float:
    """The omega at the first sample that follows the first two strokes best, or what is compared of them."""
    end = int(strokes.turning[min(2, strokes.count)]) + 1
    step = max(1, end // _START_SAMPLES)
    # Turning points stay in the path, or thinning would cut the strokes short.
    chosen = np.union1d(np.arange(0, end, step), strokes.turning[strokes.turning < end])
    path, measured = strokes.displacement[chosen], force[chosen]
    weights = np.ones(chosen.size) if compared is None or not compared[chosen].any() else compared[chosen]

    def misfit(omega: float) -> float:
        return float(weights @ (solver.force(path, omega) - measured) ** 2)

    # Imported here because it takes a third of a second, and identification does without it.
    from scipy.optimize import minimize_scalar

    inner = minimize_scalar(misfit, bounds=(-1.0, 1.0), method="bounded", options={"xatol": 1e-6})
    return float(min((-1.0, 1.0, float(inner.x)), key=misfit))


def overall(fits: tuple[RecordFit, ...]) -> tuple[float, float]:
    """RMSE [N] and RNL over the compared samples of several records."""
    squared = sum(fit.samples * fit.rmse**2 for fit in fits)
    power = sum(fit.samples * fit.rms_force**2 for fit in fits)
    count = sum(fit.samples for fit in fits)
    return float(np.sqrt(squared / count)), float(1.0 - np.sqrt(squared / power))
