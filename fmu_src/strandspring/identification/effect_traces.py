"""What effects of the rig leave in the residuals of a fit, and what taking them out promises by a linear problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from .autocorrelation import autocorrelation_time
from .corrected import Corrected
from .loops import Loops
from .rig import Effect, Rig, Sizes
from .search import Candidate, force_floor, information

MARGIN = 12.0  # by which an effect must lower the criterion beyond its price
TRIED = 3  # effects that promise most are tried
_ZEROS = (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO)  # much alike: with both FE could have any offset


def promising(rig: Rig, state: Corrected, margin: float = MARGIN) -> list[Sizes]:
    """Sizes with one more effect each, those that promise most by the linear problem, if more than the margin."""
    return [gain.sizes for gain in gains_of(rig, state) if gain.criterion > margin][:TRIED]


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


def gains_of(rig: Rig, state: Corrected, among: Sequence[Effect] = tuple(Effect)) -> list[Gain]:
    """What each of the effects that a state does not have promises, the most first."""
    open_to = [effect for effect in rig.effects if effect in among and effect not in state.sizes]
    if not open_to:
        return []
    traces = EffectTraces(rig, state.fit, state.loops, [*state.sizes, *open_to], state.sizes)
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
        gains.append(Gain(effect, before - after, sizes))
    return sorted(gains, key=lambda gain: -gain.criterion)


class EffectTraces:
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
