"""`isolate`: steady motions of a mass on springs or of the bodies of a SYSTEM.toml; and `study`: how resonance scatters
over masses, levels and springs, or the verdicts on a grid of a SYSTEM.toml.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from ...campaigns.jobs.options import Workers
from ...campaigns.jobs.threads import in_threads
from ...campaigns.studies.runs import Runs
from ...campaigns.studies.summaries import QUANTILES, read_results, summaries
from ...errors import IsolationError, ModelError, MountedSystemError, OptionError
from ...findings import Finding
from ...ground.arguments import number, numbers
from ...ground.files import readable
from ...ground.one_thread import one_thread
from ...ground.options import changed, refuse_given, takes
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import counted_from, zero_sentence
from ...model.joint import JointCovariance
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.options import DEFAULT_SHARES, Curve, Excitation, Levels, Mount
from ...vibration.one_mass.system import IsolatedMass, free_travel, static_equilibrium
from ...vibration.options import Part, Run, StudyRun
from ..common.model_source import (
    OF_MODELS,
    OF_SYSTEMS,
    ModelSource,
    Progress,
    is_system,
    model_of,
    origin_of,
    path_of,
    unseen,
)
from ..common.result import PlottedResult, Table, picked
from .isolation import IsolatedModel, Isolation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...campaigns.studies.varied import Given
    from ...vibration.description.system_file import SystemFile
    from .systems import SystemIsolation

_MOST_SHOWN = 1000  # rows in words
_DEFAULT_SHARE = 0.01  # of the free travel
_DRAWS = 100
_CURVE = Curve(points=24)
_INSTEAD = "; give values of it to {to[vary]}, such as body.box.mass=15 kg:25 kg:5."


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(PlottedResult):
    """Runs of a study, and what they say of each candidate at each grid point.

    The figures of a candidate are the worst of all cases; margins are shares of a limit that are left.

    Attributes
    ----------
    study : Runs              A `Study` of a spring, or a `SystemStudy`.
    output : Path or None     File with one line for each run, if one was asked for.
    known : tuple of Finding  What limits the worth of the result whatever its runs say.
    name : str                Of the model or the system.
    zero : float or None      Where displacement of a spring is counted from [m].
    """

    _size = (8.0, 5.5)

    study: Runs[Any]
    _summaries: pd.DataFrame
    output: Path | None
    _frame: pd.DataFrame | None
    known: tuple[Finding, ...]
    name: str
    zero: float | None = None

    def to_frame(self) -> pd.DataFrame:
        """One row for each run with the attributes of `RunRow`, or of a system those of the results file, in SI units
        but for varied values.
        """
        return self._runs().set_axis(self.study.names, axis="columns")

    @property
    def table(self) -> Table:
        """The same, as in the results file."""
        return Table(self.study.columns, _records(self._runs()))

    def _runs(self) -> pd.DataFrame:
        return read_results(self.study, Path(self.output or "")) if self._frame is None else self._frame

    def quantiles(self) -> pd.DataFrame:
        """One row for each candidate at each grid point: what it is, what was counted, and 5, 50 and 95 % quantiles of
        the figures in SI units.
        """
        return self._summaries.copy()

    _overview = quantiles

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What limits the worth of the result."""
        return (*self.known, *chain.from_iterable(map(self.study.findings, _records(self._summaries))))

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - its table knows
        """What was counted, the figures from the 5 to the 95 % quantile, and refusals."""
        study, columns, rows = self.study, [*self.study.head], []
        yield f"{self.name}: {study.headline(self._summaries)}"
        has_ranges = bool(study.draws and study.rows_of_draws)
        if has_ranges:
            yield "Figures are 5 to 95 % of the draws."
        for figure in (figure for figure in study.figures if figure.short):
            median = replace(figure, key=f"{figure.key}_median", short="median", shown="")
            columns += [figure, median] if has_ranges else [figure]
        details = [column.key for column in columns[len(study.head) :] if column.key not in study.few]
        keys = [figure.key for figure in study.figures]
        for point in _records(self._summaries.head(_MOST_SHOWN)):
            known = (key for key in keys if point[f"{key}_median"] is not None)
            rows.append(point | {key: (point[f"{key}_q05"], point[f"{key}_q95"]) for key in known})
        yield Table(columns, rows, details=details, varied={"candidate", "verdict", *keys})
        runs = len(study) // len(self._summaries)
        for row in rows:
            if row["refused"]:
                yield f"  {study.where(row)}: {row['refused']} of {runs} refused, most often: {row['reason']}"
        if more := len(self._summaries) - len(rows):
            yield f"  and {more} more {study.rows_are}, all of them in the results file"
        if self.zero is not None and (counted := zero_sentence(self.zero)):
            yield counted

    def content(self) -> Mapping[str, Any]:
        """What was run, and the quantiles of each candidate at each grid point."""
        of = {"name": self.name} if self.zero is None else {"zero": self.zero}
        counts, points = {"runs": len(self.study), **picked(self.study, "draws", "seed")}, []
        for point in _records(self._summaries):
            figures = {}
            for key in (figure.key for figure in self.study.figures):
                ends = {end: point.pop(f"{key}_{end}") for end in QUANTILES}
                figures[key] = None if None in ends.values() else ends
            points.append({**self.study.stated_point(point), "figures": figures})
        return {**of, **self.study.stated, **counts, "points": points}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw transmissibility over frequency at resonance, or acceleration over stroke of systems by verdicts, with
        bars from 5 to 95 % of the draws, into axes, those of a new figure if None.
        """
        (axes,) = self._axes(ax)
        x, y = (next(figure for figure in self.study.figures if figure.key == key) for key in self.study.drawn)
        for group, look in self.study.groups(self._summaries):
            rows = group.dropna(subset=[f"{figure.key}_median" for figure in (x, y)])
            ends = [f.factor * rows[[f"{f.key}_{end}" for end in QUANTILES]].to_numpy(float).T for f in (x, y)]
            bars = [(median - low, high - median) for low, median, high in ends]
            axes.errorbar(ends[0][1], ends[1][1], xerr=bars[0], yerr=bars[1], elinewidth=0.8, **look)
        axes.set(xlabel=x.label, ylabel=y.label, title=self.name)
        axes.grid(alpha=0.3)
        axes.legend()
        return axes


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a table, None where a value is unknown."""
    rows: Any = table.astype(object).where(table.notna(), None).to_dict("records")
    return list(rows)


