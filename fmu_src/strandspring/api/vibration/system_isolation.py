"""`isolate SYSTEM.toml`: modes and steady vibration of rigid bodies on mounts, for all candidates of a description."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import IsolationError, MountedSystemError, OptionError, Reader
from ...findings import Finding, gathered
from ...ground.result_columns import ResultColumn
from ...vibration.bodies.modes import Mode, modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.parts import Vector
from ...vibration.bodies.rest import RestPose, rest
from ...vibration.bodies.shaken_system import ShakenSystem
from ...vibration.bodies.shaking import Shaking
from ...vibration.bodies.six_response import DIRECTIONS, PointResonance, SystemResponse, all_points, system_response
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import SystemFile, load_system_file
from ...vibration.one_mass.band import DEFAULT_BAND
from ...vibration.one_mass.options import Curve, Excitation, Levels
from ...vibration.verdicts.answers import shared
from ...vibration.verdicts.cautions import catalogue_cautions
from ..common.progress import Progress, unseen
from ..common.table import Table
from .isolation_result import FREQUENCY, ISOLATION_FREQUENCY, AnyIsolation, default_levels, with_responses

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...vibration.one_mass.curves_plot import Curve as DrawnCurve

_ORIGIN = (0.0, 0.0, 0.0)
_SWAY = ResultColumn("sway", "m", "sway", "sway", "mm", 1e3)
_OF = tuple(ResultColumn(key, "", key, key) for key in ("candidate", "body"))
_EXCITATION = ResultColumn("excitation", "", "excitation")
_POINT = (ResultColumn("point", "", "point", "point"), ResultColumn("direction", "", "motion", "motion"))
_REST = (
    *_OF,
    ResultColumn("mass", "kg", "mass", "mass", "kg"),
    *(ResultColumn(way, "m", f"displacement along {way}", way, "mm", 1e3) for way in DIRECTIONS),
    ResultColumn("tilt", "rad", "tilt", "tilt", "deg", math.degrees(1.0), 3),
    ResultColumn("natural", "", "natural frequencies", "natural frequencies Hz"),
)
MODES = (
    ResultColumn("frequency", "Hz", "natural frequency", "mode", "Hz"),
    ResultColumn("viscous_damping", "1", "viscous damping", "viscous damping", "%", 100.0, 3),
    ResultColumn("motion", "", "motion", "small motion"),
)
_DIGITS = 9  # of metres and radians, beyond which a pose is rounding
# Of the figure: width of a column, height of both rows, height of a line of the legend [inches]; of a name in it the
# letters, and their height.
_WIDTH, _HEIGHT, _LEGEND = 4.5, 7.5, 0.25
_LETTERS, _POINTS = 32, 9.0


@dataclass(frozen=True, eq=False)
class IsolatedSystem:
    """One candidate.

    Attributes
    ----------
    label : str
    system : MountedSystem
    rest : RestPose                        Static equilibrium, of `isolate` that midway in the hysteresis.
    motion : SmallMotion                   About it.
    modes : tuple of Mode
    responses : tuple of SystemResponse    One for each excitation and level.
    """

    label: str
    system: MountedSystem
    rest: RestPose
    motion: SmallMotion
    modes: tuple[Mode, ...]
    responses: tuple[SystemResponse, ...] = ()

    @classmethod
    def at_rest(cls, label: str, system: MountedSystem, pose: RestPose) -> IsolatedSystem:
        """With its modes about a pose; raises MountedSystemError if that is not stable."""
        motion = SmallMotion(system, pose.pose)
        return cls(label, system, pose, motion, modes(motion, omega=pose.omega))

    @property
    def mode_rows(self) -> list[dict[str, Any]]:
        """The modes by keys of JSON."""
        return [
            {"frequency": mode.frequency, "viscous_damping": mode.damping, "motion": mode.words, "shape": mode.shape}
            for mode in self.modes
        ]

    def content(self) -> dict[str, Any]:
        """The candidate and its motions for JSON."""
        poses = zip(self.system.bodies, self.rest.displacements, self.rest.rotations, strict=True)
        return {
            "name": self.label,
            "cautions": [*gathered(catalogue_cautions(self.system), Reader.FILE)],
            "static_equilibrium": [
                {"body": body.name, "mass": body.mass, "displacement": moved, "rotation": rotation}
                for body, moved, rotation in poses
            ],
            "modes": self.mode_rows,
            "responses": [_response_content(response) for response in self.responses],
        }


def rest_tables(candidates: Sequence[IsolatedSystem], brief: bool) -> Iterator[Table]:
    """Where the bodies rest, and the modes; of these the frequencies alone if it is to be brief."""
    rows = []
    for candidate in candidates:
        of: dict[str, Any] = {"candidate": candidate.label if len(candidates) > 1 else None}
        if brief:
            of["natural"] = ", ".join(f"{mode.frequency:.3g}" for mode in candidate.modes)
        for body, pose in zip(candidate.system.bodies, candidate.rest.coordinates.tolist(), strict=True):
            tilt = 2.0 * math.atan2(math.hypot(*pose[4:]), abs(pose[3]))
            moved = dict(zip((*DIRECTIONS, "tilt"), np.round([*pose[:3], tilt], _DIGITS).tolist(), strict=True))
            rows.append({**of, "body": body.name, "mass": body.mass, **moved})
            of = dict.fromkeys(of, "")
    yield Table(_REST, rows, "Static equilibrium:")
    for candidate in () if brief else candidates:
        title = f"Modes of {candidate.label}:" if len(candidates) > 1 else "Modes:"
        yield Table(MODES, candidate.mode_rows, title)


@dataclass(frozen=True, eq=False, repr=False)
class SystemIsolation(AnyIsolation):
    """Steady vibration of all candidates of a description.

    Attributes
    ----------
    name : str
    source : str or None                   Path as it was given; None for a description in memory.
    candidates : tuple of IsolatedSystem
    levels_chosen : str                    How the levels were chosen; empty if they were given.
    """

    name: str
    source: str | None
    candidates: tuple[IsolatedSystem, ...]
    levels_chosen: str = ""

    _stated: ClassVar[Mapping[str, Any]] = {}  # each candidate and response says its own

    @property
    def _parts(self) -> tuple[IsolatedSystem, ...]:
        """The candidates."""
        return self.candidates

    def _of(self, part: IsolatedSystem, response: SystemResponse) -> dict[ResultColumn, Any]:
        level = ResultColumn("level", response.shaking.unit, "level")
        return {_OF[0]: part.label, _EXCITATION: response.shaking.name, level: response.level}

    def _curve(self, part: IsolatedSystem, response: SystemResponse) -> dict[ResultColumn, NDArray[Any]]:
        columns: dict[str, NDArray[Any]] = {"frequency [Hz]": response.frequency}
        for p, point in enumerate(response.points):
            for column, values in _series(response):
                along = dict(zip(DIRECTIONS, values[:, p].T, strict=True)) if values.ndim == 3 else {"": values[:, p]}
                for way, of_point in along.items():
                    columns[f"{f'{point.name} {way}'.rstrip()}: {column.file_heading}"] = of_point
        forces, tilt = np.abs(response.base_force), np.degrees(response.tilt)
        columns |= {f"force on the base {way} [N]": forces[:, k] for k, way in enumerate(DIRECTIONS)}
        columns |= {f"{body.name}: tilt [deg]": tilt[:, k] for k, body in enumerate(part.system.bodies)}
        for k, axis in enumerate(response.axes):
            columns[f"lowest displacement of {axis} [m]"] = response.low[:, k]
            columns[f"highest displacement of {axis} [m]"] = response.high[:, k]
        columns |= {"stable": response.stable, "requested frequency": response.requested}
        columns |= {"outside the identified range": response.extrapolating}
        return {ResultColumn(heading, "", heading): values for heading, values in columns.items()}

    def to_frame(self) -> pd.DataFrame:
        """All points of the curves, under the headings of `save_csv`."""
        _, response = next(self.every)
        return super().to_frame().rename(columns={"level": f"level [{response.shaking.unit}]"})

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """Static equilibrium, modes and the largest resonance of each point."""
        yield f"{self.name} ({self.source})" if self.source is not None else self.name
        yield from rest_tables(self.candidates, brief)
        if self.levels_chosen:
            yield self.levels_chosen
        _, response = next(self.every)
        figures = (*_POINT, FREQUENCY, response.gain_column, _SWAY, ISOLATION_FREQUENCY)
        yield self._resonance_table(figures, _largest)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of springs from a catalogue, and of each curve."""
        return (
            *shared({candidate.label: [*catalogue_cautions(candidate.system)] for candidate in self.candidates}),
            *(
                replace(finding, where=f"{candidate.label}, {response.shaking.name}, {response.level_text}")
                for candidate, response in self.every
                for finding in response.findings
            ),
        )

    def content(self) -> Mapping[str, Any]:
        """The candidates with their responses."""
        candidates = [candidate.content() for candidate in self.candidates]
        return {"name": self.name, "levels_chosen": self.levels_chosen or None, "candidates": candidates}

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a report: a page (.html) that opens offline; print it from a browser for a PDF.

        Raises
        ------
        StrandspringError   If the ending is another, or the file cannot be written.
        """
        from ...report.system_pages import write_system_isolation

        curves = [(candidate.label, response) for candidate, response in self.every]
        _, *parts = self.parts(brief=False)  # the first names the file
        write_system_isolation(os.fspath(path), self.name, self.candidates[0].system, curves, parts)

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw gain over frequency of each excitation, and below it the sway, dotted where the motion is unstable.

        Parameters
        ----------
        ax : sequence of Axes or None   Those of the gains, then those of the sways; those of a new figure if None.

        Returns
        -------
        list of Axes
        """
        if ax is None:
            return self._drawn()
        axes = self._axes(ax)
        self._draw_curves(axes)
        axes[0].legend(fontsize=8)
        return axes

    @property
    def _excitations(self) -> list[str]:
        return list(dict.fromkeys(response.shaking.name for _, response in self.every))

    @property
    def _grid(self) -> tuple[int, int]:  # type: ignore[override]
        return 2, len(self._excitations)

    @property
    def _size(self) -> tuple[float, float]:
        width = max(8.0, _WIDTH * len(self._excitations))
        names = [curve.label for curve in self._curves(self._excitations[0], "sway")]
        return width, _HEIGHT + _LEGEND * (len(names) // _legend_columns(names, width) + 1)

    def _fill(self, figure: Figure) -> list[Axes]:
        from ...vibration.one_mass.curves_plot import HANDLE_LENGTH

        axes = list(figure.subplots(*self._grid, sharex="col", sharey="row", squeeze=False).flat)
        self._draw_curves(axes)
        figure.suptitle(self.name)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=_legend_columns(labels, figure.get_figwidth()),
                      fontsize=_POINTS, frameon=False, handlelength=HANDLE_LENGTH)  # fmt: skip
        return axes

    def _draw_curves(self, axes: Sequence[Axes]) -> None:
        """Gain above sway, a column for each excitation."""
        from ...vibration.one_mass.curves_plot import draw

        column = next(self.every)[1].gain_column
        gain = f"{column.short or 'motion'} [{column.shown or '-'}], largest of x, y and z"
        below = len(self._excitations)
        for k, name in enumerate(self._excitations):
            draw(axes[k], self._curves(name, "gain"), "" if k else gain)
            draw(axes[below + k], self._curves(name, "sway"), "" if k else "sway [mm]")
            axes[k].set_title(name, fontsize=10)
            axes[k].set_xlabel("")

    def _curves(self, excitation: str, quantity: str) -> list[DrawnCurve]:
        """Of one excitation: colours tell points, or points and candidates, apart, and dashes levels."""
        from ...report.drawing import shortened
        from ...vibration.one_mass.curves_plot import COLORS, STYLES
        from ...vibration.one_mass.curves_plot import Curve as DrawnCurve

        levels = list(dict.fromkeys(response.level for _, response in self.every))
        curves, colours = [], count()
        for candidate in self.candidates:
            of = [shortened(candidate.label, _LETTERS)] if len(self.candidates) > 1 else []
            for p, (point, colour) in enumerate(zip(candidate.responses[0].points, colours, strict=False)):
                for response in candidate.responses:
                    if response.shaking.name != excitation:
                        continue
                    gain = response.gain_column.factor * np.abs(response.gain[:, p]).max(axis=1)
                    values = gain if quantity == "gain" else 1e3 * response.sway[:, p]
                    name = ", ".join([*of, shortened(point.name, _LETTERS), response.level_text])
                    style = STYLES[levels.index(response.level) % len(STYLES)]
                    colour_of = COLORS[colour % len(COLORS)]
                    curves.append(DrawnCurve(response.frequency, values, response.stable, name, colour_of, style))
        return curves


