"""Energies of the recorded loops, measured and of the saved spring, by amplitude."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.noise_levels import noise_level
from ...loops.strokes import Strokes
from ..points.sample_points import ONE_AMPLITUDE
from ..points.steady_part import SteadyRecord
from .figures import RecordFit, chosen_samples, steps_of_work

_CLOSED = 0.02  # distance between the ends of a cycle that is closed, share of its stroke


@dataclass(frozen=True)
class LoopEnergy:
    """Loops of about one amplitude.

    Attributes
    ----------
    amplitude : float             Mean [m].
    measured, predicted : float   Mean energy of a cycle, and that of the saved spring along the same path [J].
    error : float                 Standard error of the measured one by the noise of the force [J].
    spread : float                Half the difference between the largest and the smallest cycle [J].
    difference : float            Of the saved spring's energy from the measured one, share of that: over the steady
                                  cycles or over all, whichever is larger [-].
    """

    amplitude: float
    measured: float
    predicted: float
    error: float
    spread: float
    difference: float

    def as_json(self) -> dict[str, float]:
        """An entry of the model file's field `fit.recorded_loops`."""
        return {"amplitude": self.amplitude, "energy": self.measured, "predicted_energy": self.predicted}


def recorded_energies(
    solver: PathSolver, parts: Sequence[SteadyRecord], fits: Sequence[RecordFit]
) -> tuple[LoopEnergy, ...]:
    """Energies of the loops of some records, the largest amplitude first.

    Parameters
    ----------
    solver : PathSolver                Of the saved spring.
    parts : sequence of SteadyRecord   As recorded.
    fits : sequence of RecordFit       Of the spring along the displacement as recorded.
    """
    pieces = [_cycles(solver, part, fit) for part, fit in zip(parts, fits, strict=True)]
    amplitudes, settled, measured, predicted, variances = np.concatenate(pieces, axis=1)
    energies = []
    order = np.argsort(-amplitudes, kind="stable")
    while order.size:
        group = order[amplitudes[order] >= ONE_AMPLITUDE * amplitudes[order[0]]]
        order = order[group.size :]
        # The first cycle of an amplitude is none of its steady loops.
        every, steady = group, group[settled[group] > 0.0]
        group = steady if steady.size else group
        differences = [_share(predicted[cycles].sum(), measured[cycles].sum()) for cycles in (group, every)]
        energies.append(
            LoopEnergy(
                float(amplitudes[group].mean()),
                float(measured[group].mean()),
                float(predicted[group].mean()),
                float(np.sqrt(variances[group].sum())) / group.size,
                0.5 * float(np.ptp(measured[group])),
                max(differences, key=abs),
            )
        )
    return tuple(energies)


def _share(predicted: float, measured: float) -> float:
    """Difference of an energy from a measured one as a share of that; infinite where no loop was measured."""
    return float(predicted / measured) - 1.0 if measured > 0.0 else math.inf


def _cycles(solver: PathSolver, part: SteadyRecord, fit: RecordFit) -> FloatArray:
    """Of each cycle, shape (5, C): amplitude [m], whether it follows a stroke of that amplitude, work measured and
    predicted [J], and its variance by noise [J^2].
    """
    strokes, record = part.strokes, part.record
    path = record.displacement
    used = part.used & chosen_samples(record, fit.first_sample)
    of_interval = strokes.of_sample[1:]
    first = int(of_interval[min(fit.first_sample, of_interval.size - 1)])
    begins = _closed_pairs(strokes, first) or list(range(first, max(strokes.count - 1, first + 1), 2))
    cycle_of_stroke = np.full(strokes.count, len(begins))  # the last one is of no cycle
    for number, begin in enumerate(begins):
        cycle_of_stroke[begin : begin + 2] = number
    cycle = cycle_of_stroke[of_interval]
    counted = used[1:] & used[:-1]
    noise = noise_level(record.force, strokes.turning[1:-1])
    rows = [
        np.bincount(cycle, weights=np.where(counted, values, 0.0), minlength=len(begins) + 1)[: len(begins)]
        for values in (
            steps_of_work(solver, path, record.force),
            steps_of_work(solver, path, fit.predicted),
            (noise * np.diff(path)) ** 2,
        )
    ]
    # The longer stroke counts, since the first and the last of a record are often cut.
    amplitudes = 0.5 * np.array([strokes.length[begin : begin + 2].max() for begin in begins])
    before = np.array([strokes.length[max(begin - 1, 0)] for begin in begins])
    is_settled = np.abs(before - 2.0 * amplitudes) <= 2.0 * (1.0 - ONE_AMPLITUDE) * amplitudes
    return np.stack([amplitudes, is_settled, *rows])


def _closed_pairs(strokes: Strokes, first: int) -> list[int]:
    """First strokes of the cycles that end where they began, from a stroke on, one after the other."""
    ends, pairs = strokes.turning_displacement, []
    stroke = first
    while stroke + 2 < ends.size:
        is_closed = abs(ends[stroke] - ends[stroke + 2]) <= _CLOSED * strokes.length[stroke]
        if is_closed:
            pairs.append(stroke)
        stroke += 2 if is_closed else 1
    return pairs
