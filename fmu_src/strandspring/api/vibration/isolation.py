"""`isolate`: steady motions of a mass on springs or of the bodies of a SYSTEM.toml.

A part is one of those that are compared, a model or a candidate of a description.
"""

from __future__ import annotations

import os
from abc import abstractmethod
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, islice
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from ...campaigns.jobs.threads import in_threads
from ...errors import IsolationError, MountedSystemError, OptionError
from ...findings import Finding
from ...ground.arguments import number
from ...ground.one_thread import one_thread
from ...ground.options import changed, refuse_given, takes
from ...ground.result_columns import ResultColumn, columns_of
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import counted_from, zero_sentence
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.curve_points import ResponsePoint
from ...vibration.one_mass.options import DEFAULT_SHARES, Curve, Excitation, Levels, Mount
from ...vibration.one_mass.response import FrequencyResponse, Resonance, frequency_response
from ...vibration.one_mass.system import IsolatedMass, StaticEquilibrium, free_travel, static_equilibrium
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

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ...cosimulation.steady_check import SteadyCheck
    from ...report.drawing import Chart
    from ...vibration.description.system_file import SystemFile
    from .candidates import RestingSystem

_MODEL = ResultColumn("model", "", "model", "model")
_EXCITATION = ResultColumn("excitation", "", "excitation", "excitation")
# Of every resonance: the level and this as text, and whether it is at an end of the band.
_LEVELS = (ResultColumn("level", "", "level"), ResultColumn("level_text", "1", "", "level"))
_BAND = ResultColumn("band", "", "", "band")
_OF_FORCE = ResultColumn("relative", "m/N", "relative motion over force")
_VERDICTS = {True: "agrees", False: "DIFFERS: the computed motion is not steady or not stable"}


@dataclass(frozen=True, eq=False)
class IsolatedModel:
    """A mass on springs of one model."""

    label: str  # the model's name, with a number where several models have one name
    source: str | None  # path as it was given; None for a model in memory
    model: ModelFile
    zero: float  # where displacement is counted from [m]
    system: IsolatedMass
    equilibrium: StaticEquilibrium
    responses: tuple[FrequencyResponse, ...] = ()  # one for each level

    @property
    def free_travel(self) -> float:
        """From static equilibrium to the nearer end of the identified range [m]."""
        return free_travel(self.system, self.equilibrium)

    def content(self, checked: Sequence[CheckedMotion]) -> dict[str, Any]:
        """The model and its motions for JSON."""
        levels = []
        for response in self.responses:
            of_level = {"level": response.level, "unit": response.excitation.unit}
            checks = [{**vars(one.check), "agrees": one.agrees} for one in checked if one.response is response]
            of_level |= picked(response, "resonance", "extrapolating", "points")
            levels.append({**of_level, "verification": checks})
        return {
            "model": self.source,
            "zero": self.zero,
            "system": {"mass": self.system.mass, **vars(self.system.mount), "load": self.system.static_load},
            "static_equilibrium": self.equilibrium,
            "excitation": self.responses[0].excitation,
            "levels": levels,
        }


class CheckedMotion(NamedTuple):
    """A computed steady motion and its co-simulation."""

    model: IsolatedModel
    response: FrequencyResponse  # the level
    check: SteadyCheck

    @property
    def agrees(self) -> bool:
        """Whether the simulation stays on the computed motion."""
        return self.check.agrees


