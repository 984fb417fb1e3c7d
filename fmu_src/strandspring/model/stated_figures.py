"""How well a spring follows its records, in words: the saved spring alone, and beside it what was fitted.

Figures are rmse [N], rnl [-], and energy and predicted_energy [J], the work of the loops measured and predicted. In the
field `fit` of a model file they are free JSON, of which any part may be missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ..ground.quoting import printable
from ..ground.strict_json import is_finite, objects
from .modelfile import ModelFile

Figures = Mapping[str, Any]

NAMES = ("rmse", "rnl", "energy", "predicted_energy")
# Differences from which both figures are shown.
_VISIBLE_RNL = 1e-3
_VISIBLE_ENERGY = 0.01
# Display unit of each effect of a rig, and how many of it are one of SI.
_EFFECTS = {
    "delay": (1e3, "ms"), "force_zero": (1.0, "N"), "drift": (1.0, "N"), "moving_mass": (1.0, "kg"),
    "fixture_stiffness": (1e-3, "N/mm"),
}  # fmt: skip


def energy_ratio(figures: Figures) -> float | None:
    """Energy of the predicted loops over that of the measured ones; None if unknown, or if hardly any was measured.

    Examples
    --------
    >>> energy_ratio({"energy": 2.0, "predicted_energy": 1.9})
    0.95
    """
    energy, predicted = _known(figures).get("energy", 0.0), _known(figures).get("predicted_energy")
    ratio = math.nan if predicted is None or energy <= 0.0 else float(predicted / energy)
    return ratio if math.isfinite(ratio) else None


def differ(alone: Figures, fitted: Figures) -> bool:
    """Whether two sets of figures differ so far that both are shown."""
    pairs = (
        (_known(alone).get("rnl"), _known(fitted).get("rnl"), _VISIBLE_RNL),
        (energy_ratio(alone), energy_ratio(fitted), _VISIBLE_ENERGY),
    )
    return any(a is not None and b is not None and abs(a - b) >= visible for a, b, visible in pairs)


def in_words(figures: Figures, with_rmse: bool = True) -> str:
    """Figures as a list, as far as they are known.

    Examples
    --------
    >>> in_words({"rmse": 1.0, "rnl": 0.98, "energy": 2.0, "predicted_energy": 1.9})
    'rmse 1 N, RNL 0.9800, energy 0.95 of the measured'
    >>> in_words({"rnl": 0.98, "energy": -0.1, "predicted_energy": 1.9})
    'RNL 0.9800, energy 1.9 J, -0.1 J measured'
    """
    parts = []
    if with_rmse and is_finite(figures.get("rmse")):
        parts.append(f"rmse {figures['rmse']:.4g} N")
    if is_finite(figures.get("rnl")):
        parts.append(f"RNL {figures['rnl']:.4f}")
    ratio = energy_ratio(figures)
    if ratio is not None:
        parts.append(f"energy {ratio:.2f} of the measured")
    elif all(is_finite(figures.get(name)) for name in ("energy", "predicted_energy")):
        parts.append(f"energy {figures['predicted_energy']:.3g} J, {figures['energy']:.3g} J measured")
    return ", ".join(parts)


def effects_in_words(effects: Mapping[str, Any]) -> dict[str, str]:
    """Sizes of what a rig added to records, by what it is.

    Examples
    --------
    >>> effects_in_words({"delay": 5e-4, "force_zero": {"a.csv": 3.0, "b.csv": 0.0}})
    {'delay': '0.5 ms', 'force zero': 'a.csv 3 N, b.csv 0 N'}
    """

    def words(size: Any, factor: float, unit: str) -> str:
        if isinstance(size, Mapping):
            return ", ".join(f"{where} {words(value, factor, unit)}" for where, value in size.items())
        return f"{factor * size:.4g} {unit}"

    return {name.replace("_", " "): words(size, *_EFFECTS.get(name, (1.0, ""))) for name, size in effects.items()}


@dataclass(frozen=True)
class StatedFit:
    """Figures that a model file states of one record, or of all.

    Attributes
    ----------
    name : str                  The record's file; empty if all are meant.
    alone : mapping             Of the saved spring.
    fitted : mapping            Of the fit; empty if unknown.
    omega_start : float or None omega at the record's first sample.
    """

    name: str
    alone: Figures
    fitted: Figures
    omega_start: float | None

    @property
    def beside(self) -> str:
        """The figures of the fit in words where they differ."""
        return f"as fitted: {in_words(self.fitted, False)}" if differ(self.alone, self.fitted) else ""

    def as_json(self) -> dict[str, Any]:
        """The figures; null where the file states none."""
        return {**_whole(self.alone), "fitted": _whole(self.fitted) if self.fitted else None}


def stated_fit(model: ModelFile) -> StatedFit | None:
    """The figures over all records; None if the file states none."""
    return next(_stated([("", model.fit)]), None)


def stated_fits(model: ModelFile) -> list[StatedFit]:
    """The figures of each record, as far as the file states any."""
    entries = objects(model.fit.get("records"))
    return list(_stated([(printable(str(entry.get("file", ""))), entry) for entry in entries]))


def stated_verdict(model: ModelFile) -> str:
    """Whether the spring is usable, in words; empty if the file does not say."""
    verdict = model.fit.get("verdict")
    sentence = verdict.get("sentence") if isinstance(verdict, dict) else None
    return printable(sentence) if isinstance(sentence, str) else ""


def stated_json(model: ModelFile) -> dict[str, Any] | None:
    """The figures as JSON: of all records, and of each; None if the file states none."""
    whole = stated_fit(model)
    if whole is None:
        return None
    return {**whole.as_json(), "records": [{"file": fit.name, **fit.as_json()} for fit in stated_fits(model)]}


def _stated(entries: list[tuple[str, Figures]]) -> Iterator[StatedFit]:
    for name, entry in entries:
        if is_finite(entry.get("rmse")) and is_finite(entry.get("rnl")):
            fitted = entry.get("fitted")
            start = entry.get("omega_start")
            yield StatedFit(
                name,
                _known(entry),
                _known(fitted) if isinstance(fitted, dict) else {},
                start if is_finite(start) else None,
            )


def _whole(figures: Figures) -> dict[str, Any]:
    return {name: figures.get(name) for name in NAMES}


def _known(entry: Figures) -> dict[str, float]:
    return {name: entry[name] for name in NAMES if is_finite(entry.get(name))}
