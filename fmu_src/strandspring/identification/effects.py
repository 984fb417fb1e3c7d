"""Which effects of the rig the records show: found by their trace in the residuals, and taken out.

An effect is tried if a linear least-squares problem in its size, FE, FA, rho, sigma and n promises that it is worth its
price, and enters if it lowers the criterion of `search` by a margin once fitted, with the degrees of FE and FA that
suit it; where several would, the one that lowers it most. Sizes are fitted by Gauss-Newton steps: the points are
corrected by the sizes, the spring is fitted to them anew, and what is left of each size follows from the linear
problem. All that is done on finer points than the search's, as effects move single samples past reversals.

Where more than white noise is left, finer points leave another share of it, or an effect that follows the reversals was
found, that problem may not see the right one: after a delay or a play the fit of the points as measured is another
minimum. Then a range of delays and of plays is tried, each with a spring of its own. Last, every effect found is
exchanged for what would explain its share as well or better; what explains it about as well is named beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ..kernel.arrays import FloatArray
from .autocorrelation import autocorrelation_time
from .loops import Loops
from .outcomes import IdentificationError
from .polynomials import Basis
from .projection import Problem
from .refinement import FAIR_TOLERANCE
from .rig import Effect, Rig, Sizes, transferred, wears
from .scan import scan_minima
from .search import (
    CLOSE,
    PILOT,
    SATURATION,
    WHITE,
    Candidate,
    force_floor,
    information,
    is_explained,
    other_splits,
    refined,
    search,
    with_degrees,
    with_richer_bases,
)
from .steady_part import find_steady_part
from .table import TableBasis
from .two_stage import two_stage

_MARGIN = 12.0  # by which an effect must lower the criterion beyond its price
# An effect must explain this share of the misfit, unless nothing but noise is left: where the model itself does not
# follow the spring, any further column gains a little.
_WORTH = 0.25
_UNCLEAR = 30.0  # difference of the criterion up to which others may be the cause where residuals are not white
_TRACE = 3.0  # by which one would lower the criterion that is named without being taken out
_TRIED = 3  # effects that promise most are tried
_CARRIED = 3  # minima from which effects are looked for
_STEPS, _DOUBTFUL_STEPS = 6, 2  # of Gauss-Newton
_EVALUATIONS = 12  # of a fit that only shows whether a size is worth more
_SETTLED = 0.01  # change of a size at which they end, share of it
# Effects that may be fitted with the spring from the beginning.
_LINEAR = (
    (Effect.FORCE_ZERO, Effect.CURVED_DRIFT),
    (Effect.VISCOSITY,),
    (Effect.FORCE_ZERO, Effect.CURVED_DRIFT, Effect.VISCOSITY),
)
# Effects that follow the reversals, much alike on a single amplitude.
_LOCKED = (Effect.DELAY, Effect.VISCOSITY, Effect.PLAY)
# Standard deviations of what white noise does from which they are looked for, if misfit depends on the cells' width.
_HIDDEN = 3.5
_ZEROS = (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO)  # much alike: with both FE could have any offset
_COLOURED = 1.2  # autocorrelation time of the residuals from which they are looked for
_RANGE = 0.0005 * 2.0 ** np.arange(7)  # delays as shares of a cycle, plays as shares of the longest stroke
_BETWEEN = (0.75, 0.87, 1.15, 1.35)  # sizes about the best one of the range, which it is compared with
_ABOUT = (0.87, 1.15)  # sizes that one found is compared with
_CLEARLY = 1.0  # difference of the criterion from which another size is the better one
_POSITIVE = (Effect.VISCOSITY, Effect.PLAY)  # sizes that cannot be negative


@dataclass(frozen=True, eq=False)
class Corrected:
    """A spring fitted to points from which effects were taken out.

    Attributes
    ----------
    fit : Candidate
    loops : Loops    The corrected points.
    sizes : dict     Effects with their sizes.
    """

    fit: Candidate
    loops: Loops
    sizes: Sizes

    @property
    def price(self) -> int:
        """Number of sizes fitted."""
        return sum(map(len, self.sizes.values()))

    def better_by(self, other: Corrected) -> float:
        """By how much the criterion favours this one over another one."""
        loops = self.loops
        finer = min(self.fit, other.fit, key=lambda fit: fit.misfit)
        independent = loops.force.size / finer.autocorrelation_time
        floor = force_floor(loops)
        mine, theirs = (
            information(
                _misfit_in(loops, one.fit, one.loops) ** 2, one.price + one.fit.coefficients, independent, floor
            )
            + (0.0 if one.fit.steady else SATURATION)
            for one in (self, other)
        )
        return theirs - mine


def _misfit_in(cells: Loops, fit: Candidate, loops: Loops) -> float:
    """The misfit of a fit [N], if as much noise were left as in other cells than its own."""
    return fit.misfit * _noise_left(cells) / _noise_left(loops)


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
    found = started = [Corrected(fit, rig.loops, {}) for fit in candidates]
    plain = started[0]
    gains = _gains(rig, plain)
    finer = rig.finer() if rig.effects else rig
    hidden = bool(rig.effects) and _depends_on_cells(rig, finer, plain.fit)
    if rig.effects and (hidden or not _is_white(plain.fit, noise) or gains[0].criterion > 0.0):
        at_once = [] if is_explained(plain.fit, noise) else _all_at_once(rig, degrees or PILOT)
        found = started + at_once
        settled = (_settled(finer, one.fit, one.sizes) for one in started[:_CARRIED] + at_once)
        carried = [one for one in settled if one is not None]
        noise_left = noise * _noise_left(finer.loops) / _noise_left(rig.loops)
        with_effects = _with_effects(finer, carried, noise_left, degrees, hidden) if carried else []
        if with_effects:
            rig, noise, found = finer, noise_left, with_effects
            started = [state for state in carried if not state.sizes]

    def doubtful(state: Corrected) -> list[Corrected]:
        return _doubtful(rig, state, gains if state is plain else _gains(rig, state, _LOCKED), noise)

    if degrees is not None:
        return [found[0], *doubtful(found[0]), *found[1:]]
    # A richer basis has shown its worth on cycles that it was not fitted to: it takes the place of the leaner one.
    alternatives = [_enriched(rig, found[0], noise)]
    if found[0].sizes and started:
        alternatives.append(_enriched(rig, started[0], noise))
    best = _best(alternatives)
    others = [state for state in found if state is not best]
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
    noise *= _noise_left(finer.loops) / _noise_left(rig.loops)
    size, misfit = _sought(finer, {}, None, Effect.DELAY, finer.period, degrees)
    if not np.isfinite(misfit):
        return []
    best = _started(finer, {Effect.DELAY: np.array([size])}, None, noise, degrees)
    if best is not None and degrees is None:
        best = _enriched(finer, best, noise)
    if best is None or Effect.DELAY not in best.sizes or not is_explained(best.fit, noise):
        return []
    delay = float(best.sizes[Effect.DELAY][0])
    try:
        for part in rig.parts:
            find_steady_part(part.record, delay)
    except IdentificationError:
        return []
    return [best, *_doubtful(finer, best, _gains(finer, best, _LOCKED), noise)]


def other_effects(found: Sequence[Corrected]) -> list[Sizes]:
    """Other effects that explain the records about as well as those of the first spring, with no more sizes.

    Where more than white noise is left, none of them is the whole cause, and more of them count.
    """
    best, *others = found
    close = CLOSE if best.fit.autocorrelation_time <= WHITE else _UNCLEAR
    states = [
        one for one in others if one.sizes and one.price <= best.price and not best.sizes.keys() <= one.sizes.keys()
    ]
    return [one.sizes for one in sorted(states, key=best.better_by) if best.better_by(one) <= close]


def _noise_left(loops: Loops) -> float:
    """The rms that averaged white noise gives, share of that of single samples."""
    return float(np.sqrt(loops.force.size / loops.weight.sum()))


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
    gains = _gains(rig, state, _LOCKED)
    return gains[0].sizes if gains and gains[0].criterion > _TRACE else {}


def _doubtful(rig: Rig, state: Corrected, gains: Sequence[_Gain], noise: float) -> list[Corrected]:
    """Springs with one more effect that follows the reversals, which the records neither show nor rule out.

    Friction may also fall with the velocity (Stribeck), which a viscosity below zero stands for. Where more than noise
    is left, any effect takes some of it, and says nothing of what else would.
    """
    if not is_explained(state.fit, noise):
        return []
    promising = [gain.sizes for gain in gains if gain.effect in _LOCKED and gain.criterion > -CLOSE]
    tried = [_settled(rig, state.fit, sizes, (Effect.PLAY,), _DOUBTFUL_STEPS) for sizes in promising[:_TRIED]]
    return [one for one in tried if one is not None]


def _enriched(rig: Rig, state: Corrected, noise: float) -> Corrected:
    """With a richer basis, if that is called for, and the effects that pay beside it."""
    fit = with_richer_bases(state.loops, state.fit, noise)
    if fit is None:
        return state
    return _pruned(rig, _grown(rig, Corrected(fit, state.loops, state.sizes), noise, None), noise)


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
    grown = [_grown(rig, one, noise, degrees) for one in plain[:_CARRIED]]
    if at_once:
        grown.append(_grown(rig, _pruned(rig, _best(at_once), noise), noise, degrees))
    best = _best(grown)
    if hidden or any(effect in best.sizes for effect in _LOCKED) or not _is_white(best.fit, noise):
        for effect, scale in ((Effect.DELAY, rig.period), (Effect.PLAY, rig.loops.longest)):
            other = _scanned(rig, best, effect, scale, noise, degrees) if effect in rig.effects else None
            if other is not None and _replaces(other, best, noise):
                best = other
    if not best.sizes:
        return []
    # Without the effects another minimum, or other degrees, may be better.
    again = search(best.loops, degrees)
    settled = [one for fit in again if (one := _settled(rig, fit, best.sizes)) is not None]
    settled = [_pruned(rig, _grown(rig, one, noise, degrees), noise) for one in settled[:_CARRIED]]
    first, *exchanged = _exchanged(rig, _probed(rig, _best([*settled, best])))
    return [first, *(one for one in exchanged + settled + at_once if one is not first)]


def _depends_on_cells(rig: Rig, finer: Rig, fit: Candidate) -> bool:
    """Whether the misfit of a fit is another in finer cells than what averages of white noise would be.

    A delay or a play that the spring itself imitates leaves misfit in single samples next to the reversals; so does
    what samples were left out for.
    """
    if not all(part.used.all() for part in rig.parts):
        return False
    residuals = transferred(fit, finer.loops).refinement
    misfit = finer.loops.rms(residuals.backbone.misfit(finer.loops.force, residuals.omega))
    noises = [value / _noise_left(each.loops) for value, each in ((fit.misfit, rig), (misfit, finer))]
    doubt = np.sqrt(max(0.5 / rig.loops.force.size - 0.5 / finer.loops.force.size, 0.0))
    return bool(abs(np.log(noises[1] / noises[0])) > _HIDDEN * doubt)


def _is_white(fit: Candidate, noise: float) -> bool:
    """Whether nothing but white noise is left of the residuals."""
    return is_explained(fit, noise) and fit.autocorrelation_time <= _COLOURED


def _replaces(other: Corrected, best: Corrected, noise: float) -> bool:
    """Whether a state is the better one, and worth its price if it has more sizes."""
    return _pays(other, best, noise) if other.price > best.price else other.better_by(best) > 0.0


def _scanned(
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
    others = {e: size for e, size in state.sizes.items() if e not in _LOCKED}
    size, misfit = _sought(rig, others, state.fit, effect, scale, degrees)
    independent = state.loops.force.size / state.fit.autocorrelation_time
    floor = force_floor(state.loops)
    before, after = (information(rms**2, 0, independent, floor) for rms in (state.fit.misfit, misfit))
    if len(others) == len(state.sizes) and before - after <= np.log(independent):
        return None  # there is none yet, and none is called for
    return _started(rig, {**others, effect: np.array([size])}, state.fit, noise, degrees)


def _sought(
    rig: Rig, others: Sizes, fit: Candidate | None, effect: Effect, scale: float, degrees: tuple[int, int] | None
) -> tuple[float, float]:
    """Of a range of sizes of an effect beside others that with which the least misfit is left, and that misfit [N]."""
    basis = Basis(*rig.placed(others).reach, *(degrees or PILOT))

    @cache
    def misfit(size: float) -> float:
        loops = rig.corrected({**others, effect: np.array([size])}, fit)
        start = two_stage(loops, degrees or PILOT)
        trial = None if start is None else refined(loops, basis, start.hysteresis, FAIR_TOLERANCE, _EVALUATIONS)
        return np.inf if trial is None else _misfit_in(rig.loops, trial, loops)

    trials = scale * (_RANGE if effect in _POSITIVE else np.concatenate([-_RANGE, _RANGE]))
    size = min(trials.tolist(), key=misfit)
    size = min([size, *(size * factor for factor in _BETWEEN)], key=misfit)
    return size, misfit(size)


def _started(
    rig: Rig, sizes: Sizes, fit: Candidate | None, noise: float, degrees: tuple[int, int] | None
) -> Corrected | None:
    """The best spring that a search beside these sizes leads to, with the effects that pay; None if there is none."""
    fits = search(rig.corrected(sizes, fit), degrees)[:_CARRIED]
    settled = [one for each in fits if (one := _settled(rig, each, sizes)) is not None]
    return _pruned(rig, _grown(rig, _probed(rig, _best(settled)), noise, degrees), noise) if settled else None


def _probed(rig: Rig, state: Corrected) -> Corrected:
    """With other sizes of the effects that move points past reversals, where the misfit has several minima."""
    for effect in (Effect.DELAY, Effect.PLAY):
        for factor in _ABOUT if effect in state.sizes else ():
            while True:
                other = _settled(rig, state.fit, {**state.sizes, effect: factor * state.sizes[effect]})
                if other is None or other.better_by(state) <= _CLEARLY:
                    break
                state = other
    return state


def _exchanged(rig: Rig, state: Corrected) -> list[Corrected]:
    """With another effect in the place of one of its own, and as it is, the best first."""
    alternatives = [state]
    for effect in state.sizes:
        left = {other: size for other, size in state.sizes.items() if other is not effect}
        loops = rig.corrected(left, state.fit)
        put_back = Corrected(transferred(state.fit, loops), loops, left)
        tried = [_settled(rig, put_back.fit, sizes) for sizes in _promising(rig, put_back) if effect not in sizes]
        alternatives += [one for one in tried if one is not None]
    best = _best(alternatives)
    return [best, *(one for one in alternatives if one is not best)]


def _all_at_once(rig: Rig, degrees: tuple[int, int]) -> list[Corrected]:
    """Springs fitted together with every effect that is linear, since a large effect may hide the right minimum."""
    loops = rig.loops
    basis = Basis(*loops.reach, *degrees)
    found = []
    for effects in _LINEAR:
        columns = {e: rig.plain_columns(e, loops) for e in effects if e in rig.effects}
        if not columns:
            continue
        further = np.hstack(list(columns.values()))
        ends = np.cumsum([column.shape[1] for column in columns.values()])[:-1]
        for start in scan_minima(loops, basis.columns(loops.displacement, further))[:_CARRIED]:
            problem = Problem(loops, basis, start, further)
            solved = problem.solve(start, np.zeros(problem.records), loops.weight, FAIR_TOLERANCE)
            sizes = dict(zip(columns, np.split(solved.backbone.elastic[basis.elastic + 1 :], ends), strict=True))
            fit = refined(rig.corrected(sizes, None), basis, solved.hysteresis)
            settled = None if fit is None else _settled(rig, fit, sizes)
            if settled is not None:
                found.append(settled)
    return found


def _best(alternatives: Sequence[Corrected]) -> Corrected:
    best = alternatives[0]
    for other in alternatives[1:]:
        if other.better_by(best) > 0.0:
            best = other
    return best


def _grown(rig: Rig, state: Corrected, noise: float, degrees: tuple[int, int] | None) -> Corrected:
    """With each effect that pays for itself, the best first.

    A basis may be as rich as it is only because the effect was there, and have taken over much of it: each is judged
    with degrees of its own as well.
    """
    while True:
        tried = [_settled(rig, state.fit, sizes) for sizes in _promising(rig, state, 0.0)]
        settled = [one for one in tried if one is not None]
        if degrees is None:
            settled += [leaner for one in settled if (leaner := _leaner(rig, one)) is not None]
        paying = [one for one in settled if _pays(one, state, noise)]
        if not paying:
            return state
        state = _best(paying)


def _leaner(rig: Rig, state: Corrected) -> Corrected | None:
    """With the degrees that the points without the effects ask for; None if these are its own."""
    if isinstance(state.fit.basis, TableBasis):
        return None
    fit = with_degrees(state.loops, state.fit)
    return None if fit.basis == state.fit.basis else _settled(rig, fit, state.sizes)


def _pays(richer: Corrected, leaner: Corrected, noise: float) -> bool:
    """Whether the effects that one state has more are worth their price."""
    worth = richer.fit.misfit < (1.0 - _WORTH) * leaner.fit.misfit or is_explained(richer.fit, noise)
    return worth and richer.better_by(leaner) > _MARGIN


def _pruned(rig: Rig, state: Corrected, noise: float) -> Corrected:
    """Without the effects that no longer pay, now that others are there."""
    for effect in list(state.sizes):
        left = {other: size for other, size in state.sizes.items() if other is not effect}
        without = _settled(rig, state.fit, left)
        if without is not None and not _pays(state, without, noise):
            state = without
    return state


def _settled(
    rig: Rig, fit: Candidate, sizes: Sizes, positive: Sequence[Effect] = _POSITIVE, steps: int = _STEPS
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
        other = refined(loops, fit.basis, fit.refinement.hysteresis)
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
            step, _ = _Traces(rig, fit, best.loops, list(sizes), sizes).solved(list(sizes))
        else:
            step = {effect: 0.5 * change for effect, change in step.items()}
        sizes = {effect: size + step[effect] for effect, size in best.sizes.items()}
        if all(np.abs(c).max() <= _SETTLED * np.abs(sizes[effect]).max() for effect, c in step.items()):
            best = replace(best, sizes=sizes)
            break
    if best is None or any(effect in best.sizes and best.sizes[effect][0] <= 0.0 for effect in positive):
        return None
    return best if rig.is_possible(best.sizes) else None


def _promising(rig: Rig, state: Corrected, margin: float = _MARGIN) -> list[Sizes]:
    """Sizes with one more effect each, those that promise most by the linear problem, if more than the margin."""
    return [gain.sizes for gain in _gains(rig, state) if gain.criterion > margin][:_TRIED]


@dataclass(frozen=True, eq=False)
class _Gain:
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


def _gains(rig: Rig, state: Corrected, among: Sequence[Effect] = tuple(Effect)) -> list[_Gain]:
    """What each of the effects that a state does not have promises, the most first."""
    open_to = [effect for effect in rig.effects if effect in among and effect not in state.sizes]
    if not open_to:
        return []
    traces = _Traces(rig, state.fit, state.loops, [*state.sizes, *open_to], state.sizes)
    weight = state.loops.weight.sum()
    floor = force_floor(state.loops)
    _, without = traces.solved(list(state.sizes))
    gains = []
    for effect in open_to:
        if effect is Effect.DRIFT and Effect.CURVED_DRIFT in state.sizes:
            continue
        if effect in _ZEROS and not state.sizes.keys().isdisjoint(_ZEROS):
            continue
        kept = [e for e in state.sizes if not (effect is Effect.CURVED_DRIFT and e is Effect.DRIFT)]
        step, residuals = traces.solved([*kept, effect])
        independent = residuals.size / autocorrelation_time(residuals)
        price = sum(map(len, step.values())) - state.price
        before, after = (
            information(float(left @ left) / weight, paid, independent, floor)
            for left, paid in ((without, 0), (residuals, price))
        )
        sizes = {e: state.sizes.get(e, 0.0) + change for e, change in step.items()}
        gains.append(_Gain(effect, before - after, sizes))
    return sorted(gains, key=lambda gain: -gain.criterion)


class _Traces:
    """What effects leave in the residuals of a fit beside what FE, FA, rho, sigma and n can take over.

    Parameters
    ----------
    rig : Rig
    fit : Candidate       Of the points.
    loops : Loops         Corrected by the sizes.
    effects : sequence of Effect
    sizes : dict
    """

    def __init__(self, rig: Rig, fit: Candidate, loops: Loops, effects: Sequence[Effect], sizes: Sizes) -> None:
        columns, refinement = fit.basis.columns(loops.displacement), fit.refinement
        root = np.sqrt(loops.weight)
        yielding = (refinement.derivatives * refinement.backbone.G).T
        model = np.hstack([columns.elastic, refinement.omega[:, None] * columns.amplifier, yielding])
        model = model * root[:, None] / np.maximum(np.abs(model).max(axis=0), 1e-300)
        self._model, _ = np.linalg.qr(model)
        self._misfit = self._beside(root * refinement.backbone.misfit(loops.force, refinement.omega))
        delay = float(sizes.get(Effect.DELAY, [0.0])[0])
        self._traces = {
            effect: self._beside(rig.columns(effect, fit, loops, delay) * root[:, None]) for effect in effects
        }

    def _beside(self, values: FloatArray) -> FloatArray:
        return np.asarray(values - self._model @ (self._model.T @ values))

    def solved(self, effects: Sequence[Effect]) -> tuple[Sizes, FloatArray]:
        """Sizes of these effects by least squares, and the weighted residuals that are left."""
        if not effects:
            return {}, self._misfit
        matrix = np.hstack([self._traces[effect] for effect in effects])
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        solution = np.linalg.lstsq(matrix / scale, self._misfit, rcond=1e-8)[0] / scale
        ends = np.cumsum([self._traces[effect].shape[1] for effect in effects])[:-1]
        return dict(zip(effects, np.split(solution, ends), strict=True)), self._misfit - matrix @ solution
