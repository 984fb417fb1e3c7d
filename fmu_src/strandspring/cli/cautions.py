"""Messages about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..api.text import outside_range as outside_range
from ..core.parameters import SpringParameters
from ..identification.direction import backwards
from ..records.record import Record
from .output import note

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9


def note_assumptions(records: Iterable[Record]) -> None:
    """Report what was assumed when records were read."""
    for record in records:
        for sentence in record.notes:
            note(f"{record.path}: {sentence}")


def caution_backwards(records: Iterable[Record]) -> None:
    """Report records whose loops run backwards, as if the sign of a column were wrong."""
    for record in records:
        finding = backwards(record)
        if finding is not None:
            note(f"Caution: {record.path}: {finding.value}")


def caution_samples(source: str, displacement: NDArray[np.float64], p: SpringParameters) -> None:
    """Report the share of a record's displacements [m] outside the identified range, if any."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    outside = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    if outside > 0.0:
        note(f"Caution: {source}: {100 * outside:.3g} % of the samples lie {outside_range(p)}")
