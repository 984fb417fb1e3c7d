"""A SYSTEM.toml: its candidates at rest, their steady vibration, and a verdict on each in every load case."""

from __future__ import annotations

import math
import os
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, groupby
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...campaigns.jobs.threads import in_threads
from ...errors import IsolationError, MountedSystemError, Reader
from ...findings import Finding, gathered
from ...ground.arguments import flag, workers_of
from ...ground.files import refuse_unwritable, write_csv
from ...ground.options import changed, takes
from ...ground.result_columns import ResultColumn, columns_of
from ...kernel.arrays import FloatArray
from ...vibration.bodies.modes import Mode, modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import RestPose, mount_loads, rest
from ...vibration.bodies.shaken_system import ShakenSystem
from ...vibration.bodies.shaking import Shaking
from ...vibration.bodies.six_response import DIRECTIONS, PointResonance, SystemResponse, all_points, system_response
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import SystemFile, load_system_file
from ...vibration.description.table_types import read_direction
from ...vibration.one_mass.band import DEFAULT_BAND
from ...vibration.one_mass.options import Curve, Excitation, Levels
from ...vibration.options import Run
from ...vibration.verdicts.answers import (
    CandidateAnswer,
    CaseAnswer,
    answer_candidate,
    answer_case,
    findings_of,
    overall_verdicts,
    shared,
    untested,
)
from ...vibration.verdicts.cautions import catalogue_cautions
from ...vibration.verdicts.courses import Courses
from ...vibration.verdicts.drawn_springs import Drawn
from ...vibration.verdicts.draws import Unknowns
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.model_source import Progress, unseen
from ..common.result import PlottedResult, Table, picked, records
from ..common.text import counted
from .isolation import SteadyResult

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...report.drawing import Chart

_CANDIDATE = ResultColumn("candidate", "", "candidate", "candidate")
_PHASE = ResultColumn("phase", "deg", "phase")
_ROUNDING = 1e-6  # of a point's largest gain, up to which another is rounding and has no phase
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
_MOST_NUMBERS = 50_000_000  # of the histories of all answers
_LONGEST = 100  # of the name of a file
_FIGURES = tuple(
    ResultColumn(key, "", key)
    for key in ("candidate", "case", "verdict", "quantity", "subject", "unit", "value", "error", "low", "high", "limit",
                "margin", "beyond")
)  # fmt: skip
_CASE = ResultColumn("case", "", "case", "case")
_SHARE = ResultColumn("share", "1", "share of the limit", "of limit", "%", 100.0)
_RANGES = {
    kind: replace(kind.column, short="accel." if kind is FigureKind.ACCELERATION else kind.value, digits=3)
    for kind in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.STROKE, FigureKind.TILT,
                 FigureKind.RMS_ACCELERATION, FigureKind.RMS_SWAY)
}  # fmt: skip
_FIRST = [*_RANGES.values()][:3]
_ANSWERS = (
    _CASE,
    ResultColumn("verdict", "", "verdict", "verdict"),
    *_FIRST,
    ResultColumn("nearest", "", "nearest limit", "nearest limit"),
    ResultColumn("nearest of", "", "what it is of", "of"),
)
_DETAILS = (
    _CASE,
    *(ResultColumn(f"{column.key} of", "", f"{column.words} of", f"{column.short} of") for column in _FIRST),
    *[*_RANGES.values()][3:],
    ResultColumn("error", "1", "largest numerical error", "error", "%", 100.0, 2),
    ResultColumn("draws", "", "draws", "draws", digits=9),
    ResultColumn("beyond", "1", "draws beyond a limit", "beyond a limit", "%", 100.0, 3),
    ResultColumn("refused", "", "refused draws", "refused", digits=9),
    ResultColumn("step", "s", "step of the nominal run", "step", "us", 1e6),
    ResultColumn("residual", "1", "energy residual", "energy residual", "%", 100.0, 2),
)
# Of runs, by their names there and in JSON.
_OF_POINTS = ("acceleration", "acceleration_time", "acceleration_components", "sway", "sway_components",
              "rms_acceleration", "rms_sway")  # fmt: skip