class _Steady(PlottedResult):
    """Steady motions of parts, each with its `label` and its `responses`."""

    _parts_in: ClassVar[str]  # attribute that holds them

    @property
    @abstractmethod
    def _peak_columns(self) -> Sequence[ResultColumn]:
        """Of resonances; the first is the label of the part."""

    @property
    @abstractmethod
    def _panels(self) -> tuple[str, list[Chart]]:
        """The title of the plot, and panels in two rows."""

    @property
    def _parts(self) -> Sequence[Any]:
        parts: Sequence[Any] = getattr(self, self._parts_in)
        return parts

    @property
    def every(self) -> Iterator[tuple[Any, Any]]:
        """Each part with each of its responses."""
        return ((part, response) for part in self._parts for response in part.responses)

    @property
    def _of_curves(self) -> Iterator[Finding]:
        """What limits the worth of each curve, which is named."""
        for part, response in self.every:
            where = response.where if len(self._parts) == 1 else f"{part.label}, {response.where}"
            yield from (replace(finding, where=where) for finding in response.findings)

    @property
    def _peaks(self) -> Table:
        columns = self._peak_columns
        rows = [
            {columns[0].key: part.label, **picked(response, "excitation", "level", "level_text"), **vars(peak),
             "band": None if peak.inside else "at its end"}
            for part, response in self.every
            for peak in response.resonances
        ]  # fmt: skip
        varied = [column.key for column in columns if column.unit]
        return Table(columns, rows, details=("stiffness", "loss_factor"), varied=varied)

    def resonances(self) -> pd.DataFrame:
        """One row for each resonance: what it is of, and its attributes in SI units."""
        return self._peaks.frame()

    _overview = resonances

    def _shown(self, columns: Sequence[ResultColumn]) -> Sequence[ResultColumn]:
        """Columns without the first, the label of the part, where there is one part only."""
        return columns[int(len(self._parts) == 1) :]

    def plot(self, ax: Any = None) -> Any:
        """Draw motion over frequency, dotted where unstable, into axes, and return them.

        Of models they are one, of transmissibility; of a system one of the gain for each excitation, and below them
        those of the sway. Without axes a new figure of pyplot also has amplitudes of models, ``ax.figure.axes[1]``.
        """
        if ax is None:
            from matplotlib import pyplot as plt

            figure = plt.figure(figsize=self._size, layout="constrained")
            self._draw(figure)
            axes = figure.axes
        else:
            axes = self._axes(ax)
            for one, panel in zip(axes, self._panels[1], strict=False):
                panel.draw(one, has_legend=one is axes[0])
        return axes[0] if self._grid == (1, 1) else axes

    def _draw(self, figure: Figure) -> None:
        from ...report.drawing import draw_panels

        title, panels = self._panels
        draw_panels(figure, panels, title)


