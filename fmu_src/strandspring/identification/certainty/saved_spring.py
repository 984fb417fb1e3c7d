"""What the spring that is saved gives along the records as they were recorded, beside what was fitted.

An FMU of the spring knows neither what was removed from the records nor that their displacement was smoothed. So the
figures of an identification are those of the saved spring alone, and this module says where they differ from the fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.noise_levels import noise_level
from ...loops.strokes import Strokes
from ...model.outcomes import Outcome
from ...records.record import Record
from ..points.sample_points import ONE_AMPLITUDE
from ..points.steady_part import SteadyRecord
from .figures import RecordFit, chosen_samples, overall, steps_of_work

_WORTH = 0.05  # difference that is reported, share of the force's standard deviation
_WORTH_ENERGY = 0.02  # the same of a loop's energy
_BEYOND_NOISE = 3.0  # standard errors from which a difference of energies is real
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
    stroke = np.array(begins)
    after, before = strokes.length[np.minimum(stroke + 1, strokes.count - 1)], strokes.length[np.maximum(stroke - 1, 0)]
    amplitudes = 0.5 * np.maximum(strokes.length[stroke], after)
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


def differences(
    parts: Sequence[SteadyRecord],
    recorded: Sequence[LoopEnergy],
    alone: Sequence[RecordFit],
    smoothed: Sequence[RecordFit],
    fitted: Sequence[RecordFit],
) -> dict[Outcome, str]:
    """Cautions where the saved spring alone differs from the fit, or its loops' energies from those recorded.

    Parameters
    ----------
    parts : sequence of SteadyRecord    As recorded.
    recorded : sequence of LoopEnergy   Of the saved spring.
    alone : sequence of RecordFit       Of the spring along the displacement as recorded.
    smoothed : sequence of RecordFit    Along the path without reversals below the noise.
    fitted : sequence of RecordFit      With what was removed from the records.
    """
    deviation = float(
        np.sqrt(np.mean(np.concatenate([_centred(part, fit) ** 2 for part, fit in zip(parts, alone, strict=True)])))
    )
    outcomes = {}
    (rms, rnl), (without_jitter, _), (best, best_rnl) = (overall(tuple(fits)) for fits in (alone, smoothed, fitted))
    if rms - without_jitter > _WORTH * deviation:
        outcomes[Outcome.JITTER] = _both_errors(rms, without_jitter, deviation)
    if without_jitter - best > _WORTH * deviation:
        outcomes[Outcome.SPRING_ALONE] = (
            f"error of the force {100.0 * rms / deviation:.2g} % of its standard deviation, RNL {rnl:.4g}; "
            f"{100.0 * best / deviation:.2g} %, {best_rnl:.4g} with what was removed"
        )
    if energies := _energies(recorded):
        outcomes[Outcome.LOOP_ENERGY] = energies
    return outcomes


def effect_of_smoothing(record: Record, alone: RecordFit, smoothed: RecordFit) -> str:
    """A caution where reversals below the noise of a record's displacement change the error by what counts, or ""."""
    force = record.force[chosen_samples(record, alone.first_sample)]
    deviation = float(np.std(force))
    if abs(alone.rmse - smoothed.rmse) <= _WORTH * deviation:
        return ""
    errors = _both_errors(alone.rmse, smoothed.rmse, deviation)
    if alone.rmse > smoothed.rmse:
        return f"{Outcome.JITTER.value} ({errors})"
    return (
        "The displacement jumps from sample to sample as noise would, but the force follows: record 20 samples a cycle "
        f"or more. ({errors})"
    )


def _both_errors(alone: float, smoothed: float, deviation: float) -> str:
    return (
        f"error of the force {100.0 * alone / deviation:.2g} % of its standard deviation along the displacement as "
        f"recorded, {100.0 * smoothed / deviation:.2g} % along the smoothed one"
    )


def is_worse_than_a_line(parts: Sequence[SteadyRecord], alone: Sequence[RecordFit]) -> bool:
    """Whether a straight line through all records, force over displacement, is closer to them than the spring alone."""
    chosen = [part.used & chosen_samples(part.record, fit.first_sample) for part, fit in zip(parts, alone, strict=True)]
    x = np.concatenate([part.record.displacement[samples] for part, samples in zip(parts, chosen, strict=True)])
    force = np.concatenate([part.record.force[samples] for part, samples in zip(parts, chosen, strict=True)])
    columns = np.column_stack([np.ones(x.size), (x - x.mean()) / max(float(np.ptp(x)), 1e-300)])
    line = columns @ np.linalg.lstsq(columns, force, rcond=None)[0]
    predicted = np.concatenate([fit.predicted[samples] for fit, samples in zip(alone, chosen, strict=True)])
    return float(np.sum((force - predicted) ** 2)) > float(np.sum((force - line) ** 2))


def _centred(part: SteadyRecord, fit: RecordFit) -> FloatArray:
    force = part.record.force[chosen_samples(part.record, fit.first_sample)]
    return np.asarray(force - force.mean())


def _energies(recorded: Sequence[LoopEnergy]) -> str:
    """By how much the spring's loops differ in energy from those recorded, amplitude by amplitude, where it counts."""
    texts = []
    for loop in recorded:
        if abs(loop.difference) > max(_BEYOND_NOISE * loop.error / max(loop.measured, 1e-300), _WORTH_ENERGY):
            size = (
                f"energy {100.0 * loop.difference:+.0f} %" if math.isfinite(loop.difference) else "no loop was recorded"
            )
            texts.append(f"{size} at {1e3 * loop.amplitude:.3g} mm")
    return ", ".join(texts)
