"""The page that the FMU of a system carries about itself."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, tostring

from markupsafe import Markup

from ...errors import MountedSystemError
from ...vibration.bodies.modes import modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.parts import BASE, Vector
from ...vibration.bodies.rest import rest
from ...vibration.bodies.small_motion import SmallMotion
from ..documentation import template
from .system_variables import SystemFmuOptions, system_start_values, system_variables

# Views by the axes that go to the right and up.
_VIEWS = (("x", "z"), ("y", "z"), ("x", "y"))
_SIZE, _DRAWN = 300.0, 200.0  # of a view, and of the largest span in it
_BODY, _MOUNT, _POINT = "#1f5fa8", "#666", "#c8601a"


def system_page(system: MountedSystem, options: SystemFmuOptions, file: str, platforms: tuple[str, ...]) -> str:
    """HTML of one file: the system with a sketch and its modes, the FMU's behaviour, its variables.

    The same arguments give the same text.
    """
    start = system_start_values(system, options)
    pose = rest(system, options.omega_start)
    try:
        natural, unstable = modes(SmallMotion(system, pose.pose), omega=pose.omega), ""
    except MountedSystemError as problem:
        natural, unstable = (), str(problem)
    return template(__package__, "system_page.html.j2").render(
        name=system.name or "Bodies on mounts",
        system=system,
        # The SVG is made by ElementTree.
        sketch=Markup(sketch_svg(system)),  # noqa: S704
        modes=natural,
        unstable=unstable,
        options=options,
        platforms=platforms,
        file=file,
        variables=[(variable, start.get(variable.name)) for variable in system_variables(system, options)],
    )


def sketch_svg(system: MountedSystem) -> str:
    """Centres of gravity (circles), mounts (triangles on the base, squares on bodies) and points (dots), to scale."""
    bodies = [body.center for body in system.bodies]
    places = [*bodies, *(mount.place for mount in system.mounts), *(point.place for point in system.points)]
    lows, highs = (tuple(map(end, zip(*places, strict=True))) for end in (min, max))
    middle = [0.5 * (low + high) for low, high in zip(lows, highs, strict=True)]
    scale = _DRAWN / (max(high - low for low, high in zip(lows, highs, strict=True)) or 1.0)
    svg = Element(
        "svg",
        {"viewBox": f"0 0 {len(_VIEWS) * _SIZE:g} {_SIZE:g}", "role": "img", "font-family": "sans-serif",
         "font-size": "11", "aria-label": "Bodies and mounts in three views"},
    )  # fmt: skip
    for number, (right, up) in enumerate(_VIEWS):
        across, along = ("xyz".index(name) for name in (right, up))

        def at(place: Vector, left: float = number * _SIZE, a: int = across, b: int = along) -> tuple[float, float]:
            return (
                left + 0.5 * _SIZE + scale * (place[a] - middle[a]),
                0.5 * _SIZE - scale * (place[b] - middle[b]),
            )

        for mount in system.mounts:
            x, y = at(mount.place)
            _line(svg, (x, y), at(bodies[mount.body]))
            corners: Sequence[tuple[float, float]] = [(-5.0, 5.0), (5.0, 5.0), (0.0, -5.0)]
            if mount.support != BASE:
                _line(svg, (x, y), at(bodies[mount.support]), dashed=True)
                corners = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)]
            outline = " ".join(f"{x + dx:.1f},{y + dy:.1f}" for dx, dy in corners)
            _title(SubElement(svg, "polygon", {"points": outline, "fill": _MOUNT}), mount.name)
        for point in system.points:
            _dot(svg, at(point.place), 3.0, _POINT, point.name)
        names: dict[tuple[float, float], list[str]] = {}  # of bodies, those behind each other together
        for body in system.bodies:
            _dot(svg, at(body.center), 6.0, _BODY, body.name)
            names.setdefault(at(body.center), []).append(body.name)
        for place, of_bodies in names.items():
            _text(svg, place, 9.0, -7.0, ", ".join(of_bodies))
        _text(svg, (number * _SIZE, _SIZE), 12.0, -12.0, f"{right} to the right, {up} up")
    return tostring(svg, encoding="unicode")


def _line(svg: Element, begin: tuple[float, float], end: tuple[float, float], dashed: bool = False) -> None:
    ends = {name: f"{value:.1f}" for name, value in zip(("x1", "y1", "x2", "y2"), (*begin, *end), strict=True)}
    SubElement(svg, "line", {**ends, "stroke": "#99a", **({"stroke-dasharray": "4 3"} if dashed else {})})


def _dot(svg: Element, at: tuple[float, float], radius: float, colour: str, name: str) -> None:
    place = {"cx": f"{at[0]:.1f}", "cy": f"{at[1]:.1f}", "r": f"{radius:g}"}
    _title(SubElement(svg, "circle", {**place, "fill": colour}), name)


def _title(shape: Element, name: str) -> None:
    """What a browser shows at the pointer."""
    SubElement(shape, "title").text = name


def _text(svg: Element, at: tuple[float, float], dx: float, dy: float, text: str) -> None:
    SubElement(svg, "text", {"x": f"{at[0] + dx:.1f}", "y": f"{at[1] + dy:.1f}"}).text = text
