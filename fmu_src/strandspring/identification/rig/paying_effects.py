"""Which effects of the rig, and which degrees beside them, pay for themselves."""

from __future__ import annotations

from ..points.table import TableBasis
from ..search.search import MARGIN, Candidate, is_explained, with_degrees, with_richer_bases
from .corrected import Corrected, best_of
from .effect_columns import Rig
from .effects_fitted import fitted_with
from .traces_in_residuals import promising

# An effect must explain this share of the misfit, unless nothing but noise is left: where the model itself does not
# follow the spring, any further column gains a little.
_WORTH = 0.25
_COLOURED = 1.2  # autocorrelation time from which residuals are not white


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
