"""`simulate`: a SYSTEM.toml in, a verdict on every candidate in every load case out."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, count
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
from ...vibration.verdicts.static_answer import SECANT_SHARE
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.progress import Progress, unseen
from ..common.result import PlottedResult
from ..common.table import Table
from ..common.text import counted

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_NUMBERS = 50_000_000  # of the histories of all answers
_FIGURES = tuple(
    ResultColumn(key, "", key)
    for key in ("candidate", "case", "verdict", "quantity", "subject", "unit", "value", "error", "low", "high", "limit",
                "margin", "beyond")
)  # fmt: skip
_CASE = (ResultColumn("candidate", "", "candidate", "candidate"), ResultColumn("case", "", "case", "case"))
_SHARE = ResultColumn("share", "1", "share of the limit", "of limit", "%", 100.0)
_VERDICTS = (
    _CASE[1],
    ResultColumn("verdict", "", "verdict", "verdict"),
    *(
        replace(kind.column, short=short, digits=3)
        for kind, short in {
            FigureKind.ACCELERATION: "accel.",
            FigureKind.SWAY: "sway",
            FigureKind.STROKE: "stroke",
        }.items()
    ),
    ResultColumn("nearest", "", "nearest limit", "nearest limit"),
)
_POSES = (
    _CASE[0],
    ResultColumn("body", "", "body", "body"),
    *(ResultColumn(way, "m", f"displacement along {way}", way, "mm", 1e3, 3) for way in "xyz"),
    ResultColumn("tilt", "rad", "tilt", "tilt up to", "deg", math.degrees(1.0), 3),
    ResultColumn("places", "1", "place of springs in their ranges", "springs at", "% of range", 100.0, 2),
    ResultColumn("axis", "", "axis that the weight moves most", "most moved axis"),
    ResultColumn("moved", "m", "motion of that axis", "by", "mm", 1e3, 3),
)
_MODES = (
    _CASE[0],
    ResultColumn("number", "", "mode", "mode"),
    ResultColumn("frequency", "Hz", "natural frequency", "Hz"),
    ResultColumn("motion", "", "motion", "motion"),
    ResultColumn("secant", "Hz", "secant frequency", "secant", "Hz"),
    ResultColumn("damping", "1", "damping", "damping", "%", 100.0, 2),
)
# The kinds of figures that are printed, each with what it is of.
_JUDGED = {
    FigureKind.ACCELERATION: "at point",
    FigureKind.SWAY: "at point",
    FigureKind.TILT: "of body",
    FigureKind.STROKE: "of mount",
}
_WORST = (
    *_CASE,
    *(
        column
        for kind, of in _JUDGED.items()
        for column in (
            kind.column,
            replace(_SHARE, key=f"{kind.column.key}_share", digits=3),
            ResultColumn(f"{kind.column.key}_subject", "", of, of),
        )
    ),
    ResultColumn("error", "1", "largest numerical error", "error", "%", 100.0, 2),
)
_RUNS = (
    *_CASE,
    ResultColumn("draws", "", "draws", "draws", digits=9),
    ResultColumn("beyond", "1", "draws beyond a limit", "beyond a limit", "%", 100.0, 3),
    ResultColumn("refused", "", "refused draws", "refused", digits=9),
    ResultColumn("step", "s", "step of the nominal run", "step", "us", 1e6),
    ResultColumn("residual", "1", "energy residual", "energy residual", "%", 100.0, 2),
)
_SETTLED = (
    *_CASE,
    ResultColumn("point", "", "point", "point"),
    *(
        ResultColumn(f"{way} {unit}", "", f"{way} {unit}", f"{way} {unit}", digits=3)
        for unit in ("g", "mm")
        for way in "xyz"
    ),
)
# Arrays of runs by their keys in JSON: of each point, and of each axis.
_OF_POINT = {
    key: key
    for key in ("acceleration", "acceleration_time", "acceleration_components", "sway", "sway_components",
                "rms_acceleration", "rms_sway")
}  # fmt: skip
_OF_USE = {"range_low": "low", "range_high": "high", "static_equilibrium": "rest", "share_used": "share",
           "stop_deflection": "stop_deflection", "stop_force": "stop_force"}  # fmt: skip
_OF_AXIS = {
    key: key
    for key in ("displacement_low", "displacement_high", "force", "rate", "omega_low", "omega_high", "absorbed")
}
_LONGEST = 100  # of the name of a file


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
        """One row for each figure of each case, in SI units; a refused case has one row without a figure, and a limit
        that no case tests one for each candidate without a case.
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
        """Candidates down, cases across, and the verdict of each; "all cases" is that on all of them together."""
        import pandas as pd

        cases = list(dict.fromkeys(answer.case.name for answer in self.answers))
        table = {name: {"all cases": verdict.value} for name, verdict in overall_verdicts(self.answers).items()}
        for answer in self.answers:
            table[answer.candidate][answer.case.name] = answer.verdict.value
        return pd.DataFrame.from_dict(table, orient="index", columns=[*cases, "all cases"])

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
        list of Path         The files, "candidate_case.csv".

        Raises
        ------
        StrandspringError    If there are none, or a file cannot be written.
        """
        kept = [answer for answer in self.answers if answer.courses is not None]
        if not kept:
            raise MountedSystemError("No histories were kept; simulate with `courses`, and fewer cases or candidates.")
        target = Path(folder)
        refuse_unwritable(target, is_folder=True)
        target.mkdir(parents=True, exist_ok=True)
        names = unique_names([f"{answer.candidate}_{answer.case.name}" for answer in kept])
        written = []
        for name, answer in zip(names, kept, strict=True):
            path = target / f"{name}.csv"
            header, rows = history_table(answer)
            write_csv(path, header, rows)
            written.append(path)
        return written

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw acceleration against stroke of all answers, with verdicts, into axes of matplotlib, new ones if None."""
        from ...report.drawing import draw
        from ...report.system_charts import acceleration_against_stroke

        (axis,) = self._axes(ax)
        return draw(acceleration_against_stroke(self.answers), axis)

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
        """Verdicts, the range of the worst figures, and refusals; and unless it is brief static poses, modes, the error
        of each figure and energy balances.
        """
        counts = Counter(answer.verdict for answer in self.answers)
        verdicts = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in CaseVerdict if counts[verdict])
        cases = {answer.case.name for answer in self.answers}
        where = f"{counted(len(self.candidates), 'candidate')} in {counted(len(cases), 'load case')}"
        left = ", ".join(kind.value for kind in untested(self.answers))
        yield f"{self.file.name}: {where}: {verdicts}{'; limits not tested: ' if left else ''}{left}"
        yield Table(_VERDICTS, list(self._verdict_rows(brief)))
        yield from _refusals(self.candidates, self.answers)
        if not brief:
            yield from self._detail_tables()

    def _verdict_rows(self, brief: bool) -> Iterator[dict[str, Any]]:
        overall = overall_verdicts(self.answers)
        for candidate, verdict in overall.items():
            yield {"case": f"{candidate}:", "verdict": verdict.value}
            for answer in self.answers:
                if answer.candidate != candidate:
                    continue
                row: dict[str, Any] = {"case": f"  {answer.case.name}", "verdict": answer.verdict.value}
                worst = {kind.column.key: answer.worst(kind) for kind in _JUDGED}
                row |= {key: (figure.low, figure.high) for key, figure in worst.items() if figure is not None}
                if (nearest := answer.nearest_limit) is not None:
                    of = "" if brief else f" of {nearest.subject}"
                    row["nearest"] = f"{_SHARE.text(nearest.share)} % {nearest.quantity.value}{of}"
                yield row

    def _detail_tables(self) -> Iterator[Table]:
        """Static poses, modes, all kinds of figures, draws and steps, and root mean squares."""

        def rows(of: Callable[[Any], Iterator[dict[str, Any]]], parts: Sequence[Any]) -> list[dict[str, Any]]:
            one = {"candidate": None} if len(self.candidates) == 1 else {}
            return [row | one for part in parts for row in of(part)]

        given = self.file.options.rest_omega is not None
        poses = f"Static poses from the nominal ones, {'at the omega that is given' if given else 'with friction'}:"
        share = f"{100.0 * SECANT_SHARE:.0f}"
        modes = f"Modes of small motion (tangent), and of springs moving by {share} % of their free travel (secant):"
        worst = "Largest of what is unknown, and the largest numerical error of any figure:"
        runs = "Draws of omega at rest, springs, mounts and realisations; step of the nominal run:"
        settled = "Root mean squares from the settling on, of sway about its mean:"
        yield Table(_POSES, rows(_pose_rows, self.candidates), poses)
        yield Table(_MODES, rows(_mode_rows, self.candidates), modes)
        yield Table(_WORST, rows(_worst_rows, self.answers), worst)
        yield Table(_RUNS, rows(_run_rows, self.answers), runs)
        yield Table(_SETTLED, rows(_settled_rows, self.answers), settled)

    def _overview(self) -> pd.DataFrame:
        return self.verdicts()


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
    cases, candidates : str, sequence of str or None   Names of those to simulate; all if None. The name of a case with
                                                       several directions stands for all of them.
    run : Run                  Draws, their seed, and the time step; or its fields as keywords.
    workers : int or None      Threads; as many as cores if None.
    courses : bool             Whether histories and spectra are kept, of the first cases as far as memory allows
                               (400 MB); the others have None.
    progress : callable        Is called with what is being done, the number of runs done, and how many there are.

    Returns
    -------
    Simulation

    Raises
    ------
    MountedSystemError         If the file is wrong, a name is unknown, or no candidate can be simulated in any case.
    """
    workers, courses = workers_of(workers), flag("courses", courses)
    file = system if isinstance(system, SystemFile) else load_system_file(system)
    chosen = file.chosen_candidates(candidates)
    loads = file.chosen_cases(cases)
    drawn = file.options.draws if run.draws is None else run.draws
    chosen_seed = file.options.seed if run.seed is None else run.seed
    unknowns = {
        name: Unknowns(Drawn.from_models(mounted, file.models), drawn, chosen_seed, file.options.rest_omega)
        for name, mounted in chosen
    }
    statics = tuple(answer_candidate(name, mounted, file.models, unknowns[name]) for name, mounted in chosen)
    tasks = [
        partial(
            answer_case, name, mounted, case, file.limits, unknowns[name], run.step or file.options.step,
            with_courses=courses,
        )
        for name, mounted in chosen
        for case in loads
    ]  # fmt: skip
    answers: list[CaseAnswer] = []
    room = _MOST_NUMBERS
    for answer in in_threads(tasks, workers):
        if answer.courses is not None:
            room -= answer.courses.size
        answers.append(answer if room >= 0 else replace(answer, courses=None))
        progress(answer.where, len(answers), len(tasks))
    if all(answer.verdict is CaseVerdict.REFUSED for answer in answers):
        raise MountedSystemError(answers[0].refusal)
    refusals = [candidate.refusal for candidate in statics if candidate.refusal]
    if len(refusals) == len(statics):
        raise MountedSystemError(refusals[0])
    return Simulation(file, statics, tuple(answers))


def history_table(answer: CaseAnswer) -> tuple[list[str], Iterable[Iterable[object]]]:
    """Headings and rows: time, base, points and axes of mounts, in SI units.

    Raises
    ------
    MountedSystemError   If the histories were not kept.
    """
    courses = answer.courses
    if courses is None:
        raise MountedSystemError(f"The histories of {answer.candidate} in {answer.case.name} were not kept.")
    histories = courses.histories
    header = ["time [s]", *(f"base acceleration {letter} [m/s^2]" for letter in "xyz")]
    columns = [histories.time[:, None], courses.base]
    for k, point in enumerate(answer.system.points):
        header += [f"{point.name} acceleration {letter} [m/s^2]" for letter in "xyz"]
        header += [f"{point.name} displacement {letter} [m]" for letter in "xyz"]
        columns += [histories.acceleration[:, k], histories.sway[:, k]]
    for k, name in enumerate(answer.system.axis_names):
        header += [f"{name} displacement of a spring [m]", f"{name} force [N]"]
        columns += [histories.displacement[:, k : k + 1], histories.force[:, k : k + 1]]
    return header, np.hstack(columns).tolist()


def unique_names(texts: Sequence[str]) -> list[str]:
    """Names of files made of texts: letters, digits, signs and underscores, each once.

    Examples
    --------
    >>> unique_names(["softer_shock +x", "softer_shock -x", "a/b", "a b"])
    ['softer_shock_+x', 'softer_shock_-x', 'a_b', 'a_b_2']
    """
    names: list[str] = []
    taken: set[str] = set()
    for text in texts:
        name = re.sub(r"[^\w+-]+", "_", text)[:_LONGEST]
        chosen = next(
            variant for variant in chain([name], (f"{name}_{k}" for k in count(2))) if variant.lower() not in taken
        )
        taken.add(chosen.lower())
        names.append(chosen)
    return names


def _pose_rows(candidate: CandidateAnswer) -> Iterator[dict[str, Any]]:
    """Where each body rests; beside the first the places of the springs, and the axis that the weight moves most."""
    static = candidate.static
    if static is None:
        return
    ways = static.poses[0].displacement - np.array([axis.nominal for axis in candidate.system.axes])
    most = int(np.argmax(np.abs(ways)))
    beside: dict[str, Any] = {"places": _ends(static.places), "axis": candidate.system.axis_names[most]}
    beside["moved"] = float(ways[most])
    for k, body in enumerate(candidate.system.bodies):
        moved = np.array([pose.displacements[k] for pose in static.poses])
        ranges = dict(zip("xyz", map(_ends, moved.T), strict=True))
        tilt = float(static.tilt[:, k].max())
        yield {"candidate": candidate.name, "body": body.name, **ranges, "tilt": tilt, **beside}
        beside = {}


def _mode_rows(candidate: CandidateAnswer) -> Iterator[dict[str, Any]]:
    if (static := candidate.static) is None:
        return
    for k, mode in enumerate(static.tangent):
        row = {"candidate": candidate.name, "number": k + 1, "frequency": mode.frequency, "motion": mode.words}
        secant = static.secant[k] if static.secant else None
        yield row if secant is None else {**row, "secant": secant.frequency, "damping": secant.damping}


def _worst_rows(answer: CaseAnswer) -> Iterator[dict[str, Any]]:
    """The figure of each kind that is nearest to its limit, with its subject, and the largest numerical error."""
    if not answer.figures:
        return
    row: dict[str, Any] = {"candidate": answer.candidate, "case": answer.case.name, "error": answer.relative_error}
    for kind in _JUDGED:
        if (figure := answer.worst(kind)) is not None:
            key = kind.column.key
            row |= {key: figure.high, f"{key}_share": figure.share, f"{key}_subject": figure.subject}
    yield row


def _run_rows(answer: CaseAnswer) -> Iterator[dict[str, Any]]:
    if answer.runs:
        yield {
            "candidate": answer.candidate,
            "case": answer.case.name,
            "draws": answer.draws,
            "beyond": answer.beyond if answer.draws else None,
            "refused": answer.refused,
            "step": answer.runs[0].step,
            "residual": max(run.energies.relative_residual for run in answer.runs),
        }


def _settled_rows(answer: CaseAnswer) -> Iterator[dict[str, Any]]:
    for name, values in answer.settled:
        figures = {column.key: value for column, value in zip(_SETTLED[3:], values, strict=True)}
        yield {"candidate": answer.candidate, "case": answer.case.name, "point": name, **figures}


def _ends(values: FloatArray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _refusals(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> Iterator[str]:
    """Why candidates, or cases of them, or draws of these were refused, each once."""
    for candidate in candidates:
        if candidate.refusal:
            yield f"{candidate.name}: refused: {candidate.refusal}"
    refused = {(candidate.name, candidate.refusal) for candidate in candidates}
    for answer in answers:
        if answer.refusal and (answer.candidate, answer.refusal) not in refused:
            draws = f"{answer.refused} of {answer.draws} draws refused, most often" if answer.draws else "refused"
            yield f"{answer.where}: {draws}: {answer.refusal}"


def _candidate(candidate: CandidateAnswer, verdict: CaseVerdict) -> dict[str, Any]:
    """For JSON: the verdict on a candidate in all load cases together, its static poses and modes."""
    static, system = candidate.static, candidate.system
    form = {"name": candidate.name, "verdict": verdict, "refusal": candidate.refusal or None}
    form["cautions"] = [*gathered(candidate.findings, Reader.FILE)]
    if static is None:
        return {**form, "static_equilibrium": None, "modes": None}
    pose, forces = static.poses[0], np.array([drawn.force for drawn in static.poses])
    rest = {
        "bodies": [
            {
                "body": body.name,
                "displacement": pose.displacements[k],
                "quaternion": pose.coordinates[k, 3:],
                "sag": _ranged(static.sag[:, k]),
                "tilt": _ranged(static.tilt[:, k]),
            }
            for k, body in enumerate(system.bodies)
        ],
        "axes": [
            {
                "axis": name,
                "displacement": pose.displacement[k],
                "force": _ranged(forces[:, k]),
                "place_in_range": _ranged(static.places[:, k]),
            }
            for k, name in enumerate(system.axis_names)
        ],
        "mounts": [
            {"mount": mount.name, "load": load}
            for mount, load in zip(system.mounts, mount_loads(system, pose), strict=True)
        ],
    }
    modes = {"tangent": [*map(_mode, static.tangent)], "secant": [*map(_mode, static.secant)]}
    return {**form, "static_equilibrium": rest, "modes": modes}


def _ranged(values: FloatArray) -> dict[str, Any]:
    """The nominal value, which comes first, and the least and the largest of all draws."""
    return {"value": values[0], "low": values.min(), "high": values.max()}


def _mode(mode: Mode) -> dict[str, Any]:
    return {"frequency": mode.frequency, "damping": mode.damping, "motion": mode.words, "shape": mode.shape}


def _case(answer: CaseAnswer) -> dict[str, Any]:
    """For JSON: a candidate in a load case."""
    return {
        "candidate": answer.candidate,
        "case": answer.case.name,
        "text": answer.case.text,
        "verdict": answer.verdict,
        "refusal": answer.refusal or None,
        "figures": [*map(_figure, answer.figures)],
        "nominal": _nominal(answer) if answer.runs else None,
        "draws": {"count": answer.draws, "refused": answer.refused, "beyond": answer.beyond},
        "cautions": [*gathered(answer.findings, Reader.FILE)],
        "spectra": None if answer.courses is None else _spectra(answer, answer.courses),
    }


def _figure(figure: Figure) -> dict[str, Any]:
    """A figure with its margin."""
    kind = figure.quantity
    return {"quantity": kind.value, "unit": kind.unit, **vars(figure), "margin": figure.margin} | {
        "quantity": kind.value
    }


def _nominal(answer: CaseAnswer) -> dict[str, Any]:
    """The run with springs as identified."""
    run, use, system = answer.runs[0], answer.uses[0], answer.system

    def of(holder: Any, number: int, keys: Mapping[str, str]) -> dict[str, Any]:
        return {key: getattr(holder, name)[number] for key, name in keys.items()}

    points = ({"point": point.name, **of(run.figures, k, _OF_POINT)} for k, point in enumerate(system.points))
    axes = (
        {"axis": name, **of(use, k, _OF_USE), **of(run.figures, k, _OF_AXIS)}
        for k, name in enumerate(system.axis_names)
    )
    return {
        "step": run.step,
        "energies": {**vars(run.energies), "residual": run.energies.residual},
        "relative_energy_residual": run.energies.relative_residual,
        "points": [*points],
        "axes": [*axes],
    }


def _spectra(answer: CaseAnswer, courses: Courses) -> dict[str, Any]:
    """Shock response spectra (maximax) and power spectra of the base and the points, along x, y and z."""
    form: dict[str, Any] = {"interval": courses.interval, "shock": None, "power": None}
    names = [point.name for point in answer.system.points]
    if courses.shock:
        of_points = ([each.maximax for each in spectra] for spectra in courses.shock)
        form["shock"] = {
            "damping": courses.damping,
            "frequency": courses.shock[0][0].frequency,
            "base": [spectrum.maximax for spectrum in courses.base_shock],
            "points": dict(zip(names, of_points, strict=True)),
        }
    if courses.power:
        first = courses.power[0][0]
        of_points = ([each.density for each in spectra] for spectra in courses.power)
        form["power"] = {
            "frequency": first.frequency,
            "relative_error": first.relative_error,
            "base": [spectrum.density for spectrum in courses.base_power],
            "points": dict(zip(names, of_points, strict=True)),
        }
    return form
