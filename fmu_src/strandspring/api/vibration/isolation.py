"""Steady motions: of a mass on springs of one or more models, and what those of systems have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from ...findings import Finding
from ...ground.result_columns import ResultColumn, columns_of
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import zero_sentence
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.curve_points import ResponsePoint
from ...vibration.one_mass.options import Curve, Excitation
from ...vibration.one_mass.response import FrequencyResponse, Resonance, frequency_response
from ...vibration.one_mass.system import IsolatedMass, StaticEquilibrium, free_travel
from ..common.model_source import Progress, unseen
from ..common.result import PlottedResult, Table, picked

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ...cosimulation.steady_check import SteadyCheck
    from ...report.drawing import Chart

_MODEL = ResultColumn("model", "", "model", "model")
_LEVEL, _LEVEL_TEXT = ResultColumn("level", "", "level"), ResultColumn("level_text", "1", "", "level")
_BAND = ResultColumn("band", "", "", "band")  # where the resonance is at its end
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

    def response(self, excitation: Excitation, level: float, curve: Curve) -> FrequencyResponse:
        """Its steady motions under one level of an excitation."""
        frequencies = band_frequencies(curve.band, curve.points, self.equilibrium)
        return frequency_response(self.system, excitation, level, frequencies, curve.extrapolate, resolve=True)

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
    agrees: bool  # whether the simulation stays on the computed motion


class SteadyResult(PlottedResult):
    """Steady motions of parts, models or candidates."""

    _parts: Any  # each with its `label` and its `responses`
    _labels: ClassVar[Sequence[ResultColumn]]  # of curves, besides the level; the first is the part's

    @property
    @abstractmethod
    def _figures(self) -> Sequence[ResultColumn]:
        """Of resonances."""

    @property
    @abstractmethod
    def _panels(self) -> tuple[str, list[Chart]]:
        """The title of the plot, and panels in two rows."""

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
        columns = (*self._labels, _LEVEL, _LEVEL_TEXT, *self._figures, _BAND)
        rows = [
            {self._labels[0].key: part.label, **picked(response, "excitation", "level", "level_text"), **vars(peak),
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

    def _shown(self, table: Table) -> Table:
        """A table without its first column, the label of the part, where there is one part only."""
        return replace(table, columns=table.columns[int(len(self._parts) == 1) :])

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
class Isolation(SteadyResult):
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

    _parts = property(attrgetter("models"))
    _labels = (_MODEL,)
    _figures = columns_of(Resonance)
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
        return self._shown(Table((_MODEL, level, *point), rows))

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - its tables know
        """Static equilibrium, how levels were chosen, resonances, and what `verify` found."""
        several, system = len(self.models) > 1, self.models[0].system
        count = system.mount.parallel * system.mount.series
        springs = "1 spring" if count == 1 else f"{system.mount.parallel} x {system.mount.series} springs"
        yield f"{system.mass:g} kg on {springs}, static load {system.static_load:.4g} N"
        rows = [{"model": isolated.label, **vars(isolated.equilibrium)} for isolated in self.models]
        title = "Static equilibrium, with the lowest and the highest that friction leaves:"
        yield self._shown(Table((_MODEL, *columns_of(StaticEquilibrium)), rows, title))
        for isolated in self.models:
            if counted := zero_sentence(isolated.zero):
                yield f"{isolated.label}: {counted}" if several else counted
        if several and self.levels_chosen:
            yield self.levels_chosen
        yield self._shown(self._peaks)
        if self.checked:
            from ...cosimulation.steady_check import PERIODS, SteadyCheck

            rows = []
            for one in self.checked:
                what = {"model": one.model.label, "level_text": one.response.level_text}
                rows.append({**vars(one.check), **what, "verdict": _VERDICTS[one.agrees]})
            columns = (_MODEL, _LEVEL_TEXT, *columns_of(SteadyCheck), ResultColumn("verdict", "", "verdict", "verdict"))
            title = f"Co-simulation of the FMU, {PERIODS} periods from the computed motion:"
            yield self._shown(Table(columns, rows, title))

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
                        checked.append(CheckedMotion(isolated, response, check, check.agrees))
        return tuple(checked)
