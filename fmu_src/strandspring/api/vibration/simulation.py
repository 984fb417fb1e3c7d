"""`simulate`: a SYSTEM.toml in, a verdict on every candidate in every load case out."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...campaigns.jobs.threads import in_threads
from ...errors import MountedSystemError, Reader
from ...findings import Finding, gathered
from ...ground.arguments import flag, workers_of
from ...ground.files import refuse_unwritable, write_csv
from ...ground.options import takes
from ...ground.result_columns import ResultColumn
from ...kernel.arrays import FloatArray
from ...vibration.bodies.modes import Mode
from ...vibration.bodies.rest import mount_loads
from ...vibration.description.system_file import SystemFile, load_system_file
from ...vibration.options import Run
from ...vibration.verdicts.answers import (
    CandidateAnswer,
    CaseAnswer,
    answer_candidate,
    answer_case,
    findings_of,
    overall_verdicts,
    untested,
)
from ...vibration.verdicts.courses import Courses
from ...vibration.verdicts.drawn_springs import Drawn
from ...vibration.verdicts.draws import Unknowns
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.model_source import Progress, unseen
from ..common.result import PlottedResult, Table, picked, records
from ..common.text import counted
from .candidates import RestingSystem, rest_tables

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

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
            headings, columns = zip(*_histories(answer, courses), strict=True)
            write_csv(path, headings, np.column_stack(columns).tolist())
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
            at_rest = [
                RestingSystem(one.name, one.system, one.static.poses, one.static.tangent, one.static.secant)
                for one in self.candidates
                if one.static is not None
            ]
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
    chosen = file.chosen_candidates(candidates)
    draws = file.options.draws if run.draws is None else run.draws
    seed = file.options.seed if run.seed is None else run.seed
    unknowns = {
        name: Unknowns(Drawn.from_models(mounted, file.models), draws, seed, file.options.rest_omega)
        for name, mounted in chosen
    }
    statics = tuple(answer_candidate(name, mounted, file.models, unknowns[name]) for name, mounted in chosen)
    step = run.step or file.options.step
    tasks = [
        partial(answer_case, name, mounted, case, file.limits, unknowns[name], step, with_courses=courses)
        for name, mounted in chosen
        for case in file.chosen_cases(cases)
    ]
    answers: list[CaseAnswer] = []
    room = _MOST_NUMBERS
    for answer in in_threads(tasks, workers):
        if answer.courses is not None:
            room -= answer.courses.size
        answers.append(answer if room >= 0 else replace(answer, courses=None))
        progress(answer.where, len(answers), len(tasks))
    for refusals in (
        [answer.refusal if answer.verdict is CaseVerdict.REFUSED else "" for answer in answers],
        [candidate.refusal for candidate in statics],
    ):
        if all(refusals):
            raise MountedSystemError(refusals[0])
    return Simulation(file, statics, tuple(answers))


def _histories(answer: CaseAnswer, courses: Courses) -> Iterator[tuple[str, FloatArray]]:
    """Motion over time of the base, the points and the axes of mounts, with headings."""
    histories = courses.histories
    yield "time [s]", histories.time
    vectors = [("base acceleration", "m/s^2", courses.base)]
    for k, point in enumerate(answer.system.points):
        vectors.append((f"{point.name} acceleration", "m/s^2", histories.acceleration[:, k]))
        vectors.append((f"{point.name} displacement", "m", histories.sway[:, k]))
    for name, unit, values in vectors:
        yield from ((f"{name} {way} [{unit}]", along) for way, along in zip("xyz", values.T, strict=True))
    for k, name in enumerate(answer.system.axis_names):
        yield f"{name} displacement of a spring [m]", histories.displacement[:, k]
        yield f"{name} force [N]", histories.force[:, k]


def _candidate(candidate: CandidateAnswer, verdict: CaseVerdict) -> dict[str, Any]:
    """For JSON: the verdict on a candidate in all cases, its static poses and modes."""
    static, system, rest, modes = candidate.static, candidate.system, None, None
    if static is not None:
        pose, forces = static.poses[0], _ranged(np.array([drawn.force for drawn in static.poses]))
        sag, tilt, place = map(_ranged, (static.sag, static.tilt, static.places))
        bodies: dict[str, Any] = {"displacement": pose.displacements, "quaternion": pose.coordinates[:, 3:]}
        bodies |= {"sag": sag, "tilt": tilt}
        axes: dict[str, Any] = {"displacement": pose.displacement, "force": forces, "place_in_range": place}
        rest = {
            "bodies": records("body", (body.name for body in system.bodies), **bodies),
            "axes": records("axis", system.axis_names, **axes),
            "mounts": records("mount", (mount.name for mount in system.mounts), load=mount_loads(system, pose)),
        }
        modes = {"tangent": [*map(_mode, static.tangent)], "secant": [*map(_mode, static.secant)]}
    of = {"name": candidate.name, "verdict": verdict, "refusal": candidate.refusal or None}
    cautions = [*gathered(candidate.findings, Reader.FILE)]
    return {**of, "cautions": cautions, "static_equilibrium": rest, "modes": modes}


def _ranged(values: FloatArray) -> list[dict[str, Any]]:
    """Of each column the nominal value, which comes first, the least and the largest."""
    return records("value", values[0], low=values.min(axis=0), high=values.max(axis=0))


def _mode(mode: Mode) -> dict[str, Any]:
    return {**picked(mode, "frequency", "damping"), "motion": mode.words, "shape": mode.shape}


def _case(answer: CaseAnswer) -> dict[str, Any]:
    """For JSON: a candidate in a case."""
    return {
        "candidate": answer.candidate,
        "case": answer.case.name,
        "text": answer.case.text,
        "verdict": answer.verdict,
        "refusal": answer.refusal or None,
        "figures": [*map(_figure, answer.figures)],
        "nominal": _nominal(answer) if answer.runs else None,
        "draws": {"count": answer.draws, **picked(answer, "refused", "beyond")},
        "cautions": [*gathered(answer.findings, Reader.FILE)],
        "spectra": None if answer.courses is None else _spectra(answer, answer.courses),
    }


def _figure(figure: Figure) -> dict[str, Any]:
    kind = figure.quantity
    return {**vars(figure), "quantity": kind.value, "unit": kind.unit, "margin": figure.margin}


def _nominal(answer: CaseAnswer) -> dict[str, Any]:
    """The run with springs as identified."""
    run, use, system = answer.runs[0], answer.uses[0], answer.system
    of_axes = {"range_low": use.low, "range_high": use.high, "static_equilibrium": use.rest, "share_used": use.share,
               "stop_deflection": use.stop_deflection, "stop_force": use.stop_force}  # fmt: skip
    return {
        "step": run.step,
        "energies": {**vars(run.energies), "residual": run.energies.residual},
        "relative_energy_residual": run.energies.relative_residual,
        "points": records("point", (point.name for point in system.points), **picked(run.figures, *_OF_POINTS)),
        "axes": records("axis", system.axis_names, **of_axes, **picked(run.figures, *_OF_AXES)),
    }


def _spectra(answer: CaseAnswer, courses: Courses) -> dict[str, Any]:
    """Shock response (maximax) and power spectra of base and points, along x, y and z."""

    def of(points: Sequence[Sequence[Any]], base: Sequence[Any], key: str) -> dict[str, Any]:
        along = [[getattr(spectrum, key) for spectrum in spectra] for spectra in (base, *points)]
        names = (point.name for point in answer.system.points)
        return {"base": along[0], "points": dict(zip(names, along[1:], strict=True))}

    form: dict[str, Any] = {"interval": courses.interval, "shock": None, "power": None}
    if shock := courses.shock:
        first = {"damping": courses.damping, "frequency": shock[0][0].frequency}
        form["shock"] = {**first, **of(shock, courses.base_shock, "maximax")}
    if power := courses.power:
        first = picked(power[0][0], "frequency", "relative_error")
        form["power"] = {**first, **of(power, courses.base_power, "density")}
    return form
