"""What the identification of a spring asked to be careful with, as its model file states it.

The field `fit` of a model file is free JSON, of which any part may be missing.
"""

from __future__ import annotations

from collections.abc import Iterator

from .modelfile import ModelFile
from .strict_json import printable

_OF_SPEED = ("delay", "viscosity")  # effects of the rig that may be a force of the mount that depends on speed


def stated_cautions(model: ModelFile) -> dict[str, str]:
    """Sentences of the cautions of the identification by their names."""
    outcomes = model.fit.get("outcomes")
    entries = [entry for entry in outcomes if isinstance(entry, dict)] if isinstance(outcomes, list) else []
    return {str(entry.get("name")): str(entry["sentence"]) for entry in entries if "sentence" in entry}


def stated_effects(model: ModelFile) -> list[str]:
    """Names of the effects of the rig that were taken out of the records."""
    effects = model.fit.get("effects")
    return sorted(effects) if isinstance(effects, dict) else []


def cautions_in_use(name: str, model: ModelFile) -> Iterator[str]:
    """Sentences about a model, called so, in whatever it is used for."""
    if cautions := stated_cautions(model):
        named = printable(", ".join(cautions))
        yield f"{name} was identified with cautions ({named}); see `strandspring info`."
    if rates := [effect for effect in stated_effects(model) if effect in _OF_SPEED]:
        yield (
            f"The records of {name} showed {' and '.join(rates)}, taken out of the model: if that is of the mount and "
            "not of the rig, its force depends on speed, and here it does not; add a damper."
        )
