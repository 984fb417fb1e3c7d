"""Reversals between the samples: how densely the records were sampled, and what estimating the reversals changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.polynomial import polyval

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...loops.left_out import BoolArray
from ...loops.strokes import Strokes
from ...model.outcomes import Outcome
from .steady_part import SteadyRecord

_ENOUGH = 100.0  # samples per cycle from which only a change of the force is reported
_LOST = 0.001  # travel between samples at reversals that is reported, share of a stroke
# Changes of the force that are reported however many samples there are, share of its standard deviation. Of the change
# by estimated reversals a part is wrong: less than a tenth at corners or of a sine, half where corners are rounded.
_CHANGED = 0.01
_CHANGED_BY_ESTIMATES = 0.03
_FULL = 0.5  # length of strokes whose samples count, share of the longest


def samples_per_cycle(strokes: Strokes, used: BoolArray) -> float:
    """Median number of samples in two strokes, short strokes and samples that are not used left aside."""
    counts = np.bincount(strokes.of_sample[used], minlength=strokes.count)[: strokes.count]
    full = strokes.length >= _FULL * float(strokes.length.max())
    # The ends of a record cut its first and its last stroke.
    if full[1:-1].any():
        full[[0, -1]] = False
    return 2.0 * float(np.median(counts[full]))


def turns_between_samples(
    parts: Sequence[SteadyRecord], estimated: Sequence[SteadyRecord], spring: SpringParameters
) -> dict[Outcome, str]:
    """The caution about reversals between the samples with its detail, if they may be wrong by what matters.

    Parameters
    ----------
    parts : sequence of SteadyRecord       With reversals at samples.
    estimated : sequence of SteadyRecord   With those that the spring was identified with; empty if that was at samples.
    spring : SpringParameters
    """
    outcome, limit = Outcome.TURNS_RESTORED, _CHANGED_BY_ESTIMATES
    if not estimated:
        outcome, limit = Outcome.TURNS_BETWEEN_SAMPLES, _CHANGED
        parts = [part for part in parts if part.strokes.lost_at_reversals > _LOST]
        estimated = [part.turning_between_samples(corners=False) for part in parts]
    details = []
    for part, other in zip(parts, estimated, strict=True):
        count = samples_per_cycle(part.strokes, part.used)
        changed = _change(part, other, spring)
        if count < _ENOUGH or changed > limit:
            details.append(f"{part.record.path}: {count:.0f} samples per cycle, {100.0 * changed:.2g} % of the force")
    return {outcome: "; ".join(details)} if details else {}


def _change(part: SteadyRecord, turning: SteadyRecord, spring: SpringParameters) -> float:
    """rms difference between the forces with reversals at samples and between them, share of the force's deviation."""
    at_samples, between = (_hysteretic_force(record, spring) for record in (part, turning))
    return float(np.sqrt(np.mean((between - at_samples)[part.used] ** 2)) / np.std(part.record.force))


def _hysteretic_force(part: SteadyRecord, spring: SpringParameters) -> FloatArray:
    """Hysteretic force at every sample [N]."""
    loops = part.all_samples()
    FA = polyval(loops.displacement - spring.displacement_offset, spring.kA)
    return np.asarray(spring.kappa_omega * FA * loops.omega(spring.rho, spring.sigma, spring.n))
