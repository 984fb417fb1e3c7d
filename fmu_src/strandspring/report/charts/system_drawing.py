"""Drawings of a system to scale: bodies, mounts, points, gravity and the directions of loads from three sides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray
from ...vibration.bodies.loads import ChannelKind, LoadCase
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.parts import BASE, MotionKind, RigidBody
from ..content.blocks import Block, Gallery, Text
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, joined
from ..content.quantities import MM, number

_STYLES = (ChartForm.LINE, ChartForm.DASHED, ChartForm.DOTTED)
_NO_SIZE = 0.05  # half the size of a system whose parts are all in one place [m]
_THIN = 0.12  # least half size of a view, of the largest
_AXIS, _ARROW = 0.18, 0.3  # lengths of axes of mounts and of arrows, of the largest half size
_IN_PLANE = 0.3  # least share of a direction that a view shows
_TURNING = ChannelKind.BASE_ANGULAR_VELOCITY
_VIEWS = {"top": (0, 1), "front": (0, 2), "side": (1, 2)}  # coordinates to the right and up


def system_drawing(system: MountedSystem, cases: Sequence[LoadCase]) -> Iterator[Block]:
    """The system in its nominal pose, and along which directions the load cases act."""
    boxes = {body.name: _box(body) for body in system.bodies}
    places = [body.center for body in system.bodies] + [mount.place for mount in system.mounts]
    places += [point.place for point in system.points]
    everything = np.concatenate([*(box for box in boxes.values() if box is not None), np.array(places)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    half = 0.5 * (high - low)
    size = float(half.max()) or _NO_SIZE
    corners = 0.5 * (low + high) + np.array([[-1.0], [1.0]]) * np.maximum(half, _THIN * size)
    charts = []
    for name, plane in _VIEWS.items():
        view = _View(plane, corners[:, plane], size)
        traces = (*_bodies(system, boxes, view), *_mounts(system, view), *_arrows(system, cases, view))
        right, up = ("xyz"[axis] for axis in plane)
        sentence = f"To scale, {right} to the right and {up} up."
        charts.append(
            Chart(f"system-{name}", f"{name.capitalize()} view", Axis(right, MM), Axis(up, MM), traces, sentence,
                  is_drawing=True)
        )  # fmt: skip
    yield Gallery(tuple(charts))
    yield Text(_explained([name for name, box in boxes.items() if box is None], cases))


def _explained(sizeless: Sequence[str], cases: Sequence[LoadCase]) -> str:
    """What the drawings show and what they leave out."""
    unknown = f"; no inertia gives the size of {', '.join(sizeless)}" if sizeless else ""
    text = (
        "The nominal pose. Outlines are uniform cuboids of the mass and inertia of each body, not its housing"
        f"{unknown}. Each axis of a mount is drawn from its place to where a motion of the body is positive; loads "
        "point along the acceleration of the base or the force."
    )
    turning = [case.name for case in cases if any(channel.kind is _TURNING for channel in case.channels)]
    return f"{text} The base turns in {', '.join(turning)}, which is not drawn." if turning else text


@dataclass(frozen=True)
class _View:
    """One side: its two coordinates, two corners of what is in it [m], and the largest half size of the system [m]."""

    plane: tuple[int, int]
    corners: FloatArray
    size: float

    def lines(
        self, name: str, pieces: Sequence[FloatArray], role: Role, form: ChartForm = ChartForm.LINE
    ) -> Iterator[Trace]:
        """Polylines [m] of two or three coordinates, shape (K, 2 or 3) each."""
        if pieces:
            flat = [MM.factor * (piece if piece.shape[1] == 2 else piece[:, self.plane]) for piece in pieces]
            x, y, _ = joined([(piece[:, 0], piece[:, 1]) for piece in flat])
            yield Trace(name, x, y, role, form)

    def marks(self, name: str, places: Mapping[str, Sequence[float] | FloatArray], role: Role) -> Iterator[Trace]:
        """Named places [m] of three coordinates."""
        if places:
            x, y = MM.factor * np.array(list(places.values()))[:, self.plane].T
            yield Trace(name, x, y, role, ChartForm.MARKS, texts=tuple(places))


def _box(body: RigidBody) -> FloatArray | None:
    """Corners of the uniform cuboid with the mass and inertia of a body, shape (8, 3) [m]; None if that is unknown."""
    if body.motion is not MotionKind.SIX:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia))
    # A moment is m/12 times the sum of the squares of the other two edges.
    edges = np.sqrt(np.maximum(6.0 / body.mass * (moments.sum() - 2.0 * moments), 0.0))
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return np.asarray(np.array(body.center) + (signs * edges) @ axes.T)


def _bodies(system: MountedSystem, boxes: Mapping[str, FloatArray | None], view: _View) -> Iterator[Trace]:
    # Corners that differ in one sign are joined by an edge.
    edges = [(a, b) for a, b in itertools.combinations(range(8), 2) if (a ^ b).bit_count() == 1]
    outlines = [box[[a, b]] for box in boxes.values() if box is not None for a, b in edges]
    yield from view.lines("body", outlines, Role.REFERENCE)
    yield from view.marks("centre of gravity", {body.name: body.center for body in system.bodies}, Role.MEASURED)
    points = {point.name: point.place for point in system.points if point.name not in boxes}
    yield from view.marks("point", points, Role.FIRST)


def _mounts(system: MountedSystem, view: _View) -> Iterator[Trace]:
    axes: dict[str, list[FloatArray]] = {}
    for mount in system.mounts:
        for axis, label in zip(mount.axes, mount.axis_labels, strict=True):
            ends = np.array(mount.place) + np.array([[0.0], [_AXIS * view.size]]) * np.array(axis.direction)
            axes.setdefault(f"axis: {label}" if axis.name else "axis", []).append(ends)
    for k, (name, pieces) in enumerate(axes.items()):
        yield from view.lines(name, pieces, Role.SECOND, _STYLES[k % len(_STYLES)])
    for name, role, is_on_base in (("mount on the base", Role.SECOND, True), ("mount on a body", Role.THIRD, False)):
        places = {mount.name: mount.place for mount in system.mounts if (mount.support == BASE) is is_on_base}
        yield from view.marks(name, places, role)


def _load_directions(cases: Sequence[LoadCase]) -> dict[tuple[float, ...], list[str]]:
    """Names of the cases by the directions of accelerations of the base, of forces, and of impacts."""
    directions: dict[tuple[float, ...], list[str]] = {}
    for case in cases:
        vectors = [channel.direction for channel in case.channels if channel.kind is not _TURNING]
        if any(case.velocity):
            vectors.append(tuple((-np.array(case.velocity) / math.hypot(*case.velocity)).tolist()))
        for vector in vectors:
            names = directions.setdefault(tuple(round(part, 6) + 0.0 for part in vector), [])
            if case.name not in names:
                names.append(case.name)
    return directions


def _arrows(system: MountedSystem, cases: Sequence[LoadCase], view: _View) -> Iterator[Trace]:
    """Arrows of loads towards the system from outside, and of gravity beside it."""
    middle, half = view.corners.mean(axis=0), 0.5 * np.ptp(view.corners, axis=0)
    loads, names, tails = [], [], []
    for direction, of_cases in _load_directions(cases).items():
        along = np.array(direction)[[*view.plane]]
        if (length := math.hypot(*along.tolist())) >= _IN_PLANE:
            reach = float(np.min(half / np.maximum(np.abs(along), 1e-12))) + 0.12 * view.size / length
            tails.append(middle - (reach + _ARROW * view.size) * along)
            loads += _arrow(tails[-1], middle - reach * along)
            names.append(", ".join(of_cases))
    yield from view.lines("direction of a load", loads, Role.LOAD)
    if tails:
        x, y = MM.factor * np.array(tails).T
        yield Trace("", x, y, Role.LOAD, ChartForm.DOTS, texts=tuple(names))
    strength = math.hypot(*system.gravity)
    along = np.array(system.gravity)[[*view.plane]] / (strength or 1.0)
    if math.hypot(*along.tolist()) >= _IN_PLANE:
        corner = view.corners[1] + 0.1 * view.size
        arrow = _arrow(corner, corner + _ARROW * view.size * along)
        yield from view.lines(f"gravity, {number(strength / STANDARD_GRAVITY, 3)} g", arrow, Role.THIRD)


def _arrow(tail: FloatArray, tip: FloatArray) -> list[FloatArray]:
    back = 0.3 * (tail - tip)
    side = 0.4 * np.array([-back[1], back[0]])
    return [np.array([tail, tip]), np.array([tip + back + side, tip, tip + back - side])]
