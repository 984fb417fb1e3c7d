"""`isolate SYSTEM.toml`: modes and steady vibration of rigid bodies on mounts, for all candidates of a description."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import MountedSystemError, Reader
from ...findings import Finding, gathered
from ...ground.arguments import flag, limits
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
from ...vibration.one_mass.band import DEFAULT_BAND, checked_limits
from ...vibration.one_mass.system import Excitation, IsolationError
from ...vibration.verdicts.answers import shared
from ...vibration.verdicts.cautions import catalogue_cautions
from ..common.levels import checked_count, given_levels, positive_levels
from ..common.progress import Progress, unseen
from ..common.table import table_lines
from .isolation_result import FREQUENCY, ISOLATION_FREQUENCY, AnyIsolation, default_levels, with_responses

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ORIGIN = (0.0, 0.0, 0.0)
_SWAY = ResultColumn("sway", "m", "sway", "sway", "mm", 1e3)


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

    def rest_lines(self, brief: bool = False) -> list[str]:
        """Static equilibrium and modes in words; of the modes their frequencies alone if it is to be brief."""
        lines = []
        for body, pose in zip(self.system.bodies, self.rest.coordinates, strict=True):
            tilt = math.degrees(2.0 * math.atan2(math.hypot(*pose[4:]), abs(pose[3])))
            x, y, z = (f"{round(1e3 * way, 6) + 0.0:.4g}" for way in pose[:3].tolist())
            lines.append(
                f"  {body.name}, {body.mass:g} kg, rests at x {x}, y {y}, z {z} mm, tilted {round(tilt, 6):.3g} degrees"
            )
        if brief:
            return [*lines, f"  natural frequencies {', '.join(f'{mode.frequency:.3g}' for mode in self.modes)} Hz"]
        rows = [[f"{mode.frequency:.4g}", f"{100.0 * mode.damping:.3g}", mode.words] for mode in self.modes]
        return [*lines, *table_lines(["mode Hz", "viscous damping %", "small motion"], rows, left={"small motion"})]

    def as_json(self) -> dict[str, Any]:
        """The candidate and its motions as the command prints them with --json."""
        poses = zip(self.system.bodies, self.rest.displacements, self.rest.rotations, strict=True)
        return {
            "name": self.label,
            "cautions": [*gathered(catalogue_cautions(self.system), Reader.FILE)],
            "static_equilibrium": [
                {"body": body.name, "mass": body.mass, "displacement": moved.tolist(), "rotation": rotation.tolist()}
                for body, moved, rotation in poses
            ],
            "modes": [
                {
                    "frequency": mode.frequency,
                    "viscous_damping": mode.damping,
                    "motion": mode.words,
                    "shape": mode.shape.tolist(),
                }
                for mode in self.modes
            ],
            "responses": [_response_json(response) for response in self.responses],
        }


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

    _resonance = PointResonance

    @property
    def _parts(self) -> tuple[IsolatedSystem, ...]:
        """The candidates."""
        return self.candidates

    def _named(self, part: IsolatedSystem, response: SystemResponse) -> dict[str, Any]:
        return {"candidate": part.label, "excitation": response.shaking.name, "level": response.level}

    def _columns(self, part: IsolatedSystem, response: SystemResponse) -> dict[str, NDArray[Any]]:
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
        return columns | {"outside the identified range": response.extrapolating}

    def to_frame(self) -> pd.DataFrame:
        """All points of the curves as `save_csv` writes them."""
        _, response = next(self.every)
        return super().to_frame().rename(columns={"level": f"level [{response.shaking.unit}]"})

    def _csv(self) -> pd.DataFrame:
        return self.to_frame()

    def brief(self, width: int | None = None) -> list[str]:
        """The same without what the modes are."""
        return self._lines(width, brief=True)

    def text_lines(self, width: int | None = None) -> list[str]:
        """Static equilibrium, modes and the largest resonance of each point, in tables of at most a width."""
        return self._lines(width, brief=False)

    def _lines(self, width: int | None, brief: bool) -> list[str]:
        lines = [f"{self.name} ({self.source})" if self.source is not None else self.name]
        for candidate in self.candidates:
            lines += [f"{candidate.label}:", *candidate.rest_lines(brief)]
        lines += [self.levels_chosen] if self.levels_chosen else []
        _, response = next(self.every)
        columns = (
            ResultColumn("point", "", "point", "point"),
            ResultColumn("direction", "", "motion", "motion"),
            FREQUENCY,
            response.gain_column,
            _SWAY,
            ISOLATION_FREQUENCY,
        )
        return [*lines, *self._table(columns, width, _largest, brief)]

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

    def as_json(self) -> dict[str, Any]:
        """The result as the command prints it with --json."""
        return {
            "name": self.name,
            "levels_chosen": self.levels_chosen or None,
            "candidates": [candidate.as_json() for candidate in self.candidates],
        }

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a report: a page that opens offline (.html), or a document (.pdf).

        Raises
        ------
        StrandspringError   If the ending is another, a package for PDF is missing, or the file cannot be written.
        """
        from ...report.system_isolation_page import write_system_isolation

        modes = {candidate.label: candidate.modes for candidate in self.candidates}
        curves = [(candidate.label, response) for candidate, response in self.every]
        write_system_isolation(os.fspath(path), self.name, self.candidates[0].system, modes, curves)

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw gain over frequency of each excitation, and below it the sway, dotted where the motion is unstable.

        Parameters
        ----------
        ax : sequence of Axes or None   Those of the gains, then those of the sways; those of a new figure if None.

        Returns
        -------
        list of Axes
        """
        from .system_isolation_plot import draw, fill

        if ax is None:
            from matplotlib import pyplot as plt

            return fill(plt.figure(figsize=self._size, layout="constrained"), self.curves, self.name)
        axes = self._axes(ax)
        draw(axes, self.curves)
        axes[0].legend(fontsize=8)
        return axes

    @property
    def _grid(self) -> tuple[int, int]:  # type: ignore[override]
        from .system_isolation_plot import grid_of

        return grid_of(self.curves)

    @property
    def _size(self) -> tuple[float, float]:
        from .system_isolation_plot import size_of

        return size_of(self.curves)

    def _draw(self, figure: Figure) -> None:
        from .system_isolation_plot import fill

        fill(figure, self.curves, self.name)


def isolate_system(
    source: str | os.PathLike[str] | SystemFile,
    *,
    candidates: str | Sequence[str] | None = None,
    base_displacement: ArrayLike | None = None,
    base_acceleration: ArrayLike | None = None,
    base_rotation: ArrayLike | None = None,
    force: ArrayLike | None = None,
    directions: str | Sequence[str | Sequence[float]] | None = None,
    at: str | None = None,
    band: tuple[float, float] | None = None,
    points: int = 200,
    extrapolate: bool = False,
    progress: Progress = unseen,
) -> SystemIsolation:
    """Modes and steady vibration of rigid bodies on mounts, to the second order of rotations from rest.

    Parameters
    ----------
    source : path of a SYSTEM.toml, or SystemFile
    candidates : str, sequence of str or None   Names of those to compute; all if None.
    base_displacement, base_acceleration, base_rotation, force : float, array_like or None
        One level or several of one of them [m, m/s^2, rad, N]; if None, base displacements of 0.5, 1 and 2 % of the
        free travel of the mounts from static equilibrium to the nearer end of an identified range, the smallest of all.
    directions : str, sequence or None
        Of the excitation, one after the other: "x", "-z" or three components; x, y and z if None. A rotation is about
        such an axis through the origin of the description.
    at : str or None       The point, or the body by its centre of gravity, where a force acts; if None the first body.
    band : tuple or None   Lowest and highest frequency [Hz]; 0.23 times the lowest to 5 times the highest natural
                           frequency of each candidate if None.
    points : int           Number of frequencies, evenly spaced in the logarithm.
    extrapolate : bool     Continue where the motion leaves an identified range, instead of refusing.
    progress : callable    Is called with what is being done, the number of frequencies done, and how many there are.

    Returns
    -------
    SystemIsolation

    Raises
    ------
    MountedSystemError   If the description is wrong, a body cannot rest, or a motion leaves an identified range.
    IsolationError       If an argument is out of bounds, or no steady motion is found.
    """
    checked_count("points", points)
    extrapolate = flag("extrapolate", extrapolate)
    band = None if band is None else limits("band", band, "Hz")
    directions = [directions] if isinstance(directions, str) else directions
    description = source if isinstance(source, SystemFile) else load_system_file(source)
    parts = []
    for label, system in description.chosen_candidates(candidates):
        parts.append(IsolatedSystem.at_rest(label, system, rest(system)))
    kind, about, levels, chosen = _levels(parts, base_displacement, base_acceleration, base_rotation, force)
    if at is not None and kind is not Excitation.FORCE:
        raise IsolationError("`at` says where a force acts; give `force`, too, or leave it out.")
    shakings = [
        _shaking(parts[0].system, kind, direction, about, at)
        for direction in ([_vector(vector) for vector in directions] if directions is not None else np.eye(3).tolist())
    ]
    if directions is None:
        shakings = [shaking for shaking in shakings if all(_moves(part, shaking) for part in parts)]

    def respond(
        shaking: Shaking, level: float, part: IsolatedSystem, advance: Callable[[float], None]
    ) -> SystemResponse:
        try:
            return system_response(
                part.motion, shaking, level, _band(band, points, part), extrapolate=extrapolate, advance=advance
            )
        except (IsolationError, MountedSystemError) as refusal:
            raise type(refusal)("{where}: {refusal}", where=f"{part.label}, {shaking.name}", refusal=refusal) from None

    motions = [
        (f"{shaking.name}, {shaking.level_text(level)}", partial(respond, shaking, level))
        for shaking in shakings
        for level in levels
    ]
    path = None if isinstance(source, SystemFile) else os.fspath(source)
    return SystemIsolation(description.name, path, with_responses(parts, motions, points, progress), chosen)


def _levels(
    parts: Sequence[IsolatedSystem],
    base_displacement: ArrayLike | None,
    base_acceleration: ArrayLike | None,
    base_rotation: ArrayLike | None,
    force: ArrayLike | None,
) -> tuple[Excitation, Vector | None, tuple[float, ...], str]:
    """The excitation, a place of its axis if it turns the base, its levels, and how they were chosen."""
    if base_rotation is not None:
        if not (base_displacement is None and base_acceleration is None and force is None):
            raise IsolationError("`base_rotation` and other excitations exclude each other; give one of them.")
        angles = positive_levels("base rotation", base_rotation, "rad")
        return Excitation.BASE_DISPLACEMENT, _ORIGIN, angles, ""
    given = given_levels(base_displacement, base_acceleration, force)
    if given is not None:
        return given[0], None, given[1], ""
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


def _band(limits: tuple[float, float] | None, points: int, part: IsolatedSystem) -> np.ndarray:
    """Frequencies evenly spaced in the logarithm [Hz]."""
    if limits is None:
        held = [mode.frequency for mode in part.modes if mode.frequency > 0.0]
        return np.geomspace(DEFAULT_BAND[0] * held[0], DEFAULT_BAND[1] * held[-1], points)
    return np.geomspace(*checked_limits(limits), points)


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


def _response_json(response: SystemResponse) -> dict[str, Any]:
    series = _series(response)
    return {
        "excitation": response.shaking.name,
        "direction": response.shaking.direction,
        "level": response.level,
        "unit": response.shaking.unit,
        "gain_unit": response.gain_unit,
        "resonances": [asdict(resonance) for resonance in response.resonances],
        "cautions": [*gathered(response.findings, Reader.FILE)],
        "errors_against_time_integration": [asdict(error) for error in response.errors],
        "frequency": response.frequency.tolist(),
        "points": [
            {"name": point.name, **{column.key: values[:, p].tolist() for column, values in series}}
            for p, point in enumerate(response.points)
        ],
        "base_force": np.abs(response.base_force).tolist(),
        "axes": [
            {"name": name, "min": response.low[:, k].tolist(), "max": response.high[:, k].tolist()}
            for k, name in enumerate(response.axes)
        ],
        "stable": response.stable.tolist(),
        "requested": response.requested.tolist(),
        "extrapolating": response.extrapolating.tolist(),
    }
