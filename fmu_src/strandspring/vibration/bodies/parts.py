"""The parts of a system as they stand in the nominal pose: rigid bodies, hysteretic mounts with their axes, points.

Places and directions are given in one frame, which is fixed to the base; in the nominal pose the frame of each body is
parallel to it. An axis of a mount is fixed to what the mount stands on, the base or another body, and its displacement
is how far the body's place of the mount has moved along it relative to that.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ..one_mass.options import MASS_RANGE, MOST_SPRINGS

BASE = -1  # in place of the number of a body
LARGEST_PLACE = 100.0  # [m]; what is farther was given in another unit
_ROUNDING = 1e-9  # of lengths of unit vectors and of moments of inertia
_PARALLEL = 1.0 - 1e-9  # least component of a direction that is called by its letter

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class MotionKind(Enum):
    """How a body may move; the value is how people name it."""

    SIX = "six"  # in all six degrees of freedom
    PLANE = "plane"  # in a plane, about the plane's normal
    AXIS = "axis"  # along an axis, without rotation


@dataclass(frozen=True)
class RigidBody:
    """A rigid body.

    Parameters
    ----------
    name : str
    mass : float            [kg].
    center : Vector         Centre of gravity in the nominal pose [m].
    inertia : Matrix        About the centre of gravity [kg m^2]; ignored where the body moves along an axis.
    motion : MotionKind
    direction : Vector      Normal of the plane, or the axis, along which the body moves; a unit vector.

    Raises
    ------
    MountedSystemError      If no body has such a mass or inertia.
    """

    name: str
    mass: float
    center: Vector = (0.0, 0.0, 0.0)
    inertia: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    motion: MotionKind = MotionKind.SIX
    direction: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if not MASS_RANGE[0] <= self.mass <= MASS_RANGE[1]:
            raise MountedSystemError(
                f"The mass of {self.name} must be within [{MASS_RANGE[0]:g}, {MASS_RANGE[1]:g}] kg, got {self.mass!r}."
            )
        _check_place(self.center, f"the centre of gravity of {self.name}")
        _check_direction(self.direction, f"the direction of {self.name}")
        if self.motion is not MotionKind.AXIS:
            self._check_inertia()

    def _check_inertia(self) -> None:
        inertia = np.array(self.inertia)
        if not np.isfinite(inertia).all():
            raise MountedSystemError(f"The moments of inertia of {self.name} must be finite [kg m^2].")
        if np.abs(inertia - inertia.T).max() > _ROUNDING * np.abs(inertia).max():
            raise MountedSystemError(f"The inertia tensor of {self.name} must be symmetric, got {inertia.tolist()}.")
        least, middle, largest = np.linalg.eigvalsh(inertia).tolist()
        if not least > 0.0:
            raise MountedSystemError(
                f"No body has the inertia tensor of {self.name}: its principal moments {least:.6g}, {middle:.6g} "
                f"and {largest:.6g} kg m^2 must be > 0; check the signs of the products, xy = -(integral of x*y dm)."
            )
        if largest > (1.0 + _ROUNDING) * (least + middle):
            raise MountedSystemError(
                f"No body has the inertia tensor of {self.name}: of its principal moments {least:.6g}, {middle:.6g} "
                f"and {largest:.6g} kg m^2 the largest must not exceed the sum of the others; check them all."
            )

    @property
    def translations(self) -> FloatArray:
        """Projector on the translations that are free, shape (3, 3)."""
        direction = np.array(self.direction)
        along = np.outer(direction, direction)
        return {MotionKind.SIX: np.eye(3), MotionKind.PLANE: np.eye(3) - along, MotionKind.AXIS: along}[self.motion]

    @property
    def rotations(self) -> FloatArray:
        """Projector on the rotations that are free, shape (3, 3)."""
        direction = np.array(self.direction)
        return {
            MotionKind.SIX: np.eye(3),
            MotionKind.PLANE: np.outer(direction, direction),
            MotionKind.AXIS: np.zeros((3, 3)),
        }[self.motion]

    @property
    def inverse_inertia(self) -> FloatArray:
        """What turns angular momentum into angular velocity in the body's frame, shape (3, 3) [1/(kg m^2)]."""
        if self.motion is MotionKind.SIX:
            return np.linalg.inv(np.array(self.inertia))
        if self.motion is MotionKind.AXIS:
            return np.zeros((3, 3))
        direction = np.array(self.direction)
        return np.outer(direction, direction) / float(direction @ np.array(self.inertia) @ direction)


