"""A drawing of a system to scale: bodies, mounts, points, gravity and the directions of loads, in three views.

Views are arranged as in third-angle projection: the top view above the front view, the side view to its right.
"""

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
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, joined
from ..content.quantities import DisplayUnit, number

_MM = DisplayUnit("mm", 1e3)
_STYLES = (ChartForm.LINE, ChartForm.DASHED, ChartForm.DOTTED)
_NO_SIZE = 0.05  # half the size of a system whose parts are all in one place [m]
_THIN = 0.12  # least half size of a view, of the largest
_GAP, _AXIS, _ARROW = 0.62, 0.18, 0.3  # between views, lengths of axes and of arrows; of the largest half size
_APART = 0.01  # of the drawing, from which marks lie apart
_IN_PLANE = 0.3  # least share of a direction that a view shows
_TURNING = ChannelKind.BASE_ANGULAR_VELOCITY


@dataclass(frozen=True)
class _View:
    """One view: its name, the coordinates to the right and up, and where its middle is in the drawing [mm]."""

    name: str
    right: int
    up: int
    middle: FloatArray
    center: FloatArray

    def seen(self, places: FloatArray) -> FloatArray:
        """Places [m], shape (..., 3), in the drawing, shape (..., 2)."""
        return self.middle + _MM.factor * (places - self.center)[..., [self.right, self.up]]


def system_drawing(system: MountedSystem, cases: Sequence[LoadCase]) -> Chart:
    """The system in its nominal pose, and along which directions the load cases act."""
    boxes = {body.name: _box(body) for body in system.bodies}
    directions = _load_directions(cases)
    corners = [box for box in boxes.values() if box is not None]
    places = [body.center for body in system.bodies]
    places += [mount.place for mount in system.mounts] + [point.place for point in system.points]
    everything = np.concatenate([*corners, np.array(places)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    half = 0.5 * (high - low)
    size = float(half.max()) or _NO_SIZE
    half = np.maximum(half, _THIN * size)
    views = _views(0.5 * (low + high), half, size)
    traces = [*_bodies(system, boxes, views), *_mounts(system, views, size), *_points(system, views)]
    traces += _arrows(system, directions, views, half, size)
    traces += _frame(views, half, size)
    sizeless = [name for name, box in boxes.items() if box is None]
    sentence = (
        "The nominal pose to scale, in third-angle projection. Outlines are uniform cuboids of the mass and inertia of "
        "each body, not its housing"
    )
    sentence += f"; no inertia gives the size of {', '.join(sizeless)}." if sizeless else "."
    sentence += (
        " Each axis of a mount is drawn from its place to where a motion of the body is positive; loads point along "
        "the acceleration of the base or the force."
    )
    if turning := [case.name for case in cases if _turns(case)]:
        sentence += f" The base turns in {', '.join(turning)}, which is not drawn."
    return Chart(
        "system", "The system", Axis("", _MM), Axis("", _MM), tuple(traces), sentence, wide=True, is_drawing=True
    )


def _views(center: FloatArray, half: FloatArray, size: float) -> tuple[_View, ...]:
    across = _MM.factor * (half[0] + half[1] + 2.0 * _GAP * size)
    above = _MM.factor * (half[2] + half[1] + 2.0 * _GAP * size)
    return (
        _View("top", 0, 1, np.array([0.0, above]), center),
        _View("front", 0, 2, np.zeros(2), center),
        _View("side", 1, 2, np.array([across, 0.0]), center),
    )


def _box(body: RigidBody) -> FloatArray | None:
    """Corners of the uniform cuboid with the mass and inertia of a body, shape (8, 3) [m]; None if that is unknown."""
    if body.motion is not MotionKind.SIX:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia))
    # A moment is m/12 times the sum of the squares of the other two edges.
    edges = np.sqrt(np.maximum(6.0 / body.mass * (moments.sum() - 2.0 * moments), 0.0))
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return np.asarray(np.array(body.center) + (signs * edges) @ axes.T)


def _bodies(system: MountedSystem, boxes: Mapping[str, FloatArray | None], views: Sequence[_View]) -> Iterator[Trace]:
    # Corners that differ in one sign are joined by an edge.
    edges = [(a, b) for a, b in itertools.combinations(range(8), 2) if (a ^ b).bit_count() == 1]
    outlines = [view.seen(box)[[a, b]] for view in views for box in boxes.values() if box is not None for a, b in edges]
    if outlines:
        yield _lines("body", outlines, Role.REFERENCE)
    centers = {body.name: np.array(body.center) for body in system.bodies}
    yield from _marks("centre of gravity", centers, views, Role.MEASURED)


def _mounts(system: MountedSystem, views: Sequence[_View], size: float) -> Iterator[Trace]:
    axes: dict[str, list[FloatArray]] = {}
    for mount in system.mounts:
        for axis, label in zip(mount.axes, mount.axis_labels, strict=True):
            ends = np.array(mount.place) + np.array([[0.0], [_AXIS * size]]) * np.array(axis.direction)
            name = f"axis: {label}" if axis.name else "axis"
            axes.setdefault(name, []).extend(view.seen(ends) for view in views)
    for k, (name, pieces) in enumerate(axes.items()):
        yield _lines(name, pieces, Role.SECOND, _STYLES[k % len(_STYLES)])
    for name, role, of_kind in (
        ("mount on the base", Role.SECOND, [mount for mount in system.mounts if mount.support == BASE]),
        ("mount on a body", Role.THIRD, [mount for mount in system.mounts if mount.support != BASE]),
    ):
        if of_kind:
            yield from _marks(name, {mount.name: np.array(mount.place) for mount in of_kind}, views, role)


