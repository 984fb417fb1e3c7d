"""What effects of the rig leave in the residuals of a fit, and what taking them out promises by a linear problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from ..kernel.arrays import FloatArray
from .autocorrelation import autocorrelation_time
from .corrected import Corrected, Gain
from .rig import Effect, Rig, Sizes
from .search import force_floor, information

MARGIN = 12.0  # by which an effect must lower the criterion beyond its price
TRIED = 3  # effects that promise most are tried
_ZEROS = (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO)  # much alike: with both FE could have any offset


def promising(rig: Rig, state: Corrected, margin: float = MARGIN) -> list[Sizes]:
    """Sizes with one more effect each, those that promise most by the linear problem, if more than the margin."""
    return [gain.sizes for gain in gains_of(rig, state) if gain.criterion > margin][:TRIED]


def gains_of(rig: Rig, state: Corrected, among: Sequence[Effect] = tuple(Effect)) -> list[Gain]:
    """What each of the effects that a state does not have promises, the most first."""
    open_to = [effect for effect in rig.effects if effect in among and effect not in state.sizes]
    if new := [effect for effect in open_to if effect not in state.gains]:
        state.gains.update((gain.effect, gain) for gain in _gains(rig, state, new))
    gains = [state.gains[effect] for effect in open_to if effect in state.gains]
    return sorted(gains, key=lambda gain: -gain.criterion)


def _gains(rig: Rig, state: Corrected, effects: Sequence[Effect]) -> Iterator[Gain]:
    """The same of some effects, without those that make no sense beside others."""
    traces = EffectTraces(rig, state, [*state.sizes, *effects])
    weight = state.loops.weight.sum()
    floor = force_floor(state.loops)
    _, without = traces.solved(list(state.sizes))
    for effect in effects:
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
        yield Gain(effect, before - after, sizes)


class EffectTraces:
    """What effects leave in the residuals of a fit beside what FE, FA, rho, sigma and n can take over.

    Parameters
    ----------
    rig : Rig
    state : Corrected
    effects : sequence of Effect
    """

    def __init__(self, rig: Rig, state: Corrected, effects: Sequence[Effect]) -> None:
        fit, loops, refinement = state.fit, state.loops, state.fit.refinement
        columns = fit.basis.columns(loops.displacement)
        root = np.sqrt(loops.weight)
        yielding = refinement.derivatives * refinement.backbone.G
        rows = np.concatenate([columns.elastic.T, refinement.omega * columns.amplifier.T, yielding])
        rows *= root / np.maximum(np.abs(rows).max(axis=1), 1e-300)[:, None]
        self._model, _ = np.linalg.qr(rows.T)
        self._misfit = self.beside(root * refinement.backbone.misfit(loops.force, refinement.omega))
        delay = float(state.sizes.get(Effect.DELAY, [0.0])[0])
        self._traces = {
            effect: self.beside(rig.columns(effect, fit, loops, delay) * root[:, None]) for effect in effects
        }

    def beside(self, values: FloatArray) -> FloatArray:
        """Weighted values at the points without what the spring can take over, shape (P,) or (P, columns)."""
        return np.asarray(values - self._model @ (self._model.T @ values))

    def solved(self, effects: Sequence[Effect]) -> tuple[Sizes, FloatArray]:
        """Sizes of these effects by least squares, and the weighted residuals that are left."""
        if not effects:
            return {}, self._misfit
        traces = [self._traces[effect] for effect in effects]
        matrix = np.hstack(traces) if len(traces) > 1 else traces[0]
        scale = np.maximum(np.sqrt(np.sum(matrix**2, axis=0)), 1e-300)
        if matrix.shape[1] == 1:
            solution = self._misfit @ (matrix / scale) / scale
        else:
            solution = np.linalg.lstsq(matrix / scale, self._misfit, rcond=1e-8)[0] / scale
        ends = accumulate(trace.shape[1] for trace in traces)
        steps = [solution[end - trace.shape[1] : end] for trace, end in zip(traces, ends, strict=True)]
        return dict(zip(effects, steps, strict=True)), self._misfit - matrix @ solution
