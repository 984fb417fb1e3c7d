"""Sentences of caution about records beside a model, and text of model files made safe for the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..core.parameters import SpringParameters
from ..identification.direction import backwards
from ..kernel.arrays import FloatArray
from ..records.record import Record

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9


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


def outside_cautions(source: str, displacement: FloatArray, p: SpringParameters) -> list[str]:
    """A sentence with the share of displacements [m] outside the identified range; none if all lie within."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    outside = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    return [f"{source}: {100 * outside:.3g} % of the samples lie {outside_range(p)}"] if outside > 0.0 else []


def printable(value: Any) -> str:
    """Text of a model file without control characters, which could change the terminal."""
    return "".join(c if c.isprintable() else "?" for c in str(value))