@dataclass(frozen=True)
class Stops:
    """Elastic bump stops in parallel with the springs of an axis.

    Parameters
    ----------
    low, high : float        Displacement of one spring at which a stop is touched [m]; infinite where there is none.
    stiffness : float        Of a stop, force over displacement of the mount [N/m].

    Raises
    ------
    MountedSystemError       If low is not below high, or the stiffness is not finite and > 0.
    """

    low: float
    high: float
    stiffness: float

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise MountedSystemError(
                f"The lower stop must be below the upper one [m], got {self.low!r} and {self.high!r}."
            )
        if not (math.isfinite(self.stiffness) and self.stiffness > 0.0):
            raise MountedSystemError(f"The stiffness of a stop must be finite and > 0 [N/m], got {self.stiffness!r}.")


@dataclass(frozen=True)
class MountAxis:
    """Equal hysteretic springs of a mount that act along one axis, with a damper and bump stops in parallel.

    S springs in series share the displacement d of the mount's axis, P such rows stand side by side: each spring is at
    `nominal` + d/S, and the axis has the force P*r(nominal + d/S) + damping*d'.

    Parameters
    ----------
    spring : SpringParameters
    direction : Vector          In which a motion of the body is a positive displacement; a unit vector.
    nominal : float             Displacement of one spring in the nominal pose [m].
    parallel, series : int      P and S.
    damping : float             Of the viscous damper [N s/m].
    stops : Stops or None
    model : str                 Where the spring comes from, for people.
    rated_load : float          Static force that one spring may carry [N]; infinite where none is stated.
    stated_amplitude : float or None   Of the one loop of which a catalogue states stiffness and damping [m]; None where
                                the spring was identified from records.
    name : str                  What the vendor calls the axis, such as "compression"; empty if nothing is given.
    stated : (str, str)         Catalogue values and the direction of which they are, for people; empty without any.

    Raises
    ------
    MountedSystemError          If a value is out of its bounds.
    """

    spring: SpringParameters
    direction: Vector
    nominal: float
    parallel: int = 1
    series: int = 1
    damping: float = 0.0
    stops: Stops | None = None
    model: str = ""
    rated_load: float = math.inf
    stated_amplitude: float | None = None
    name: str = ""
    stated: tuple[str, str] = ("", "")

    def __post_init__(self) -> None:
        _check_direction(self.direction, "the direction of an axis")
        for name, count in (("parallel", self.parallel), ("series", self.series)):
            if not 1 <= count <= MOST_SPRINGS:
                raise MountedSystemError(
                    f"`{name}` must be a number of springs from 1 to {MOST_SPRINGS}, got {count!r}."
                )
        if not (math.isfinite(self.damping) and self.damping >= 0.0):
            raise MountedSystemError(f"`damping` must be finite and >= 0 [N s/m], got {self.damping!r}.")
        if not self.spring.displacement_min <= self.nominal <= self.spring.displacement_max:
            raise MountedSystemError(
                f"In the nominal pose a spring of {self.model or 'a mount'} is at {1e3 * self.nominal:.6g} mm, outside "
                f"its identified range of {1e3 * self.spring.displacement_min:.6g} to "
                f"{1e3 * self.spring.displacement_max:.6g} mm; use another preload or a record that reaches it."
            )


@dataclass(frozen=True)
class Tolerance:
    """Scatter of mounts of one type about the mount described, each uniform between 1 - share and 1 + share.

    Parameters
    ----------
    stiffness : float     Share of the elastic force FE.
    friction : float      Share of the hysteretic force kappa_omega.
    batch : bool          Whether all mounts of the type are alike; else each is another.

    Raises
    ------
    MountedSystemError    If a share is not within [0, 1).
    """

    stiffness: float
    friction: float
    batch: bool = False

    def __post_init__(self) -> None:
        for name, share in (("stiffness", self.stiffness), ("friction", self.friction)):
            if not 0.0 <= share < 1.0:
                raise MountedSystemError(f"The tolerance of `{name}` must be a share within [0, 1), got {share!r}.")


def scaled(spring: SpringParameters, stiffness: float, friction: float) -> SpringParameters:
    """A spring with its elastic and branch forces times one factor and its hysteretic ones times another, both > 0."""
    return replace(
        spring,
        kE=tuple(stiffness * coefficient for coefficient in spring.kE),
        FE_forces=tuple(stiffness * force for force in spring.FE_forces),
        kappa_omega=friction * spring.kappa_omega,
        second=spring.second and replace(spring.second, kappa_omega=friction * spring.second.kappa_omega),
        branches=tuple(replace(branch, stiffness=stiffness * branch.stiffness) for branch in spring.branches),
    )


