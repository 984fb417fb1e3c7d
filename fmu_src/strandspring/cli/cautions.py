"""What is told about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from ..identification.direction import backwards
from ..records.record import Record
from .output import note

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9


def tell_notes(records: Iterable[Record]) -> None:
    """Tell what was assumed when records were read."""
    for record in records:
        for sentence in record.notes:
            note(f"{record.path}: {sentence}")


def caution_backwards(records: Iterable[Record]) -> None:
    """Tell which records have loops that run the other way than a spring's, as if a column's sign were turned."""
    for record in records:
        turned = backwards(record)
        if turned is not None:
            note(f"Caution: {record.path}: {turned.value}")


def outside_range(p: SpringParameters) -> str:
    """How a caution ends that something lies, or goes, beyond the identified range."""
    return (
        f"outside the identified range {p.displacement_min * 1e3:.6g} to {p.displacement_max * 1e3:.6g} mm, where the "
        "model is continued linearly."
    )


def caution_samples(source: str, displacement: NDArray[np.float64], p: SpringParameters) -> None:
    """Tell which share of a record's displacements [m] lies outside the identified range, if any does."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    outside = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    if outside > 0.0:
        note(f"Caution: {source}: {100 * outside:.3g} % of the samples lie {outside_range(p)}")
