"""Tables of a simulation's report: what was read, and where the system rests."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ..core.spline import Elastic
from ..ground.gravity import STANDARD_GRAVITY
from ..vibration.bodies.loads import LoadCase
from ..vibration.bodies.parts import BASE, MotionKind, MountAxis, RigidBody, Vector, direction_words
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ..vibration.verdicts.static_answer import SECANT_SHARE
from ..vibration.verdicts.verdicts import FigureKind
from .content.blocks import Block, Facts, Level, Notice, Text, first_rows
from .content.quantities import number, percent, prose

_MOST_MODES = 12
_NOTHING = 1e-9  # of rounding, in display units


def inputs(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], cases: Sequence[LoadCase], source: str
) -> Iterator[Block]:
    """What was read: bodies, points, mounts, limits and load cases."""
    system = candidates[0].system
    gravity = [number(part / STANDARD_GRAVITY, 4) for part in system.gravity]
    yield Facts((("File", source), ("Gravity", f"({', '.join(gravity)}) g")))
    bodies = [
        (body.name, number(body.mass), _place(body.center), *_inertia(body), _motion(body)) for body in system.bodies
    ]
    header = ("body", "mass [kg]", "centre of gravity [mm]", "Ixx, Iyy, Izz [kg m²]", "Ixy, Ixz, Iyz [kg m²]", "motion")
    yield from first_rows("Bodies", header, bodies)
    points = [(point.name, system.bodies[point.body].name, _place(point.place)) for point in system.points]
    yield from first_rows("Points", ("point", "body", "place [mm]"), points)
    yield from _mounts(candidates)
    yield from _limits(answers)
    rows = [(case.name, case.text or case.kind, f"{number(case.duration)} s") for case in cases]
    yield from first_rows("Load cases", ("case", "load", "simulated"), rows)


def _place(place: Vector) -> str:
    return ", ".join(tiny(1e3 * part) for part in place)


def _inertia(body: RigidBody) -> tuple[str, str]:
    if body.motion is MotionKind.AXIS:
        return "–", "–"
    inertia = np.array(body.inertia)
    if body.motion is MotionKind.PLANE:
        direction = np.array(body.direction)
        return f"{number(float(direction @ inertia @ direction))} about the normal", "–"
    products = [tiny(float(inertia[at])) for at in ((0, 1), (0, 2), (1, 2))]
    return ", ".join(number(part) for part in np.diag(inertia).tolist()), ", ".join(products)


def _motion(body: RigidBody) -> str:
    if body.motion is MotionKind.SIX:
        return "six degrees of freedom"
    along = direction_words(body.direction)
    return f"along {along}" if body.motion is MotionKind.AXIS else f"in the plane with the normal {along}"


def _mounts(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    axes: dict[tuple[str, ...], None] = {}
    mounts: dict[tuple[str, ...], dict[str, None]] = {}
    if len(candidates) > 1:
        types = [
            (candidate.name, ", ".join(dict.fromkeys(mount.type_name for mount in candidate.system.mounts)))
            for candidate in candidates
        ]
        yield from first_rows("Candidates", ("candidate", "mount types"), types)
    for candidate in candidates:
        system = candidate.system
        for mount in system.mounts:
            support = "base" if mount.support == BASE else system.bodies[mount.support].name
            body = system.bodies[mount.body].name
            mounts.setdefault((mount.name, body, support, _place(mount.place)), {})[mount.type_name] = None
            for label, axis in zip(mount.axis_labels, mount.axes, strict=True):
                axes[(f"{mount.type_name}, {label}", *_axis(axis))] = None
    header = ("mount", "carries", "stands on", "place [mm]", "type")
    rows = [(*mount, " or ".join(types_of_mount)) for mount, types_of_mount in mounts.items()]
    yield from first_rows("Mounts", header, rows)
    of_axes = (
        "type and axis", "direction", "model file", "parallel × series", "preload of a spring [N]",
        "nominal displacement [mm]", "identified range [mm]", "stops [mm]", "damping [N s/m]",
    )  # fmt: skip
    yield from first_rows("Axes of the mount types", of_axes, list(axes))


def _axis(axis: MountAxis) -> tuple[str, ...]:
    spring, stops = axis.spring, "–"
    preload = Elastic(spring).force(axis.nominal - spring.displacement_offset)
    if axis.stops is not None:
        ends = [f"{tiny(1e3 * end)}" for end in (axis.stops.low, axis.stops.high) if math.isfinite(end)]
        stops = f"at {' and '.join(ends)}, {number(1e-3 * axis.stops.stiffness)} N/mm"
    return (
        direction_words(axis.direction),
        axis.model or "–",
        f"{axis.parallel} × {axis.series}",
        tiny(preload),
        tiny(1e3 * axis.nominal),
        f"{tiny(1e3 * spring.displacement_min)} to {tiny(1e3 * spring.displacement_max)}",
        stops,
        tiny(axis.damping),
    )


def _limits(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    tested = answers[0].limits.tested([answer.case for answer in answers if answer.candidate == answers[0].candidate])
    limits: dict[tuple[FigureKind, float], dict[str, None]] = {}
    counts: dict[FigureKind, set[str]] = {}
    for answer in answers:
        for figure in answer.figures:
            counts.setdefault(figure.quantity, set()).add(figure.subject)
            if figure.limit is not None:
                limits.setdefault((figure.quantity, figure.limit), {})[figure.subject] = None
    rows = []
    for (quantity, limit), subjects in limits.items():
        of_all = len(subjects) == len(counts[quantity]) and len(subjects) > 1
        shown = quantity.column.shown.replace("deg", "°")
        rows.append((quantity.value, f"{number(quantity.column.factor * limit)} {shown}",
                     "all" if of_all else ", ".join(subjects), ", ".join(tested.get(quantity, ("all",)))))  # fmt: skip
    rows += [(kind.value, "–", "–", "not tested") for kind, names in tested.items() if not names]
    yield from first_rows("Limits", ("quantity", "at most", "of", "tested by"), rows)
    without = [quantity.value for quantity in counts if not any(of == quantity for of, _ in limits)]
    if without:
        yield Text(f"Without a limit, and only reported: {', '.join(without)}.")


def at_rest(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    """Static poses of the bodies, static load and displacement of each axis of the mounts."""
    poses, loads = [], []
    for candidate in candidates:
        if candidate.static is None:
            yield Notice(Level.POOR, f"{candidate.name}: {prose(candidate.refusal)}")
            continue
        static = candidate.static
        for k, body in enumerate(candidate.system.bodies):
            moved = 1e3 * np.array([pose.displacements[k] for pose in static.poses])
            tilt = np.degrees(static.tilt[:, k])
            poses.append((f"{candidate.name}, {body.name}", *(_range(part) for part in moved.T), _range(tilt)))
        force = np.array([pose.force for pose in static.poses])
        displacement = np.array([pose.displacement for pose in static.poses])
        names = candidate.system.axis_names
        for k, axis in enumerate(candidate.system.axes):
            spring = axis.spring
            moved = axis.series * (displacement[:, k] - axis.nominal)
            down = axis.series * (displacement[:, k] - spring.displacement_min)
            up = axis.series * (spring.displacement_max - displacement[:, k])
            loads.append((f"{candidate.name}, {names[k]}", _range(force[:, k]), _range(1e3 * moved),
                          _range(100.0 * static.places[:, k]), f"{tiny(1e3 * down.min(), 3)} and "
                          f"{tiny(1e3 * up.min(), 3)}"))  # fmt: skip
    if not poses:
        return
    header = ("candidate and body", "x [mm]", "y [mm]", "z [mm]", "tilt [°]")
    yield from first_rows("Static pose from the nominal one", header, poses)
    header = (
        "candidate and axis", "static load [N]", "deflection [mm]", "place in the range [%]",
        "free stroke down and up [mm]",
    )  # fmt: skip
    yield from first_rows("Static load and stroke of each mount", header, loads)
    yield Text(
        "Friction leaves a range of static equilibria. The static load is the force of the axis; deflection is that of "
        "the mount along the axis from its nominal place, positive as its direction. 0 % is the lower end of a "
        "spring's identified range, 100 % its upper end, and the free stroke of the mount ends there."
    )


def natural_modes(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    """Modes of small motion, and of motion by half of the free stroke."""
    share = percent(SECANT_SHARE)
    header = ("mode", "tangent [Hz]", "motion", f"secant at {share} [Hz]", "damping [%]")
    for candidate in candidates:
        if candidate.static is None or not candidate.static.tangent:
            continue
        rows = []
        for k, mode in enumerate(candidate.static.tangent[:_MOST_MODES]):
            secant = candidate.static.secant[k] if candidate.static.secant else None
            of_loops = ("–", "–") if secant is None else (number(secant.frequency), number(100.0 * secant.damping, 2))
            rows.append((str(k + 1), number(mode.frequency), mode.words, *of_loops))
        yield from first_rows(f"Natural modes of {candidate.name}", header, rows)
    yield Text(
        "Tangent: of vanishing motion about the static pose. Secant: with the stiffness and the losses "
        f"of steady loops in which each spring moves by {share} of its way to the nearer end of its identified range."
    )


def _range(values: np.ndarray) -> str:
    low, high = tiny(float(values.min()), 3), tiny(float(values.max()), 3)
    return low if low == high else f"{low} to {high}"


def tiny(value: float, digits: int = 4) -> str:
    """A number, 0 where it is nothing but rounding."""
    return "0" if abs(value) < _NOTHING else number(value, digits)
