"""Sizes of effects of the rig, fitted with the spring by Gauss-Newton steps.

The points are corrected by the sizes, the spring is fitted to them anew, and what is left of each size follows from
the linear problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..search.search import Candidate, refined
from .corrected import Corrected
from .effect_columns import Effect, Rig, Sizes, wears
from .traces_in_residuals import EffectTraces

_STEPS = 6
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