def _legend_columns(names: Sequence[str], width: float) -> int:
    """Of a legend as wide as a figure [inches]."""
    from ...report.drawing import legend_columns
    from ...vibration.one_mass.curves_plot import LEGEND_COLUMNS

    return min(LEGEND_COLUMNS, legend_columns(names, width, _POINTS, 12))


def isolated_bodies(
    source: str | os.PathLike[str] | SystemFile,
    levels: Levels,
    curve: Curve,
    candidates: str | Sequence[str] | None = None,
    progress: Progress = unseen,
) -> SystemIsolation:
    """Modes and steady vibration of rigid bodies on mounts, to the second order of rotations from rest; see `isolate`.

    Raises
    ------
    MountedSystemError   If the description is wrong, a body cannot rest, or a motion leaves an identified range.
    IsolationError       If an argument is out of bounds, or no steady motion is found.
    """
    if levels.at is not None and levels.force is None:
        raise OptionError("{to[at]} says where a force acts; give {to[force]}, too, or leave it out.", at=levels.at)
    directions = [levels.directions] if isinstance(levels.directions, str) else levels.directions
    description = source if isinstance(source, SystemFile) else load_system_file(source)
    parts = []
    for label, system in description.chosen_candidates(candidates):
        parts.append(IsolatedSystem.at_rest(label, system, rest(system)))
    kind, about, heights, chosen = _levels(parts, levels)
    shakings = [
        _shaking(parts[0].system, kind, direction, about, levels.at)
        for direction in ([_vector(vector) for vector in directions] if directions is not None else np.eye(3).tolist())
    ]
    if directions is None:
        shakings = [shaking for shaking in shakings if all(_moves(part, shaking) for part in parts)]

    def respond(
        shaking: Shaking, level: float, part: IsolatedSystem, advance: Callable[[float], None]
    ) -> SystemResponse:
        try:
            return system_response(
                part.motion, shaking, level, _band(curve, part), extrapolate=curve.extrapolate, advance=advance
            )
        except (IsolationError, MountedSystemError) as refusal:
            raise type(refusal)("{where}: {refusal}", where=f"{part.label}, {shaking.name}", refusal=refusal) from None

    motions = [
        (f"{shaking.name}, {shaking.level_text(level)}", partial(respond, shaking, level))
        for shaking in shakings
        for level in heights
    ]
    path = None if isinstance(source, SystemFile) else os.fspath(source)
    return SystemIsolation(description.name, path, with_responses(parts, motions, curve.points, progress), chosen)


