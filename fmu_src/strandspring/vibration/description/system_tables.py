"""The tables of SYSTEM.toml that describe bodies, mounts, candidates, limits and runs, as pydantic models.

A number without unit is in SI; a text carries its unit. Directions are "+x", "-z" and the like, or vectors of any
length.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from ...ground.gravity import STANDARD_GRAVITY
from ...ground.tables import OWN, TAG, StrictTable
from ..bodies.mounted import MOST_BODIES, MOST_POINTS
from .case_tables import AnyCase
from .table_types import (
    AccelerationVector,
    Angle,
    Damping,
    Duration,
    FilePath,
    Force,
    Inertia,
    Length,
    Mass,
    Name,
    NamedDirection,
    Place,
    PositiveAcceleration,
    PositiveAngle,
    PositiveInertia,
    PositiveLength,
    ReadBy,
    Stiffness,
    Text,
)

MOST_TYPES, MOST_PLACES, MOST_CANDIDATES, MOST_CASES = 600, 600, 1000, 200
MOST_DRAWS = 1_000_000
FORMAT, VERSION = "strandspring-system", 1


def _kind_of_value(value: Any) -> str:
    kind = "table" if isinstance(value, dict) else "list" if isinstance(value, list) else "quantity"
    return f"{TAG}{kind}"


def _forms(message: str) -> Discriminator:
    """Tells forms of a field apart by what TOML calls its value."""
    return Discriminator(_kind_of_value, custom_error_type=OWN, custom_error_message=message)


def _read_version(value: Any) -> int:
    if type(value) is not int or value != VERSION:
        newer = "; the file was written for a newer strandspring, upgrade" if type(value) is int and value > 1 else ""
        raise ValueError(f"must be {VERSION}, got {value!r:.40}{newer}")
    return value


Version = Annotated[int, ReadBy(_read_version, {"const": VERSION})]


class PointTable(StrictTable):
    """A point of a body whose motion is asked for."""

    name: Name
    place: Place = Field(description="In the nominal pose.")


class InertiaTable(StrictTable):
    """Inertia tensor about the centre of gravity; xy = -(integral of x*y dm), and likewise."""

    xx: PositiveInertia
    yy: PositiveInertia
    zz: PositiveInertia
    xy: Inertia = 0.0
    xz: Inertia = 0.0
    yz: Inertia = 0.0


class PlaneTable(StrictTable):
    """Motion in a plane, with rotation about its normal."""

    plane: NamedDirection = Field(description="The normal of the plane.")


class AxisMotionTable(StrictTable):
    """Motion along an axis, without rotation."""

    axis: NamedDirection


def _kind_of_motion(value: Any) -> str:
    if isinstance(value, dict):
        return f"{TAG}axis" if "axis" in value and "plane" not in value else f"{TAG}plane"
    return f"{TAG}six" if isinstance(value, str) else f"{TAG}none"


class BodyTable(StrictTable):
    """A rigid body."""

    name: Name
    mass: Mass
    center: Place = Field((0.0, 0.0, 0.0), description="Centre of gravity in the nominal pose.")
    inertia: (
        Annotated[
            Annotated[InertiaTable, Tag(f"{TAG}table")] | Annotated[PositiveInertia, Tag(f"{TAG}quantity")],
            _forms("must be a table with xx, yy and zz, or for motion in a plane a moment about its normal"),
        ]
        | None
    ) = None
    motion: Annotated[
        Annotated[Literal["six"], Tag(f"{TAG}six")]
        | Annotated[PlaneTable, Tag(f"{TAG}plane")]
        | Annotated[AxisMotionTable, Tag(f"{TAG}axis")],
        Discriminator(
            _kind_of_motion,
            custom_error_type=OWN,
            custom_error_message="must be 'six', { plane = normal } or { axis = direction }",
        ),
    ] = "six"
    point: list[PointTable] = Field(default=[], max_length=MOST_POINTS)


class StopsTable(StrictTable):
    """Elastic bump stops; displacements are those of one spring as its model counts them."""

    low: Length | None = None
    high: Length | None = None
    stiffness: Stiffness


class AxisTable(StrictTable):
    """Equal springs of a mount along one axis."""

    name: Name | None = Field(None, description="What the vendor calls the axis: compression, shear, roll.")
    direction: NamedDirection = Field(
        description="In the mount's frame: where the body moves as the spring's displacement grows."
    )
    model: FilePath = Field(description="Model file of one spring, from the folder of this file.")
    parallel: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    series: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    preload: Force | None = Field(
        None, description="Elastic force of one spring in the nominal pose; 0 N if not given."
    )
    nominal: Length | None = Field(
        None, description="Displacement of one spring in the nominal pose, as its model counts, instead of a preload."
    )
    damping: Damping = Field(0.0, description="Of a viscous damper along the axis.")
    stops: StopsTable | None = None


class MountTypeTable(StrictTable):
    """One to three axes, perpendicular to each other."""

    axes: list[AxisTable] = Field(min_length=1, max_length=3)


class RotationTable(StrictTable):
    """A rotation of the mount's frame."""

    about: NamedDirection
    angle: Angle


