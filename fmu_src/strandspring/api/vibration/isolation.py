"""`isolate`: one model or several in, transmissibility and resonance of a mass on each of them out."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from ...errors import IsolationError, OptionError
from ...findings import Finding, Outcome
from ...ground.arguments import number
from ...ground.options import changed, refuse_given, takes
from ...ground.result_columns import ResultColumn
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import counted_from, zero_sentence
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.curve_points import ResponsePoint
from ...vibration.one_mass.options import Curve, Excitation, Levels, Mount
from ...vibration.one_mass.response import FrequencyResponse, frequency_response
from ...vibration.one_mass.system import IsolatedMass, StaticEquilibrium, free_travel, static_equilibrium
from ..common.model_source import OF_MODELS, OF_SYSTEMS, ModelSource, is_system, model_of, origin_of, path_of
from ..common.progress import Progress, unseen
from ..common.table import Table
from .isolation_result import FREQUENCY, ISOLATION_FREQUENCY, AnyIsolation, default_levels, with_responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...cosimulation.steady_check import SteadyCheck
    from ...vibration.description.system_file import SystemFile
    from .system_isolation import SystemIsolation

_MODEL = ResultColumn("model", "", "model")
_PLACE = ResultColumn("displacement", "m", "displacement", "displacement", "mm", 1e3)
_FIGURES = (
    FREQUENCY,
    ResultColumn("transmissibility", "1", "transmissibility", "transmissibility"),
    ResultColumn("amplitude", "m", "amplitude", "amplitude", "mm", 1e3),
    ResultColumn("stiffness", "N/m", "secant stiffness", "stiffness", "N/mm", 1e-3),
    ResultColumn("loss_factor", "1", "loss factor", "loss factor", digits=3),
    ISOLATION_FREQUENCY,
)
# Of the curves: keys, units and words.
_POINT = (
    ("frequency", "Hz", "frequency"),
    ("transmissibility", "1", "transmissibility"),
    ("phase", "deg", "phase"),
    ("relative", "", "relative motion over"),
    ("relative_phase", "deg", "relative phase"),
    ("amplitude", "m", "amplitude of the mount"),
    ("mean", "m", "mean displacement of a spring"),
    ("min", "m", "lowest displacement of a spring"),
    ("max", "m", "highest displacement of a spring"),
    ("force", "N", "force on the base"),
    ("acceleration", "m/s^2", "acceleration"),
    ("start_displacement", "m", "displacement of the mount at the crest"),
    ("start_speed", "m/s", "speed of the mount at the crest"),
    ("start_omega", "1", "omega at the crest"),
    ("stable", "", "stable"),
    ("requested", "", "requested frequency"),
    ("extrapolating", "", "outside the identified range"),
)
_CHECK = (
    ResultColumn("model", "", "model", "model"),
    ResultColumn("level", "", "level", "level"),
    ResultColumn("frequency", "Hz", "frequency", "frequency", "Hz"),
    ResultColumn("difference", "1", "difference of the amplitude", "amplitude off by", "%", 100.0, 3),
    ResultColumn("phase", "deg", "difference of the phase", "phase off by", "deg", digits=3),
    ResultColumn("verdict", "", "verdict", "verdict"),
)


@dataclass(frozen=True, eq=False)
class IsolatedModel:
    """A mass on springs of one model.

    Attributes
    ----------
    label : str                       The model's name, with a number where several models have one name.
    source : str or None              Path as it was given; None for a model in memory.
    model : ModelFile
    zero : float                      Where displacement is counted from [m].
    system : IsolatedMass
    equilibrium : StaticEquilibrium
    responses : tuple of FrequencyResponse   One for each level.
    """

    label: str
    source: str | None
    model: ModelFile
    zero: float
    system: IsolatedMass
    equilibrium: StaticEquilibrium
    responses: tuple[FrequencyResponse, ...] = ()

    def equilibrium_lines(self) -> list[str]:
        """The static equilibrium in words."""
        system, rest = self.system, self.equilibrium
        mount = system.mount
        springs = "1 spring" if mount.parallel * mount.series == 1 else f"{mount.parallel} x {mount.series} springs"
        place, low, high = map(_PLACE.text, (rest.displacement, rest.min, rest.max))
        sag = "" if math.isnan(rest.sag) else f", static sag {_PLACE.text(rest.sag)} mm"
        counted = zero_sentence(self.zero)
        return [
            f"{system.mass:g} kg on {springs}, static load {system.static_load:.4g} N",
            f"  static equilibrium at {place} mm of each spring ({low} to {high} mm with friction){sag}",
            f"  small motion: {1e-3 * rest.stiffness:.4g} N/mm, {rest.frequency:.4g} Hz",
            *([f"  {counted}"] if counted else []),
        ]

    def content(self, checked: Sequence[CheckedMotion]) -> dict[str, Any]:
        """The model and its motions for JSON."""
        described = {"mass": self.system.mass, **asdict(self.system.mount)}
        return {
            "model": self.source,
            "zero": self.zero,
            "system": {**described, "load": self.system.static_load},
            "static_equilibrium": self.equilibrium,
            "excitation": self.responses[0].excitation,
            "levels": [
                {
                    "level": response.level,
                    "unit": response.excitation.unit,
                    "resonance": response.resonance,
                    "extrapolating": response.extrapolating,
                    "points": response.points,
                    "verification": [
                        {**vars(motion.check), "agrees": motion.agrees}
                        for motion in checked
                        if motion.response is response
                    ],
                }
                for response in self.responses
            ],
        }


@dataclass(frozen=True, eq=False)
class CheckedMotion:
    """A computed steady motion and its co-simulation.

    Attributes
    ----------
    model : IsolatedModel
    response : FrequencyResponse   The level.
    check : SteadyCheck
    """

    model: IsolatedModel
    response: FrequencyResponse
    check: SteadyCheck

    @property
    def agrees(self) -> bool:
        """Whether the simulation stays on the computed motion."""
        return self.check.agrees

    def words(self, several: bool) -> dict[str, str | None]:
        """The verdict, and of what it is: the model only if there are several."""
        verdict = "agrees" if self.agrees else "DIFFERS: the computed motion is not steady or not stable"
        return {"model": self.model.label if several else None, "level": self.response.level_text, "verdict": verdict}


@dataclass(frozen=True, eq=False, repr=False)
class Isolation(AnyIsolation):
    """Steady motions of a mass on springs of one or more models.

    Attributes
    ----------
    models : tuple of IsolatedModel
    excitation : Excitation
    levels : tuple of float          [m], [m/s^2] or [N].
    levels_chosen : str              How the levels were chosen; empty if they were given.
    checked : tuple of CheckedMotion What `verify` found, if it belongs to the result.

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
    >>> bool(result.to_frame().query("model == 'stiff'").transmissibility.max() > 8.5)
    True
    """

    models: tuple[IsolatedModel, ...]
    excitation: Excitation
    levels: tuple[float, ...]
    levels_chosen: str = ""
    checked: tuple[CheckedMotion, ...] = ()

    _details = ("stiffness", "loss_factor")
    _size = (8.0, 8.0)

    @property
    def _parts(self) -> tuple[IsolatedModel, ...]:
        """The models."""
        return self.models

    @property
    def title(self) -> str:
        """Of a plot."""
        mass = f"{self.models[0].system.mass:g} kg"
        return f"{self.models[0].label}: {mass}" if len(self.models) == 1 else mass

    def _of(self, part: IsolatedModel, response: FrequencyResponse) -> dict[ResultColumn, Any]:
        return {_MODEL: part.label, ResultColumn("level", self.excitation.unit, "level"): response.level}

    def _curve(self, _part: IsolatedModel, response: FrequencyResponse) -> Mapping[ResultColumn, NDArray[Any]]:
        columns = {key: ResultColumn(key, unit, words) for key, unit, words in _POINT}
        over = ("m/N", "force") if self.excitation is Excitation.FORCE else ("1", "base motion")
        columns["relative"] = ResultColumn("relative", over[0], f"{columns['relative'].words} {over[1]}")
        return {columns[key]: values for key, values in response.columns.items()}

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all points of the curves, with their model if there are several.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        table = self.table
        replace(table, columns=table.columns[int(len(self.models) == 1) :]).save_csv(path)

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - its tables know
        """Static equilibrium, how levels were chosen, resonances, and what `verify` found."""
        several = len(self.models) > 1
        for isolated in self.models:
            first, *rest = isolated.equilibrium_lines()
            yield f"{self._name(isolated)}: {first}" if several else first
            yield from rest
        if several and self.levels_chosen:
            yield self.levels_chosen
        yield self._resonance_table(_FIGURES, attrgetter("resonances"))
        if self.checked:
            from ...cosimulation.steady_check import PERIODS

            rows = [{**vars(motion.check), **motion.words(several)} for motion in self.checked]
            yield Table(_CHECK, rows, f"Co-simulation of the FMU, {PERIODS} periods from the computed motion:")

    def _name(self, isolated: IsolatedModel) -> str:
        return isolated.label if isolated.source is None else f"{isolated.label} ({isolated.source})"

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the identifications, where a curve folds, and where a motion leaves the identified range."""
        found: list[Finding] = []
        for isolated in self.models:
            found += cautions_in_use(isolated.label, isolated.model)
            spring = isolated.system.spring
            ends = (spring.displacement_min, spring.displacement_max)
            for response in isolated.responses:
                of_model = f"{isolated.label}, " if len(self.models) > 1 else ""
                where = f"{of_model}{response.level_text}"
                if unstable := int(response.unstable.sum()):
                    found.append(Finding(Outcome.CURVE_FOLDS, {"motions": unstable}, where))
                if outside := [point.frequency for point in response.points if point.extrapolating]:
                    numbers = {"frequencies": ((min(outside), max(outside)),), "range": (ends,)}
                    found.append(Finding(Outcome.OUTSIDE_RANGE, numbers, where))
        return tuple(found)

    def content(self) -> Mapping[str, Any]:
        """Of one model, or a list of them in `models`."""
        models = [isolated.content(self.checked) for isolated in self.models]
        return models[0] if len(models) == 1 else {"levels_chosen": self.levels_chosen or None, "models": models}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw transmissibility over frequency, dotted where the motion is unstable.

        Without axes a new figure of pyplot also has the amplitudes of the mount, in ``ax.figure.axes[1]``.

        Parameters
        ----------
        ax : Axes or None     Where to draw.

        Returns
        -------
        Axes                  Those of the transmissibility.
        """
        from ...vibration.one_mass.curves_plot import HANDLE_LENGTH, draw_transmissibility

        if ax is None:
            return self._drawn()[0]
        (axes,) = self._axes(ax)
        draw_transmissibility(axes, self.curves)
        axes.legend(title=self.excitation.value, fontsize=8, handlelength=HANDLE_LENGTH)
        return axes

    def _fill(self, figure: Figure) -> list[Axes]:
        from ...vibration.one_mass.curves_plot import fill

        return [*fill(figure, self.curves, self.title)]

    def verify(self, progress: Progress = unseen) -> tuple[CheckedMotion, ...]:
        """Build the FMUs and co-simulate stable motions of each level: at both ends of the band and at the peak.

        Parameters
        ----------
        progress : callable   Is called with what is being done, the number of parts done, and how many there are.

        Returns
        -------
        tuple of CheckedMotion   Each says whether the simulation stays on the computed motion for 20 periods.

        Raises
        ------
        BuildError            If an FMU cannot be built.
        CosimulationError     If it cannot be run.
        """
        from ...cosimulation.steady_check import check_steady
        from ...fmu.native.native_fmu import build_native_fmu

        runs = [(isolated, response, point) for isolated, response in self.every for point in _ends(response)]
        total = len(runs) + len(self.models)
        checked: list[CheckedMotion] = []
        with TemporaryFolder() as folder:
            fmus = {}
            for built, isolated in enumerate(self.models):
                progress(f"Building the FMU of {isolated.label}", built, total)
                fmus[isolated] = build_native_fmu(isolated.model, folder / str(built), zero=isolated.zero)
            for isolated, response, point in runs:
                task = f"Simulating {isolated.label}, {response.level_text}, {point.frequency:.4g} Hz"
                progress(task, len(fmus) + len(checked), total)
                check = check_steady(fmus[isolated], isolated.system, response.excitation, response.level, point)
                checked.append(CheckedMotion(isolated, response, check))
        progress("Simulated", total, total)
        return tuple(checked)


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
    """Transmissibility and resonance of a mass on a spring, or on several to compare them, or of bodies on mounts.

    The steady motion is found by harmonic balance and followed through folds. A system is computed in all degrees of
    freedom, to the second order of rotations from rest, with its modes.

    Parameters
    ----------
    models : Spring, path of a model file or FMU, or a sequence of these; or path of a SYSTEM.toml, or SystemFile
    mass : float                   On the mount of a model [kg].
    levels : Levels                What shakes the base or the mass; or its fields as keywords. If none are given, base
                                   displacements of 0.5, 1 and 2 % of the free travel from static equilibrium to the
                                   nearer end of the identified range, the smallest of all models or mounts.
    mount : Mount                  Load and arrangement of springs of a model; or its fields as keywords.
    curve : Curve                  Frequencies; or its fields as keywords. The band of a system is by default 0.23 times
                                   the lowest to 5 times the highest natural frequency of each candidate.
    zero : "rig", "middle", float or None
        Where displacement of a model is counted from: a displacement of the record [m]; by default as in its FMU.
    candidates : str, sequence of str or None   Names of those of a system to compute; all if None.
    progress : callable            Is called with what is being done, the number of frequencies done, and how many there
                                   are.

    Returns
    -------
    Isolation or SystemIsolation

    Raises
    ------
    ModelError           If a file is not a physically possible spring.
    MountedSystemError   If a system is wrong, a body cannot rest, or a motion leaves an identified range.
    IsolationError       If there is no static equilibrium, an argument is out of bounds, the motion leaves the
                         identified range, or no steady motion is found.
    OptionError          If an option does not apply to what is given.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, isolate
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> result = isolate(spring, mass=5.0, base_displacement=[1e-4, 2e-4], points=8)
    >>> print(result.summary())
    5 kg on 1 spring, static load 49.03 N
      static equilibrium at 6.129 mm of each spring (4.879 to 7.379 mm with friction), static sag 6.129 mm
      small motion: 13 N/mm, 8.115 Hz
      level   resonance Hz  transmissibility  amplitude mm  stiffness N/mm  loss factor  isolates from Hz
      0.1 mm         7.904             11.57         1.142           12.52       0.0856             11.47
      0.2 mm         7.743             8.579         1.687           12.08        0.115             11.44
    """
    is_one = isinstance(models, str) or not isinstance(models, Sequence)
    sources: Sequence[Any] = [models] if is_one else list(models)  # type: ignore[arg-type]
    if not sources:
        raise IsolationError("Nothing to isolate on; give at least one model.")
    if described := next(filter(is_system, sources), None):
        if len(sources) > 1:
            raise OptionError(
                f"{path_of(described)} describes a whole system and its candidates; give it alone, and models in "
                "another call."
            )
        where = path_of(described) or "a SystemFile"
        refuse_given(f"{OF_MODELS}; leave it out.", where, mass=mass, zero=zero, **changed(mount))
        from .system_isolation import isolated_bodies  # slow to import

        return isolated_bodies(described, levels, curve, candidates, progress)
    where = path_of(sources[0]) or "a model"
    if mass is None:
        raise OptionError("Give the {to[mass]} on the spring of {where}.", where=where)
    of_systems = {"directions": levels.directions, "at": levels.at, "base_rotation": levels.rotation}
    refuse_given(OF_SYSTEMS, where, **of_systems, candidates=candidates)
    mass = number("mass", mass, "kg")
    contents = [model_of(source) for source in sources]
    parts = []
    for source, content, label in zip(sources, contents, _labels(contents), strict=True):
        origin = origin_of(source, zero, content.parameters)
        system = IsolatedMass(counted_from(origin, content.parameters), mass, mount)
        with _named(label, len(contents)):
            equilibrium = static_equilibrium(system)
        parts.append(IsolatedModel(label, path_of(source), content, origin, system, equilibrium))
    if levels.chosen is None:
        excitation = Excitation.BASE_DISPLACEMENT
        heights, chosen, nearest = default_levels([free_travel(part.system, part.equilibrium) for part in parts])
        chosen += f" on {parts[nearest].label}{', the smallest of these models' if len(parts) > 1 else ''}."
    else:
        (excitation, heights), chosen = levels.chosen, ""

    def respond(level: float, part: IsolatedModel, advance: Callable[[float], None]) -> FrequencyResponse:
        frequencies = band_frequencies(curve.band, curve.points, part.equilibrium)
        with _named(part.label, len(parts)):
            return frequency_response(
                part.system, excitation, level, frequencies, curve.extrapolate, resolve=True, advance=advance
            )

    motions = [(excitation.level_text(level), partial(respond, level)) for level in heights]
    return Isolation(with_responses(parts, motions, curve.points, progress), excitation, heights, chosen)


@contextmanager
def _named(label: str, models: int) -> Iterator[None]:
    """Name the model in a refusal if there are several."""
    try:
        yield
    except IsolationError as refusal:
        if models == 1:
            raise
        raise IsolationError("{label}: {refusal}", label=label, refusal=refusal) from None


def _labels(models: Sequence[ModelFile]) -> list[str]:
    """The models' names, numbered in their order where they are alike."""
    names = [model.name for model in models]
    counts = Counter(names)
    return [name if counts[name] == 1 else f"{name} ({names[: k + 1].count(name)})" for k, name in enumerate(names)]


def _ends(response: FrequencyResponse) -> list[ResponsePoint]:
    """The stable motions at both ends of the band and at peak transmissibility."""
    stable = [point for point in response.points if point.stable]
    chosen = (stable[0], max(stable, key=lambda point: point.transmissibility), stable[-1])
    return list(dict.fromkeys(chosen))