def _levels(parts: Sequence[IsolatedSystem], given: Levels) -> tuple[Excitation, Vector | None, tuple[float, ...], str]:
    """The excitation, a place of its axis if it turns the base, its levels, and how they were chosen."""
    if given.rotation is not None:
        return Excitation.BASE_DISPLACEMENT, _ORIGIN, given.rotation, ""
    if given.chosen is not None:
        return given.chosen[0], None, given.chosen[1], ""
    levels, chosen, nearest = default_levels(
        [float(part.system.laws.free_travel(part.rest.displacement).min()) for part in parts]
    )
    several = f" of {parts[nearest].label}, the smallest of these candidates" if len(parts) > 1 else ""
    return Excitation.BASE_DISPLACEMENT, None, levels, f"{chosen} of the mounts{several}."


def _vector(direction: str | Sequence[float]) -> Vector:
    """A direction as people give it, of unit length."""
    names = {f"{sign}{name}": np.array(row) * (-1.0 if sign == "-" else 1.0)
             for sign in ("", "+", "-") for name, row in zip(DIRECTIONS, np.eye(3), strict=True)}  # fmt: skip
    if isinstance(direction, str):
        if direction not in names:
            raise IsolationError(f"A direction must be x, y, z, -x, -y, -z or three components, got {direction!r}.")
        values = names[direction]
    else:
        values = np.asarray(direction, dtype=np.float64)
    length = float(np.linalg.norm(values)) if values.shape == (3,) else math.nan
    if not (math.isfinite(length) and length > 0.0):
        raise IsolationError(f"A direction must have three finite components that are not all 0, got {direction!r}.")
    x, y, z = (values / length).tolist()
    return x, y, z


