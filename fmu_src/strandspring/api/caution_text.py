"""Sentences of caution about records beside a model, and text of model files made safe for the terminal."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core.parameters import SpringParameters
from ..identification.direction import backwards
from ..kernel.arrays import FloatArray
from ..loops.strokes import find_strokes
from ..modelfile import ModelFile
from ..records.record import Record
from ..stated_cautions import stated_effects
from ..strict_json import printable

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9
# Share of a record's range by which a path without reversals below the noise may differ from it: white noise of 1 % of
# the range makes it 2 %.
_SMOOTHED = 0.05


def outside_range(p: SpringParameters) -> str:
    """The end of a caution about something outside the identified range."""
    return (
        f"outside the identified range {p.displacement_min * 1e3:.6g} to {p.displacement_max * 1e3:.6g} mm, where the "
        "model is continued linearly."
    )


def backwards_cautions(records: Iterable[Record]) -> list[str]:
    """One sentence for each record whose loops run backwards, as if the sign of a column were wrong."""
    findings = ((record, backwards(record)) for record in records)
    return [f"{record.path}: {finding.value}" for record, finding in findings if finding is not None]


def jumping_cautions(records: Iterable[Record]) -> list[str]:
    """One sentence for each record whose displacement is not followed, since it jumps from sample to sample."""
    sentences = []
    for record in records:
        path = record.displacement
        apart, span = float(np.max(np.abs(find_strokes(path).displacement - path))), float(np.ptp(path))
        if apart > _SMOOTHED * span:
            share = 100.0 * apart / span
            sentences.append(
                f"{record.path}: the displacement jumps from sample to sample as noise would, and the path of the "
                f"model, which leaves reversals below the noise out, differs from it by up to {share:.2g} % of "
                "its range: what is compared here says nothing; give a record with 20 samples a cycle or more."
            )
    return sentences


def outside_cautions(source: str, displacement: FloatArray, p: SpringParameters) -> list[str]:
    """A sentence with the share of displacements [m] outside the identified range; none if all lie within."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    outside = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    return [f"{source}: {100 * outside:.3g} % of the samples lie {outside_range(p)}"] if outside > 0.0 else []


def effects_of(model: ModelFile) -> str:
    """The effects of the rig that were taken out of a model's records, in words; empty if none was."""
    return printable(", ".join(stated_effects(model)).replace("_", " "))


def effects_cautions(source: str, model: ModelFile) -> list[str]:
    """A sentence about records beside a model without the effects of its rig; none if none was taken out."""
    effects = effects_of(model)
    if not effects:
        return []
    return [
        f"{source}: {effects} was taken out of the records of the model, as an effect of the rig; where the records "
        "given here hold it too, the measured forces differ from the model by it."
    ]
