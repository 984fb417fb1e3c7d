"""What the spring that is saved gives along the records as they were recorded, beside what was fitted.

An FMU of the spring knows neither what was removed from the records nor that their displacement was smoothed. So the
figures of an identification are those of the saved spring alone, and this module says where they differ from the fit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.noise_levels import noise_level
from ..records.record import Record
from .figures import RecordFit, chosen_samples, overall, steps_of_work
from .outcomes import Outcome
from .steady_part import SteadyRecord

_WORTH = 0.05  # difference that is reported, share of the force's standard deviation or of a loop's energy
_ONE_AMPLITUDE = 0.9  # amplitude in the largest of a group down to which it belongs to the group
_BEYOND_NOISE = 3.0  # standard errors from which a difference of energies is real


def differences(
    solver: PathSolver,
    parts: Sequence[SteadyRecord],
    alone: Sequence[RecordFit],
    smoothed: Sequence[RecordFit],
    fitted: Sequence[RecordFit],
) -> dict[Outcome, str]:
    """Cautions where the saved spring alone differs from the fit, or its loops' energies from those recorded.

    Parameters
    ----------
    solver : PathSolver                 Of the saved spring.
    parts : sequence of SteadyRecord    As recorded.
    alone : sequence of RecordFit       Of the spring along the displacement as recorded.
    smoothed : sequence of RecordFit    Along the path without reversals below the noise.
    fitted : sequence of RecordFit      With what was removed from the records.
    """
    deviation = float(
        np.sqrt(np.mean(np.concatenate([_centred(part, fit) ** 2 for part, fit in zip(parts, alone, strict=True)])))
    )
    found = {}
    (own, own_rnl), (without_jitter, _), (best, best_rnl) = (overall(tuple(fits)) for fits in (alone, smoothed, fitted))
    if own - without_jitter > _WORTH * deviation:
        found[Outcome.JITTER] = _both_errors(own, without_jitter, deviation)
    if without_jitter - best > _WORTH * deviation:
        found[Outcome.SPRING_ALONE] = (
            f"error of the force {100.0 * own / deviation:.2g} % of its standard deviation, RNL {own_rnl:.4g}; "
            f"{100.0 * best / deviation:.2g} %, {best_rnl:.4g} with what was removed"
        )
    if energies := _energies(solver, parts, alone):
        found[Outcome.LOOP_ENERGY] = energies
    return found


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
    x = np.concatenate([part.record.displacement[own] for part, own in zip(parts, chosen, strict=True)])
    force = np.concatenate([part.record.force[own] for part, own in zip(parts, chosen, strict=True)])
    columns = np.column_stack([np.ones(x.size), (x - x.mean()) / max(float(np.ptp(x)), 1e-300)])
    line = columns @ np.linalg.lstsq(columns, force, rcond=None)[0]
    predicted = np.concatenate([fit.predicted[own] for fit, own in zip(alone, chosen, strict=True)])
    return float(np.sum((force - predicted) ** 2)) > float(np.sum((force - line) ** 2))


def _centred(part: SteadyRecord, fit: RecordFit) -> FloatArray:
    force = part.record.force[chosen_samples(part.record, fit.first_sample)]
    return np.asarray(force - force.mean())


def _energies(solver: PathSolver, parts: Sequence[SteadyRecord], fits: Sequence[RecordFit]) -> str:
    """By how much the spring's loops differ in energy from those recorded, amplitude by amplitude, where it counts."""
    amplitudes, measured, predicted, variances = np.concatenate(
        [_cycles(solver, part, fit) for part, fit in zip(parts, fits, strict=True)], axis=1
    )
    texts = []
    order = np.argsort(-amplitudes)
    while order.size:
        group = order[amplitudes[order] >= _ONE_AMPLITUDE * amplitudes[order[0]]]
        order = order[group.size :]
        recorded = float(measured[group].sum())
        difference = float(predicted[group].sum()) - recorded
        is_real = abs(difference) > _BEYOND_NOISE * float(np.sqrt(variances[group].sum()))
        if is_real and abs(difference) > _WORTH * abs(recorded):
            size = f"energy {100.0 * difference / recorded:+.0f} %" if recorded > 0.0 else "no loop was recorded"
            texts.append(f"{size} at {1e3 * float(amplitudes[group].mean()):.3g} mm")
    return ", ".join(texts)


def _cycles(solver: PathSolver, part: SteadyRecord, fit: RecordFit) -> FloatArray:
    """Amplitude [m], hysteretic work measured and predicted [J], and its variance by noise of each cycle: (4, C)."""
    strokes, record = part.strokes, part.record
    path = record.displacement
    used = part.used & chosen_samples(record, fit.first_sample)
    counted = used[1:] & used[:-1]
    of_interval = strokes.of_sample[1:]
    first = int(of_interval[fit.first_sample]) if fit.first_sample < of_interval.size else 0
    cycle = np.maximum(of_interval - first, 0) // 2
    # A single stroke at the end belongs to the cycle before it.
    count = max((strokes.count - first) // 2, 1)
    cycle = np.minimum(cycle, count - 1)
    noise = noise_level(record.force, strokes.turning[1:-1])
    rows = [
        np.bincount(cycle, weights=np.where(counted, values, 0.0), minlength=count)
        for values in (
            steps_of_work(solver, path, record.force),
            steps_of_work(solver, path, fit.predicted),
            (noise * np.diff(path)) ** 2,
        )
    ]
    lengths = strokes.length[first : first + 2 * count]
    amplitudes = 0.5 * np.array([lengths[2 * k : 2 * k + 2].max() for k in range(count)])
    return np.stack([amplitudes, *rows])