@dataclass(frozen=True)
class Mount:
    """A mount: one to three axes between a body and the base or another body.

    Parameters
    ----------
    name : str
    body : int                     Number of the body it carries.
    place : Vector                 Where it acts, in the nominal pose [m].
    axes : tuple of MountAxis
    support : int                  Number of the body it stands on, or BASE.
    type_name : str                Of its mount type; "" if it has none.
    tolerance : Tolerance or None  Scatter from mount to mount; None if none is stated.

    Raises
    ------
    MountedSystemError             If there are no axes or more than three, or they are not perpendicular.
    """

    name: str
    body: int
    place: Vector
    axes: tuple[MountAxis, ...]
    support: int = BASE
    type_name: str = ""
    tolerance: Tolerance | None = None

    def __post_init__(self) -> None:
        _check_place(self.place, f"the place of mount {self.name}")
        if not 1 <= len(self.axes) <= 3:
            raise MountedSystemError(f"Mount {self.name} must have one to three axes, got {len(self.axes)}.")
        directions = np.array([axis.direction for axis in self.axes])
        if np.abs(directions @ directions.T - np.eye(len(directions))).max() > 1e-6:
            raise MountedSystemError(f"The axes of mount {self.name} must be perpendicular to each other.")

    @property
    def axis_labels(self) -> list[str]:
        """What tells its axes apart: the name that each was given, else its direction, or both."""
        directions = [direction_words(axis.direction) for axis in self.axes]
        labels = [axis.name or words for axis, words in zip(self.axes, directions, strict=True)]
        counts = Counter(labels)
        return [
            label if counts[label] == 1 else f"{label} {words}" for label, words in zip(labels, directions, strict=True)
        ]

    @property
    def axis_names(self) -> list[str]:
        """Its own name, where it has several axes followed by the label of each.

        Examples
        --------
        >>> from strandspring.vibration.description.system_file import load_system_file
        >>> from strandspring.examples.system_models import SYSTEMS
        >>> load_system_file(SYSTEMS / "electronics_box.toml").candidates[0][1].mounts[3].axis_names
        ['corner 4 compression', 'corner 4 shear', 'corner 4 roll']
        """
        return [self.name] if len(self.axes) == 1 else [f"{self.name} {label}" for label in self.axis_labels]


@dataclass(frozen=True)
class Point:
    """A point of a body whose motion is asked for.

    Parameters
    ----------
    name : str
    body : int
    place : Vector      In the nominal pose [m].
    """

    name: str
    body: int
    place: Vector

    def __post_init__(self) -> None:
        _check_place(self.place, f"the place of point {self.name}")


def direction_words(direction: Vector) -> str:
    """A direction as "x" or "-z" where it is one of these, else its components.

    Examples
    --------
    >>> direction_words((0.0, 0.0, -1.0)), direction_words((0.6, 0.8, 0.0))
    ('-z', '(0.6, 0.8, 0)')
    """
    components = ", ".join(f"{component:.3g}" for component in (round(part, 9) + 0.0 for part in direction))
    return direction_name(direction) or f"({components})"


def direction_name(direction: Vector) -> str:
    """A direction as "x" or "-z" where it is one of these, else "".

    Examples
    --------
    >>> direction_name((0.0, 0.0, -1.0)), direction_name((0.6, 0.8, 0.0))
    ('-z', '')
    """
    for letter, component in zip("xyz", direction, strict=True):
        if abs(component) > _PARALLEL:
            return letter if component > 0.0 else f"-{letter}"
    return ""


def _check_place(place: Vector, what: str) -> None:
    if not all(abs(coordinate) <= LARGEST_PLACE for coordinate in place):
        raise MountedSystemError(
            f"{what[0].upper()}{what[1:]} must be within +-{LARGEST_PLACE:g} m, got {place!r} m; check its unit, which "
            "may be mm."
        )


def _check_direction(direction: Vector, what: str) -> None:
    length = math.hypot(*direction)
    if not abs(length - 1.0) <= _ROUNDING:
        raise MountedSystemError(
            f"{what[0].upper()}{what[1:]} must be a unit vector, got {direction!r} of length {length!r}."
        )
