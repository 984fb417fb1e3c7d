"""The variables of the FMU of a system, in the order of their value references (c/system_instance.h)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.variables import FmiUnit, Variable, units
from ...errors import MountedSystemError
from ...ground.gravity import STANDARD_GRAVITY
from ...ground.quoting import printable
from ...kernel.arrays import FloatArray
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.parts import RigidBody, Vector, direction_name

LEAST_STEP = 1e-12  # [s]
LARGEST_GRAVITY = 1e4  # [m/s^2]
MOST_FORCES = 61  # beside three accelerations of the base
_DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_LONGEST = 32  # part of a name that comes from the system's
_HELD = 1e-9  # of a unit vector

_UNITS = (
    *(unit for unit in units(1, 1) if unit.name in ("1", "m", "N", "J")),
    FmiUnit("rad", rad=1, displayed=(("deg", math.degrees(1.0)),)),
    FmiUnit("s", s=1, displayed=(("ms", 1e3),)),
    FmiUnit("m/s^2", m=1, s=-2, displayed=(("g", 1.0 / STANDARD_GRAVITY),)),
)


@dataclass(frozen=True)
class ForceInput:
    """A force on a body, as an input.

    Parameters
    ----------
    name : str
    body : int
    place : Vector        Where it acts, in the nominal pose [m]; turns with the body.
    direction : Vector    A unit vector; turns with the body.
    """

    name: str
    body: int
    place: Vector
    direction: Vector


@dataclass(frozen=True)
class SystemFmuOptions:
    """How the FMU of a system integrates, and what it takes besides accelerations of the base.

    Parameters
    ----------
    step : float                   Start value of `step`, its largest internal step [s].
    largest_step : float           The largest step that is stable [s].
    omega_start : float            Of all springs at rest, in the direction of their static forces [-1, 1].
    forces : tuple of ForceInput
    author : str
    fmi : int                      Version of FMI, 2 or 3.

    Raises
    ------
    MountedSystemError             If a value is out of its bounds.
    """

    step: float
    largest_step: float
    omega_start: float = 0.0
    forces: tuple[ForceInput, ...] = ()
    author: str = ""
    fmi: int = 2

    def __post_init__(self) -> None:
        if not LEAST_STEP <= self.step <= self.largest_step < np.inf:
            raise MountedSystemError(
                f"`step` must be within [{LEAST_STEP:g}, {self.largest_step:.6g}] s, the largest step that is stable, "
                f"got {self.step!r}."
            )
        if not -1.0 <= self.omega_start <= 1.0:
            raise MountedSystemError(f"`omega_start` must be within [-1, 1], got {self.omega_start!r}.")
        if self.fmi not in (2, 3):
            raise MountedSystemError(f"The version of FMI must be 2 or 3, got {self.fmi!r}.")
        if len(self.forces) > MOST_FORCES:
            raise MountedSystemError(
                f"An FMU can have at most {MOST_FORCES} forces on bodies, got {len(self.forces)}; take some out."
            )


def base_directions(system: MountedSystem) -> tuple[str, ...]:
    """Those of x, y and z along which some body is free to move."""
    return tuple(
        name
        for name, direction in _DIRECTIONS.items()
        if any(np.abs(body.translations @ direction).max() > _HELD for body in system.bodies)
    )


def base_vectors(system: MountedSystem) -> FloatArray:
    """The same as unit vectors, shape (D, 3)."""
    return np.array([_DIRECTIONS[name] for name in base_directions(system)]).reshape(-1, 3)


def system_variables(system: MountedSystem, options: SystemFmuOptions) -> tuple[Variable, ...]:
    """The table of variables."""
    load_names = unique_names(force.name for force in options.forces)
    loads = [f"load_{name}" for name in load_names]
    parameters = tuple(_parameters(options.largest_step))
    of_rest = tuple(parameter.name for parameter in parameters if parameter.name != "step")
    points = list(zip(unique_names(point.name for point in system.points), system.points, strict=True))
    axes = list(_axes(system))
    return (
        Variable(
            "extrapolating", "local", "discrete",
            "True while a spring is outside its identified range, where its force is extrapolated, or was within the "
            "last step",
            initial="calculated",
        ),
        *(
            Variable(f"base_acceleration_{name}", "input", "continuous", f"Acceleration of the base along {name}",
                     "m/s^2", "g")
            for name in base_directions(system)
        ),
        *(
            Variable(
                name, "input", "continuous",
                f"Force on {_named(system.bodies[force.body])}: {printable(force.name)}", "N", "kN",
            )
            for name, force in zip(loads, options.forces, strict=True)
        ),
        *(
            _output(
                f"acceleration_{name}_{direction}",
                f"Absolute acceleration of {printable(point.name)} along {direction}", "m/s^2", "g", of_rest,
                (*_held_inputs(system, point.body, direction),
                 *(load for load, force in zip(loads, options.forces, strict=True) if force.body == point.body)),
            )
            for name, point in points
            for direction in _DIRECTIONS
        ),
        *(
            _output(f"sway_{name}_{direction}",
                    f"Displacement of {printable(point.name)} relative to the base along {direction}, from static "
                    "equilibrium", "m", "mm", of_rest)
            for name, point in points
            for direction in _DIRECTIONS
        ),
        *(
            _output(f"force_{name}", f"Force of {text}, with damper and stops", "N", "kN", of_rest)
            for name, text in axes
        ),
        *(
            _output(f"displacement_{name}", f"Displacement of one spring of {text}, as its model counts", "m", "mm",
                    of_rest)
            for name, text in axes
        ),
        *(
            _output(f"tilt_{name}", f"Angle by which {_named(body)} is turned relative to the base, from static "
                    "equilibrium", "rad", "deg", of_rest)
            for name, body in zip(unique_names(body.name for body in system.bodies), system.bodies, strict=True)
        ),
        *(
            _output(f"reaction_{direction}", f"Force of all mounts on the base along {direction}, with dampers and "
                    "stops", "N", "kN", of_rest)
            for direction in _DIRECTIONS
        ),
        _output("absorbed_energy", "Energy absorbed by all springs since initialization", "J", None, ()),
        *parameters,
    )  # fmt: skip


def system_units() -> tuple[FmiUnit, ...]:
    """The units that the table uses."""
    return _UNITS


def system_start_values(system: MountedSystem, options: SystemFmuOptions) -> dict[str, float]:
    """Start value of each input and parameter, by name."""
    inputs = [v.name for v in system_variables(system, options) if v.causality == "input"]
    gravity = {f"gravity_{name}": value for name, value in zip(_DIRECTIONS, system.gravity, strict=True)}
    return {**dict.fromkeys(inputs, 0.0), "step": options.step, "omega_start": options.omega_start, **gravity}


def unique_names(texts: Iterable[str], longest: int = _LONGEST, others: str = "") -> list[str]:
    """Names of letters, digits, underscores and other signs for texts, all different, of about so many characters."""
    names: list[str] = []
    for text in texts:
        name = re.sub(rf"[^A-Za-z0-9{others}]+", "_", text).strip("_")[:longest].rstrip("_") or "unnamed"
        number, chosen = 1, name
        while chosen in names:
            number += 1
            chosen = f"{name}_{number}"
        names.append(chosen)
    return names


def _held_inputs(system: MountedSystem, body: int, direction: str) -> tuple[str, ...]:
    """Accelerations of the base that a body takes part in along a direction, since it is held there."""
    held = np.eye(3) - system.bodies[body].translations
    row = held[list(_DIRECTIONS).index(direction)]
    return tuple(
        f"base_acceleration_{name}"
        for name, share in zip(_DIRECTIONS, row.tolist(), strict=True)
        if abs(share) > _HELD and name in base_directions(system)
    )


def _axes(system: MountedSystem) -> Iterator[tuple[str, str]]:
    """Name and text of each axis of a mount."""
    mounts = unique_names(mount.name for mount in system.mounts)
    names = unique_names(
        (
            f"{name} {label if axis.name or direction_name(axis.direction) else number}"
            for name, mount in zip(mounts, system.mounts, strict=True)
            for number, (axis, label) in enumerate(zip(mount.axes, mount.axis_labels, strict=True), start=1)
        ),
        2 * _LONGEST,
    )
    for name, text, axis in zip(names, system.axis_names, system.axes, strict=True):
        along = ", ".join(f"{component:.6g}" for component in axis.direction)
        yield name, f"{printable(text)}, along ({along})"


def _parameters(largest_step: float) -> Iterator[Variable]:
    bounds: Sequence[tuple[str, str, str, str | None, float, float]] = (
        ("step", "Largest step of the time integration; steps of co-simulation are cut into equal ones", "s", "ms",
         LEAST_STEP, largest_step),
        ("omega_start", "omega of all springs at rest, in the direction of their static forces; it is unknown, -1, 0 "
         "and 1 are its extremes", "1", None, -1.0, 1.0),
        *((f"gravity_{name}", f"Gravity along {name}", "m/s^2", "g", -LARGEST_GRAVITY, LARGEST_GRAVITY)
          for name in _DIRECTIONS),
    )  # fmt: skip
    for name, text, unit, display_unit, low, high in bounds:
        yield Variable(name, "parameter", "fixed", text, unit, display_unit, "exact", low, high)


def _output(
    name: str, text: str, unit: str, display_unit: str | None, of_rest: tuple[str, ...], inputs: tuple[str, ...] = ()
) -> Variable:
    return Variable(
        name, "output", "continuous", text, unit, display_unit, "calculated",
        depends_on=inputs, starts_from=(*inputs, *of_rest),
    )  # fmt: skip


def _named(body: RigidBody) -> str:
    return printable(body.name)
