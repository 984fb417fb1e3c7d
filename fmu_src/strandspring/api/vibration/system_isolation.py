"""`isolate SYSTEM.toml`: modes and steady vibration of rigid bodies on mounts, for all candidates of a description."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...errors import IsolationError, MountedSystemError, OptionError, Reader
from ...findings import Finding, gathered
from ...ground.result_columns import ResultColumn, columns_of
from ...vibration.bodies.modes import Mode, modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import RestPose, rest
from ...vibration.bodies.shaken_system import ShakenSystem
from ...vibration.bodies.shaking import Shaking
from ...vibration.bodies.six_response import DIRECTIONS, PointResonance, SystemResponse, all_points, system_response
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import SystemFile, load_system_file
from ...vibration.description.table_types import read_direction
from ...vibration.one_mass.band import DEFAULT_BAND
from ...vibration.one_mass.options import Curve, Excitation, Levels
from ...vibration.verdicts.answers import shared
from ...vibration.verdicts.cautions import catalogue_cautions
from ..common.model_source import Progress, unseen
from ..common.result import picked, records
from ..common.table import Table
from .steady import BAND, LEVELS, AnyIsolation, default_levels, with_responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...report.drawing import Chart

_CANDIDATE = ResultColumn("candidate", "", "candidate", "candidate")
_EXCITATION = ResultColumn("excitation", "", "excitation", "excitation")
_PHASE = ResultColumn("phase", "deg", "phase")
_ROUNDING = 1e-6  # of a point's largest gain, up to which that of another direction is rounding and has no phase
_ACCELERATION = ResultColumn("acceleration", "m/s^2", "acceleration")
_SWAY = ResultColumn("sway", "m", "sway", "sway", "mm", 1e3)
_REST = (
    _CANDIDATE,
    ResultColumn("body", "", "body", "body"),
    ResultColumn("mass", "kg", "mass", "mass", "kg"),
    *(ResultColumn(way, "m", f"displacement along {way}", way, "mm", 1e3) for way in DIRECTIONS),
    ResultColumn("tilt", "rad", "tilt", "tilt", "deg", math.degrees(1.0), 3),
    ResultColumn("natural", "", "natural frequencies", "natural frequencies Hz"),
)
MODES = (
    ResultColumn("frequency", "Hz", "natural frequency", "mode", "Hz"),
    ResultColumn("viscous_damping", "1", "viscous damping", "viscous damping", "%", 100.0, 3),
    ResultColumn("motion", "", "motion", "small motion"),
    # Of text, where springs move by much of their free travel.
    ResultColumn("secant", "Hz", "", "secant", "Hz"),
    ResultColumn("damping", "1", "", "damping", "%", 100.0, 2),
)
_DIGITS = 9  # of metres and radians, beyond which a pose is rounding


@dataclass(frozen=True, eq=False)
class RestingSystem:
    """A candidate at rest."""

    label: str
    system: MountedSystem
    poses: tuple[RestPose, ...]  # where friction may leave it, first the nominal one
    modes: tuple[Mode, ...]  # of small motion about that
    secants: tuple[Mode, ...] = ()  # of large motion, if they are known

    @property
    def mode_rows(self) -> list[dict[str, Any]]:
        """The modes by keys of JSON."""
        return [
            {"frequency": mode.frequency, "viscous_damping": mode.damping, "motion": mode.words, "shape": mode.shape}
            for mode in self.modes
        ]

    def content(self) -> dict[str, Any]:
        """For JSON."""
        bodies, pose = self.system.bodies, self.poses[0]
        names, masses = [body.name for body in bodies], [body.mass for body in bodies]
        rest = records("body", names, mass=masses, displacement=pose.displacements, rotation=pose.rotations)
        return {"static_equilibrium": rest, "modes": self.mode_rows}


@dataclass(frozen=True, eq=False)
class IsolatedSystem(RestingSystem):
    """A candidate, at rest midway in the hysteresis."""

    responses: tuple[SystemResponse, ...] = ()  # one for each excitation and level

    def content(self) -> dict[str, Any]:
        """The candidate and its motions for JSON."""
        cautions = [*gathered(catalogue_cautions(self.system), Reader.FILE)]
        responses = [*map(_response_content, self.responses)]
        return {"name": self.label, "cautions": cautions, **super().content(), "responses": responses}


def rest_tables(candidates: Sequence[RestingSystem], brief: bool) -> Iterator[Table]:
    """Where the bodies rest, and the modes; of these the frequencies alone if it is to be brief."""
    several, rows = len(candidates) > 1, []
    for candidate in candidates:
        of = {"candidate": candidate.label, "natural": ", ".join(f"{mode.frequency:.3g}" for mode in candidate.modes)}
        for k, body in enumerate(candidate.system.bodies):
            x, y, z, w, *turned = np.array([pose.coordinates[k] for pose in candidate.poses]).T
            tilt = 2.0 * np.arctan2(np.linalg.norm(turned, axis=0), np.abs(w))
            ranges = ((float(moved.min()), float(moved.max())) for moved in np.round((x, y, z, tilt), _DIGITS))
            moved = dict(zip((*DIRECTIONS, "tilt"), ranges, strict=True))
            rows.append({**of, **picked(body, "mass"), "body": body.name, **moved})
            of = dict.fromkeys(of, "")
    yield Table(_REST[int(not several) : None if brief else -1], rows, "Static equilibrium:")
    for candidate in () if brief else candidates:
        modes = candidate.mode_rows
        for row, secant in zip(modes, candidate.secants, strict=False):
            row |= {"secant": secant.frequency, "damping": secant.damping}
        yield Table(MODES, modes, f"Modes of {candidate.label}:" if several else "Modes:")


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

    _parts_in = "candidates"
    _size = (12.0, 9.5)
    _stated: ClassVar[Mapping[str, Any]] = {}  # each candidate and response says its own

    @property
    def table(self) -> Table:
        """All points of the curves, under headings with units."""
        level = f"level [{next(self.every)[1].shaking.unit}]"
        headings: dict[str, None] = dict.fromkeys(("candidate", "excitation", level))
        rows = []
        for candidate, response in self.every:
            of = {"candidate": candidate.label, "excitation": response.excitation, level: response.level}
            curve = dict(_headed(candidate, response))
            headings |= dict.fromkeys(curve)
            points = zip(*(values.tolist() for values in curve.values()), strict=True)
            rows += [{**of, **dict(zip(curve, point, strict=True))} for point in points]
        return Table([ResultColumn(heading, "", heading) for heading in headings], rows)

    @property
    def _peak_columns(self) -> tuple[ResultColumn, ...]:
        gain = next(self.every)[1].gain_column
        figures = (gain if column.key == gain.key else column for column in columns_of(PointResonance))
        return (_CANDIDATE, _EXCITATION, *LEVELS, *figures, BAND)

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """Static equilibrium, modes, and of each point the largest resonance in any direction."""
        yield f"{self.name} ({self.source})" if self.source is not None else self.name
        yield from rest_tables(self.candidates, brief)
        if self.levels_chosen:
            yield self.levels_chosen
        peaks = self._peak_table()
        same = ("candidate", "excitation", "level", "point")
        of_points = groupby(peaks.rows, key=lambda row: [row[key] for key in same])
        yield replace(peaks, rows=[max(rows, key=lambda row: row["gain"]) for _, rows in of_points])

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of springs from a catalogue, and of each curve."""
        of_candidates = {candidate.label: [*catalogue_cautions(candidate.system)] for candidate in self.candidates}
        return (*shared(of_candidates), *self._of_curves)

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
        write_system_isolation(os.fspath(path), self.name, self.candidates[0].system, curves, parts, self.findings)

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw gain over frequency of each excitation, and below it the sway, dotted where the motion is unstable, into
        axes, first those of the gains, and return them; those of a new figure if None.
        """
        return self._drawn(ax)

    @property
    def _excitations(self) -> list[str]:
        return list(dict.fromkeys(response.excitation for _, response in self.every))

    @property
    def _grid(self) -> tuple[int, int]:  # type: ignore[override]
        return 2, len(self._excitations)

    def _draw(self, figure: Figure) -> None:
        from ...report.drawing import draw_panels

        draw_panels(figure, self._panels, self.name)

    @property
    def _panels(self) -> list[Chart]:
        """Gain above sway, a column for each excitation: colours tell points and candidates, and dashes levels."""
        from ...report.drawing import Steady, steady_chart

        of_gain = next(self.every)[1].gain_column
        gain = f"{of_gain.short or 'motion'} [{of_gain.shown or '-'}], largest of x, y and z"
        panels = []
        for label in (gain, "sway [mm]"):
            for excitation in self._excitations:
                curves = []
                for candidate, response in self.every:
                    largest = of_gain.factor * np.abs(response.gain).max(axis=2)
                    values = largest if label is gain else 1e3 * response.sway
                    of = f"{candidate.label}, " if len(self.candidates) > 1 else ""
                    curves += [
                        Steady(response.frequency, along, response.stable, f"{of}{point.name}", response.level_text)
                        for point, along in zip(response.points, values.T, strict=True)
                        if response.excitation == excitation
                    ]
                panels.append(steady_chart(label, curves, excitation if label is gain else ""))
        return panels


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
    description = source if isinstance(source, SystemFile) else load_system_file(source)
    parts, motions = [], {}
    for label, system in description.chosen_candidates(candidates):
        pose = rest(system)
        motions[label] = SmallMotion(system, pose.pose)
        parts.append(IsolatedSystem(label, system, (pose,), modes(motions[label], omega=pose.omega)))
    kind, about, chosen = Excitation.BASE_DISPLACEMENT, None, ""
    if levels.rotation is not None:
        about, heights = (0.0, 0.0, 0.0), levels.rotation
    elif levels.chosen is not None:
        kind, heights = levels.chosen
    else:
        travels = {part.label: float(part.system.laws.free_travel(part.poses[0].displacement).min()) for part in parts}
        heights, chosen = default_levels(travels)
    given = [levels.directions] if isinstance(levels.directions, str) else levels.directions
    ways = DIRECTIONS if given is None else given
    shakings = [_shaking(parts[0].system, kind, direction, about, levels.at) for direction in ways]
    if given is None:
        # Those that some body is free to follow.
        shakings = [one for one in shakings if all(ShakenSystem(motion, one, 1.0).moves for motion in motions.values())]

    def respond(part: IsolatedSystem, shaking: Shaking, level: float) -> SystemResponse:
        held = [mode.frequency for mode in part.modes if mode.frequency > 0.0]
        ends = curve.band or (DEFAULT_BAND[0] * held[0], DEFAULT_BAND[1] * held[-1])
        band = np.geomspace(*ends, curve.points)
        try:
            return system_response(motions[part.label], shaking, level, band, extrapolate=curve.extrapolate)
        except (IsolationError, MountedSystemError) as refusal:
            raise type(refusal)("{where}: {refusal}", where=f"{part.label}, {shaking.name}", refusal=refusal) from None

    shaken = [partial(respond, shaking=shaking, level=level) for shaking in shakings for level in heights]
    path = None if isinstance(source, SystemFile) else os.fspath(source)
    return SystemIsolation(description.name, path, with_responses(parts, shaken, curve.points, progress), chosen)


def _shaking(
    system: MountedSystem, kind: Excitation, given: Any, about: tuple[float, float, float] | None, at: str | None
) -> Shaking:
    """What shakes a system along or about a direction, or as a force on a point, the first one by default."""
    try:
        direction = read_direction(given if isinstance(given, str) else np.ravel(given).tolist()).vector
    except ValueError as problem:
        raise IsolationError(f"An entry of `directions` {problem}.") from None
    if kind is not Excitation.FORCE:
        return Shaking(kind, direction, about)
    places = {point.name: point for point in all_points(system)}
    if at is not None and at not in places:
        raise IsolationError(f"`at` must be one of the points {', '.join(places)}, got {at!r}.")
    point = places[at or next(iter(places))]
    return Shaking(kind, direction, None, point.body, point.place)


def _series(response: SystemResponse) -> dict[ResultColumn, NDArray[Any]]:
    """Figures of each point over the curve, shape (P, F, 3), or (P, F) without a direction."""
    gain = np.abs(response.gain)
    has_phase = gain > _ROUNDING * gain.max(axis=2, keepdims=True)
    phase = np.where(has_phase, np.degrees(np.angle(response.gain)), np.nan)
    figures = {response.gain_column: gain, _PHASE: phase, _ACCELERATION: response.acceleration}
    return {column: values.swapaxes(0, 1) for column, values in (figures | {_SWAY: response.sway}).items()}


def _headed(candidate: IsolatedSystem, response: SystemResponse) -> Iterator[tuple[str, NDArray[Any]]]:
    """A curve under the headings of files."""
    yield "frequency [Hz]", response.frequency
    for p, point in enumerate(response.points):
        for column, values in _series(response).items():
            ways = [f"{point.name} {way}" for way in DIRECTIONS] if values.ndim == 3 else [point.name]
            along = np.atleast_3d(values)[p].T
            yield from ((f"{of}: {column.file_heading}", one) for of, one in zip(ways, along, strict=True))
    forces = np.abs(response.base_force)
    yield from ((f"force on the base {way} [N]", forces[:, k]) for k, way in enumerate(DIRECTIONS))
    for k, body in enumerate(candidate.system.bodies):
        yield f"{body.name}: tilt [deg]", np.degrees(response.tilt[:, k])
    for k, axis in enumerate(response.axes):
        yield f"lowest displacement of {axis} [m]", response.low[:, k]
        yield f"highest displacement of {axis} [m]", response.high[:, k]
    yield "stable", response.stable
    yield "requested frequency", response.requested
    yield "outside the identified range", response.extrapolating


def _response_content(response: SystemResponse) -> dict[str, Any]:
    series = {column.key: values for column, values in _series(response).items()}
    return {
        "excitation": response.excitation,
        "direction": response.shaking.direction,
        "level": response.level,
        "unit": response.shaking.unit,
        **picked(response, "gain_unit", "resonances"),
        "cautions": [*gathered(response.findings, Reader.FILE)],
        "errors_against_time_integration": response.errors,
        "frequency": response.frequency,
        "points": records("name", (point.name for point in response.points), **series),
        "base_force": np.abs(response.base_force),
        "axes": records("name", response.axes, min=response.low.T, max=response.high.T),
        **picked(response, "stable", "requested", "extrapolating"),
    }
