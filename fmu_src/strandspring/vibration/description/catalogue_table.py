"""What SYSTEM.toml states of a spring instead of records: `catalogue` of an axis and `tolerance` of a mount type.

Lengths, forces and stiffnesses must have their units; shares are numbers, or texts in percent.
"""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import Field

from ...core.parameters import SpringParameters
from ...errors import MountedSystemError
from ...ground.quoting import quoted, shown
from ...ground.strict_json import is_finite
from ...ground.tables import StrictTable
from ..catalogue.catalogue_spring import CatalogueValues, spring_from_catalogue
from ..catalogue.static_curve import MOST_POINTS
from . import quantity_text as q
from .table_types import ReadBy, Text

_PERCENT = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*%\s*")
_MOST_DAMPING = 10.0  # more is an error of units
_QUANTITY = {"type": "string", "maxLength": 60, "pattern": r"^\s*[+-]?[0-9.]"}


def _with_unit(value: Any, kind: q.QuantityKind) -> float:
    if not isinstance(value, str):
        raise ValueError(f"must be {kind.name} with its unit, such as '{kind.example}', got {shown(value)}")
    return q.in_si(value, kind)


def _stated(kind: q.QuantityKind, is_positive: bool = True) -> ReadBy:
    """A quantity that must have its unit."""

    def read(value: Any) -> float:
        number = _with_unit(value, kind)
        if is_positive and not number > 0.0:
            raise ValueError(f"must be {kind.name} > 0, got {quoted(value)}")
        return number

    return ReadBy(read, {**_QUANTITY, "examples": [kind.example]})


def _share(most: float, may_be_zero: bool = False) -> ReadBy:
    """A share below `most`."""

    def read(value: Any) -> float:
        percent = _PERCENT.fullmatch(value) if isinstance(value, str) else None
        number = 0.01 * float(percent[1]) if percent else float(value) if is_finite(value) else -1.0
        if not 0.0 <= number < most or (number == 0.0 and not may_be_zero):
            sign = ">=" if may_be_zero else ">"
            raise ValueError(f"must be a share {sign} 0 and below {most:g} such as '15 %' or 0.15, got {shown(value)}")
        return number

    forms = [{"type": "number", "minimum": 0, "exclusiveMaximum": most}, {**_QUANTITY, "examples": ["15 %"]}]
    return ReadBy(read, {"anyOf": forms})


def _read_stroke(value: Any) -> tuple[float, float]:
    if isinstance(value, list):
        if len(value) != 2:
            raise ValueError(f"must be a length, or a list of the least and the largest deflection, got {shown(value)}")
        low, high = (_with_unit(end, q.LENGTH) for end in value)
    else:
        high = _with_unit(value, q.LENGTH)
        low = -high
    if not low < high:
        raise ValueError(f"must be > 0 mm, or a list of the least and the largest deflection, got {shown(value)}")
    return low, high


def _read_points(value: Any) -> tuple[tuple[float, float], ...]:
    if not isinstance(value, list) or not all(isinstance(point, list) and len(point) == 2 for point in value):
        raise ValueError(
            f"must be a list of points, each of a deflection and a force, such as ['2 mm', '90 N'], got {shown(value)}"
        )
    if not 2 <= len(value) <= MOST_POINTS:
        raise ValueError(f"must have 2 to {MOST_POINTS} points, got {len(value)}")
    return tuple((_with_unit(x, q.LENGTH), _with_unit(force, q.FORCE)) for x, force in value)


def _read_width(value: Any) -> tuple[float | None, float | None]:
    """The width [N], or the share."""
    if isinstance(value, str) and _PERCENT.fullmatch(value):
        return None, _LOSS.read(value)
    return _FORCE.read(value), None


_LENGTH, _FORCE, _STIFFNESS = _stated(q.LENGTH), _stated(q.FORCE), _stated(q.STIFFNESS)
_LOSS = _share(_MOST_DAMPING)
_ENDS = ReadBy(
    _read_stroke, {"anyOf": [_QUANTITY, {"type": "array", "items": _QUANTITY, "minItems": 2, "maxItems": 2}]}
)
_POINTS = ReadBy(
    _read_points,
    {
        "type": "array",
        "items": {"type": "array", "items": _QUANTITY, "minItems": 2, "maxItems": 2},
        "minItems": 2,
        "maxItems": MOST_POINTS,
    },
)
_WIDTH = ReadBy(_read_width, {**_QUANTITY, "examples": ["40 N", "12 %"]})

StatedForce = Annotated[float, _FORCE]
Scatter = Annotated[float, _share(1.0, may_be_zero=True)]


class CatalogueTable(StrictTable):
    """What a vendor's catalogue states of one spring along an axis, instead of a model file."""

    source: Text = Field("", description="Catalogue, part and page, for cautions and reports.")
    stiffness: Annotated[float, _STIFFNESS] | None = Field(
        None, description="Force between the ends of the loop over twice its amplitude."
    )
    curve: Annotated[tuple[tuple[float, float], ...], _POINTS] | None = Field(
        None,
        description="Instead of a stiffness: points [deflection, force] of the static curve, in the loop's middle.",
    )
    symmetric: bool = Field(False, description="Whether the curve is the same in the other sense.")
    amplitude: Annotated[float, _LENGTH] = Field(
        description="Of the deflection, half of peak to peak, at which stiffness and damping are stated."
    )
    about: Annotated[float, _stated(q.LENGTH, is_positive=False)] = Field(
        0.0, description="Mean deflection at which they are stated."
    )
    loss_factor: Annotated[float, _LOSS] | None = Field(None, description="Twice the damping ratio.")
    damping_ratio: Annotated[float, _LOSS] | None = None
    loop_width: Annotated[tuple[float | None, float | None], _WIDTH] | None = Field(
        None, description="Force between loading and unloading in the middle, or its share of that between the ends."
    )
    vibration_stiffness: Annotated[float, _STIFFNESS] | None = Field(None, description="Of small vibration.")
    stroke: Annotated[tuple[float, float], _ENDS] = Field(
        description="Largest deflection in either sense, or a list of the least and the largest."
    )


class ToleranceTable(StrictTable):
    """Scatter from mount to mount, each the half width of a uniform distribution."""

    stiffness: Scatter = 0.0
    friction: Scatter = 0.0
    batch: bool = Field(False, description="Whether all mounts of the type are alike.")


def catalogue_spring(table: CatalogueTable) -> SpringParameters:
    """The spring of a table.

    Raises
    ------
    MountedSystemError   If there is none; the message names neither file nor table.
    """
    loss_factor = table.loss_factor
    if table.damping_ratio is not None:
        if loss_factor is not None:
            raise MountedSystemError("must have either `loss_factor` or `damping_ratio`, got both; leave one out.")
        loss_factor = 2.0 * table.damping_ratio
    width, share = table.loop_width or (None, None)
    return spring_from_catalogue(
        CatalogueValues(
            amplitude=table.amplitude,
            stroke=table.stroke,
            stiffness=table.stiffness,
            curve=table.curve or (),
            is_symmetric=table.symmetric,
            about=table.about,
            loss_factor=loss_factor,
            loop_width=width,
            loop_share=share,
            vibration_stiffness=table.vibration_stiffness,
        )
    )
