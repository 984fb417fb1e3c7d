"""The effects of a rig in words and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ...model.outcomes import Outcome
from .effect_columns import ZEROS, Effect, Sizes

CAUTIONS = {
    Effect.DELAY: Outcome.DELAY,
    Effect.VISCOSITY: Outcome.VISCOSITY,
    Effect.PLAY: Outcome.PLAY,
    Effect.FORCE_ZERO: Outcome.FORCE_ZERO,
    Effect.DISPLACEMENT_ZERO: Outcome.DISPLACEMENT_ZERO,
    Effect.DRIFT: Outcome.DRIFT_REMOVED,
    Effect.CURVED_DRIFT: Outcome.DRIFT_REMOVED,
    Effect.FRICTION_WEAR: Outcome.FRICTION_WEAR,
    Effect.STIFFNESS_WEAR: Outcome.STIFFNESS_WEAR,
}
# What a curved drift may come from.
RELAXING = (
    ", not at a constant rate; if the material relaxes (creep), its force depends on the frequency too: repeat the "
    "test at another one"
)

_NAMES = {
    Effect.DELAY: "a delay",
    Effect.VISCOSITY: "viscous damping",
    Effect.PLAY: "play",
    Effect.FORCE_ZERO: "zeros of the force",
    Effect.DISPLACEMENT_ZERO: "zeros of the displacement",
    Effect.DRIFT: "a drift",
    Effect.FRICTION_WEAR: "wear of the hysteretic force",
    Effect.STIFFNESS_WEAR: "wear of the elastic force",
}


def described(sizes: Sizes) -> dict[str, Any]:
    """Sizes by name in SI units: what the model file and JSON hold.

    A drift counts from the first sample to the last, wear from the first cycle to the last, zeros from the first
    record on.
    """
    content: dict[str, Any] = {}
    for effect, size in sizes.items():
        if effect in ZEROS:
            content[effect.value] = [0.0, *size.tolist()]
        elif effect is Effect.CURVED_DRIFT:
            content[Effect.DRIFT.value] = float(size.sum())
        else:
            content[effect.value] = float(size[0])
    return content


def detail(outcome: Outcome, effects: dict[str, Any]) -> str:
    """What was found of the effect that a caution speaks of; empty for other cautions."""
    texts = [_text(effect, effects[effect.value]) for effect, caution in CAUTIONS.items() if caution is outcome
             and effect.value in effects]  # fmt: skip
    return "; ".join(texts)


def with_other_effects(findings: dict[Outcome, str], sizes: Sizes, others: Sequence[Sizes]) -> dict[Outcome, str]:
    """Details of cautions, those on effects completed by what would explain the records about as well in their place.

    Parameters
    ----------
    findings : dict             Details by outcome.
    sizes : dict                Effects that were removed.
    others : sequence of dict   Effects that could have been instead, the best first.
    """
    completed = dict(findings)
    for effect in sizes:
        without = next((other for other in others if effect not in other), None)
        if without is not None:
            instead = in_words({other: size for other, size in without.items() if other not in sizes})
            completed[CAUTIONS[effect]] += f"; or, nearly as well, {instead or 'without it'}"
    return completed


def in_words(sizes: Sizes) -> str:
    """Effects by their names with their sizes."""
    return " and ".join(f"{_NAMES[effect]}: {_text(effect, size)}" for effect, size in _named(sizes))


def _named(sizes: Sizes) -> Iterator[tuple[Effect, Any]]:
    content = described(sizes)
    return ((effect, content[effect.value]) for effect in _NAMES if effect.value in content)


def _text(effect: Effect, size: Any) -> str:
    match effect:
        case Effect.DELAY:
            return f"the force {'lags' if size > 0.0 else 'leads'} by {abs(1e3 * size):.3g} ms"
        case Effect.VISCOSITY:
            return f"{size:.3g} N s/m"
        case Effect.PLAY:
            return f"{1e3 * size:.3g} mm"
        case Effect.FORCE_ZERO:
            return f"{', '.join(f'{value:+.3g}' for value in size)} N"
        case Effect.DISPLACEMENT_ZERO:
            return f"{', '.join(f'{1e3 * value:+.3g}' for value in size)} mm"
        case Effect.DRIFT | Effect.CURVED_DRIFT:
            return f"{size:+.3g} N from the first sample to the last"
        case _:
            return f"{100.0 * size:+.3g} % from the first cycle to the last"