@takes(levels=Levels, mount=Mount, curve=Curve)
def isolate(
    models: ModelSource | SystemFile | Sequence[ModelSource],
    mass: float | None = None,
    *,
    levels: Levels,
    mount: Mount,
    curve: Curve,
    zero: str | float | None = None,
    candidates: str | Sequence[str] | None = None,
    progress: Progress = unseen,
) -> Isolation | SystemIsolation:
    """Transmissibility and resonance of a mass on one spring or several, or of bodies on mounts.

    The steady motion is found by harmonic balance and followed through folds; that of a system in all degrees of
    freedom, to the second order of rotations from rest.

    Parameters
    ----------
    models : Spring, path of a model file or FMU, or a sequence of these; or path of a SYSTEM.toml, or SystemFile
    mass : float          On the mount of a model [kg].
    levels : Levels       What shakes the base or the mass; or its fields as keywords. By default base displacements of
                          0.5, 1 and 2 % of the smallest free travel from rest to an end of the identified range.
    mount, curve : Mount, Curve
                          Load and springs of a model, and frequencies; or their fields as keywords.
    zero : "rig", "middle", float or None
        Where displacement of a model is counted from: a displacement of the record [m]; by default as in its FMU.
    candidates : str, sequence of str or None
                          Names of those of a system to compute; all if None.
    progress : callable   Takes the curve that is done, the number of frequencies done, and of all.

    Returns
    -------
    Isolation or SystemIsolation

    Raises
    ------
    ModelError           If a file is not a physically possible spring.
    MountedSystemError   If a system is wrong, a body cannot rest, or a motion leaves an identified range.
    IsolationError       If an argument is out of bounds, the mass cannot rest, or no steady motion is found.
    OptionError          If an option does not apply to what is given.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, isolate
    >>> soft = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "soft")
    >>> stiff = Spring(SpringParameters((0.0, 16000.0), (1.0,), 20.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "stiff")
    >>> result = isolate([soft, stiff], mass=5.0, base_displacement=2e-4, points=8)
    >>> result.resonances()[["model", "frequency", "transmissibility"]].round(1)
       model  frequency  transmissibility
    0   soft        7.7               8.6
    1  stiff       11.0               8.6
    """
    is_one = isinstance(models, str) or not isinstance(models, Sequence)
    sources: Sequence[Any] = [models] if is_one else list(models)  # type: ignore[arg-type]
    if not sources:
        raise IsolationError("Nothing to isolate on; give at least one model.")
    parts: Any
    described = next(filter(is_system, sources), None)
    path = path_of(sources[0] if described is None else described)
    if described is None:
        where = path or "a model"
        if mass is None:
            raise OptionError("Give the {to[mass]} on the spring of {where}.", where=where)
        of_systems = {"directions": levels.directions, "at": levels.at, "base_rotation": levels.rotation}
        refuse_given(OF_SYSTEMS, where, **of_systems, candidates=candidates)
        parts = _loaded(sources, number("mass", mass, "kg"), mount, zero)
    else:
        # Slow to import.
        from ...vibration.description.system_file import load_system_file
        from .systems import RestingSystem, SystemIsolation, shakings_of

        if len(sources) > 1:
            sentence = "describes a whole system and its candidates; give it alone, and models in another call."
            raise OptionError(f"{path} {sentence}")
        refuse_given(f"{OF_MODELS}; leave it out.", path or "a SystemFile", mass=mass, zero=zero, **changed(mount))
        if levels.at is not None and levels.force is None:
            raise OptionError("{to[at]} says where a force acts; give {to[force]}, too, or leave it out.", at=levels.at)
        file = described if path is None else load_system_file(path)
        parts = [RestingSystem.about(label, system) for label, system in file.chosen_candidates(candidates)]
    (kind, heights), chosen = levels.chosen or (Excitation.BASE_DISPLACEMENT, levels.rotation), ""
    if heights is None:
        # Those of the part that has the smallest free travel.
        part = min(parts, key=lambda part: part.free_travel)
        way, heights = f"{1e3 * part.free_travel:.4g} mm", tuple(share * part.free_travel for share in DEFAULT_SHARES)
        of = f"smallest free travel, {way} of {part.label}" if len(parts) > 1 else f"free travel of {way}"
        chosen = f"Levels: 0.5, 1 and 2 % of the {of}."
    shakings: Sequence[Any] = [kind] if described is None else shakings_of(parts, kind, levels)
    runs: list[Any] = []
    responses: dict[Any, list[Any]] = {part: [] for part in parts}
    for part, shaking in product(parts, shakings):
        where = part.label if len(parts) > 1 else ""
        where = where if described is None else f"{part.label}, {shaking.name}"
        runs += [(part, partial(_named, where, part.response, shaking, level, curve)) for level in heights]
    # The systems of equations are too small to be shared among threads.
    with one_thread():
        computed = in_threads(call for _, call in runs)
        for count, ((part, _), response) in enumerate(zip(runs, computed, strict=True), 1):
            responses[part].append(response)
            progress(f"{part.label}, {response.where}", count * curve.points, len(runs) * curve.points)
    moved = tuple(replace(part, responses=tuple(of)) for part, of in responses.items())
    if described is not None:
        return SystemIsolation(file.name, path, moved, chosen)
    return Isolation(moved, kind, heights, chosen)


