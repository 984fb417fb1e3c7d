"""A study of one mass on a spring: every grid point with every draw, and the result of one run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from itertools import product
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import IsolationError, Reader
from ...findings import Finding, Outcome
from ...ground.result_columns import ResultColumn
from ...ground.strict_json import finite
from ...model.joint import HYSTERETIC_UNITS, JointCovariance
from ...vibration.bodies.parts import scaled
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.options import Curve, Excitation, Mount
from ...vibration.one_mass.response import frequency_response
from ...vibration.one_mass.system import IsolatedMass, static_equilibrium
from .runs import DONE, Place, Runs
from .summaries import most_frequent

if TYPE_CHECKING:
    import pandas as pd

STIFFNESS_FACTORS = (1e-6, 1e6)


@dataclass(frozen=True)
class RunRow:
    """One run: its inputs and results.

    Attributes
    ----------
    run : int                               From 0 in the study.
    draw : int or None                      Number of the draw, from 0; None at the identified parameters.
    mass, level, stiffness_factor : float   Of the grid point [kg], [unit of the excitation], [-].
    kappa_omega, rho, sigma, n : float      As drawn, before the stiffness factor [N], [1/m], [-], [-].
    static_equilibrium, sag : float or None See `StaticEquilibrium` [m]; None where there is none.
    frequency, transmissibility, amplitude, stiffness, loss_factor, isolation_frequency : float or None
                                            See `Resonance`; None if the run is refused or there is none.
    inside : bool or None                   Whether the resonance lies inside the band, not at one of its ends.
    extrapolating : bool or None            Whether the spring leaves the identified range anywhere in the band.
    outcome : str                           `DONE`, or the sentence why the run is refused.
    """

    run: int
    draw: int | None
    mass: float
    level: float
    stiffness_factor: float
    kappa_omega: float
    rho: float
    sigma: float
    n: float
    static_equilibrium: float | None = None
    sag: float | None = None
    frequency: float | None = None
    transmissibility: float | None = None
    amplitude: float | None = None
    stiffness: float | None = None
    loss_factor: float | None = None
    isolation_frequency: float | None = None
    inside: bool | None = None
    extrapolating: bool | None = None
    outcome: str = DONE


@dataclass(frozen=True)
class GridPoint:
    """One point of the grid: mass [kg], level, factor on FE and kappa_omega."""

    mass: float
    level: float
    stiffness_factor: float


_COLUMNS = (
    ResultColumn("run", "", "run"),
    ResultColumn("draw", "", "draw"),
    ResultColumn("mass", "kg", "mass"),
    ResultColumn("level", "", "level"),  # in the unit of the excitation
    ResultColumn("stiffness_factor", "1", "stiffness factor"),
    *(ResultColumn(name, unit, name) for name, unit in HYSTERETIC_UNITS.items()),
    ResultColumn("static_equilibrium", "m", "static equilibrium"),
    ResultColumn("sag", "m", "sag"),
    ResultColumn("frequency", "Hz", "resonance frequency", "resonance", "Hz"),
    ResultColumn("transmissibility", "1", "transmissibility", "transmissibility"),
    ResultColumn("amplitude", "m", "amplitude", "amplitude", "mm", 1e3),
    ResultColumn("stiffness", "N/m", "stiffness"),
    ResultColumn("loss_factor", "1", "loss factor", "loss factor"),
    ResultColumn("isolation_frequency", "Hz", "isolation frequency", "isolates from", "Hz"),
    ResultColumn("inside", "", "resonance inside the band"),
    ResultColumn("extrapolating", "", "beyond the identified range"),
    ResultColumn("outcome", "", "outcome"),
)
_COUNTED = {Outcome.OUTSIDE_RANGE: "extrapolating", Outcome.PEAK_AT_END: "at_end_of_band"}  # columns of `sum_up`
_cells = attrgetter(*(column.key for column in _COLUMNS))


@dataclass(frozen=True)
class Study(Runs[RunRow]):
    """Runs over a grid of masses, levels and stiffness factors, each with every spring drawn from a spread.

    Run k has grid point k modulo their number, and draw k divided by it: all grid points advance together and share
    their draws.

    Parameters
    ----------
    spring : SpringParameters
    excitation : Excitation
    masses, levels : tuple of float       [kg], [unit of the excitation], > 0.
    stiffness_factors : tuple of float    Scale FE and kappa_omega, 1e-6 to 1e6.
    draws : int                           Springs drawn for each grid point; 0 for the identified spring alone.
    seed : int                            Of the draws, >= 0.
    spread : JointCovariance or None               Needed for draws.
    mount : Mount
    curve : Curve

    Raises
    ------
    IsolationError                        If a value is out of its bounds.
    """

    subject = "model"
    row_type = RunRow
    refusal = IsolationError
    figures = _COLUMNS[9:17]
    few = ("frequency", "transmissibility", "amplitude", "isolation_frequency")
    drawn = ("frequency", "transmissibility")

    spring: SpringParameters
    excitation: Excitation
    masses: tuple[float, ...]
    levels: tuple[float, ...]
    stiffness_factors: tuple[float, ...] = (1.0,)
    draws: int = 0
    seed: int = 0
    spread: JointCovariance | None = None
    mount: Mount = field(default_factory=Mount)
    curve: Curve = field(default_factory=partial(Curve, points=24))

    def __post_init__(self) -> None:
        for mass in self.masses:
            self._system(self.spring, mass)
        for level in self.levels:
            if not (math.isfinite(level) and level > 0.0):
                raise IsolationError(f"Every level must be finite and > 0 [{self.excitation.unit}], got {level!r}.")
        lowest_factor, highest_factor = STIFFNESS_FACTORS
        for factor in self.stiffness_factors:
            if not lowest_factor <= factor <= highest_factor:
                raise IsolationError(
                    f"Every stiffness factor must be within [{lowest_factor:g}, {highest_factor:g}], got {factor!r}."
                )
        if self.draws and self.spread is None:
            raise IsolationError("`spread` must be given where there are draws.")
        self._check_counts()

    @property
    def grid_size(self) -> int:
        """Number of grid points."""
        return len(self.masses) * len(self.levels) * len(self.stiffness_factors)

    def grid_point(self, index: int) -> GridPoint:
        """A grid point: levels and stiffness factors of the first mass come first, then those of the next."""
        rest, factor = divmod(index, len(self.stiffness_factors))
        mass, level = divmod(rest, len(self.levels))
        return GridPoint(self.masses[mass], self.levels[level], self.stiffness_factors[factor])

    def __len__(self) -> int:
        return self.grid_size * max(self.draws, 1)

    @property
    def columns(self) -> list[ResultColumn]:
        """See `Runs`."""
        return [replace(column, unit=self.excitation.unit) if column.key == "level" else column for column in _COLUMNS]

    @property
    def identity(self) -> tuple[Any, dict[str, Any]]:
        """See `Runs`."""
        apart = ("spring", "spread", "excitation", "mount", "curve")
        options = {each.name: getattr(self, each.name) for each in fields(self) if each.name not in apart}
        options |= {**asdict(self.mount), **asdict(self.curve)}
        content = {"spring": self.spring.as_dict(), "spread": None if self.spread is None else asdict(self.spread)}
        return content, {"excitation": self.excitation.value, **options}

    def place(self, run: Any) -> Place:
        """See `Runs`."""
        draw, point = divmod(run, self.grid_size)
        return Place(point, draw, 0, 0)

    def cells(self, row: RunRow) -> tuple[object, ...]:
        """See `Runs`."""
        cells: tuple[object, ...] = _cells(row)
        return cells

    @property
    def summed_up(self) -> list[str]:
        """See `Runs`."""
        return [*(figure.key for figure in self.figures), "inside", "extrapolating", "outcome"]

    def grid(self) -> pd.DataFrame:
        """See `Runs`."""
        import pandas as pd

        names = [field.name for field in fields(GridPoint)]
        axes = [self.masses, self.levels, self.stiffness_factors]
        return pd.MultiIndex.from_product(axes, names=names).to_frame(index=False)

    def sum_up(self, runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
        """See `Runs`; counts have "runs", "refused", "reason", "at_end_of_band" and "extrapolating"."""
        is_done = runs["outcome"] == DONE
        flags = runs[["group"]].assign(
            runs=1,
            refused=~is_done,
            at_end_of_band=runs["inside"].eq(False),
            extrapolating=runs["extrapolating"].eq(True),
        )
        refused = runs[~is_done]
        counts = flags.groupby("group").sum()
        counts.insert(2, "reason", most_frequent(refused["outcome"], refused["group"]))
        return counts, runs[[figure.key for figure in self.figures]].where(is_done).assign(group=runs["group"])

    @property
    def head(self) -> tuple[ResultColumn, ...]:
        """See `Runs`."""
        is_length = self.excitation is Excitation.BASE_DISPLACEMENT
        shown, factor = ("mm", 1e3) if is_length else (self.excitation.unit, 1.0)
        return (
            ResultColumn("mass", "kg", "mass", "mass", "kg", digits=6),
            ResultColumn("level", self.excitation.unit, "level", "level", shown, factor),
            ResultColumn("stiffness_factor", "1", "stiffness factor", "stiffness", digits=6),
            ResultColumn("refused", "", "refused runs", "refused", digits=9),
        )

    @property
    def stated(self) -> dict[str, Any]:
        """See `Runs`."""
        return {"excitation": self.excitation, "unit": self.excitation.unit}

    def headline(self, summaries: pd.DataFrame) -> str:
        """See `Runs`."""
        springs = f"{self.draws} draws (seed {self.seed})" if self.draws else "the identified spring"
        refused = int(summaries["refused"].sum())
        return f"{len(self)} runs: {springs} at each of {self.grid_size} grid points, {refused} refused"

    def where(self, point: Mapping[str, Any]) -> str:
        """See `Runs`."""
        level = self.excitation.level_text(point["level"])
        return f"{point['mass']:g} kg, {level}, stiffness x {point['stiffness_factor']:g}"

    def findings(self, point: Mapping[str, Any]) -> Iterator[Finding]:
        """Of peaks at an end of the band, and of motions beyond the identified range."""
        ends = ((self.spring.displacement_min, self.spring.displacement_max),)
        for kind, column in _COUNTED.items():
            if point[column]:
                yield Finding(kind, {"runs": point[column], "of": point["runs"], "range": ends}, self.where(point))

    def groups(self, summaries: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, dict[str, Any]]]:
        """A line over the masses for each level and stiffness factor."""
        for level, factor in product(self.levels, self.stiffness_factors):
            rows = summaries[(summaries["level"] == level) & (summaries["stiffness_factor"] == factor)]
            yield rows, {"label": f"{self.excitation.level_text(level)}, stiffness x {factor:g}", "marker": "o"}

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        """Execute runs."""
        return [self._row(run) for run in runs]

    def _row(self, run: int) -> RunRow:
        place = self.place(run)
        draw, point = place.draw if self.draws else None, self.grid_point(place.point)
        spring = self.spring
        if draw is not None and self.spread is not None:
            spring = self.spread.draw(spring, self.seed, draw)
        row = RunRow(
            run, draw, point.mass, point.level, point.stiffness_factor,
            spring.kappa_omega, spring.rho, spring.sigma, spring.n,
        )  # fmt: skip
        try:
            system = self._system(scaled(spring, point.stiffness_factor, point.stiffness_factor), point.mass)
            equilibrium = static_equilibrium(system)
            row = replace(row, static_equilibrium=equilibrium.displacement, sag=finite(equilibrium.sag))
            frequencies = band_frequencies(self.curve.band, self.curve.points, equilibrium)
            response = frequency_response(system, self.excitation, point.level, frequencies, self.curve.extrapolate)
        except IsolationError as refusal:
            return replace(row, outcome=refusal.words(Reader.FILE))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # One extreme spring must not end a study of thousands.
            return replace(row, outcome=f"No steady motion was found: {problem}.")
        figures: dict[str, Any] = asdict(response.resonance)
        inside = bool(figures.pop("inside"))
        figures = {name: finite(value) for name, value in figures.items()}
        return replace(row, **figures, inside=inside, extrapolating=response.extrapolating)

    def _system(self, spring: SpringParameters, mass: float) -> IsolatedMass:
        return IsolatedMass(spring, mass, self.mount)