def _shaking(
    system: MountedSystem, kind: Excitation, direction: Sequence[float], about: Vector | None, at: str | None
) -> Shaking:
    x, y, z = direction
    if kind is not Excitation.FORCE:
        return Shaking(kind, (x, y, z), about)
    places = {point.name: point for point in all_points(system)}
    if at is not None and at not in places:
        raise IsolationError(f"`at` must be one of the points {', '.join(places)}, got {at!r}.")
    point = places[at] if at is not None else all_points(system)[0]
    return Shaking(kind, (x, y, z), None, point.body, point.place)


def _moves(part: IsolatedSystem, shaking: Shaking) -> bool:
    """Whether some body is free to follow an excitation."""
    return ShakenSystem(part.motion, shaking, 1.0).moves


def _band(curve: Curve, part: IsolatedSystem) -> np.ndarray:
    """Frequencies evenly spaced in the logarithm [Hz]."""
    if curve.band is None:
        held = [mode.frequency for mode in part.modes if mode.frequency > 0.0]
        return np.geomspace(DEFAULT_BAND[0] * held[0], DEFAULT_BAND[1] * held[-1], curve.points)
    return np.geomspace(*curve.band, curve.points)


def _largest(response: SystemResponse) -> list[PointResonance]:
    """Of each point in the direction in which it moves most."""
    return [
        max(
            (resonance for resonance in response.resonances if resonance.point == point.name),
            key=lambda resonance: resonance.gain,
        )
        for point in response.points
        if any(resonance.point == point.name for resonance in response.resonances)
    ]


