"""What the spring that is saved gives along the records as they were recorded, beside what was fitted.

An FMU of the spring knows neither what was removed from the records nor that their displacement was smoothed. So the
figures of an identification are those of the saved spring alone, and this module says where they differ from the fit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...kernel.arrays import FloatArray
from ...model.outcomes import Outcome
from ...records.record import Record
from ..points.steady_part import SteadyRecord
from .figures import RecordFit, chosen_samples, overall
from .recorded_energies import LoopEnergy

_WORTH = 0.05  # difference that is reported, share of the force's standard deviation
_WORTH_ENERGY = 0.02  # the same of a loop's energy
_BEYOND_NOISE = 3.0  # standard errors from which a difference of energies is real


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
