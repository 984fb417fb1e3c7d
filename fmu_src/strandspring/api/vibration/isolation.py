"""One mass on springs: `isolate`, one model or several in and transmissibility and resonance on each of them out; and
the transmissibility of two springs over one band, for `compare`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import IsolationError, OptionError
from ...findings import Finding
from ...ground.arguments import number
from ...ground.gravity import STANDARD_GRAVITY
from ...ground.options import changed, refuse_given, takes
from ...ground.result_columns import ResultColumn, columns_of
from ...ground.scratch import TemporaryFolder
from ...kernel.path import PathSolver
from ...model.coordinates import counted_from, zero_sentence
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.band import DEFAULT_BAND, band_frequencies
from ...vibration.one_mass.curve_points import ResponsePoint
from ...vibration.one_mass.options import Curve, Excitation, Levels, Mount
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
from ..common.result import picked
from ..common.table import Table
from .steady import BAND, LEVELS, AnyIsolation, default_levels, with_responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...cosimulation.steady_check import SteadyCheck
    from ...report.drawing import Chart
    from ...vibration.description.system_file import SystemFile
    from .system_isolation import SystemIsolation

_MODEL = ResultColumn("model", "", "model", "model")
_OF_FORCE = ResultColumn("relative", "m/N", "relative motion over force")
# Of two springs.
_APART = 100.0  # natural frequencies that differ by more are not swept through in one band
_LEVEL = 0.01  # amplitude of the base, share of the free travel of the spring that has less
_POINTS = 200
_FREQUENCY = 10.0  # Hz, where no mass rests in the middle of the range by its weight
_LEAST_WEIGHT = 0.02  # static load that is a weight, share of the range of forces


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


@dataclass(frozen=True, eq=False)
class CheckedMotion:
    """A computed steady motion and its co-simulation."""

    model: IsolatedModel
    response: FrequencyResponse  # the level
    check: SteadyCheck

    @property
    def agrees(self) -> bool:
        """Whether the simulation stays on the computed motion."""
        return self.check.agrees


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
    """

    models: tuple[IsolatedModel, ...]
    excitation: Excitation
    levels: tuple[float, ...]
    levels_chosen: str = ""
    checked: tuple[CheckedMotion, ...] = ()

    _parts_in = "models"
    _peak_columns = (_MODEL, *LEVELS, *columns_of(Resonance), BAND)
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
        yield self._peak_table(details=("stiffness", "loss_factor"))
        if self.checked:
            from ...cosimulation.steady_check import PERIODS, SteadyCheck

            verdicts = {True: "agrees", False: "DIFFERS: the computed motion is not steady or not stable"}
            rows = []
            for one in self.checked:
                what = {"model": one.model.label, "level_text": one.response.level_text}
                rows.append({**vars(one.check), **what, "verdict": verdicts[one.agrees]})
            checks = (_MODEL, LEVELS[1], *columns_of(SteadyCheck), ResultColumn("verdict", "", "verdict", "verdict"))
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

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw transmissibility over frequency, dotted where it is unstable, into axes, and return them. Without
        axes a new figure of pyplot also has the amplitudes of the mount, in ``ax.figure.axes[1]``.
        """
        return self._drawn(ax)[0]

    @property
    def _panels(self) -> list[Chart]:
        from ...report.drawing import Steady, steady_chart

        several = len(self.models) > 1

        def curves(name: str, factor: float = 1.0) -> list[Steady]:
            return [
                Steady(response.column("frequency"), factor * response.column(name), ~response.unstable,
                      *((isolated.label, response.level_text) if several else (response.level_text,)))
                for isolated, response in self.every
            ]  # fmt: skip

        kind = "force" if self.excitation is Excitation.FORCE else "absolute"
        return [
            steady_chart(f"{kind} transmissibility [-]", curves("transmissibility"), level=1.0),
            steady_chart("amplitude of the mount [mm]", curves("amplitude", 1e3)),
        ]

    def _draw(self, figure: Figure) -> None:
        from ...report.drawing import draw_panels

        models = "" if len(self.models) > 1 else f"{self.models[0].label}: "
        title = f"{models}{self.models[0].system.mass:g} kg, {self.excitation.value}"
        draw_panels(figure, self._panels, title)

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
    mass : float
        On the mount of a model [kg].
    levels : Levels
        What shakes the base or the mass; or its fields as keywords. If none are given, base displacements of 0.5, 1 and
        2 % of the free travel from static equilibrium to the nearer end of the identified range, the smallest of all.
    mount, curve : Mount, Curve
        Load and arrangement of springs of a model, and frequencies; or their fields as keywords. The band of a system
        is by default 0.23 times the lowest to 5 times the highest natural frequency of each candidate.
    zero : "rig", "middle", float or None
        Where displacement of a model is counted from: a displacement of the record [m]; by default as in its FMU.
    candidates : str, sequence of str or None
        Names of those of a system to compute; all if None.
    progress : callable
        Is called with the curve that is done, the number of frequencies done, and of all.

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
    Static equilibrium, with the lowest and the highest that friction leaves:
      spring mm  sag mm  lowest mm  highest mm  stiffness N/mm  natural Hz
          6.129   6.129      4.879       7.379              13       8.115
       level  resonance Hz  transmissibility  amplitude mm  stiffness N/mm  loss factor  isolates from Hz
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
        heights, chosen = default_levels({part.label: free_travel(part.system, part.equilibrium) for part in parts})
    else:
        (excitation, heights), chosen = levels.chosen, ""

    def respond(part: IsolatedModel, level: float) -> FrequencyResponse:
        frequencies = band_frequencies(curve.band, curve.points, part.equilibrium)
        with _named(part.label, len(parts)):
            return frequency_response(part.system, excitation, level, frequencies, curve.extrapolate, resolve=True)

    motions = [partial(respond, level=level) for level in heights]
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


@dataclass(frozen=True, eq=False)
class SharedMass:
    """Transmissibility of a mass on spring A and on spring B."""

    mass: float = math.nan  # [kg], like the others NaN where it is unknown
    load: float = math.nan  # [N]
    level: float = math.nan  # amplitude of the base [m]
    responses: tuple[FrequencyResponse, ...] = ()  # of A and of B, if there are any
    refusal: str = ""  # why there are none

    def lines(self) -> list[str]:
        """The peaks in words."""
        if self.refusal:
            return [f"Transmissibility was not compared: {self.refusal}"]
        a, b = (response.resonance for response in self.responses)
        return [
            f"A mass of {self.mass:.4g} kg under a load of {self.load:.4g} N, base moved by {1e3 * self.level:.3g} mm: "
            f"transmissibility {a.transmissibility:.4g} at {a.frequency:.4g} Hz on A, {b.transmissibility:.4g} at "
            f"{b.frequency:.4g} Hz on B."
        ]

    def as_json(self) -> dict[str, Any]:
        """The peaks as JSON."""
        a, b = [vars(response.resonance) for response in self.responses] or (None, None)
        return {**picked(self, "mass", "load", "level"), "a": a, "b": b, "refusal": self.refusal}


def shared_mass(
    springs: tuple[SpringParameters, SpringParameters], low: float, high: float, mass: float | None
) -> SharedMass:
    """The transmissibility of both springs, or why there is none.

    Parameters
    ----------
    springs : (SpringParameters, SpringParameters)
    low, high : float      The range that both share [m].
    mass : float or None   Loads the springs by its weight [kg]; if None the mass whose weight A holds in the middle of
                           the range, or where A does not carry one there, a mass for 10 Hz of small motion.
    """
    try:
        chosen, load = _default(springs[0], low, high) if mass is None else (mass, mass * STANDARD_GRAVITY)
        systems = [IsolatedMass(spring, chosen, Mount(load)) for spring in springs]
        rest = [static_equilibrium(system) for system in systems]
        places = [equilibrium.displacement for equilibrium in rest]
        level = _LEVEL * min(min(places) - low, high - max(places))
        if not level > 0.0:
            at = " and ".join(f"{1e3 * place:.4g} mm on {name}" for name, place in zip("AB", places, strict=True))
            raise IsolationError(f"{chosen:.4g} kg rest at {at}, outside the range that both share; use another mass.")
        lowest, highest = sorted(equilibrium.frequency for equilibrium in rest)
        if not highest <= _APART * lowest < math.inf:
            raise IsolationError(
                f"The natural frequencies of {lowest:.4g} and {highest:.4g} Hz are too far apart for one band; look at "
                "each spring with isolate."
            )
        band = np.geomspace(DEFAULT_BAND[0] * lowest, DEFAULT_BAND[1] * highest, _POINTS)
        responses = tuple(frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band) for system in systems)
    except IsolationError as refusal:
        return SharedMass(refusal=str(refusal))
    return SharedMass(chosen, load, level, responses)


def _default(spring: SpringParameters, low: float, high: float) -> tuple[float, float]:
    """Mass [kg] and static load [N] that let a spring rest in the middle of a range, if its force rises there."""
    forces, stiffnesses = PathSolver(spring).small_motion(np.linspace(low, high, 101))
    load, stiffness = float(forces[50]), float(stiffnesses[50])
    if load > _LEAST_WEIGHT * float(np.ptp(forces)):
        return load / STANDARD_GRAVITY, load
    if not stiffness > 0.0:
        raise IsolationError(
            f"The stiffness of A in the middle of the range that both share must be > 0 for a mass to rest there, got "
            f"{stiffness:.4g} N/m; give a mass that rests elsewhere."
        )
    return stiffness / (2.0 * math.pi * _FREQUENCY) ** 2, load
