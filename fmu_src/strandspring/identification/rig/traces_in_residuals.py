"""What effects of the rig leave in the residuals of a fit, and what taking them out promises by a linear problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate, pairwise

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.residuals import autocorrelation_time
from ..search.search import MARGIN, Criterion
from .corrected import Corrected, Gain
from .effect_columns import ZEROS, Effect, Rig, Sizes

TRIED = 3  # effects that promise most are tried


class Tangent:
    """The changes of the force that changes of FE, FA, rho, sigma, n and omega_start can make, weighted.

    Attributes
    ----------
    root : ndarray, shape (P,)     Roots of the points' weights.
    reached : ndarray, shape (P, q)   Orthonormal; what they reach beside omega_start.
    misfit : ndarray, shape (P,)   Weighted residuals that they do not reach [N].

    Parameters
    ----------
    state : Corrected
    """

    def __init__(self, state: Corrected) -> None:
        fit, loops, refinement = state.fit, state.loops, state.fit.refinement
        columns = fit.basis.columns(loops.displacement)
        self.root = np.sqrt(loops.weight)
        *shared, own = refinement.derivatives * (self.root * refinement.backbone.G)
        rows = np.concatenate([columns.elastic.T, refinement.omega * columns.amplifier.T])
        rows = np.concatenate([self.root * rows, shared])
        rows /= np.maximum(np.abs(rows).max(axis=1), 1e-300)[:, None]
        self._loops, self._own = loops, own
        self.reached, _ = np.linalg.qr(loops.beside_starts(rows.T, own))
        self.misfit = self.beside(self.root * refinement.backbone.misfit(loops.force, refinement.omega))

    def beside(self, values: FloatArray) -> FloatArray:
        """What they do not reach of weighted values, shape (P,) or (P, columns)."""
        left = self.beside_starts(values)
        return np.asarray(left - self.reached @ (self.reached.T @ left))

    def beside_starts(self, values: FloatArray) -> FloatArray:
        """What omega_start does not reach of weighted values, shape (P,) or (P, columns)."""
        columns = values.reshape(values.shape[0], -1)
        return self._loops.beside_starts(columns, self._own).reshape(values.shape)


def promising(rig: Rig, state: Corrected, margin: float = MARGIN) -> list[Sizes]:
    """Sizes with one more effect each, those that promise most by the linear problem, if more than the margin."""
    return [gain.sizes for gain in gains_of(rig, state) if gain.criterion > margin][:TRIED]


def gains_of(rig: Rig, state: Corrected, among: Sequence[Effect] = tuple(Effect)) -> list[Gain]:
    """What each of the effects that a state does not have promises, the most first."""
    open_to = [effect for effect in rig.effects if effect in among and effect not in state.sizes]
    return sorted(_gains(rig, state, open_to), key=lambda gain: -gain.criterion) if open_to else []


def _gains(rig: Rig, state: Corrected, effects: Sequence[Effect]) -> Iterator[Gain]:
    """The same of some effects, without those that make no sense beside others."""
    traces = EffectTraces(rig, state, [*state.sizes, *effects])
    total = float(np.sqrt(state.loops.weight.sum()))
    _, without = traces.solved(list(state.sizes))
    for effect in effects:
        if effect is Effect.DRIFT and Effect.CURVED_DRIFT in state.sizes:
            continue
        if effect in ZEROS and not state.sizes.keys().isdisjoint(ZEROS):  # with both FE could have any offset
            continue
        kept = [e for e in state.sizes if not (effect is Effect.CURVED_DRIFT and e is Effect.DRIFT)]
        step, residuals = traces.solved([*kept, effect])
        criterion = Criterion.from_points(state.loops, autocorrelation_time(residuals))
        price = sum(map(len, step.values())) - state.price
        before = criterion.value(float(np.linalg.norm(without)) / total, 0)
        after = criterion.value(float(np.linalg.norm(residuals)) / total, price)
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
        tangent = Tangent(state)
        self._loops, self._reached, self._misfit = state.loops, tangent.reached, tangent.misfit
        delay = float(state.sizes.get(Effect.DELAY, [0.0])[0])
        columns = {e: rig.columns(e, state.fit, state.loops, delay) * tangent.root[:, None] for e in effects}
        self._traces = {e: tangent.beside(of_effect) for e, of_effect in columns.items() if e not in ZEROS}
        # Each record but the first has a column of its own, whose length does not grow with their number.
        self._of_records = {e: tangent.beside_starts(columns[e].sum(axis=1)) for e in ZEROS if e in columns}

    def solved(self, effects: Sequence[Effect]) -> tuple[Sizes, FloatArray]:
        """Sizes of these effects by least squares, and the weighted residuals that are left."""
        if not effects:
            return {}, self._misfit
        traces = {effect: self._traces[effect] for effect in effects if effect not in ZEROS}
        matrix = np.column_stack([self._misfit, *traces.values()])[:, 1:]
        fitted, target = matrix, self._misfit
        of_records = next((self._of_records[effect] for effect in effects if effect in ZEROS), None)
        if of_records is not None:
            matrix = np.hstack([matrix, self._reached])
            beside = self._loops.beside_starts(np.column_stack([matrix, target]), of_records)
            fitted, target = beside[:, :-1], beside[:, -1]
        scale = np.maximum(np.sqrt(np.sum(fitted**2, axis=0)), 1e-300)
        solution = np.linalg.lstsq(fitted / scale, target, rcond=1e-8)[0] / scale
        ends = accumulate((trace.shape[1] for trace in traces.values()), initial=0)
        steps = {effect: solution[begin:end] for effect, (begin, end) in zip(traces, pairwise(ends), strict=True)}
        if of_records is not None:
            along = self._loops.sums_of_records(of_records * (self._misfit - matrix @ solution))
            zeros = along / np.maximum(self._loops.sums_of_records(of_records**2), 1e-300)
            steps |= {effect: zeros[1:] for effect in effects if effect in ZEROS}
        return {effect: steps[effect] for effect in effects}, target - fitted @ solution
