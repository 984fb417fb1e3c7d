"""Where displacement is counted from: in the record's coordinates, or from a zero as an FMU counts it."""

from __future__ import annotations

from dataclasses import replace
from numbers import Real
from typing import Any

from ..core.parameters import LARGEST_DISPLACEMENT, SpringParameters
from ..errors import StrandspringError
from .modelfile import ModelFile


def sensible_zero(parameters: SpringParameters) -> float:
    """The rig's zero, 0, if it lies within the identified range, else the middle of the range [m]."""
    within = parameters.displacement_min <= 0.0 <= parameters.displacement_max
    return 0.0 if within else _middle(parameters)


def _middle(parameters: SpringParameters) -> float:
    return 0.5 * (parameters.displacement_min + parameters.displacement_max)


def counted_from(zero: float, parameters: SpringParameters) -> SpringParameters:
    """The same spring with its displacement counted from `zero` [m].

    Raises
    ------
    StrandspringError   If that is no spring any more: so far away, its range is lost in rounding.
    """
    if zero == 0.0:
        return parameters
    if not abs(zero) <= LARGEST_DISPLACEMENT:
        raise StrandspringError(
            f"The zero of displacement must be within +-{LARGEST_DISPLACEMENT:g} m, got {zero:g} m."
        )
    p = parameters
    try:
        return replace(
            p,
            displacement_offset=p.displacement_offset - zero,
            displacement_min=p.displacement_min - zero,
            displacement_max=p.displacement_max - zero,
            FE_knots=tuple(knot - zero for knot in p.FE_knots),
        )
    except ValueError as problem:
        raise StrandspringError(
            f"Counted from {1e3 * zero:.6g} mm, the spring's displacement is lost in rounding: {problem}"
        ) from None


def placed(model: ModelFile, zero: str | float | None) -> tuple[ModelFile, float]:
    """A model with its displacement counted from what `chosen_zero` takes; and that zero [m]."""
    chosen, start = chosen_zero(zero, model.parameters), model.start
    if start is not None:
        start = start.model_copy(update={"displacement": start.displacement - chosen})
    return replace(model, parameters=counted_from(chosen, model.parameters), start=start), chosen


def zero_sentence(zero: float) -> str:
    """Where 0 lies, in words; empty where nothing is shifted."""
    return "" if zero == 0.0 else f"Displacement is counted from {1e3 * zero:.6g} mm of the record, as in the FMU."


def chosen_zero(choice: str | float | None, parameters: SpringParameters) -> float:
    """The zero [m] that "rig", "middle" or a displacement of the record [m] stands for; a sensible one if None.

    Raises
    ------
    StrandspringError   If it is none of these.
    """
    checked_zero(choice)
    if choice is None:
        return sensible_zero(parameters)
    if choice == "rig":
        return 0.0
    return _middle(parameters) if choice == "middle" else float(choice)


def checked_zero(choice: Any) -> None:
    """Refuse what `chosen_zero` refuses whatever the spring; raises StrandspringError."""
    if choice is None or (isinstance(choice, str) and choice in ("rig", "middle")):
        return
    is_number = isinstance(choice, Real) and not isinstance(choice, bool)
    if not (is_number and abs(choice) <= LARGEST_DISPLACEMENT):
        raise StrandspringError(f'`zero` must be "rig", "middle" or a displacement of the record [m], got {choice!r}.')