_OF_AXES = ("displacement_low", "displacement_high", "force", "rate", "omega_low", "omega_high", "absorbed")


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

    def response(self, shaking: Shaking, level: float, curve: Curve) -> SystemResponse:
        """Its steady motions under one level of what shakes it."""
        held = [mode.frequency for mode in self.modes if mode.frequency > 0.0]
        band = np.geomspace(*(curve.band or (DEFAULT_BAND[0] * held[0], DEFAULT_BAND[1] * held[-1])), curve.points)
        return system_response(self.motion, shaking, level, band, extrapolate=curve.extrapolate)

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


@dataclass(frozen=True, eq=False, repr=False)
class SystemIsolation(SteadyResult):
    """Steady vibration of the candidates of a description.

    Attributes
    ----------
    name : str
    source : str or None                  Path as it was given; None for a description in memory.
    candidates : tuple of RestingSystem   With their responses.
    levels_chosen : str                   How the levels were chosen; empty if they were given.
    """

    name: str
    source: str | None
    candidates: tuple[RestingSystem, ...]
    levels_chosen: str = ""

    _labels = (_CANDIDATE, ResultColumn("excitation", "", "excitation", "excitation"))
    _parts = property(attrgetter("candidates"))
    _size = (12.0, 9.5)
    _stated: ClassVar[Mapping[str, Any]] = {}  # each candidate and response says its own

    @property
    def _figures(self) -> list[ResultColumn]:
        gain = self.candidates[0].responses[0].gain_column
        return [gain if column.key == gain.key else column for column in columns_of(PointResonance)]

    @property
    def table(self) -> Table:
        """All points of the curves, under headings with units."""
        rows = []
        for candidate, response in self.every:
            level = f"level [{response.shaking.unit}]"
            of = {"candidate": candidate.label, "excitation": response.excitation, level: response.level}
            curve = _headed(candidate.system, response)
            points = zip(*(values.tolist() for values in curve.values()), strict=True)
            rows += [{**of, **dict(zip(curve, point, strict=True))} for point in points]
        return Table([ResultColumn(heading, "", heading) for heading in dict.fromkeys(chain(*rows))], rows)

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """Static equilibrium, modes, and of each point the largest resonance."""
        yield f"{self.name} ({self.source})" if self.source is not None else self.name
        yield from rest_tables(self.candidates, brief)
        if self.levels_chosen:
            yield self.levels_chosen
        same = ("candidate", "excitation", "level", "point")
        of_points = groupby(self._peaks.rows, key=lambda row: [row[key] for key in same])
        rows = [max(rows, key=lambda row: row["gain"]) for _, rows in of_points]
        yield self._shown(replace(self._peaks, rows=rows))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of springs from a catalogue, and of each curve."""
        of_springs = {candidate.label: [*catalogue_cautions(candidate.system)] for candidate in self.candidates}
        return (*shared(of_springs), *self._of_curves)

    def content(self) -> Mapping[str, Any]:
        """The candidates with their responses."""
        candidates = []
        for one in self.candidates:
            of = {"name": one.label, "cautions": [*gathered(catalogue_cautions(one.system), Reader.FILE)]}
            candidates.append({**of, **one.content(), "responses": [*map(_response_content, one.responses)]})
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

    @property
    def _grid(self) -> tuple[int, int]:  # type: ignore[override]
        return 2, len({response.excitation for _, response in self.every})

    @property
    def _panels(self) -> tuple[str, list[Chart]]:
        """Gain above sway, a column for each excitation: colours tell points and candidates, and dashes levels."""
        from ...report.drawing import Steady, steady_chart

        gains, sways = defaultdict[str, list[Steady]](list), defaultdict[str, list[Steady]](list)
        for candidate, response in self.every:
            of, gain = f"{candidate.label}, " if len(self.candidates) > 1 else "", response.gain_column
            largest = gain.factor * np.abs(response.gain).max(axis=2)
            for p, point in enumerate(response.points):
                name = (f"{of}{point.name}", response.level_text)
                curve = Steady(response.frequency, largest[:, p], response.stable, *name)
                gains[response.excitation].append(curve)
                sways[response.excitation].append(curve._replace(values=1e3 * response.sway[:, p]))
        label = f"{gain.short or 'motion'} [{gain.shown or '-'}], largest of x, y and z"
        above = [steady_chart(label, curves, excitation) for excitation, curves in gains.items()]
        return self.name, above + [steady_chart("sway [mm]", curves) for curves in sways.values()]


def shakings_of(parts: Sequence[RestingSystem], kind: Excitation, levels: Levels) -> list[Shaking]:
    """What shakes a system along or about each direction, by default those in which some body is free to follow; a
    force acts on the first point by default.
    """
    given = [levels.directions] if isinstance(levels.directions, str) else levels.directions
    points = {point.name: point for point in all_points(parts[0].system)}
    if levels.at is not None and levels.at not in points:
        raise IsolationError(f"`at` must be one of the points {', '.join(points)}, got {levels.at!r}.")
    point = points[levels.at or next(iter(points))]
    about, shakings = None if levels.rotation is None else (0.0, 0.0, 0.0), []
    for way in DIRECTIONS if given is None else given:
        try:
            direction = read_direction(way if isinstance(way, str) else np.ravel(way).tolist()).vector
        except ValueError as problem:
            raise IsolationError(f"An entry of `directions` {problem}.") from None
        shaking = Shaking(kind, direction, about, point.body, point.place)
        if given is not None or all(ShakenSystem(part.motion, shaking, 1.0).moves for part in parts):
            shakings.append(shaking)
    return shakings


def _series(response: SystemResponse) -> dict[ResultColumn, NDArray[Any]]:
    """Figures of each point over the curve, shape (P, F, 3), or (P, F) without a direction."""
    gain = np.abs(response.gain)
    has_phase = gain > _ROUNDING * gain.max(axis=2, keepdims=True)
    phase = np.where(has_phase, np.degrees(np.angle(response.gain)), np.nan)
    figures = {response.gain_column: gain, _PHASE: phase, FigureKind.ACCELERATION.column: response.acceleration}
    figures[FigureKind.SWAY.column] = response.sway
    return {column: values.swapaxes(0, 1) for column, values in figures.items()}


def _headed(system: MountedSystem, response: SystemResponse) -> dict[str, NDArray[Any]]:
    """A curve under the headings of files."""
    curve: dict[str, NDArray[Any]] = {"frequency [Hz]": response.frequency}
    for p, point in enumerate(response.points):
        for column, values in _series(response).items():
            ways = [f"{point.name} {way}" for way in DIRECTIONS] if values.ndim == 3 else [point.name]
            curve |= zip((f"{way}: {column.file_heading}" for way in ways), np.atleast_3d(values)[p].T, strict=True)
    curve |= _along("force on the base", "N", np.abs(response.base_force))
    curve |= {f"{body.name}: tilt [deg]": np.degrees(response.tilt[:, k]) for k, body in enumerate(system.bodies)}
    for k, axis in enumerate(response.axes):
        for end, values in (("lowest", response.low), ("highest", response.high)):
            curve[f"{end} displacement of {axis} [m]"] = values[:, k]
    flags = {"stable": response.stable, "requested frequency": response.requested}
    return {**curve, **flags, "outside the identified range": response.extrapolating}


def _response_content(response: SystemResponse) -> dict[str, Any]:
    series = {column.key: values for column, values in _series(response).items()}
    return {
        **picked(response, "excitation"),
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


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(PlottedResult):
    """Candidates under load cases.

    Attributes
    ----------
    file : SystemFile
    candidates : tuple of CandidateAnswer   Static pose and modes of each.
    answers : tuple of CaseAnswer           Of each candidate in each case, in their order.
    """

    _stated: ClassVar[Mapping[str, Any]] = {}  # each candidate and case says its own
    _size = (9.0, 6.0)

    file: SystemFile
    candidates: tuple[CandidateAnswer, ...]
    answers: tuple[CaseAnswer, ...]

    @property
    def table(self) -> Table:
        """One row for each figure of each case, in SI units; a refused case, and a limit that no case tests, have one
        without a figure.
        """
        rows: list[dict[str, Any]] = []
        for answer in self.answers:
            head = {"candidate": answer.candidate, "case": answer.case.name, "verdict": answer.verdict.value}
            rows += [head | figure for figure in map(_figure, answer.figures)] or [head]
        for kind in untested(self.answers):
            left: dict[str, Any] = {"verdict": CaseVerdict.NOT_TESTED.value, "quantity": kind.value, "unit": kind.unit}
            left["limit"] = self.file.limits.of_all.get(kind)
            rows += [{"candidate": one.name, **left} for one in self.candidates]
        return Table(_FIGURES, rows)

    def verdicts(self) -> pd.DataFrame:
        """Candidates down, cases across, and the verdict of each; "all cases" is that on all together."""
        import pandas as pd

        verdicts = {(answer.candidate, answer.case.name): answer.verdict.value for answer in self.answers}
        verdicts |= {(name, "all cases"): verdict.value for name, verdict in overall_verdicts(self.answers).items()}
        return pd.Series(verdicts).unstack(sort=False)

    _overview = verdicts

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a report: a page (.html) that opens offline; print it from a browser for a PDF.

        Raises
        ------
        StrandspringError   If the ending is another, or the file cannot be written.
        """
        from ...report.system_pages import write_simulation

        write_simulation(os.fspath(path), self.file, self.candidates, self.answers, self.parts(brief=False))

    def save_histories(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the histories of each answer into a CSV file of its own, with units in the header.

        Returns
        -------
        list of Path   The files, "candidate_case.csv".

        Raises
        ------
        StrandspringError   If there are none, or a file cannot be written.
        """
        from ...fmu.system.system_variables import unique_names  # slow to import

        kept = [(answer, courses) for answer in self.answers if (courses := answer.courses) is not None]
        if not kept:
            raise MountedSystemError("No histories were kept; simulate with `courses`, and fewer cases or candidates.")
        target = Path(folder)
        refuse_unwritable(target, is_folder=True)
        target.mkdir(parents=True, exist_ok=True)
        names = unique_names((f"{answer.candidate}_{answer.case.name}" for answer, _ in kept), _LONGEST, "+-")
        written = [target / f"{name}.csv" for name in names]
        for path, (answer, courses) in zip(written, kept, strict=True):
            columns = _histories(answer.system, courses)
            write_csv(path, [*columns], np.column_stack([*columns.values()]).tolist())
        return written

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw acceleration against stroke of all answers, with verdicts, into axes, new ones if None."""
        from ...report.system_pages import acceleration_against_stroke

        (axis,) = self._axes(ax)
        return acceleration_against_stroke(self.answers).draw(axis)

    def content(self) -> Mapping[str, Any]:
        """Limits, candidates and cases."""
        limits, overall = self.file.limits, overall_verdicts(self.answers)
        tested = limits.tested([answer.case for answer in self.answers if answer.candidate == self.candidates[0].name])
        return {
            "system": self.file.name,
            "limits": {kind.name.lower(): limit for kind, limit in {**limits.of_all, **limits.of_kind}.items()},
            "tested": {kind.name.lower(): names for kind, names in tested.items()},
            "candidates": [_candidate(candidate, overall[candidate.name]) for candidate in self.candidates],
            "cases": [_case(answer) for answer in self.answers],
        }

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Limits that are not tested, and what is to be known of candidates, and of each in each case."""
        not_tested = (kind.untested for kind in untested(self.answers))
        return (*not_tested, *findings_of(self.candidates, self.answers))

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """Verdicts, ranges of the worst figures, refusals; and unless it is brief where they are, poses and modes."""
        counts = Counter(answer.verdict for answer in self.answers)
        verdicts = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in CaseVerdict if counts[verdict])
        cases = {answer.case.name for answer in self.answers}
        where = f"{counted(len(self.candidates), 'candidate')} in {counted(len(cases), 'load case')}"
        left = ", ".join(kind.value for kind in untested(self.answers))
        yield f"{self.file.name}: {where}: {verdicts}{'; limits not tested: ' if left else ''}{left}"
        rows = list(self._answer_rows())
        yield Table(_ANSWERS, rows, details=["nearest of"])
        refused = {candidate.name: candidate.refusal for candidate in self.candidates}
        yield from (f"{name}: refused: {refusal}" for name, refusal in refused.items() if refusal)
        for answer in self.answers:
            if answer.refusal and answer.refusal != refused.get(answer.candidate):
                draws = f"{answer.refused} of {answer.draws} draws refused, most often" if answer.draws else "refused"
                yield f"{answer.where}: {draws}: {answer.refusal}"
        if not brief:
            yield Table(_DETAILS, rows, "Where the figures are largest, others, and their numerical errors and draws:")
            known = [(one, one.static) for one in self.candidates if one.static is not None]
            at_rest = [RestingSystem(one.name, one.system, of.poses, of.tangent, of.secant) for one, of in known]
            yield from rest_tables(at_rest, brief=False)

    def _answer_rows(self) -> Iterator[dict[str, Any]]:
        """A row for each candidate, with one for each of its cases below."""
        for candidate, verdict in overall_verdicts(self.answers).items():
            yield {"case": f"{candidate}:", "verdict": verdict.value}
            for answer in (answer for answer in self.answers if answer.candidate == candidate):
                row: dict[str, Any] = {"case": f"  {answer.case.name}", "verdict": answer.verdict.value}
                for kind, column in _RANGES.items():
                    if (worst := answer.worst(kind)) is not None:
                        row |= {column.key: (worst.low, worst.high), f"{column.key} of": worst.subject}
                if (near := answer.nearest_limit) is not None:
                    row["nearest"] = f"{_SHARE.text(near.share)} % {near.quantity.value}"
                    row["nearest of"] = near.subject
                if answer.runs:
                    row |= {**picked(answer, "draws", "refused", "beyond"), "error": answer.relative_error}
                    row["step"] = answer.runs[0].step
                    row["residual"] = max(run.energies.relative_residual for run in answer.runs)
                yield row


@takes(run=Run)
def simulate(
    system: str | os.PathLike[str] | SystemFile,
    cases: str | Sequence[str] | None = None,
    candidates: str | Sequence[str] | None = None,
    *,
    run: Run,
    workers: int | None = None,
    courses: bool = True,
    progress: Progress = unseen,
) -> Simulation:
    """Simulate bodies on hysteretic mounts under the load cases of a SYSTEM.toml.

    Parameters
    ----------
    system : path or SystemFile
    cases, candidates : str, sequence of str or None
                           Names of those to simulate; all if None. That of a case with several directions is of all.
    run : Run              Draws, their seed, and the time step; or its fields as keywords.
    workers : int or None  Threads; as many as cores if None.
    courses : bool         Whether histories and spectra are kept, as far as memory allows (400 MB).
    progress : callable    Takes what is being done, the number of runs done, and of all.

    Returns
    -------
    Simulation

    Raises
    ------
    MountedSystemError   If the file is wrong, a name is unknown, or no candidate can be simulated in any case.
    """
    workers, courses = workers_of(workers), flag("courses", courses)
    file = system if isinstance(system, SystemFile) else load_system_file(system)
    of = replace(file.options, **changed(run))
    statics, tasks = [], []
    for name, mounted in file.chosen_candidates(candidates):
        unknowns = Unknowns(Drawn.from_models(mounted, file.models), of.draws, of.seed, of.rest_omega)
        statics.append(answer_candidate(name, mounted, file.models, unknowns))
        tasks += [
            partial(answer_case, name, mounted, case, file.limits, unknowns, of.step, with_courses=courses)
            for case in file.chosen_cases(cases)
        ]
    answers: list[CaseAnswer] = []
    room = _MOST_NUMBERS
    for answer in in_threads(tasks, workers):
        if answer.courses is not None:
            room -= answer.courses.size
        answers.append(answer if room >= 0 else replace(answer, courses=None))
        progress(answer.where, len(answers), len(tasks))
    if all(one.refusal for one in statics) or all(answer.verdict is CaseVerdict.REFUSED for answer in answers):
        raise MountedSystemError(statics[0].refusal or answers[0].refusal)
    return Simulation(file, tuple(statics), tuple(answers))


def _histories(system: MountedSystem, courses: Courses) -> dict[str, FloatArray]:
    """Motion over time of the base, the points and the axes of mounts, under the headings of files."""
    motion = courses.histories
    columns = {"time [s]": motion.time, **_along("base acceleration", "m/s^2", courses.base)}
    for k, point in enumerate(system.points):
        columns |= _along(f"{point.name} acceleration", "m/s^2", motion.acceleration[:, k])
        columns |= _along(f"{point.name} displacement", "m", motion.sway[:, k])
    for k, name in enumerate(system.axis_names):
        columns[f"{name} displacement of a spring [m]"] = motion.displacement[:, k]
        columns[f"{name} force [N]"] = motion.force[:, k]
    return columns


def _along(name: str, unit: str, values: FloatArray) -> dict[str, FloatArray]:
    """The components of vectors, shape (K, 3), under headings."""
    return {f"{name} {way} [{unit}]": values[:, k] for k, way in enumerate(DIRECTIONS)}


def _candidate(candidate: CandidateAnswer, verdict: CaseVerdict) -> dict[str, Any]:
    """For JSON: the verdict on a candidate in all cases, its static poses and modes."""
    static, system, rest, modes = candidate.static, candidate.system, None, None
    if static is not None:
        pose, names = static.poses[0], [body.name for body in system.bodies]
        drawn = (static.sag, static.tilt, static.places, np.array([one.force for one in static.poses]))
        # The nominal value, which comes first, the least and the largest.
        sag, tilt, place, force = (records("value", of[0], low=of.min(axis=0), high=of.max(axis=0)) for of in drawn)
        turned: dict[str, Any] = {"quaternion": pose.coordinates[:, 3:], "sag": sag, "tilt": tilt}
        sprung: dict[str, Any] = {"force": force, "place_in_range": place}
        rest = {
            "bodies": records("body", names, displacement=pose.displacements, **turned),
            "axes": records("axis", system.axis_names, displacement=pose.displacement, **sprung),
            "mounts": records("mount", (mount.name for mount in system.mounts), load=mount_loads(system, pose)),
        }
        modes = {
            kind: [{**picked(mode, "frequency", "damping"), "motion": mode.words, "shape": mode.shape} for mode in of]
            for kind, of in picked(static, "tangent", "secant").items()
        }
    of = {"name": candidate.name, "verdict": verdict, "refusal": candidate.refusal or None}
    cautions = [*gathered(candidate.findings, Reader.FILE)]
    return {**of, "cautions": cautions, "static_equilibrium": rest, "modes": modes}


def _case(answer: CaseAnswer) -> dict[str, Any]:
    """For JSON: a candidate in a case."""
    names = [point.name for point in answer.system.points]
    return {
        "candidate": answer.candidate,
        "case": answer.case.name,
        "text": answer.case.text,
        "verdict": answer.verdict,
        "refusal": answer.refusal or None,
        "figures": [*map(_figure, answer.figures)],
        "nominal": _nominal(answer, names) if answer.runs else None,
        "draws": {"count": answer.draws, **picked(answer, "refused", "beyond")},
        "cautions": [*gathered(answer.findings, Reader.FILE)],
        "spectra": None if answer.courses is None else _spectra(answer.courses, names),
    }


def _figure(figure: Figure) -> dict[str, Any]:
    kind = figure.quantity
    return {**vars(figure), "quantity": kind.value, "unit": kind.unit, "margin": figure.margin}


def _nominal(answer: CaseAnswer, names: Sequence[str]) -> dict[str, Any]:
    """The run with springs as identified."""
    run, use = answer.runs[0], answer.uses[0]
    of_axes = {"range_low": use.low, "range_high": use.high, "static_equilibrium": use.rest, "share_used": use.share,
               "stop_deflection": use.stop_deflection, "stop_force": use.stop_force}  # fmt: skip
    return {
        "step": run.step,
        "energies": {**vars(run.energies), "residual": run.energies.residual},
        "relative_energy_residual": run.energies.relative_residual,
        "points": records("point", names, **picked(run.figures, *_OF_POINTS)),
        "axes": records("axis", answer.system.axis_names, **of_axes, **picked(run.figures, *_OF_AXES)),
    }


def _spectra(courses: Courses, names: Sequence[str]) -> dict[str, Any]:
    """Shock response (maximax) and power spectra of base and points, along x, y and z."""

    def of(key: str, *spectra: Sequence[Any]) -> dict[str, Any]:
        base, *points = ([getattr(spectrum, key) for spectrum in along] for along in spectra)
        return {"base": base, "points": dict(zip(names, points, strict=True))}

    form: dict[str, Any] = {"interval": courses.interval, "shock": None, "power": None}
    if shock := courses.shock:
        first = {"damping": courses.damping, "frequency": shock[0][0].frequency}
        form["shock"] = {**first, **of("maximax", courses.base_shock, *shock)}
    if power := courses.power:
        first = picked(power[0][0], "frequency", "relative_error")
        form["power"] = {**first, **of("density", courses.base_power, *power)}
    return form