def _points(system: MountedSystem, views: Sequence[_View]) -> Iterator[Trace]:
    names = {body.name for body in system.bodies}
    points = {point.name: np.array(point.place) for point in system.points if point.name not in names}
    if points:
        yield from _marks("point", points, views, Role.FIRST)


def _marks(name: str, places: Mapping[str, FloatArray], views: Sequence[_View], role: Role) -> Iterator[Trace]:
    """Marks in all views; each name stands once, in the first view in which its mark lies alone if there is one."""
    seen = np.array([view.seen(np.array(list(places.values()))) for view in views])
    x, y = seen.reshape(-1, 2).T
    yield Trace(name, x, y, role, ChartForm.MARKS, texts=tuple(places) * len(views))
    labels = []
    for k in range(len(places)):
        others = np.delete(seen, k, axis=1)
        alone = np.all(np.linalg.norm(others - seen[:, k, None], axis=2) > _APART * np.ptp(seen), axis=1)
        labels.append(seen[int(np.argmax(alone)), k])
    x, y = np.array(labels).T
    yield Trace("", x, y, role, ChartForm.LABELS, texts=tuple(places), labelled=True)


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


def _turns(case: LoadCase) -> bool:
    return any(channel.kind is _TURNING for channel in case.channels)


def _arrows(
    system: MountedSystem,
    directions: Mapping[tuple[float, ...], list[str]],
    views: Sequence[_View],
    half: FloatArray,
    size: float,
) -> Iterator[Trace]:
    """Arrows of loads towards the system from outside, and of gravity beside it."""
    loads, tails, texts = [], [], []
    above = np.array([0.0, 0.1 * _MM.factor * size])
    named: set[tuple[float, ...]] = set()
    for view in views:
        for direction, names in directions.items():
            along = np.array(direction)[[view.right, view.up]]
            length = math.hypot(*along.tolist())
            if length < _IN_PLANE:
                continue
            reach = float(np.min(half[[view.right, view.up]] / np.maximum(np.abs(along), 1e-12)))
            tip = view.middle - _MM.factor * (reach + 0.12 * size / length) * along
            tail = tip - _MM.factor * _ARROW * size * along
            loads += _arrow(tail, tip)
            # Behind the tail of an arrow up or down, else above its middle.
            is_steep = abs(along[1]) > abs(along[0])
            tails.append(tail - _MM.factor * 0.1 * size * along if is_steep else 0.5 * (tail + tip) + above)
            texts.append("" if direction in named else ", ".join(names))
            named.add(direction)
    if loads:
        yield _lines("direction of a load", loads, Role.MODEL)
        x, y = np.array(tails).T
        yield Trace("", x, y, Role.MODEL, ChartForm.LABELS, texts=tuple(texts), labelled=True)
    strength = math.hypot(*system.gravity)
    gravity = []
    for view in views:
        along = np.array(system.gravity)[[view.right, view.up]] / (strength or 1.0)
        if math.hypot(*along.tolist()) >= _IN_PLANE:
            corner = view.middle + _MM.factor * (half[[view.right, view.up]] + 0.1 * size)
            gravity += _arrow(corner, corner + _MM.factor * _ARROW * size * along)
    if gravity:
        yield _lines(f"gravity, {number(strength / STANDARD_GRAVITY, 3)} g", gravity, Role.THIRD)


def _arrow(tail: FloatArray, tip: FloatArray) -> list[FloatArray]:
    back = 0.3 * (tail - tip)
    side = 0.4 * np.array([-back[1], back[0]])
    return [np.array([tail, tip]), np.array([tip + back + side, tip, tip + back - side])]


def _frame(views: Sequence[_View], half: FloatArray, size: float) -> Iterator[Trace]:
    """Names of the views with their coordinates, and a scale."""
    letters = "xyz"
    titles, names = [], []
    for view in views:
        title = view.middle + _MM.factor * np.array([-half[view.right], half[view.up] + 0.25 * size])
        titles.append(title)
        names.append(f"{view.name}: {letters[view.right]} right, {letters[view.up]} up")
    x, y = np.array(titles).T
    yield Trace("", x, y, Role.MEASURED, ChartForm.LABELS, texts=tuple(names), labelled=True)
    length = _round_length(_MM.factor * size)
    side = views[2]
    begin = np.array([side.middle[0] - 0.5 * length, views[0].middle[1]])
    tick = np.array([0.0, 0.04 * _MM.factor * size])
    end = begin + np.array([length, 0.0])
    bar = [np.array([begin, end]), np.array([begin - tick, begin + tick]), np.array([end - tick, end + tick])]
    yield _lines(f"scale, {number(length)} mm", bar, Role.MEASURED)
    middle = 0.5 * (begin + end)
    yield Trace(
        "", middle[:1], middle[1:], Role.MEASURED, ChartForm.LABELS, texts=(f"{number(length)} mm",), labelled=True
    )


def _round_length(longest: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not longer."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9))


def _lines(name: str, pieces: Sequence[FloatArray], role: Role, form: ChartForm = ChartForm.LINE) -> Trace:
    x, y, _ = joined([(piece[:, 0], piece[:, 1]) for piece in pieces])
    return Trace(name, x, y, role, form)
