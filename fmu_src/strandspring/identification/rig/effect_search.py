"""Which effects of the rig the records show: found by their trace in the residuals, and removed.

An effect is tried if a linear least-squares problem in its size, FE, FA, rho, sigma and n promises that it is worth its
price, and enters if it lowers the criterion of `search` by a margin once fitted, with the degrees of FE and FA that
suit it; where several would, the one that lowers it most. Sizes are fitted by Gauss-Newton steps: the points are
corrected by the sizes, the spring is fitted to them anew, and what is left of each size follows from the linear
problem. All that is done on finer points than the search's, as effects move single samples past reversals.

Where more than white noise is left, finer points leave another share of it, or an effect that follows the reversals was
found, that problem may not see the right one: after a delay or a play the fit of the points as measured is another
minimum. Then a range of delays and of plays is tried, each with a spring of its own. Last, every effect found is
exchanged for what would explain its share as well or better; what explains it about as well is named beside it.

Delay and play move samples past reversals, and are sought over a range of sizes, each with a spring of its own: after
them the fit of the points as measured may be in another minimum, from which no linear problem sees the right one.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from ...model.outcomes import IdentificationError
from ..least_squares.projection import Problem
from ..least_squares.refinement import FAIR_TOLERANCE
from ..least_squares.stages import Hysteresis
from ..points.polynomials import Basis
from ..points.steady_part import find_steady_part
from ..points.table import TableBasis
from ..search.scan import scan_minima
from ..search.search import CLOSE, PILOT, WHITE, Candidate, are_alike, is_explained, other_splits, refined, search
from ..search.two_stage import two_stage
from .corrected import Corrected, Gain, best_of, rms_in
from .effect_columns import LOCKED, Effect, Rig, Sizes, transferred
from .paying_effects import (
    POSITIVE,
    fitted_with,
    is_white,
    pays,
    with_effects_chosen,
    with_paying_effects,
    with_richer_basis,
    without_idle_effects,
)
from .traces_in_residuals import TRIED, gains_of, promising

_UNCLEAR = 30.0  # difference of the criterion up to which others may be the cause where residuals are not white
_TRACE = 3.0  # by which one would lower the criterion that is named without being removed
_DOUBTFUL_STEPS = 2  # of Gauss-Newton
# Effects that may be fitted with the spring from the beginning.
_LINEAR = (
    (Effect.FORCE_ZERO, Effect.CURVED_DRIFT),
    (Effect.VISCOSITY,),
    (Effect.FORCE_ZERO, Effect.CURVED_DRIFT, Effect.VISCOSITY),
)
# Standard deviations of what white noise does from which they are looked for, if misfit depends on the cells' width.
_HIDDEN = 3.5
CARRIED = 3  # minima from which effects are looked for
_EVALUATIONS = 12  # of a fit that only shows whether a size is worth more
_RANGE = 0.0005 * 2.0 ** np.arange(7)  # delays as shares of a cycle, plays as shares of the longest stroke
_BETWEEN = (0.75, 0.87, 1.15, 1.35)  # sizes about the best one of the range, which it is compared with
_ABOUT = (0.87, 1.15)  # sizes that one found is compared with
_CHANGES = 30  # by one factor, at most: together they are as wide as the range
_CLEARLY = 1.0  # difference of the criterion from which another size is the better one


def find_effects(
    rig: Rig, candidates: Sequence[Candidate], noise: float, degrees: tuple[int, int] | None
) -> list[Corrected]:
    """The effects that pay for themselves, and the springs fitted without them, the best first.

    Parameters
    ----------
    rig : Rig
    candidates : sequence of Candidate   From `search`, of the points as measured; at least one.
    noise : float                        The rms that noise alone gives the residuals [N].
    degrees : (int, int) or None         Of FE and FA; chosen if None.
    """
    states = started = [Corrected(fit, rig.loops, {}) for fit in candidates]
    plain = started[0]
    gains = gains_of(rig, plain)
    finer = rig.finer() if rig.effects else rig
    hidden = bool(rig.effects) and _depends_on_cells(rig, finer, plain.fit)
    if rig.effects and (hidden or not is_white(plain.fit, noise) or gains[0].criterion > 0.0):
        at_once = [] if is_explained(plain.fit, noise) else _all_at_once(rig, degrees or PILOT)
        states = started + at_once
        settled = (fitted_with(finer, start.fit, start.sizes) for start in started[:CARRIED] + at_once)
        carried = [start for start in settled if start is not None]
        noise_left = rms_in(finer.loops, noise, rig.loops)
        with_effects = _with_effects(finer, carried, noise_left, degrees, hidden) if carried else []
        if with_effects:
            rig, noise, states = finer, noise_left, with_effects
            started = [state for state in carried if not state.sizes]

    def doubtful(state: Corrected) -> list[Corrected]:
        return _doubtful(rig, state, gains if state is plain else gains_of(rig, state, LOCKED), noise)

    if degrees is not None:
        return [states[0], *doubtful(states[0]), *states[1:]]
    # A richer basis has shown its worth on cycles that it was not fitted to: it takes the place of the leaner one.
    alternatives = [with_richer_basis(rig, states[0], noise)]
    if states[0].sizes and started:
        alternatives.append(with_richer_basis(rig, started[0], noise))
    best = best_of(alternatives)
    others = [state for state in states if state is not best]
    if isinstance(best.fit.basis, TableBasis):
        best, *splits = (Corrected(fit, best.loops, best.sizes) for fit in other_splits(best.loops, best.fit))
        others = [*splits, *others]
    return [best, *doubtful(best), *others]


def find_delayed(rig: Rig, noise: float, degrees: tuple[int, int] | None) -> list[Corrected]:
    """Springs with a delay where no spring can have made the records as measured, the best first.

    None where a delay does not explain all but noise, or leaves what no spring can do, and where all loops have one
    amplitude, on which a filter or play looks like a delay.

    Parameters
    ----------
    rig : Rig
    noise : float                  The rms that noise alone gives the residuals [N].
    degrees : (int, int) or None   Of FE and FA; chosen if None.
    """
    if Effect.DELAY not in rig.effects or rig.loops.has_one_amplitude:
        return []
    finer = rig.finer()
    noise = rms_in(finer.loops, noise, rig.loops)
    size, misfit = best_size(finer, {}, None, Effect.DELAY, finer.period, degrees)
    if not np.isfinite(misfit):
        return []
    best = searched_beside(finer, {Effect.DELAY: np.array([size])}, None, noise, degrees)
    if best is not None and degrees is None:
        best = with_richer_basis(finer, best, noise)
    if best is None or Effect.DELAY not in best.sizes or not is_explained(best.fit, noise):
        return []
    delay = float(best.sizes[Effect.DELAY][0])
    try:
        for part in rig.parts:
            find_steady_part(part.record, delay)
    except IdentificationError:
        return []
    return [best, *_doubtful(finer, best, gains_of(finer, best, LOCKED), noise)]


def other_effects(states_found: Sequence[Corrected]) -> list[Sizes]:
    """Other effects that explain the records about as well as those of the first spring, with no more sizes.

    Where more than white noise is left, none of them is the whole cause, and more of them count.
    """
    best, *others = states_found
    close = CLOSE if best.fit.autocorrelation_time <= WHITE else _UNCLEAR
    states = [
        state
        for state in others
        if state.sizes and state.price <= best.price and not best.sizes.keys() <= state.sizes.keys()
    ]
    return [state.sizes for state in sorted(states, key=best.better_by) if best.better_by(state) <= close]


def hinted_effects(rig: Rig, state: Corrected) -> Sizes:
    """The effect that follows the reversals, of which the residuals of a spring without effects show a trace, if any.

    It is one that was not worth its price with the margin that keeps effects out of clean records.

    Parameters
    ----------
    rig : Rig
    state : Corrected   The spring that was chosen.
    """
    if state.sizes:
        return {}
    gains = gains_of(rig, state, LOCKED)
    return gains[0].sizes if gains and gains[0].criterion > _TRACE else {}


def _doubtful(rig: Rig, state: Corrected, gains: Sequence[Gain], noise: float) -> list[Corrected]:
    """Springs with one more effect that follows the reversals, which the records neither show nor rule out.

    Friction may also fall with the velocity (Stribeck), which a viscosity below zero stands for. Where more than noise
    is left, any effect takes some of it, and says nothing of what else would.
    """
    if not is_explained(state.fit, noise):
        return []
    promising = [gain.sizes for gain in gains if gain.effect in LOCKED and gain.criterion > -CLOSE]
    tried = [fitted_with(rig, state.fit, sizes, (Effect.PLAY,), _DOUBTFUL_STEPS) for sizes in promising[:TRIED]]
    return [other for other in tried if other is not None]


def _with_effects(
    rig: Rig, states: list[Corrected], noise: float, degrees: tuple[int, int] | None, hidden: bool
) -> list[Corrected]:
    """The springs with the effects that pay for themselves, the best first; none if none do.

    Parameters
    ----------
    rig : Rig
    states : list of Corrected   Springs without effects and, where these leave more than noise, springs with every
                                 linear effect at once.
    noise : float
    degrees : (int, int) or None
    hidden : bool                Whether there may be an effect that the residuals of these springs do not show.
    """
    plain = [state for state in states if not state.sizes]
    at_once = [state for state in states if state.sizes]
    grown = [with_paying_effects(rig, start, noise, degrees) for start in plain[:CARRIED]]
    if at_once:
        grown.append(with_paying_effects(rig, without_idle_effects(rig, best_of(at_once), noise), noise, degrees))
    best = best_of(grown)
    if hidden or any(effect in best.sizes for effect in LOCKED) or not is_white(best.fit, noise):
        for effect, scale in ((Effect.DELAY, rig.period), (Effect.PLAY, rig.loops.longest)):
            other = with_moving_effect(rig, best, effect, scale, noise, degrees) if effect in rig.effects else None
            if other is not None and _replaces(other, best, noise):
                best = other
    if not best.sizes:
        return []
    # Without the effects another minimum, or other degrees, may be better.
    again = search(best.loops, degrees)
    settled = [start for fit in again if (start := fitted_with(rig, fit, best.sizes)) is not None]
    settled = [with_effects_chosen(rig, start, noise, degrees) for start in settled[:CARRIED]]
    first, *exchanged = _exchanged(rig, with_other_sizes(rig, best_of([*settled, best])))
    return [first, *(start for start in exchanged + settled + at_once if start is not first)]


def _depends_on_cells(rig: Rig, finer: Rig, fit: Candidate) -> bool:
    """Whether the misfit of a fit is another in finer cells than what averages of white noise would be.

    A delay or a play that the spring itself imitates leaves misfit in single samples next to the reversals; so does
    what samples were left out for.
    """
    if not all(part.used.all() for part in rig.parts):
        return False
    residuals = transferred(fit, finer.loops, coarse=True).refinement
    misfit = finer.loops.rms(residuals.backbone.misfit(finer.loops.force, residuals.omega))
    change = np.log(rms_in(rig.loops, misfit, finer.loops) / fit.misfit)
    doubt = np.sqrt(max(0.5 / rig.loops.force.size - 0.5 / finer.loops.force.size, 0.0))
    return bool(abs(change) > _HIDDEN * doubt)


def _replaces(other: Corrected, best: Corrected, noise: float) -> bool:
    """Whether a state is the better one, and worth its price if it has more sizes."""
    return pays(other, best, noise) if other.price > best.price else other.better_by(best) > 0.0


def _exchanged(rig: Rig, state: Corrected) -> list[Corrected]:
    """With another effect in the place of one of its own, and as it is, the best first."""
    alternatives = [state]
    for effect in state.sizes:
        left = {other: size for other, size in state.sizes.items() if other is not effect}
        loops = rig.corrected(left, state.fit)
        put_back = Corrected(transferred(state.fit, loops), loops, left)
        tried = [fitted_with(rig, put_back.fit, sizes) for sizes in promising(rig, put_back) if effect not in sizes]
        alternatives += [alternative for alternative in tried if alternative is not None]
    best = best_of(alternatives)
    return [best, *(alternative for alternative in alternatives if alternative is not best)]


def _all_at_once(rig: Rig, degrees: tuple[int, int]) -> list[Corrected]:
    """Springs fitted together with every effect that is linear, since a large effect may hide the right minimum."""
    loops = rig.loops
    basis = Basis(*loops.reach, *degrees)
    states = []
    for effects in dict.fromkeys(tuple(e for e in effects if e in rig.effects) for effects in _LINEAR):
        if not effects:
            continue
        columns = {e: rig.plain_columns(e, loops) for e in effects}
        minima: list[Hysteresis] = []
        further = np.hstack(list(columns.values()))
        ends = np.cumsum([column.shape[1] for column in columns.values()])[:-1]
        for start in scan_minima(loops, basis.columns(loops.displacement, further))[:CARRIED]:
            problem = Problem(loops, basis, start, further)
            solved = problem.solve(start, np.zeros(problem.records), loops.weight, FAIR_TOLERANCE)
            if any(are_alike(solved.hysteresis, other) for other in minima):
                continue
            minima.append(solved.hysteresis)
            sizes = dict(zip(columns, np.split(solved.backbone.elastic[basis.elastic + 1 :], ends), strict=True))
            fit = refined(rig.corrected(sizes, None), basis, solved.hysteresis)
            settled = None if fit is None else fitted_with(rig, fit, sizes)
            if settled is not None:
                states.append(settled)
    return states


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
