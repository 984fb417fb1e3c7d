"""What the identification of a spring asked to be careful with, as its model file states it.

The field `fit` of a model file is free JSON, of which any part may be missing.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..ground.quoting import escaped
from ..ground.strict_json import objects
from .joint import HYSTERETIC_UNITS
from .modelfile import ModelFile

_ROUNDING = 1e-9
_OF_SPEED = ("delay", "viscosity")  # effects of the rig that may be a force of the mount that depends on speed


def stated_cautions(model: ModelFile) -> list[tuple[str, str]]:
    """Name and sentence of each caution of the identification; the last one of parameters that were changed."""
    entries = [entry for entry in objects(model.fit.get("outcomes")) if "sentence" in entry]
    return [*((str(entry.get("name")), str(entry["sentence"])) for entry in entries), *_changed(model)]


def _changed(model: ModelFile) -> Iterator[tuple[str, str]]:
    """A caution about parameters beyond the ends of their own intervals, which no identification writes."""
    intervals = model.uncertainty.get("interval_95") or {}
    ends = {name: interval for name in HYSTERETIC_UNITS if (interval := intervals.get(name)) is not None}
    beyond = []
    for name, (low, high) in ends.items():
        value = getattr(model.parameters, name)
        slack = _ROUNDING * abs(value)
        if (low is not None and value < low - slack) or (high is not None and value > high + slack):
            beyond.append(name)
    if beyond:
        yield (
            "parameters_changed",
            f"{', '.join(beyond)} lies outside the 95 % interval in the same file: the parameters were changed after "
            "the identification, whose errors and figures are not theirs.",
        )


def stated_effects(model: ModelFile) -> list[str]:
    """Names of the effects of the rig that were removed from the records."""
    effects = model.fit.get("effects")
    return sorted(effects) if isinstance(effects, dict) else []


def stated_amplitudes(model: ModelFile) -> list[float]:
    """Amplitudes of the loops that the model was identified from [m]; empty where the file does not say so."""
    entries = [entry.get("amplitude") for entry in objects(model.fit.get("recorded_loops"))]
    return [float(value) for value in entries if isinstance(value, int | float) and value > 0.0]


def cautions_in_use(name: str, model: ModelFile) -> Iterator[str]:
    """Sentences about a model, called so, in whatever it is used for."""
    if cautions := stated_cautions(model):
        named = escaped(", ".join(dict.fromkeys(name for name, _ in cautions)))
        yield f"{name} was identified with cautions ({named}); see `strandspring info`."
    if rates := [effect for effect in stated_effects(model) if effect in _OF_SPEED]:
        yield (
            f"The records of {name} showed {' and '.join(rates)}, removed from the model: if that is the mount's and "
            "not the rig's, add a damper."
        )
