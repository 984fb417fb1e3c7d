"""Sentences of caution about records beside a model, and text of model files made safe for the terminal."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...core.parameters import SpringParameters
from ...ground.quoting import printable
from ...identification.refusals import Strokes, backwards, clipped_samples
from ...kernel.arrays import FloatArray
from ...loops.strokes import find_strokes
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_amplitudes, stated_effects
from ...records.record import Record
from .text import outside_range

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9
_ALIKE = 0.15  # logarithm of the ratio of two amplitudes up to which they are alike
_FEW = 0.05  # share of strokes that hardly counts


def backwards_cautions(records: Iterable[Record]) -> list[str]:
    """One sentence for each record whose loops run backwards, as if the sign of a column were wrong."""
    findings = ((record, backwards(Strokes(record))) for record in records)
    return [f"{record.path}: {finding.value}" for record, finding in findings if finding is not None]


def clipped_cautions(record: Record) -> list[str]:
    """A sentence where the force stays at the end of its sensor's range; none if it does not."""
    clipped = np.count_nonzero(clipped_samples(record.force))
    if not clipped:
        return []
    return [
        f"{record.path}: {clipped} of {len(record)} samples are at the end of the force sensor's range; errors leave "
        "them out, and measured loops are too flat."
    ]


def unrecorded_cautions(source: str, model: ModelFile, record: Record) -> list[str]:
    """A sentence where loops of a record are of no amplitude that the model was identified from; none otherwise."""
    known = np.array(stated_amplitudes(model))
    amplitudes = 0.5 * find_strokes(record.displacement).length[1:-1]
    if not known.size or not amplitudes.size:
        return []
    alike = np.abs(np.log(amplitudes[:, None] / known)).min(axis=1) <= _ALIKE
    if np.mean(~alike) <= _FEW:
        return []
    beyond = amplitudes[~alike]
    given = ", ".join(f"{1e3 * value:.3g}" for value in sorted(known))
    return [
        f"{record.path}: the 95 % prediction interval of {source} holds for loops of {given} mm, not for those of "
        f"{1e3 * beyond.min():.3g} to {1e3 * beyond.max():.3g} mm."
    ]


def outside_cautions(source: str, displacement: FloatArray, p: SpringParameters) -> list[str]:
    """A sentence with the share of displacements [m] outside the identified range; none if all lie within."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    outside = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    return [f"{source}: {100 * outside:.3g} % of the samples lie {outside_range(p)}"] if outside > 0.0 else []


def effects_of(model: ModelFile) -> str:
    """The effects of the rig that were removed from a model's records, in words; empty if none was."""
    return printable(", ".join(stated_effects(model)).replace("_", " "))


def effects_cautions(source: str, model: ModelFile) -> list[str]:
    """A sentence about records beside a model without the effects of its rig; none if none was removed."""
    effects = effects_of(model)
    if not effects:
        return []
    return [
        f"{source}: {effects} was removed from the records of the model, as an effect of the rig; records that hold "
        "it too differ by it."
    ]