@dataclass(frozen=True, eq=False, repr=False)
class Isolation(_Steady):
    """Steady motions of a mass on springs of one or more models.

    Attributes
    ----------
    models : tuple of IsolatedModel
    excitation : Excitation
    levels : tuple of float   [m], [m/s^2] or [N].
    levels_chosen : str       How the levels were chosen; empty if they were given.
    checked : tuple of CheckedMotion What `verify` found, if it belongs to the result.
    """

    models: tuple[IsolatedModel, ...]
    excitation: Excitation
    levels: tuple[float, ...]
    levels_chosen: str = ""
    checked: tuple[CheckedMotion, ...] = ()

    _parts_in = "models"
    _peak_columns = (_MODEL, *_LEVELS, *columns_of(Resonance), _BAND)
    _size = (8.0, 8.0)

    @property
    def table(self) -> Table:
        """All points of the curves in their order, with their model if there are several."""
        level = ResultColumn("level", self.excitation.unit, "level")
        of_force = self.excitation is Excitation.FORCE
        point = (_OF_FORCE if of_force and each.key == "relative" else each for each in columns_of(ResponsePoint))
        rows = [
            {"model": isolated.label, "level": response.level, **vars(of_point)}
            for isolated, response in self.every
            for of_point in response.points
        ]
        return Table(self._shown((_MODEL, level, *point)), rows)

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - its tables know
        """Static equilibrium, how levels were chosen, resonances, and what `verify` found."""
        several, system = len(self.models) > 1, self.models[0].system
        count = system.mount.parallel * system.mount.series
        springs = "1 spring" if count == 1 else f"{system.mount.parallel} x {system.mount.series} springs"
        yield f"{system.mass:g} kg on {springs}, static load {system.static_load:.4g} N"
        rows = [{"model": isolated.label, **vars(isolated.equilibrium)} for isolated in self.models]
        columns = self._shown((_MODEL, *columns_of(StaticEquilibrium)))
        yield Table(columns, rows, "Static equilibrium, with the lowest and the highest that friction leaves:")
        for isolated in self.models:
            if counted := zero_sentence(isolated.zero):
                yield f"{isolated.label}: {counted}" if several else counted
        if several and self.levels_chosen:
            yield self.levels_chosen
        yield replace(self._peaks, columns=self._shown(self._peak_columns))
        if self.checked:
            from ...cosimulation.steady_check import PERIODS, SteadyCheck

            rows = []
            for one in self.checked:
                what = {"model": one.model.label, "level_text": one.response.level_text}
                rows.append({**vars(one.check), **what, "verdict": _VERDICTS[one.agrees]})
            checks = (_MODEL, _LEVELS[1], *columns_of(SteadyCheck), ResultColumn("verdict", "", "verdict", "verdict"))
            title = f"Co-simulation of the FMU, {PERIODS} periods from the computed motion:"
            yield Table(self._shown(checks), rows, title)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the identifications, where a curve folds, and where a motion leaves the identified range."""
        of_models = (cautions_in_use(isolated.label, isolated.model) for isolated in self.models)
        return (*chain.from_iterable(of_models), *self._of_curves)

    def content(self) -> Mapping[str, Any]:
        """Of one model, or a list of them in `models`."""
        models = [isolated.content(self.checked) for isolated in self.models]
        return models[0] if len(models) == 1 else {"levels_chosen": self.levels_chosen or None, "models": models}

    @property
    def _panels(self) -> tuple[str, list[Chart]]:
        from ...report.drawing import Steady, steady_chart

        upper, lower = [], []
        for isolated, response in self.every:
            name = (response.level_text,) if len(self.models) == 1 else (isolated.label, response.level_text)
            curve = Steady(response.column("frequency"), response.column("transmissibility"), ~response.unstable, *name)
            upper.append(curve)
            lower.append(curve._replace(values=1e3 * response.column("amplitude")))
        kind = "force" if self.excitation is Excitation.FORCE else "absolute"
        model = "" if len(self.models) > 1 else f"{isolated.label}: "
        return f"{model}{isolated.system.mass:g} kg, {self.excitation.value}", [
            steady_chart(f"{kind} transmissibility [-]", upper, level=1.0),
            steady_chart("amplitude of the mount [mm]", lower),
        ]

    def verify(self, progress: Progress = unseen) -> tuple[CheckedMotion, ...]:
        """Build the FMUs and co-simulate stable motions of each level, at the ends of the band and at the peak.

        Parameters
        ----------
        progress : callable   Takes what is being done, the number of parts done, and of all.

        Returns
        -------
        tuple of CheckedMotion   Each says whether the simulation stays on the computed motion for 20 periods.

        Raises
        ------
        BuildError          If an FMU cannot be built.
        CosimulationError   If it cannot be run.
        """
        from ...cosimulation.steady_check import check_steady
        from ...fmu.native.native_fmu import build_native_fmu

        checked: list[CheckedMotion] = []
        with TemporaryFolder() as folder:
            for k, isolated in enumerate(self.models):
                progress(f"Building the FMU of {isolated.label}", k, len(self.models))
                fmu = build_native_fmu(isolated.model, folder / str(k), zero=isolated.zero)
                for response in isolated.responses:
                    progress(f"Simulating {isolated.label}, {response.level_text}", k, len(self.models))
                    stable = [point for point in response.points if point.stable]
                    peak = max(stable, key=lambda point: point.transmissibility)
                    for point in dict.fromkeys((stable[0], peak, stable[-1])):
                        check = check_steady(fmu, isolated.system, response.excitation, response.level, point)
                        checked.append(CheckedMotion(isolated, response, check))
        return tuple(checked)


@dataclass(frozen=True, eq=False, repr=False)
class SystemIsolation(_Steady):
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

    _parts_in = "candidates"
    _size = (12.0, 9.5)
    _stated: ClassVar[Mapping[str, Any]] = {}  # each candidate and response says its own

    @property
    def table(self) -> Table:
        """All points of the curves, under headings with units."""
        from .candidates import curve_table

        return curve_table(self.candidates)

    @property
    def _peak_columns(self) -> tuple[ResultColumn, ...]:
        from ...vibration.bodies.six_response import PointResonance
        from .candidates import CANDIDATE

        gain = self.candidates[0].responses[0].gain_column
        figures = (gain if column.key == gain.key else column for column in columns_of(PointResonance))
        return (CANDIDATE, _EXCITATION, *_LEVELS, *figures, _BAND)

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """Static equilibrium, modes, and of each point the largest resonance."""
        from .candidates import rest_tables

        yield f"{self.name} ({self.source})" if self.source is not None else self.name
        yield from rest_tables(self.candidates, brief)
        if self.levels_chosen:
            yield self.levels_chosen
        same = ("candidate", "excitation", "level", "point")
        of_points = groupby(self._peaks.rows, key=lambda row: [row[key] for key in same])
        rows = [max(rows, key=lambda row: row["gain"]) for _, rows in of_points]
        yield replace(self._peaks, columns=self._shown(self._peak_columns), rows=rows)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of springs from a catalogue, and of each curve."""
        from ...vibration.verdicts.answers import shared

        of_candidates = {candidate.label: candidate.findings for candidate in self.candidates}
        return (*shared(of_candidates), *self._of_curves)

    def content(self) -> Mapping[str, Any]:
        """The candidates with their responses."""
        candidates = [candidate.content_of_motions() for candidate in self.candidates]
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
    motions: Sequence[tuple[str, Callable[[Any], Any]]]
    described = next(filter(is_system, sources), None)
    if described is None:
        where = path_of(sources[0]) or "a model"
        if mass is None:
            raise OptionError("Give the {to[mass]} on the spring of {where}.", where=where)
        of_systems = {"directions": levels.directions, "at": levels.at, "base_rotation": levels.rotation}
        refuse_given(OF_SYSTEMS, where, **of_systems, candidates=candidates)
        parts = _loaded(sources, number("mass", mass, "kg"), mount, zero)
    else:
        # Slow to import.
        from ...vibration.description.system_file import load_system_file
        from .candidates import RestingSystem, motions_of

        path = path_of(described)
        if len(sources) > 1:
            sentence = "describes a whole system and its candidates; give it alone, and models in another call."
            raise OptionError(f"{path} {sentence}")
        refuse_given(f"{OF_MODELS}; leave it out.", path or "a SystemFile", mass=mass, zero=zero, **changed(mount))
        if levels.at is not None and levels.force is None:
            raise OptionError("{to[at]} says where a force acts; give {to[force]}, too, or leave it out.", at=levels.at)
        file = described if path is None else load_system_file(path)
        parts = [RestingSystem.about(label, system) for label, system in file.chosen_candidates(candidates)]
    kind, heights, chosen = Excitation.BASE_DISPLACEMENT, levels.rotation, ""
    if levels.chosen is not None:
        kind, heights = levels.chosen
    elif heights is None:
        # Those of the part that has the smallest free travel.
        part = min(parts, key=lambda part: part.free_travel)
        way, heights = f"{1e3 * part.free_travel:.4g} mm", tuple(share * part.free_travel for share in DEFAULT_SHARES)
        of = f"smallest free travel, {way} of {part.label}" if len(parts) > 1 else f"free travel of {way}"
        chosen = f"Levels: 0.5, 1 and 2 % of the {of}."
    if described is not None:
        motions = motions_of(parts, kind, heights, levels, curve)
        return SystemIsolation(file.name, path, _with_responses(parts, motions, curve.points, progress), chosen)

    def respond(part: IsolatedModel, level: float) -> FrequencyResponse:
        frequencies = band_frequencies(curve.band, curve.points, part.equilibrium)
        return frequency_response(part.system, kind, level, frequencies, curve.extrapolate, resolve=True)

    motions = [("", partial(respond, level=level)) for level in heights]
    return Isolation(_with_responses(parts, motions, curve.points, progress), kind, heights, chosen)


