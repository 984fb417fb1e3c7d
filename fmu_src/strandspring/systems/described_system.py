"""The tables of SYSTEM.toml as rigid bodies on mounts, one system for each candidate."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from ..kernel.arrays import FloatArray
from ..modelfile import ModelFile
from ..records.units import quoted
from .limits import Limits
from .mounted import (
    BASE,
    MOST_AXES,
    Matrix,
    Motion,
    Mount,
    MountAxis,
    MountedSystem,
    MountedSystemError,
    Point,
    RigidBody,
    Stops,
    Vector,
)
from .nominal import displacement_at
from .system_tables import (
    AxisMotionTable,
    AxisTable,
    BodyTable,
    InertiaTable,
    LimitsTable,
    MountTable,
    MountTypeTable,
    PlaneTable,
    StopsTable,
    SystemTable,
)
from .table_refusals import located
from .table_types import suggestion
from .unheld import unheld_motion

AS_DESCRIBED = "as described"
_MOST_AXES_OF_ALL = 60_000  # of all candidates together

Models = Mapping[str, ModelFile]


def body_number(name: str, bodies: Iterable[RigidBody | BodyTable]) -> int:
    """Number of a body by its name.

    Raises
    ------
    MountedSystemError   If there is none.
    """
    names = [body.name for body in bodies]
    if name not in names:
        raise MountedSystemError(f"{quoted(name)} is not a body; {suggestion(name, names)}")
    return names.index(name)


def model_paths(table: SystemTable) -> dict[str, tuple[str | int, ...]]:
    """Model files of the mount types that some candidate uses, in their order, each with its first field."""
    used = {mount.type for mount in table.mount}
    used |= {new for candidate in table.candidate for old, new in candidate.types.items() if old in used}
    found: dict[str, tuple[str | int, ...]] = {}
    for name, mount_type in table.mount_type.items():
        for k, axis in enumerate(mount_type.axes if name in used else ()):
            found.setdefault(axis.model, ("mount_type", name, "axes", k, "model"))
    return found


def mounted_systems(table: SystemTable, models: Models) -> tuple[tuple[str, MountedSystem], ...]:
    """The candidates by their names.

    Parameters
    ----------
    table : SystemTable
    models : mapping       Content of each file of `model_paths`.

    Raises
    ------
    MountedSystemError     If the tables describe no such system; the message names the field.
    """
    _check_names(table)
    bodies = tuple(_body(k, body) for k, body in enumerate(table.body))
    points = _points(table, bodies)
    build = partial(_axes_of, table=table, models=models, known={})
    if not table.candidate:
        return ((AS_DESCRIBED, _system(table, bodies, points, {}, build, "")),)
    systems, axes = [], 0
    for k, candidate in enumerate(table.candidate):
        for name in (*candidate.types, *candidate.types.values()):
            if name not in table.mount_type:
                with located("candidate", k, "types"):
                    raise MountedSystemError(
                        f"{quoted(name)} is not a mount type; {suggestion(name, list(table.mount_type))}"
                    )
        system = _system(
            table, bodies, points, candidate.types, build, f"candidate[{k + 1}] {quoted(candidate.name)}: "
        )
        systems.append((candidate.name, system))
        axes += sum(len(mount.axes) for mount in system.mounts)
        if axes > _MOST_AXES_OF_ALL:
            raise MountedSystemError(
                f"candidate: all candidates together must have at most {_MOST_AXES_OF_ALL} axes of mounts; split the "
                "file."
            )
    return tuple(systems)


def limits_of(table: LimitsTable, points: Iterable[Point]) -> Limits:
    """The limits, each point with its own.

    Raises
    ------
    MountedSystemError   If a point is not known; the message names the field.
    """
    names = [point.name for point in points]
    by_point = {}
    for key in ("acceleration", "sway"):
        given = getattr(table, key)
        if isinstance(given, dict):
            for name in given:
                if name not in names:
                    with located("limits", key):
                        raise MountedSystemError(f"{quoted(name)} is not a point; {suggestion(name, names)}")
            by_point[key] = given
        else:
            by_point[key] = {} if given is None else dict.fromkeys(names, given)
    return Limits(by_point["acceleration"], by_point["sway"], table.tilt, table.stroke)


def _check_names(table: SystemTable) -> None:
    """Refuse names that stand for two things."""
    points = [point.name for body in table.body for point in body.point]
    points += [body.name for body in table.body if not body.point]
    for field, names in (
        ("body", [body.name for body in table.body]),
        ("body.point", points),
        ("mount", [name for mount in table.mount for name in _names_of_mounts(mount)]),
        ("candidate", [candidate.name for candidate in table.candidate]),
        ("case", [case.name for case in table.case]),
    ):
        name, count = Counter(names).most_common(1)[0] if names else ("", 0)
        if count > 1:
            raise MountedSystemError(f"{field}: {quoted(name)} is the name of {count} of them; give each its own.")
    for k, body in enumerate(table.body):
        if body.name == "base":
            raise MountedSystemError(f"body[{k + 1}].name: 'base' is what mounts stand on; give another name.")


def _names_of_mounts(table: MountTable) -> list[str]:
    """Numbered where there are several places."""
    count = len(table.places or ())
    return [f"{table.name} {number}" for number in range(1, count + 1)] if count > 1 else [table.name]


def _body(k: int, table: BodyTable) -> RigidBody:
    motion, direction = Motion.SIX, (0.0, 0.0, 1.0)
    if isinstance(table.motion, PlaneTable):
        motion, direction = Motion.PLANE, table.motion.plane.vector
    elif isinstance(table.motion, AxisMotionTable):
        motion, direction = Motion.AXIS, table.motion.axis.vector
    with located("body", k):
        return RigidBody(table.name, table.mass, table.center, _inertia(table, motion), motion, direction)


def _inertia(table: BodyTable, motion: Motion) -> Matrix:
    given = table.inertia
    if isinstance(given, InertiaTable):
        return (
            (given.xx, given.xy, given.xz),
            (given.xy, given.yy, given.yz),
            (given.xz, given.yz, given.zz),
        )
    if given is None and motion is not Motion.AXIS:
        raise MountedSystemError(
            "must have `inertia`, or `motion` along an axis; add { xx = ..., yy = ..., zz = ... }."
        )
    if given is not None and motion is Motion.SIX:
        raise MountedSystemError(
            "`inertia` must have xx, yy and zz for motion in six degrees of freedom, got one moment."
        )
    moment = given or 0.0
    return (moment, 0.0, 0.0), (0.0, moment, 0.0), (0.0, 0.0, moment)


def _points(table: SystemTable, bodies: tuple[RigidBody, ...]) -> tuple[Point, ...]:
    """Points of interest; a body without any has its centre of gravity under its own name."""
    points = []
    for k, (of_body, body) in enumerate(zip(table.body, bodies, strict=True)):
        if not of_body.point:
            points.append(Point(body.name, k, body.center))
        for number, point in enumerate(of_body.point):
            with located("body", k, "point", number):
                points.append(Point(point.name, k, point.place))
    return tuple(points)


def _system(
    table: SystemTable,
    bodies: tuple[RigidBody, ...],
    points: tuple[Point, ...],
    replaced: Mapping[str, str],
    axes_of: Callable[[str, tuple[float, ...]], tuple[MountAxis, ...]],
    where: str,
) -> MountedSystem:
    mounts: list[Mount] = []
    for k, mount in enumerate(table.mount):
        mounts += _mounts(k, mount, table, replaced, axes_of)
        if sum(len(each.axes) for each in mounts) > MOST_AXES:
            raise MountedSystemError(f"mount: all mounts together must have at most {MOST_AXES} axes; take some out.")
    with located("mount"):
        system = MountedSystem(bodies, tuple(mounts), points, table.gravity, table.name)
    if sentence := unheld_motion(system):
        raise MountedSystemError(f"{where or 'mount: '}{sentence}")
    return system


def _mounts(
    k: int,
    table: MountTable,
    whole: SystemTable,
    replaced: Mapping[str, str],
    axes_of: Callable[[str, tuple[float, ...]], tuple[MountAxis, ...]],
) -> list[Mount]:
    """The mounts of one table, one for each place."""
    if table.type not in whole.mount_type:
        with located("mount", k, "type"):
            raise MountedSystemError(
                f"{quoted(table.type)} is not a mount type; {suggestion(table.type, list(whole.mount_type))}"
            )
    with located("mount", k, "body"):
        if table.body is None and len(whole.body) > 1:
            raise MountedSystemError(
                "must be given where there are several bodies; name the one that the mount carries."
            )
        body = 0 if table.body is None else body_number(table.body, whole.body)
    with located("mount", k, "on"):
        support = BASE if table.on == "base" else body_number(table.on, whole.body)
        if support == body:
            raise MountedSystemError(f"must be 'base' or another body than {quoted(whole.body[body].name)}.")
    with located("mount", k):
        if (table.place is None) == (table.places is None):
            raise MountedSystemError("must have either `place` or `places`; give one of them.")
        places = [table.place] if table.places is None else table.places
        rotations = table.rotate if isinstance(table.rotate, list) else [table.rotate] * len(places)
        if len(rotations) != len(places):
            raise MountedSystemError(
                f"`rotate` must be one rotation or one for each of the {len(places)} places, got {len(rotations)}."
            )
    name = replaced.get(table.type, table.type)
    found = []
    for own, place, rotation in zip(_names_of_mounts(table), places, rotations, strict=True):
        turn = () if rotation is None else tuple(rotation.angle * each for each in rotation.about.vector)
        axes = axes_of(name, turn)
        with located("mount", k):
            found.append(Mount(own, body, place or (0.0, 0.0, 0.0), axes, support))
    return found


def _axes_of(
    name: str,
    turn: tuple[float, ...],
    *,
    table: SystemTable,
    models: Models,
    known: dict[tuple[str, tuple[float, ...]], tuple[MountAxis, ...]],
) -> tuple[MountAxis, ...]:
    """The axes of a mount type, rotated by a rotation vector [rad], () for none."""
    if (name, turn) not in known:
        if not turn:
            known[name, turn] = _unrotated(name, table.mount_type[name], models)
        else:
            rotation = Rotation.from_rotvec(turn)
            known[name, turn] = tuple(
                replace(axis, direction=_vector(rotation.apply(axis.direction)))
                for axis in _axes_of(name, (), table=table, models=models, known=known)
            )
    return known[name, turn]


def _unrotated(name: str, table: MountTypeTable, models: Models) -> tuple[MountAxis, ...]:
    axes = []
    for k, axis in enumerate(table.axes):
        with located("mount_type", name, "axes", k):
            axes.append(_axis(axis, models[axis.model]))
    directions = np.array([axis.direction for axis in axes])
    if np.abs(directions @ directions.T - np.eye(len(axes))).max() > 1e-6:
        raise MountedSystemError(
            f"mount_type.{name}.axes: must be perpendicular to each other; they belong to one frame, which `rotate` "
            "turns as a whole."
        )
    return tuple(axes)


def _axis(table: AxisTable, model: ModelFile) -> MountAxis:
    spring = model.parameters
    if table.nominal is not None and table.preload is not None:
        raise MountedSystemError("must have either `preload` or `nominal`, got both; leave one out.")
    if table.nominal is not None:
        nominal = table.nominal
    else:
        nominal = displacement_at(spring, table.preload or 0.0, table.preload is not None)
    return MountAxis(
        spring,
        table.direction.vector,
        nominal,
        table.parallel,
        table.series,
        table.damping,
        None if table.stops is None else _stops(table.stops, nominal),
        table.model,
    )


def _stops(table: StopsTable, nominal: float) -> Stops:
    if table.low is None and table.high is None:
        raise MountedSystemError("`stops` must have `low` or `high`; give one, or leave the stops out.")
    low = -math.inf if table.low is None else table.low
    high = math.inf if table.high is None else table.high
    if not low <= nominal <= high:
        raise MountedSystemError(
            f"the nominal displacement of {1e3 * nominal:.6g} mm must be between the stops, "
            f"{1e3 * low:.6g} and {1e3 * high:.6g} mm, displacements of one spring as its model counts; correct "
            "them."
        )
    return Stops(low, high, table.stiffness)


def _vector(values: FloatArray) -> Vector:
    length = math.hypot(*values.tolist())
    x, y, z = (each / length for each in values.tolist())
    return x, y, z
