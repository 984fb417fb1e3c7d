"""Why loops of one amplitude do not decide what smaller ones do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...model.outcomes import Outcome
from ..rig.corrected import Corrected
from ..rig.effect_columns import Effect, Rig
from ..rig.effect_search import hinted_effects
from ..rig.effect_texts import in_words

# Effects that a loop of a single amplitude is known from by its form alone.
_LIKE_LOOPS = {
    Effect.DELAY: "a delay",
    Effect.VISCOSITY: "viscous damping",
    Effect.PLAY: "play",
    Effect.CURVED_DRIFT: "the relaxation that a curved drift may come from",
}


def one_amplitude_doubts(
    rig: Rig, state: Corrected, cautions: Sequence[Outcome], intervals: Mapping[str, Any]
) -> list[str]:
    """Why loops of one amplitude do not decide the energy of smaller ones.

    Parameters
    ----------
    rig : Rig
    state : Corrected              The spring that was found.
    cautions : sequence of Outcome
    intervals : mapping            Of the parameters, an open end being None.
    """
    unseen = ["the strokes do not saturate"] if Outcome.NO_STEADY_SECTION in cautions else []
    for name, outcome in (("n", Outcome.N_AT_BOUND), ("sigma", Outcome.SIGMA_AT_BOUND)):
        if outcome in cautions:
            unseen.append(f"{name} ended at its bound")
        elif None in intervals[name]:
            unseen.append(f"{name} is known on one side only")
    doubts = [f"the form of the loop is little known, since {' and '.join(unseen)}"] if unseen else []
    removed = [name for effect, name in _LIKE_LOOPS.items() if effect in state.sizes]
    if removed:
        doubts.append(f"at one amplitude {' and '.join(removed)} can hardly be distinguished from part of the loop")
    if hinted := hinted_effects(rig, state):
        doubts.append(f"there is a trace of {in_words(hinted)}, too weak to be removed")
    return doubts
