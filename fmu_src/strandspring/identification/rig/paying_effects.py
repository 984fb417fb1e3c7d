"""Which effects of the rig, and which degrees beside them, pay for themselves.

Sizes of effects are fitted with the spring by Gauss-Newton steps: the points are corrected by the sizes, the spring is
fitted to them anew, and what is left of each size follows from the linear problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..points.table import TableBasis
from ..search.search import MARGIN, Candidate, is_explained, refined, with_degrees, with_richer_bases
from .corrected import Corrected, best_of
from .effect_columns import Effect, Rig, Sizes, wears
from .traces_in_residuals import EffectTraces, promising

# An effect must explain this share of the misfit, unless nothing but noise is left: where the model itself does not
# follow the spring, any further column gains a little.
_WORTH = 0.25
_COLOURED = 1.2  # autocorrelation time from which residuals are not white
_STEPS = 6  # of Gauss-Newton
_SETTLED = 0.01  # change of a size at which they end, share of it
POSITIVE = (Effect.VISCOSITY, Effect.PLAY)  # sizes that cannot be negative


def fitted_with(
    rig: Rig, fit: Candidate, sizes: Sizes, positive: Sequence[Effect] = POSITIVE, steps: int = _STEPS
) -> Corrected | None:
    """Sizes and spring after Gauss-Newton steps; None where they do not fit together.

    A step that raises the misfit is halved: where samples lie close to a reversal, its derivatives hold on one side of
    it only.
    """
    best: Corrected | None = None
    for _ in range(steps):
        if not rig.is_possible(sizes):
            return None
        loops = rig.corrected(sizes, fit if sizes else None)
        other = refined(loops, fit.basis, fit.hysteresis)
        if other is None:
            return None
        if not sizes:
            return Corrected(other, loops, sizes)
        if wears(sizes):  # which is a share of the new fit's force
            loops = rig.corrected(sizes, other)
            residuals = other.refinement.backbone.misfit(loops.force, other.refinement.omega)
            other = replace(other, misfit=loops.rms(residuals))
        if best is None or other.misfit <= best.fit.misfit:
            fit = other
            best = Corrected(fit, loops, sizes)
            step, _ = EffectTraces(rig, best, list(sizes)).solved(list(sizes))
        else:
            step = {effect: 0.5 * change for effect, change in step.items()}
        sizes = {effect: size + step[effect] for effect, size in best.sizes.items()}
        if all(np.abs(c).max() <= _SETTLED * np.abs(sizes[effect]).max() for effect, c in step.items()):
            best = replace(best, sizes=sizes)
            break
    if best is None or any(effect in best.sizes and best.sizes[effect][0] <= 0.0 for effect in positive):
        return None
    return best if rig.is_possible(best.sizes) else None


def with_paying_effects(rig: Rig, state: Corrected, noise: float, degrees: tuple[int, int] | None) -> Corrected:
    """With each effect that pays for itself, the best first.

    A basis may be as rich as it is only because the effect was there, and have taken over much of it: each is judged
    with degrees of its own as well.
    """
    while True:
        tried = [fitted_with(rig, state.fit, sizes) for sizes in promising(rig, state, 0.0)]
        settled = [richer for richer in tried if richer is not None]
        if degrees is None:
            settled += [leaner for richer in settled if (leaner := _leaner(rig, richer)) is not None]
        paying = [richer for richer in settled if pays(richer, state, noise)]
        if not paying:
            return state
        state = best_of(paying)


def _leaner(rig: Rig, state: Corrected) -> Corrected | None:
    """With the degrees that the points without the effects ask for; None if these are its own."""
    if isinstance(state.fit.basis, TableBasis):
        return None
    fit = with_degrees(state.loops, state.fit)
    return None if fit.basis == state.fit.basis else fitted_with(rig, fit, state.sizes)


def pays(richer: Corrected, leaner: Corrected, noise: float) -> bool:
    """Whether the effects that one state has more are worth their price."""
    worth = richer.fit.misfit < (1.0 - _WORTH) * leaner.fit.misfit or is_explained(richer.fit, noise)
    return worth and richer.better_by(leaner) > MARGIN


def without_idle_effects(rig: Rig, state: Corrected, noise: float) -> Corrected:
    """Without the effects that no longer pay, now that others are there."""
    for effect in list(state.sizes):
        left = {other: size for other, size in state.sizes.items() if other is not effect}
        without = fitted_with(rig, state.fit, left)
        if without is not None and not pays(state, without, noise):
            state = without
    return state


def with_effects_chosen(rig: Rig, state: Corrected, noise: float, degrees: tuple[int, int] | None) -> Corrected:
    """With each effect that pays for itself, and without those that no longer do beside it."""
    return without_idle_effects(rig, with_paying_effects(rig, state, noise, degrees), noise)


def with_richer_basis(rig: Rig, state: Corrected, noise: float) -> Corrected:
    """With a richer basis, if that is called for, and the effects that pay beside it."""
    fit = with_richer_bases(state.loops, state.fit, noise)
    if fit is None:
        return state
    return with_effects_chosen(rig, Corrected(fit, state.loops, state.sizes), noise, None)


def is_white(fit: Candidate, noise: float) -> bool:
    """Whether nothing but white noise is left of the residuals."""
    return is_explained(fit, noise) and fit.autocorrelation_time <= _COLOURED
