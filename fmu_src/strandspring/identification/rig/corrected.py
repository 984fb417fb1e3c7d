"""A spring fitted to points from which effects of the rig were removed, and how two of them compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..points.sample_points import SamplePoints
from ..search.search import SATURATION, Candidate, Criterion
from .effect_columns import Effect, Sizes


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

    @cached_property
    def gains(self) -> dict[Effect, Gain]:
        """What one more effect promises, of those that were asked for."""
        return {}

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