def _loaded(sources: Sequence[ModelSource], mass: float, mount: Mount, zero: str | float | None) -> list[IsolatedModel]:
    """The mass at rest on each model; models of one name are numbered."""
    contents = [model_of(source) for source in sources]
    names, parts = [content.name for content in contents], []
    for k, (source, content, name) in enumerate(zip(sources, contents, names, strict=True)):
        label = name if names.count(name) == 1 else f"{name} ({names[: k + 1].count(name)})"
        origin = origin_of(source, zero, content.parameters)
        system = IsolatedMass(counted_from(origin, content.parameters), mass, mount)
        with _named(label if len(contents) > 1 else ""):
            equilibrium = static_equilibrium(system)
        parts.append(IsolatedModel(label, path_of(source), content, origin, system, equilibrium))
    return parts


@contextmanager
def _named(where: str) -> Iterator[None]:
    """Say in a refusal where it is, if anything."""
    try:
        yield
    except (IsolationError, MountedSystemError) as refusal:
        if not where:
            raise
        raise type(refusal)("{where}: {refusal}", where=where, refusal=refusal) from None


def _with_responses(
    parts: Sequence[Any], motions: Sequence[tuple[str, Callable[[Any], Any]]], points: int, progress: Progress
) -> tuple[Any, ...]:
    """The parts with their responses, of so many points, computed in threads by what shakes them and functions."""
    pairs = [(part, motion) for part in parts for motion in motions]
    responses: list[Any] = []

    def respond(part: Any, motion: tuple[str, Callable[[Any], Any]]) -> Any:
        shaking, response_of = motion
        with _named(f"{part.label}, {shaking}" if shaking else part.label if len(parts) > 1 else ""):
            return response_of(part)

    # The systems of equations are too small to be shared among threads.
    with one_thread():
        for response in in_threads(partial(respond, *pair) for pair in pairs):
            part, _ = pairs[len(responses)]
            responses.append(response)
            progress(f"{part.label}, {response.where}", len(responses) * points, len(pairs) * points)
    each = iter(responses)
    return tuple(replace(part, responses=tuple(islice(each, len(motions)))) for part in parts)
