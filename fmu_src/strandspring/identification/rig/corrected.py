"""A spring fitted to points from which effects of the rig were removed, and how two of them compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...loops.strokes import find_strokes
from ..points.sample_points import POINTS_PER_STROKE, SamplePoints
from ..points.steady_part import SteadyRecord
from ..search.search import SATURATION, Candidate, Criterion
from .effect_columns import Effect, Rig, Sizes, transferred


@dataclass(frozen=True, eq=False)
class Gain:
    """What one more effect promises by the linear problem.

    Attributes
    ----------
    effect : Effect
    criterion : float   By how much it would lower the criterion, its price paid.
    sizes : dict        Of all effects, with it.
    """

    effect: Effect
    criterion: float
    sizes: Sizes


@dataclass(frozen=True, eq=False)
class Corrected:
    """A spring fitted to points from which effects were removed.

    Attributes
    ----------
    fit : Candidate
    loops : SamplePoints   The corrected points.
    sizes : dict           Effects with their sizes.
    """

    fit: Candidate
    loops: SamplePoints
    sizes: Sizes

    @property
    def price(self) -> int:
        """Number of sizes fitted."""
        return sum(map(len, self.sizes.values()))

    def better_by(self, other: Corrected) -> float:
        """By how much the criterion favours this one over another one."""
        finer = min(self.fit, other.fit, key=lambda fit: fit.misfit)
        criterion = Criterion.from_points(self.loops, finer.autocorrelation_time)

        def value(state: Corrected) -> float:
            misfit = rms_in(self.loops, state.fit.misfit, state.loops)
            penalty = 0.0 if state.fit.steady else SATURATION
            return criterion.value(misfit, state.price + state.fit.coefficients) + penalty

        return value(other) - value(self)

    @property
    def criterion(self) -> Criterion:
        """The criterion by which effects are judged beside this spring."""
        return Criterion.from_points(self.loops, self.fit.autocorrelation_time)


def best_of(alternatives: Sequence[Corrected]) -> Corrected:
    """The best by the criterion; the first of equals."""
    best = alternatives[0]
    for other in alternatives[1:]:
        if other.better_by(best) > 0.0:
            best = other
    return best


def rms_in(cells: SamplePoints, rms: float, loops: SamplePoints) -> float:
    """An rms of some points [N], if as much noise were left as in other cells than theirs."""
    return rms * _averaged_noise(cells) / _averaged_noise(loops)


def _averaged_noise(loops: SamplePoints) -> float:
    """The rms that averaged white noise gives, share of that of single samples."""
    return float(np.sqrt(loops.force.size / loops.weight.sum()))


def spring_alone(rig: Rig, sizes: Sizes, fit: Candidate) -> tuple[SteadyRecord, ...]:
    """The steady parts of the records as the spring alone gives them, the same samples used.

    Parameters
    ----------
    rig : Rig         Of every sample.
    sizes : dict      Of the effects that were found.
    fit : Candidate   The spring, on which the size of some effects depends.
    """
    loops = rig.corrected(sizes, transferred(fit, rig.placed(sizes)))
    parts = []
    for part, (_, at) in zip(rig.parts, loops.by_record, strict=True):
        record = replace(part.record, displacement=loops.displacement[at], force=loops.force[at])
        strokes = find_strokes(record.displacement)
        # A delay moves the turning points.
        first_used = int(np.argmin(np.abs(strokes.turning[:-1] - part.first_sample)))
        moved = replace(part, record=record, strokes=strokes, first_used=first_used)
        parts.append(replace(moved, loops=moved.loops_with(POINTS_PER_STROKE)))
    return tuple(parts)
