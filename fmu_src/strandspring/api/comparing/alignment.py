"""Where two springs are compared: from which zero each counts its displacement, and over which range."""

from __future__ import annotations

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import StrandspringError
from ...loops.loop import Loop
from ...model.coordinates import counted_from
from ...model.modelfile import ModelFile
from ..options import Align

_LEAST_SHARED = 0.5  # of the narrower range, below which ranges are not compared where they lie


def aligned(models: tuple[ModelFile, ModelFile], align: Align) -> tuple[SpringParameters, SpringParameters]:
    """Both springs with their displacements counted as asked."""
    a, b = (model.parameters for model in models)
    return (a, b) if align == "record" else (counted_from(middle_of(a), a), counted_from(middle_of(b), b))


def shared_range(springs: tuple[SpringParameters, SpringParameters], align: Align) -> tuple[float, float]:
    """The displacements [m] that both springs were identified for.

    Raises
    ------
    StrandspringError   If that is less than half of the narrower range, where displacements are those of the records.
    """
    low = max(p.displacement_min for p in springs)
    high = min(p.displacement_max for p in springs)
    narrower = min(p.displacement_max - p.displacement_min for p in springs)
    if align == "record" and high - low < _LEAST_SHARED * narrower:
        ranges = [f"{1e3 * p.displacement_min:.6g} to {1e3 * p.displacement_max:.6g} mm" for p in springs]
        raise StrandspringError(
            "A was identified from {of_a} and B from {of_b}, which share less than half of the narrower range; if the "
            "zero of displacement was moved between the tests, align them by their middles ({to[align=middle]}), else "
            "identify both over one range.",
            of_a=ranges[0],
            of_b=ranges[1],
        )
    return low, high


def apart(a: Loop, b: Loop) -> tuple[float, float]:
    """rms difference of force between two loops of one range [N], and its share of their mean height."""
    squares = [
        np.mean((getattr(b, side).force - getattr(a, side).force) ** 2) for side in ("loading", "unloading")
    ]  # fmt: skip
    rms = float(np.sqrt(np.mean(squares)))
    return rms, rms / max(0.5 * (a.figures.height + b.figures.height), 1e-300)


def middle_of(p: SpringParameters) -> float:
    """The middle of the identified range [m]."""
    return 0.5 * (p.displacement_min + p.displacement_max)