def _series(response: SystemResponse) -> tuple[tuple[ResultColumn, NDArray[Any]], ...]:
    """Figures of each point over the curve, shape (F, P, 3), or (F, P) without a direction."""
    return (
        (response.gain_column, np.abs(response.gain)),
        (ResultColumn("phase", "deg", "phase"), np.degrees(np.angle(response.gain))),
        (ResultColumn("acceleration", "m/s^2", "acceleration"), response.acceleration),
        (_SWAY, response.sway),
    )


def _response_content(response: SystemResponse) -> dict[str, Any]:
    series = _series(response)
    ranges = zip(response.axes, response.low.T, response.high.T, strict=True)
    return {
        "excitation": response.shaking.name,
        "direction": response.shaking.direction,
        "level": response.level,
        "unit": response.shaking.unit,
        "gain_unit": response.gain_unit,
        "resonances": response.resonances,
        "cautions": [*gathered(response.findings, Reader.FILE)],
        "errors_against_time_integration": response.errors,
        "frequency": response.frequency,
        "points": [
            {"name": point.name, **{column.key: values[:, p] for column, values in series}}
            for p, point in enumerate(response.points)
        ],
        "base_force": np.abs(response.base_force),
        "axes": [{"name": name, "min": low, "max": high} for name, low, high in ranges],
        "stable": response.stable,
        "requested": response.requested,
        "extrapolating": response.extrapolating,
    }
