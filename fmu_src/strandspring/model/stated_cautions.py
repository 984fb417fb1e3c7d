"""What the identification of a spring asked to be careful with, as its model file states it.

The field `fit` of a model file is free JSON, of which any part may be missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..findings import CAUTIONS, Finding, Outcome, of_severity
from ..ground.quoting import printable
from ..ground.strict_json import is_finite, objects
from .joint import HYSTERETIC_UNITS
from .modelfile import ModelFile

_ROUNDING = 1e-9
_OF_SPEED = ("delay", "viscosity")  # effects of the rig that may be a force of the mount that depends on speed


def stated_cautions(model: ModelFile, where: str = "") -> list[Finding]:
    """The cautions of the identification, with what they are said of; the last one of parameters that were changed."""
    entries = [entry for entry in objects(model.fit.get("outcomes")) if "sentence" in entry]
    return [*of_severity((_finding(entry, where) for entry in entries), CAUTIONS), *_changed(model, where)]


def _finding(entry: dict[str, Any], where: str) -> Finding:
    """A finding of a file; its name and sentence as they stand where this version does not know the kind."""
    numbers, name = entry.get("numbers"), printable(str(entry.get("name", "a finding"))[:200])
    known = {name: _read(value) for name, value in numbers.items()} if isinstance(numbers, dict) else {}
    place = ", ".join(filter(None, (where, printable(entry.get("where", "")))))
    if (kind := Outcome.__members__.get(name.upper())) and (finding := Finding(kind, known, place)).is_complete:
        return finding
    return Finding(Outcome.OF_FILE, {"name": name, "sentence": printable(entry["sentence"])}, where)


def _read(value: Any) -> Any:
    """A number, a name or a sequence of these, out of a file; empty for anything else."""
    if isinstance(value, list):
        return tuple(map(_read, value))
    return value if is_finite(value) else printable(value) if isinstance(value, str) else ""


def _changed(model: ModelFile, where: str) -> Iterator[Finding]:
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
        yield Finding(Outcome.PARAMETERS_CHANGED, {"parameters": tuple(beyond)}, where)


def stated_effects(model: ModelFile) -> list[str]:
    """Names of the effects of the rig that were removed from the records."""
    effects = model.fit.get("effects")
    return sorted(effects) if isinstance(effects, dict) else []


def stated_amplitudes(model: ModelFile) -> list[float]:
    """Amplitudes of the loops that the model was identified from [m]; empty where the file does not say so."""
    entries = [entry.get("amplitude") for entry in objects(model.fit.get("recorded_loops"))]
    return [float(value) for value in entries if isinstance(value, int | float) and value > 0.0]


def cautions_in_use(name: str, model: ModelFile) -> Iterator[Finding]:
    """What is to be known of a model, called so, in whatever it is used for."""
    if cautions := stated_cautions(model):
        names = dict.fromkeys(str(finding.numbers.get("name", finding.name)) for finding in cautions)
        yield Finding(Outcome.IDENTIFIED_WITH_CAUTIONS, {"model": name, "cautions": tuple(map(printable, names))})
    if rates := tuple(effect for effect in stated_effects(model) if effect in _OF_SPEED):
        yield Finding(Outcome.SPEED_REMOVED, {"model": name, "effects": rates})
