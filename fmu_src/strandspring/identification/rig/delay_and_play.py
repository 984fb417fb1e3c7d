"""Delay and play, which move samples past reversals: sought over a range of sizes, each with a spring of its own.

After them the fit of the points as measured may be in another minimum, from which no linear problem sees the right one.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..least_squares.refinement import FAIR_TOLERANCE
from ..points.polynomials import Basis
from ..search.search import PILOT, Candidate, refined, search
from ..search.two_stage import two_stage
from .corrected import Corrected, best_of, rms_in
from .effect_columns import LOCKED, Effect, Rig, Sizes
from .paying_effects import POSITIVE, fitted_with, with_effects_chosen

CARRIED = 3  # minima from which effects are looked for
_EVALUATIONS = 12  # of a fit that only shows whether a size is worth more
_RANGE = 0.0005 * 2.0 ** np.arange(7)  # delays as shares of a cycle, plays as shares of the longest stroke
_BETWEEN = (0.75, 0.87, 1.15, 1.35)  # sizes about the best one of the range, which it is compared with
_ABOUT = (0.87, 1.15)  # sizes that one found is compared with
_CHANGES = 30  # by one factor, at most: together they are as wide as the range
_CLEARLY = 1.0  # difference of the criterion from which another size is the better one


def with_moving_effect(
    rig: Rig, state: Corrected, effect: Effect, scale: float, noise: float, degrees: tuple[int, int] | None
) -> Corrected | None:
    """The best spring with an effect that moves the points, in place of the effects like it; None without promise.

    Parameters
    ----------
    rig : Rig
    state : Corrected
    effect : Effect      DELAY or PLAY.
    scale : float        What the sizes tried are shares of.
    noise : float
    degrees : (int, int) or None
    """
    others = {e: size for e, size in state.sizes.items() if e not in LOCKED}
    size, misfit = best_size(rig, others, state.fit, effect, scale, degrees)
    criterion = state.criterion
    if len(others) == len(state.sizes) and criterion.value(state.fit.misfit, 0) <= criterion.value(misfit, 1):
        return None  # there is none yet, and none is called for
    return searched_beside(rig, {**others, effect: np.array([size])}, state.fit, noise, degrees)


def best_size(
    rig: Rig, others: Sizes, fit: Candidate | None, effect: Effect, scale: float, degrees: tuple[int, int] | None
) -> tuple[float, float]:
    """Of a range of sizes of an effect beside others that with which the least misfit is left, and that misfit [N]."""
    basis = Basis(*rig.placed(others).reach, *(degrees or PILOT))

    @cache
    def misfit(size: float) -> float:
        loops = rig.corrected({**others, effect: np.array([size])}, fit)
        start = two_stage(loops, degrees or PILOT)
        trial = None if start is None else refined(loops, basis, start.hysteresis, FAIR_TOLERANCE, _EVALUATIONS)
        return np.inf if trial is None else rms_in(rig.loops, trial.misfit, loops)

    trials = scale * (_RANGE if effect in POSITIVE else np.concatenate([-_RANGE, _RANGE]))
    size = min(trials.tolist(), key=misfit)
    size = min([size, *(size * factor for factor in _BETWEEN)], key=misfit)
    return size, misfit(size)


def searched_beside(
    rig: Rig, sizes: Sizes, fit: Candidate | None, noise: float, degrees: tuple[int, int] | None
) -> Corrected | None:
    """The best spring that a search beside these sizes leads to, with the effects that pay; None if there is none."""
    fits = search(rig.corrected(sizes, fit), degrees)[:CARRIED]
    settled = [state for fit_beside in fits if (state := fitted_with(rig, fit_beside, sizes)) is not None]
    return with_effects_chosen(rig, with_other_sizes(rig, best_of(settled)), noise, degrees) if settled else None


def with_other_sizes(rig: Rig, state: Corrected) -> Corrected:
    """With other sizes of the effects that move points past reversals, where the misfit has several minima."""
    for effect in (Effect.DELAY, Effect.PLAY):
        for factor in _ABOUT if effect in state.sizes else ():
            for _ in range(_CHANGES):
                other = fitted_with(rig, state.fit, {**state.sizes, effect: factor * state.sizes[effect]})
                if other is None or other.better_by(state) <= _CLEARLY:
                    break
                state = other
    return state
