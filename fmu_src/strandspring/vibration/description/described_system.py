"""The tables of SYSTEM.toml as rigid bodies on mounts, one system for each candidate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import partial

from ...errors import MountedSystemError
from ...ground.quoting import quoted
from ...ground.tables import suggestion
from ..bodies.mounted import MOST_AXES, MountedSystem
from ..bodies.parts import BASE, Matrix, MotionKind, Mount, MountAxis, Point, RigidBody, Tolerance
from ..signals.shock_spectra import RequiredSpectrum
from ..verdicts.verdicts import FigureKind, Limits
from .case_tables import SpectrumTable
from .described_mounts import Models, rotated_axes
from .described_vibration import required_spectrum
from .system_tables import (
    AxisMotionTable,
    BodyTable,
    InertiaTable,
    LimitsTable,
    MountTable,
    PlaneTable,
    SystemTable,
)
from .table_types import located
from .unheld import unheld_motion

AS_DESCRIBED = "as described"
_MOST_AXES_OF_ALL = 60_000  # of all candidates together


def body_number(name: str, bodies: Iterable[RigidBody | BodyTable]) -> int:
    """Number of a body by its name.

    Raises
    ------
    MountedSystemError   If there is none.
    """
    names = [body.name for body in bodies]
    if name not in names:
        raise MountedSystemError(f"{quoted(name)} is not a body; {suggestion(name, names)}.")
    return names.index(name)


def model_paths(table: SystemTable) -> dict[str, tuple[str | int, ...]]:
    """Model files of the mount types that some candidate uses, in their order, each with its first field."""
    used = {mount.type for mount in table.mount}
    used |= {new for candidate in table.candidate for old, new in candidate.types.items() if old in used}
    places: dict[str, tuple[str | int, ...]] = {}
    for name, mount_type in table.mount_type.items():
        for k, axis in enumerate(mount_type.axes if name in used else ()):
            if axis.model is not None:
                places.setdefault(axis.model, ("mount_type", name, "axes", k, "model"))
    return places


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
    build = partial(rotated_axes, table=table, models=models, known={})
    if not table.candidate:
        return ((AS_DESCRIBED, _system(table, bodies, points, {}, build, "")),)
    systems, axes = [], 0
    for k, candidate in enumerate(table.candidate):
        for name in (*candidate.types, *candidate.types.values()):
            if name not in table.mount_type:
                with located("candidate", k, "types"):
                    raise MountedSystemError(
                        f"{quoted(name)} is not a mount type; {suggestion(name, list(table.mount_type))}."
                    )
        system = _system(table, bodies, points, candidate.types, build, f"candidate {quoted(candidate.name)}: ")
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
    of_kind: dict[FigureKind, dict[str, float]] = {}
    of_all: dict[FigureKind, float] = {}
    spectra: dict[str, RequiredSpectrum] = {}
    for kind in FigureKind:
        given = getattr(table, kind.name.lower()) if kind.name.lower() in table.model_fields_set else None
        if isinstance(given, dict):
            for name in given:
                if name not in names:
                    with located("limits", kind.name.lower()):
                        raise MountedSystemError(f"{quoted(name)} is not a point; {suggestion(name, names)}.")
        if kind is FigureKind.SRS and given is not None:
            spectra = _spectra(given if isinstance(given, dict) else dict.fromkeys(names, given))
            of_kind[kind] = dict.fromkeys(spectra, 1.0)
        elif isinstance(given, dict):
            of_kind[kind] = given
        elif given is not None:
            of_all[kind] = given
    return Limits(of_kind, of_all, spectra)


def _spectra(tables: Mapping[str, SpectrumTable]) -> dict[str, RequiredSpectrum]:
    with located("limits", "srs"):
        spectra = {name: required_spectrum(table) for name, table in tables.items()}
        if len({required.quality for required in spectra.values()}) > 1:
            raise MountedSystemError("must have the same `q` at all points; give one.")
    return spectra


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
    motion, direction = MotionKind.SIX, (0.0, 0.0, 1.0)
    if isinstance(table.motion, PlaneTable):
        motion, direction = MotionKind.PLANE, table.motion.plane.vector
    elif isinstance(table.motion, AxisMotionTable):
        motion, direction = MotionKind.AXIS, table.motion.axis.vector
    with located("body", k):
        return RigidBody(table.name, table.mass, table.center, _inertia(table, motion), motion, direction)


def _inertia(table: BodyTable, motion: MotionKind) -> Matrix:
    given = table.inertia
    if isinstance(given, InertiaTable):
        return (
            (given.xx, given.xy, given.xz),
            (given.xy, given.yy, given.yz),
            (given.xz, given.yz, given.zz),
        )
    if given is None and motion is not MotionKind.AXIS:
        raise MountedSystemError(
            "must have `inertia`, or `motion` along an axis; add { xx = ..., yy = ..., zz = ... }."
        )
    if given is not None and motion is MotionKind.SIX:
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
        if sum(len(mount_of_system.axes) for mount_of_system in mounts) > MOST_AXES:
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
                f"{quoted(table.type)} is not a mount type; {suggestion(table.type, list(whole.mount_type))}."
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
    scatter = whole.mount_type[name].tolerance
    tolerance = Tolerance(scatter.stiffness, scatter.friction, scatter.batch) if scatter else None
    mounts = []
    for mount_name, place, rotation in zip(_names_of_mounts(table), places, rotations, strict=True):
        turn = () if rotation is None else tuple(rotation.angle * component for component in rotation.about.vector)
        axes = axes_of(name, turn)
        with located("mount", k):
            mounts.append(Mount(mount_name, body, place or (0.0, 0.0, 0.0), axes, support, name, tolerance))
    return mounts
