"""The tables of SYSTEM.toml that describe bodies, mounts, candidates, limits and runs, as pydantic models.

A text carries its unit; a number has the one that `units` states and is refused otherwise. Directions are "+x", "-z"
and the like, or vectors of any length.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator
from pydantic.functional_validators import ModelWrapValidatorHandler

from ...ground.gravity import STANDARD_GRAVITY
from ...ground.tables import OWN, TAG, StrictTable
from ..bodies.mounted import MOST_BODIES, MOST_POINTS
from ..options import DRAWS, LEAST_DRAWS, MOST_DRAWS
from . import quantity_text as q
from .case_tables import AnyCase, SpectrumTable
from .catalogue_table import CatalogueTable, StatedForce, ToleranceTable
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
    PositiveForce,
    PositiveInertia,
    PositiveLength,
    ReadBy,
    Stiffness,
    Text,
    forms,
    kind_of_value,
    unit_of,
)

MOST_TYPES, MOST_PLACES, MOST_CANDIDATES, MOST_CASES = 600, 600, 1000, 200
FORMAT, VERSION = "strandspring-system", 1
DEFAULT_GRAVITY = (0, 0, f"{-STANDARD_GRAVITY} m/s^2")  # as a file would have it


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
            forms("must be a table with xx, yy and zz, or for motion in a plane a moment about its normal"),
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
    model: FilePath | None = Field(None, description="Model file of one spring, from the folder of this file.")
    catalogue: CatalogueTable | None = None
    rated_load: StatedForce | None = Field(None, description="Largest static force of one spring, as its maker states.")
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
    tolerance: ToleranceTable | None = None


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
            forms("must be a table with about and angle, or a list of one for each place"),
        ]
        | None
    ) = None


class CandidateTable(StrictTable):
    """Mount types that take the place of others."""

    name: Name
    types: dict[str, Name] = Field({}, max_length=MOST_TYPES)


AccelerationLimit = Annotated[
    Annotated[dict[str, PositiveAcceleration], Tag(f"{TAG}table")]
    | Annotated[PositiveAcceleration, Tag(f"{TAG}quantity")],
    forms("must be an acceleration such as '15 g', or a table with one for each point"),
]
SwayLimit = Annotated[
    Annotated[dict[str, PositiveLength], Tag(f"{TAG}table")] | Annotated[PositiveLength, Tag(f"{TAG}quantity")],
    forms("must be a length such as '25 mm', or a table with one for each point"),
]


def _kind_of_spectrum(value: Any) -> str:
    return f"{TAG}spectrum" if isinstance(value, dict) and "levels" in value else kind_of_value(value)


SpectrumLimit = Annotated[
    Annotated[dict[str, SpectrumTable], Tag(f"{TAG}table")] | Annotated[SpectrumTable, Tag(f"{TAG}spectrum")],
    Discriminator(
        _kind_of_spectrum,
        custom_error_type=OWN,
        custom_error_message="must be a table with levels and q, or a table with one for each point",
    ),
]


class LimitsTable(StrictTable):
    """What is allowed."""

    acceleration: AccelerationLimit | None = None
    sway: SwayLimit | None = None
    sway_x: SwayLimit | None = None
    sway_y: SwayLimit | None = None
    sway_z: SwayLimit | None = None
    tilt: PositiveAngle | None = None
    stroke: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        1.0, description="Share of the identified range that springs may use."
    )
    force: PositiveForce | None = Field(None, description="Of each axis of a mount, its static force included.")
    mount_force: PositiveForce | None = Field(None, description="Of each mount, its axes together.")
    reaction: PositiveForce | None = Field(None, description="Of all mounts on the base, weight included.")
    rms_acceleration: PositiveAcceleration | None = Field(None, description="Of each point along each axis.")
    three_sigma: AccelerationLimit | None = Field(None, description="Three times the largest rms of x, y and z.")
    srs: SpectrumLimit | None = Field(None, description="Shock response spectrum of a point, along x, y and z.")


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
    draws: Annotated[int, Field(ge=LEAST_DRAWS, le=MOST_DRAWS)] = Field(
        DRAWS, description="Of omega at rest, springs, mounts and realisations, for the ranges of the figures."
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0


class UnitsTable(StrictTable):
    """Units of the numbers that stand without one anywhere in the file."""

    length: Annotated[float, unit_of(q.LENGTH)] | None = None
    mass: Annotated[float, unit_of(q.MASS)] | None = None
    time: Annotated[float, unit_of(q.TIME)] | None = None
    angle: Annotated[float, unit_of(q.ANGLE)] | None = None
    force: Annotated[float, unit_of(q.FORCE)] | None = None
    velocity: Annotated[float, unit_of(q.VELOCITY)] | None = None
    acceleration: Annotated[float, unit_of(q.ACCELERATION)] | None = None
    density: Annotated[float, unit_of(q.ACCELERATION_DENSITY)] | None = None
    stiffness: Annotated[float, unit_of(q.STIFFNESS)] | None = None
    damping: Annotated[float, unit_of(q.DAMPING)] | None = None
    inertia: Annotated[float, unit_of(q.INERTIA)] | None = None
    impulse: Annotated[float, unit_of(q.IMPULSE)] | None = None

    def sizes(self) -> dict[str, float]:
        """Of the stated units, in SI units."""
        return self.model_dump(exclude_none=True)


class SystemTable(StrictTable):
    """A system of rigid bodies on hysteretic mounts, its limits and load cases."""

    format: Literal["strandspring-system"]
    format_version: Version
    name: Name
    description: Text = ""
    units: UnitsTable = Field(default_factory=lambda: UnitsTable.model_validate({}))
    gravity: AccelerationVector = (0.0, 0.0, -STANDARD_GRAVITY)
    body: list[BodyTable] = Field(min_length=1, max_length=MOST_BODIES)
    mount_type: dict[str, MountTypeTable] = Field(min_length=1, max_length=MOST_TYPES)
    mount: list[MountTable] = Field(min_length=1, max_length=MOST_PLACES)
    candidate: list[CandidateTable] = Field(default=[], max_length=MOST_CANDIDATES)
    limits: LimitsTable = Field(default_factory=lambda: LimitsTable.model_validate({}))
    run: RunTable = Field(default_factory=lambda: RunTable.model_validate({}))
    case: list[AnyCase] = Field(default=[], max_length=MOST_CASES)

    @model_validator(mode="wrap")
    @classmethod
    def _in_stated_units(cls, content: Any, handler: ModelWrapValidatorHandler[SystemTable]) -> SystemTable:
        given = content.get("units", {}) if isinstance(content, dict) else {}
        try:
            sizes = UnitsTable.model_validate(given).sizes()
        except ValidationError:  # the field is refused below
            sizes = {}
        with q.stated_units(sizes):
            return handler(content)
