"""Cautions about displacements beyond the identified range."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..model.parameters import SpringParameters
from .output import note

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9


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
