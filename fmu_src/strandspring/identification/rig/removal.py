"""Which effects of the rig may be removed from the records.

What a mount does must not be taken for a fault of the rig: the spring would be saved without it. So effects are removed
only where the spring with them leaves nothing but noise, which no spring of this class does on a mount of another
class, and where no other class of mount explains the records about as well. The others stay in the spring, whose loops
then have the recorded energy, and are named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..search.search import CLOSE, Candidate, force_floor, is_explained
from .corrected import Corrected, rms_in
from .effect_columns import DRIFTS, LOCKED, WEAR, ZEROS, Effect, Rig, Sizes
from .effect_search import find_effects
from .effect_texts import in_words
from .other_mounts import explanations
from .paying_effects import fitted_with

# What cannot be distinguished where more than noise is left.
_FAMILIES = {
    LOCKED: "delay, filter, viscous force, relaxation, play or several friction mechanisms",
    WEAR: "wear, or friction or stiffness that depends on amplitude or rate",
    DRIFTS: "drift or relaxation",
}
_MOST = 0.2  # misfit left by a drift in that without it, up to which it is one whatever else is left
_MUCH = 0.5  # the same of zeros
_JUDGED = (*LOCKED, *WEAR, Effect.CURVED_DRIFT)  # what other mounts may do as well
_LITTLE = 1e-3  # motion that is not worth removing, share of the amplitude
_IN_NOISE = 2.0  # play that is not worth removing, standard deviations of the displacement's noise


@dataclass(frozen=True, eq=False)
class Kept:
    """Effects that might be the rig's and were left in the records.

    Attributes
    ----------
    sizes : dict           As they would have been removed.
    fit : Candidate        The spring without them.
    instead : str          The other mount that explains the records as well, in words; empty if more than noise is
                           left, so that none of these sizes can be trusted.
    is_negligible : bool   Nobody would miss them.
    """

    sizes: Sizes
    fit: Candidate
    instead: str = ""
    is_negligible: bool = False

    @property
    def may_be_mount(self) -> bool:
        """Whether a second mechanism or a branch of the mount gives the like of all of them."""
        return self.sizes.keys() <= {*LOCKED, Effect.CURVED_DRIFT}

    @property
    def sentence(self) -> str:
        """What it may be, in words."""
        if self.instead:
            return f"{in_words(self.sizes)}; or, as well, {self.instead}"
        return "; or ".join(words for effects, words in _FAMILIES.items() if not self.sizes.keys().isdisjoint(effects))


def find_removable(
    rig: Rig, candidates: Sequence[Candidate], noise: float, degrees: tuple[int, int] | None
) -> tuple[list[Corrected], list[Kept]]:
    """Springs fitted without the effects that may be removed, the best first, and what was left in the records.

    Parameters as of `find_effects`.
    """
    kept: list[Kept] = []
    while True:
        states = find_effects(rig, candidates, noise, degrees)
        doubted = _doubted(rig, states[0], noise)
        if doubted is None:
            return states, kept
        kept.append(doubted)
        rig = rig.keeping(doubted.sizes)


def _doubted(rig: Rig, best: Corrected, noise: float) -> Kept | None:
    """Effects of a spring that must stay in the records; None if all may be removed."""
    sizes = best.sizes
    if not sizes:
        return None
    negligible = _negligible(rig, sizes)
    if negligible:
        return Kept(negligible, best.fit, is_negligible=True)
    left = rms_in(best.loops, noise, rig.loops)
    if not is_explained(best.fit, left) and best.fit.misfit > force_floor(best.loops):
        harmless = [
            effect
            for effects, share in ((DRIFTS, _MOST), (ZEROS, _MUCH))
            if _makes_up(rig, best, effects, share)
            for effect in effects
        ]
        in_loops = {effect: size for effect, size in sizes.items() if effect not in harmless}
        return Kept(in_loops, best.fit) if in_loops else None
    if Effect.VISCOSITY in sizes and rig.loops.has_one_amplitude:
        return Kept({Effect.VISCOSITY: sizes[Effect.VISCOSITY]}, best.fit, "friction of the mount")
    judged = [effect for effect in sizes if effect in _JUDGED]
    for effects in [judged] * (len(judged) > 1) + [[effect] for effect in judged]:
        if instead := _other_mount(rig, best, effects):
            return Kept({effect: sizes[effect] for effect in effects}, best.fit, instead)
    return None


def _negligible(rig: Rig, sizes: Sizes) -> Sizes:
    """The effects that move points by next to nothing, and play that the displacement's noise hides."""
    amplitude = 0.5 * rig.loops.longest
    noise = max(part.strokes.noise for part in rig.parts)
    travel = {Effect.PLAY: 1.0, Effect.DELAY: 2.0 * np.pi * amplitude / rig.period}
    least = {Effect.PLAY: max(_LITTLE * amplitude, _IN_NOISE * noise), Effect.DELAY: _LITTLE * amplitude}
    return {
        effect: sizes[effect]
        for effect, factor in travel.items()
        if effect in sizes and abs(factor * float(sizes[effect][0])) < least[effect]
    }


def _makes_up(rig: Rig, best: Corrected, effects: Sequence[Effect], share: float) -> bool:
    """Whether effects that hardly change the loops leave no more than a share of the misfit without them."""
    others = {effect: size for effect, size in best.sizes.items() if effect not in effects}
    if len(others) == len(best.sizes):
        return False
    without = fitted_with(_points_of(rig, best), best.fit, others)
    return without is not None and best.fit.misfit < share * without.fit.misfit


def _points_of(rig: Rig, best: Corrected) -> Rig:
    """The rig with the points to which a spring was fitted."""
    return rig if best.loops.force.size <= rig.loops.force.size else rig.finer()


def _other_mount(rig: Rig, best: Corrected, effects: Sequence[Effect]) -> str:
    """The other class of mount that explains the records about as well as effects of the rig; empty if none does."""
    finer = _points_of(rig, best)
    others = {other: size for other, size in best.sizes.items() if other not in effects}
    without = fitted_with(finer, best.fit, others)
    if without is None:
        return ""
    criterion = best.criterion
    target = rms_in(without.loops, best.fit.misfit, best.loops)
    criterion_of_effects = criterion.value(target, sum(len(best.sizes[effect]) for effect in effects))
    for other in explanations(finer, without):
        # Wear must show among cycles of like amplitude and rate, however many such groups there are.
        price = 0 if other.is_grouped and set(effects) <= set(WEAR) else other.price
        if criterion.value(other.misfit, price) < criterion_of_effects + CLOSE:
            return other.mount
    return ""
