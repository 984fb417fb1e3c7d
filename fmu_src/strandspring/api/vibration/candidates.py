"""Candidates of a SYSTEM.toml at rest, and shaken."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import IsolationError, Reader
from ...findings import Finding, gathered
from ...ground.result_columns import ResultColumn
from ...vibration.bodies.modes import Mode, modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import RestPose, rest
from ...vibration.bodies.shaken_system import ShakenSystem
from ...vibration.bodies.shaking import Shaking
from ...vibration.bodies.six_response import DIRECTIONS, SystemResponse, all_points, system_response
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.table_types import read_direction
from ...vibration.one_mass.band import DEFAULT_BAND
from ...vibration.one_mass.options import Curve, Excitation, Levels
from ...vibration.verdicts.cautions import catalogue_cautions
from ..common.result import Table, picked, records

CANDIDATE = ResultColumn("candidate", "", "candidate", "candidate")
_PHASE = ResultColumn("phase", "deg", "phase")
_ROUNDING = 1e-6  # of a point's largest gain, up to which another is rounding and has no phase
_ACCELERATION = ResultColumn("acceleration", "m/s^2", "acceleration")
_SWAY = ResultColumn("sway", "m", "sway", "sway", "mm", 1e3)
_REST = (
    CANDIDATE,
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
    """A candidate at rest, and its responses to what shakes it."""

    label: str
    system: MountedSystem
    poses: tuple[RestPose, ...]  # where friction may leave it, first the nominal one
    modes: tuple[Mode, ...]  # of small motion about that
    secants: tuple[Mode, ...] = ()  # of large motion, if they are known
    responses: tuple[SystemResponse, ...] = ()  # one for each excitation and level

    @classmethod
    def about(cls, label: str, system: MountedSystem, omega: float = 0.0) -> RestingSystem:
        """A system with omega at this share of saturation; raises MountedSystemError if it cannot rest."""
        pose = rest(system, omega)
        return cls(label, system, (pose,), modes(SmallMotion(system, pose.pose), omega=pose.omega))

    @cached_property
    def motion(self) -> SmallMotion:
        """Of small motion about the nominal pose."""
        return SmallMotion(self.system, self.poses[0].pose)

    @property
    def free_travel(self) -> float:
        """The least of all mounts' axes from rest to the nearer end of the identified range [m]."""
        return float(self.system.laws.free_travel(self.poses[0].displacement).min())

    @property
    def findings(self) -> list[Finding]:
        """Of springs from a catalogue."""
        return [*catalogue_cautions(self.system)]

    @property
    def mode_rows(self) -> list[dict[str, Any]]:
        """The modes by keys of JSON."""
        return [
            {"frequency": mode.frequency, "viscous_damping": mode.damping, "motion": mode.words, "shape": mode.shape}
            for mode in self.modes
        ]

    def content(self) -> dict[str, Any]:
        """What JSON holds of it at rest."""
        bodies, pose = self.system.bodies, self.poses[0]
        names, masses = [body.name for body in bodies], [body.mass for body in bodies]
        at_rest = records("body", names, mass=masses, displacement=pose.displacements, rotation=pose.rotations)
        return {"static_equilibrium": at_rest, "modes": self.mode_rows}

    def content_of_motions(self) -> dict[str, Any]:
        """What JSON holds of it and its responses."""
        of = {"name": self.label, "cautions": [*gathered(self.findings, Reader.FILE)], **self.content()}
        return {**of, "responses": [*map(_response_content, self.responses)]}


def rest_tables(candidates: Sequence[RestingSystem], brief: bool) -> Iterator[Table]:
    """Where the bodies rest, and the modes, if brief the frequencies alone."""
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


def curve_table(candidates: Sequence[RestingSystem]) -> Table:
    """All points of the curves, under headings with units."""
    level = f"level [{candidates[0].responses[0].shaking.unit}]"
    headings: dict[str, None] = dict.fromkeys(("candidate", "excitation", level))
    rows = []
    for candidate in candidates:
        for response in candidate.responses:
            of = {"candidate": candidate.label, "excitation": response.excitation, level: response.level}
            curve = dict(_headed(candidate, response))
            headings |= dict.fromkeys(curve)
            points = zip(*(values.tolist() for values in curve.values()), strict=True)
            rows += [{**of, **dict(zip(curve, point, strict=True))} for point in points]
    return Table([ResultColumn(heading, "", heading) for heading in headings], rows)


def motions_of(
    parts: Sequence[RestingSystem], kind: Excitation, heights: Sequence[float], levels: Levels, curve: Curve
) -> list[tuple[str, partial[SystemResponse]]]:
    """What shakes the system along each direction, by default where some body is free to follow, at each level, and
    what computes the response of a candidate.
    """
    given = [levels.directions] if isinstance(levels.directions, str) else levels.directions
    shakings = [_shaking(parts[0].system, kind, way, levels) for way in (DIRECTIONS if given is None else given)]
    if given is None:
        shakings = [one for one in shakings if all(ShakenSystem(part.motion, one, 1.0).moves for part in parts)]

    def respond(part: RestingSystem, shaking: Shaking, level: float) -> SystemResponse:
        held = [mode.frequency for mode in part.modes if mode.frequency > 0.0]
        ends = curve.band or (DEFAULT_BAND[0] * held[0], DEFAULT_BAND[1] * held[-1])
        band = np.geomspace(*ends, curve.points)
        return system_response(part.motion, shaking, level, band, extrapolate=curve.extrapolate)

    return [(one.name, partial(respond, shaking=one, level=level)) for one in shakings for level in heights]


def _shaking(system: MountedSystem, kind: Excitation, given: Any, levels: Levels) -> Shaking:
    """What shakes a system along or about a direction, or as a force on a point, the first one by default."""
    try:
        direction = read_direction(given if isinstance(given, str) else np.ravel(given).tolist()).vector
    except ValueError as problem:
        raise IsolationError(f"An entry of `directions` {problem}.") from None
    if kind is not Excitation.FORCE:
        return Shaking(kind, direction, None if levels.rotation is None else (0.0, 0.0, 0.0))
    places = {point.name: point for point in all_points(system)}
    if levels.at is not None and levels.at not in places:
        raise IsolationError(f"`at` must be one of the points {', '.join(places)}, got {levels.at!r}.")
    point = places[levels.at or next(iter(places))]
    return Shaking(kind, direction, None, point.body, point.place)


def _series(response: SystemResponse) -> dict[ResultColumn, NDArray[Any]]:
    """Figures of each point over the curve, shape (P, F, 3), or (P, F) without a direction."""
    gain = np.abs(response.gain)
    has_phase = gain > _ROUNDING * gain.max(axis=2, keepdims=True)
    phase = np.where(has_phase, np.degrees(np.angle(response.gain)), np.nan)
    figures = {response.gain_column: gain, _PHASE: phase, _ACCELERATION: response.acceleration}
    return {column: values.swapaxes(0, 1) for column, values in (figures | {_SWAY: response.sway}).items()}


def _headed(candidate: RestingSystem, response: SystemResponse) -> Iterator[tuple[str, NDArray[Any]]]:
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