class MountTable(StrictTable):
    """Mounts of one type at one place or several."""

    name: Name
    type: Name
    body: Name | None = None
    on: Name = "base"
    place: Place | None = None
    places: list[Place] | None = Field(None, min_length=1, max_length=MOST_PLACES)
    rotate: (
        Annotated[
            Annotated[RotationTable, Tag(f"{TAG}table")]
            | Annotated[Annotated[list[RotationTable], Field(min_length=1, max_length=MOST_PLACES)], Tag(f"{TAG}list")],
            _forms("must be a table with about and angle, or a list of one for each place"),
        ]
        | None
    ) = None


class CandidateTable(StrictTable):
    """Mount types that take the place of others."""

    name: Name
    types: dict[str, Name] = Field({}, max_length=MOST_TYPES)


class LimitsTable(StrictTable):
    """What is allowed."""

    acceleration: (
        Annotated[
            Annotated[dict[str, PositiveAcceleration], Tag(f"{TAG}table")]
            | Annotated[PositiveAcceleration, Tag(f"{TAG}quantity")],
            _forms("must be an acceleration such as '15 g', or a table with one for each point"),
        ]
        | None
    ) = None
    sway: (
        Annotated[
            Annotated[dict[str, PositiveLength], Tag(f"{TAG}table")] | Annotated[PositiveLength, Tag(f"{TAG}quantity")],
            _forms("must be a length such as '25 mm', or a table with one for each point"),
        ]
        | None
    ) = None
    tilt: PositiveAngle | None = None
    stroke: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        1.0, description="Share of the identified range that springs may use."
    )


def _kind_of_rest(value: Any) -> str:
    is_word = isinstance(value, str) and not re.match(r"\s*[+-]?\.?\d", value)
    return f"{TAG}text" if is_word else f"{TAG}number"


class RunTable(StrictTable):
    """How the cases are simulated."""

    step: Duration | None = Field(None, description="Time step; chosen by the program if not given.")
    rest_omega: Annotated[
        Annotated[Literal["unknown"], Tag(f"{TAG}text")]
        | Annotated[Annotated[float, Field(ge=-1.0, le=1.0)], Tag(f"{TAG}number")],
        Discriminator(_kind_of_rest),
    ] = Field("unknown", description="Normalized hysteretic variable at rest, in the direction of the static force.")
    draws: Annotated[int, Field(ge=0, le=MOST_DRAWS)] = Field(
        0, description="Of springs from the uncertainty of their model files."
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0


class SystemTable(StrictTable):
    """A system of rigid bodies on hysteretic mounts, its limits and load cases."""

    format: Literal["strandspring-system"]
    format_version: Version
    name: Name
    description: Text = ""
    gravity: AccelerationVector = (0.0, 0.0, -STANDARD_GRAVITY)
    body: list[BodyTable] = Field(min_length=1, max_length=MOST_BODIES)
    mount_type: dict[str, MountTypeTable] = Field(min_length=1, max_length=MOST_TYPES)
    mount: list[MountTable] = Field(min_length=1, max_length=MOST_PLACES)
    candidate: list[CandidateTable] = Field(default=[], max_length=MOST_CANDIDATES)
    limits: LimitsTable = Field(default_factory=lambda: LimitsTable.model_validate({}))
    run: RunTable = Field(default_factory=lambda: RunTable.model_validate({}))
    case: list[AnyCase] = Field(default=[], max_length=MOST_CASES)