def _loaded(sources: Sequence[ModelSource], mass: float, mount: Mount, zero: str | float | None) -> list[IsolatedModel]:
    """The mass at rest on each model; models of one name are numbered."""
    contents = [model_of(source) for source in sources]
    names, parts = [content.name for content in contents], []
    for k, (source, content, name) in enumerate(zip(sources, contents, names, strict=True)):
        label = name if names.count(name) == 1 else f"{name} ({names[: k + 1].count(name)})"
        origin = origin_of(source, zero, content.parameters)
        system = IsolatedMass(counted_from(origin, content.parameters), mass, mount)
        equilibrium = _named(label if len(contents) > 1 else "", static_equilibrium, system)
        parts.append(IsolatedModel(label, path_of(source), content, origin, system, equilibrium))
    return parts


def _named(where: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a function returns; its refusal says where it is, if anything."""
    try:
        return function(*arguments)
    except (IsolationError, MountedSystemError) as refusal:
        if not where:
            raise
        raise type(refusal)("{where}: {refusal}", where=where, refusal=refusal) from None


@takes(levels=Levels, mount=Mount, curve=_CURVE, part=Part, run=StudyRun, placing=Workers)
def study(
    model: ModelSource | SystemFile,
    mass: ArrayLike | None = None,
    *,
    vary: Mapping[str, Given] | None = None,
    levels: Levels,
    stiffness: ArrayLike = 1.0,
    mount: Mount,
    curve: Curve,
    part: Part,
    run: StudyRun,
    zero: str | float | None = None,
    placing: Workers,
    output: str | os.PathLike[str] | None = None,
    progress: Progress = unseen,
) -> StudyResult:
    """Run a model over masses, levels, stiffness factors and springs drawn from its uncertainty, or simulate a
    SYSTEM.toml over a grid of its values.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a row with the reason. Figures of a system are the upper ends of their ranges.

    Parameters
    ----------
    model : Spring, or path of a model file, FMU or SYSTEM.toml
    mass : float or array_like        On the mount of a model, each [kg].
    vary : mapping
        Of a system: values of each path, such as "body.box.mass"; `*` stands for all entries of a list. Text is
        LOW:HIGH:COUNT or a list with commas, with one unit: "15 kg:25 kg:5", "4,6,8"; percent are of what the file
        says, other numbers in its `units`. That of "mount.NAME.places" is how many of them have a mount.
    levels, mount, curve : Levels, Mount, Curve
        Of a model, as for `isolate`, but by default a base displacement of 1 % of the free travel.
    stiffness : float or array_like   Factors on all forces of the spring of a model.
    part, run : Part, StudyRun
        Cases and candidates, draws, their seed, and time step of a system; or their fields as keywords.
    zero : str, float or None         Of a model, as for `isolate`.
    placing : Workers
        Where runs are executed, by default in this process; or its fields as keywords. A script that asks for more
        workers must call this below ``if __name__ == "__main__":``.
    output : path or None
        File with one line for each run; the same call continues from finished runs, which are kept beside it.
    progress : callable               Takes what is being done, the number of finished runs, and of all.

    Returns
    -------
    StudyResult

    Raises
    ------
    ModelError           If the model is not a physically possible spring, or has no uncertainty to draw from.
    IsolationError       If an argument is out of bounds, the mass cannot rest, or the runs cannot be executed.
    MountedSystemError   If the SYSTEM.toml is wrong, or a path or a name is unknown.
    OptionError          If an option does not apply to what is given.

    Examples
    --------
    >>> from strandspring import study
    >>> from strandspring.examples.system_models import SYSTEMS
    >>> box = SYSTEMS / "electronics_box.toml"
    >>> result = study(box, vary={"body.box.mass": "15 kg:25 kg:3"}, cases="drop", candidates="softer")
    >>> result.quantiles()[["body.box.mass [kg]", "verdict", "stroke_median"]].round(2)
       body.box.mass [kg]      verdict  stroke_median
    0                15.0         pass           0.65
    1                20.0         pass           0.76
    2                25.0  not decided           0.85
    """
    path = path_of(model)
    where = path or "a model"
    if output is not None and path is not None and Path(output).resolve() == Path(path).resolve():
        raise IsolationError(f"`output` {readable(path)} would overwrite the input; write elsewhere.")
    planned: Runs[Any]
    if is_system(model):
        of_model = {"mass": mass, "zero": zero, "stiffness": None if stiffness == 1.0 else stiffness, **changed(levels)}
        refuse_given(f"{OF_MODELS}{_INSTEAD}", where, **of_model, **changed(mount), **changed(curve, _CURVE))
        if vary is None:
            raise OptionError("Give values to {to[vary]} of {where}.", where=where)
        # Slow to import.
        from ...campaigns.studies.system_planning import planned_study, undrawn
        from ...vibration.description.named_files import FilesOfFolder
        from ...vibration.description.system_file import read_description

        described, files = read_description(where), FilesOfFolder(Path(where).parent)
        try:
            of_system = planned_study(described, files, vary, part, Run(run.draws, run.seed, run.step))
            known = (*(kind.untested for kind in of_system.untested), *undrawn(of_system))
        except MountedSystemError as problem:
            raise MountedSystemError(f"{readable(where)}, {problem}") from None
        planned, name, origin = of_system, described["name"], None
    else:
        only = {"vary": vary, **changed(part), "step": run.step, "directions": levels.directions, "at": levels.at}
        refuse_given(OF_SYSTEMS, where, **only, base_rotation=levels.rotation)
        if mass is None:
            raise OptionError("Give the {to[mass]} on the spring of {where}.", where=where)
        content = model_of(model)  # type: ignore[arg-type]  # no SystemFile
        name, known = content.name, tuple(cautions_in_use(content.name, content))
        origin = origin_of(model, zero, content.parameters)
        spring, masses, given = counted_from(origin, content.parameters), numbers("mass", mass, "kg"), levels.chosen
        if given is None:
            if not masses:
                raise IsolationError("`mass` must hold at least one mass [kg].")
            lightest = IsolatedMass(spring, min(masses), mount)
            travel = free_travel(lightest, static_equilibrium(lightest))
            given = Excitation.BASE_DISPLACEMENT, (_DEFAULT_SHARE * travel,)
        draws, spread = _DRAWS if run.draws is None else run.draws, None
        if draws:
            try:
                spread = JointCovariance.to_draw_from(spring, content.uncertainty)
            except ModelError as problem:
                sentence = "{where}: {problem} Or ask for no draws ({to[draws=0]})."
                raise ModelError(sentence, where=path or name, problem=problem) from None
        factors = numbers("stiffness", stiffness)
        from ...campaigns.studies.definition import Study

        planned = Study(spring, given[0], masses, given[1], factors, draws, run.seed or 0, spread, mount, curve)
    from ...campaigns.studies.execution import run_study  # slow to import

    with TemporaryFolder() as folder:
        results = folder / "results.csv" if output is None else Path(output)
        done = lambda runs: progress("Running", runs, len(planned))  # noqa: E731
        run_study(planned, results, placing, done)
        kept, frame = (results, None) if output is not None else (None, read_results(planned, results))
        return StudyResult(planned, summaries(planned, results), kept, frame, known, name, origin)
