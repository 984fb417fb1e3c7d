"""A study of a SYSTEM.toml: every grid point with every candidate and load case."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import MountedSystemError, Reader, StrandspringError
from ...ground.result_columns import ResultColumn
from ...ground.strict_json import finite
from ...vibration.description.named_files import HeldFiles
from ...vibration.description.system_file import SystemFile, system_of_content
from ...vibration.description.system_tables import SystemTable
from ...vibration.description.value_paths import Location
from ...vibration.options import DRAWS, LEAST_DRAWS
from ...vibration.verdicts.answers import CaseAnswer, answer_case
from ...vibration.verdicts.drawn_springs import Drawn
from ...vibration.verdicts.draws import Unknowns
from ...vibration.verdicts.verdicts import CaseVerdict, FigureKind, of_all_cases
from .runs import DONE, Place, Runs
from .summaries import most_frequent
from .varied import Varied, with_texts

# Of verdicts and of candidates in a plot.
_COLORS = {
    CaseVerdict.NO_LIMITS: "tab:blue",
    CaseVerdict.PASSES: "tab:green",
    CaseVerdict.NOT_TESTED: "tab:cyan",
    CaseVerdict.UNDECIDED: "tab:olive",
    CaseVerdict.FAILS: "tab:red",
    CaseVerdict.OUTSIDE: "tab:purple",
    CaseVerdict.REFUSED: "tab:gray",
}
_MARKERS = "osD^vPX*<>"
_HEAD = (
    ResultColumn("candidate", "", "candidate", "candidate"),
    ResultColumn("verdict", "", "verdict", "verdict"),
    ResultColumn("least_margin", "", "least margin", "least margin"),
    ResultColumn("beyond", "1", "draws beyond a limit", "beyond a limit", "%", 100.0, 3),
)
# Figures whose margins stand in a row.
_LIMITED = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)
# Of the fields of a row after the accelerations.
_COLUMNS = (
    FigureKind.SWAY.column,
    FigureKind.TILT.column,
    replace(FigureKind.STROKE.column, unit="1"),
    ResultColumn("mount", "", "mount of the stroke"),
    *(kind.column for kind in (FigureKind.FORCE, FigureKind.RMS_ACCELERATION, FigureKind.RMS_SWAY)),
    ResultColumn("error", "1", "numerical error"),
    ResultColumn("beyond", "1", "draws beyond a limit"),
    *(ResultColumn(f"{name}_margin", "1", f"margin of {name}") for name in ("acceleration", "sway", "tilt", "stroke")),
    ResultColumn("governing", "", "least margin"),
    ResultColumn("verdict", "", "verdict"),
    ResultColumn("outcome", "", "outcome"),
)
_MARGINS = [column.key for column in _COLUMNS if column.key.endswith("_margin")]


@dataclass(frozen=True)
class SystemRow:
    """One run: a load case on a candidate at a grid point.

    Attributes
    ----------
    run : int                             From 0 in the study.
    accelerations : tuple of float        Largest absolute acceleration of each point [m/s^2]; empty if refused.
    sway, tilt : float or None            Largest of all points and of all bodies [m], [rad].
    stroke : float or None                Largest share used of the way from rest to the end of a spring's range.
    mount : str or None                   The axis of a mount that has it.
    force : float or None                 Largest of any axis of a mount [N].
    rms_acceleration, rms_sway : float or None   Largest of all points and axes [m/s^2], [m]; None if nothing settles.
    error : float or None                 Numerical error of acceleration, sway or stroke, relative to the largest.
    acceleration_margin, sway_margin, tilt_margin, stroke_margin : float or None
                                          Least share of a limit that is left; None without a limit.
    governing : str or None               The limit with the least margin.
    verdict : str                         See `CaseVerdict`.
    beyond : float or None                Share of the draws beyond a limit or an identified range.
    outcome : str                         `DONE`, "outside" where figures are extrapolated, or why it is refused.
    """

    run: int
    accelerations: tuple[float, ...] = ()
    sway: float | None = None
    tilt: float | None = None
    stroke: float | None = None
    mount: str | None = None
    force: float | None = None
    rms_acceleration: float | None = None
    rms_sway: float | None = None
    error: float | None = None
    acceleration_margin: float | None = None
    sway_margin: float | None = None
    tilt_margin: float | None = None
    stroke_margin: float | None = None
    governing: str | None = None
    beyond: float | None = None
    verdict: str = CaseVerdict.REFUSED.value
    outcome: str = DONE


def system_row(run: int, answer: CaseAnswer) -> SystemRow:
    """A run of which there is an answer."""
    if answer.verdict is CaseVerdict.REFUSED:
        return SystemRow(run, outcome=answer.refusal)
    worst = {
        kind.name.lower(): finite(max((figure.high for figure in answer.figures_of(kind)), default=None))
        for kind in FigureKind
        if kind.name.lower() in SystemRow.__dataclass_fields__
    }
    stroke = max(answer.figures_of(FigureKind.STROKE), key=lambda figure: figure.high)
    margins: dict[str, float | None] = {}
    for kind in _LIMITED:
        shares = [figure.margin for figure in answer.figures_of(kind) if figure.margin is not None]
        margins[f"{kind.name.lower()}_margin"] = finite(min(shares, default=None))
    nearest = answer.nearest_limit
    return SystemRow(
        run=run,
        accelerations=tuple(figure.high for figure in answer.figures_of(FigureKind.ACCELERATION)),
        mount=stroke.subject,
        error=finite(answer.relative_error),
        **worst,
        **margins,
        governing=None if nearest is None else f"{nearest.quantity.value} of {nearest.subject}",
        beyond=answer.beyond,
        verdict=answer.verdict.value,
        outcome=answer.verdict.value if answer.verdict is CaseVerdict.OUTSIDE else DONE,
    )


if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class SystemStudy(Runs[SystemRow]):
    """Runs over a grid of values of a SYSTEM.toml, each with every candidate and load case.

    Cases come first, then candidates and grid points, of which the values of the last path come first. A run is what
    `simulate` does; its figures are the upper ends of their ranges.

    Parameters
    ----------
    content : mapping            Of the description, as TOML gives it.
    files : HeldFiles            All that it may name.
    varied : tuple of Varied     The axes of the grid.
    candidates, cases : tuple    Their indices in the description, and their names.
    points : tuple of str        Names of the points whose acceleration is asked for.
    draws, seed : int            Draws in each run, see `Unknowns`.
    step : float or None         See `simulate_case`.

    Raises
    ------
    MountedSystemError           If there are no runs or too many, or two paths lead to the same value.
    """

    subject = "system"
    row_type = SystemRow
    refusal = MountedSystemError
    rows_of_draws = False
    rows_are = "rows"
    few = ("margin",)
    drawn = ("stroke", "acceleration")
    figures = (  # the worst of all cases; margins are shares of limits that are left
        ResultColumn("margin", "1", "margin", "margin", "%", 100.0),
        FigureKind.ACCELERATION.column,
        *_COLUMNS[:3],
    )

    content: Mapping[str, Any]
    files: HeldFiles
    varied: tuple[Varied, ...]
    candidates: tuple[tuple[int, str], ...]
    cases: tuple[tuple[int, str], ...]
    points: tuple[str, ...]
    draws: int = DRAWS
    seed: int = 0
    step: float | None = None

    def __post_init__(self) -> None:
        taken: dict[Location, str] = {}
        for axis in self.varied:
            for location in axis.locations:
                if location in taken:
                    raise MountedSystemError(f"{taken[location]} and {axis.path} vary the same value; leave one out.")
                taken[location] = axis.path
        if self.draws < LEAST_DRAWS:
            raise MountedSystemError(f"`draws` must be >= {LEAST_DRAWS}, got {self.draws!r}.")
        self._check_counts("; vary less, or choose cases and candidates")

    @property
    def grid_size(self) -> int:
        """Number of grid points."""
        return math.prod(len(axis.values) for axis in self.varied)

    def __len__(self) -> int:
        return self.grid_size * len(self.candidates) * len(self.cases)

    @property
    def columns(self) -> list[ResultColumn]:
        """See `Runs`."""
        return [
            ResultColumn("run", "", "run"),
            *(ResultColumn(axis.path, axis.unit, axis.path) for axis in self.varied),
            *(ResultColumn(name, "", name) for name in ("candidate", "case")),
            *(ResultColumn(name, "m/s^2", name) for name in (f"acceleration of {point}" for point in self.points)),
            *_COLUMNS,
        ]

    @property
    def identity(self) -> tuple[Any, dict[str, Any]]:
        """See `Runs`."""
        options = {name: getattr(self, name) for name in ("candidates", "cases", "draws", "seed", "step")}
        content = {"system": self.content, "files": self.files.digests()}
        return content, {"vary": [asdict(axis) for axis in self.varied], **options}

    def place(self, run: Any) -> Place:
        """See `Runs`."""
        rest, case = divmod(run, len(self.cases))
        rest, candidate = divmod(rest, len(self.candidates))
        return Place(rest, 0 * rest, candidate, case)

    def cells(self, row: SystemRow) -> list[object]:
        """See `Runs`."""
        place = self.place(row.run)
        accelerations = row.accelerations or (None,) * len(self.points)
        return [
            row.run, *self.values(place.point), self.candidates[place.candidate][1], self.cases[place.case][1],
            *accelerations,
            *(getattr(row, column.key) for column in _COLUMNS),
        ]  # fmt: skip

    @property
    def summed_up(self) -> list[str]:
        """See `Runs`."""
        accelerations = [f"acceleration of {name}" for name in self.points]
        return [*accelerations, "sway", "tilt", "stroke", *_MARGINS, "governing", "beyond", "verdict", "outcome"]

    def grid(self) -> pd.DataFrame:
        """See `Runs`; values that are varied stand under their headings."""
        import pandas as pd

        names = [*(axis.heading for axis in self.varied), "candidate"]
        axes = [*(axis.values for axis in self.varied), [name for _, name in self.candidates]]
        return pd.MultiIndex.from_product(axes, names=names).to_frame(index=False)

    def sum_up(self, runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
        """See `Runs`; counts have "verdict", that on all cases together, "beyond", the largest share of draws beyond a
        limit, "refused", "reason", and "least_margin", the limit that has the least margin, with its case.
        """
        import pandas as pd

        refused = runs[runs["verdict"] == CaseVerdict.REFUSED.value]
        # Unknown where a spring without free travel has left its range, which is worse than any other.
        margin = runs[_MARGINS].min(axis=1).where(runs["stroke"].notna())
        acceleration = runs[[f"acceleration of {name}" for name in self.points]].max(axis=1)
        figures = runs.assign(acceleration=acceleration, margin=margin).groupby(["group", "draw"])
        worst = figures[["acceleration", "sway", "tilt", "stroke"]].max().assign(margin=figures["margin"].min())
        nearest = runs.assign(margin=margin.fillna(-math.inf)).drop(refused.index)
        nearest = nearest.sort_values("margin", kind="stable").drop_duplicates(["group", "draw"]).sort_index()
        limits = zip(nearest["governing"], nearest["case"], strict=True)
        governing = pd.Series([f"{name} in {self.cases[case][1]}" for name, case in limits], nearest.index, dtype=str)
        verdicts = runs["verdict"].groupby(runs["group"])
        counts = verdicts.agg(lambda of: of_all_cases(map(CaseVerdict, of), self.untested).value).to_frame("verdict")
        counts["beyond"] = runs.groupby("group")["beyond"].max()
        counts["refused"] = refused.groupby("group").size().reindex(counts.index, fill_value=0)
        counts["reason"] = most_frequent(refused["outcome"], refused["group"])
        counts["least_margin"] = most_frequent(governing, nearest["group"])
        return counts, worst.reset_index()

    @property
    def names(self) -> list[str]:
        """The headings of the results file."""
        return [column.file_heading for column in self.columns]

    @property
    def head(self) -> tuple[ResultColumn, ...]:
        """See `Runs`."""
        headings = (axis.heading for axis in self.varied)
        return (*(ResultColumn(heading, "", heading, heading, digits=6) for heading in headings), *_HEAD)

    @property
    def stated(self) -> dict[str, Any]:
        """See `Runs`."""
        varied = [{"path": axis.path, "unit": axis.unit, "values": axis.values} for axis in self.varied]
        return {"vary": varied, "cases": [name for _, name in self.cases]}

    def stated_point(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """See `Runs`; the varied values are a list."""
        headings = [axis.heading for axis in self.varied]
        others = {name: value for name, value in point.items() if name not in headings}
        return {**others, "values": [point[heading] for heading in headings]}

    def headline(self, summaries: pd.DataFrame) -> str:
        """See `Runs`, with how many candidates at grid points have each verdict."""
        counts = {verdict.value: int((summaries["verdict"] == verdict.value).sum()) for verdict in CaseVerdict}
        parts = {"candidate": len(self.candidates), "load case": len(self.cases), "grid point": self.grid_size}
        candidates, cases, points = (f"{count} {noun}{'' if count == 1 else 's'}" for noun, count in parts.items())
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
        return (
            f"{len(self)} runs of {self.draws} draws (seed {self.seed}): {candidates} in {cases} at each of {points}: "
            f"{verdicts}, {int(summaries['refused'].sum())} runs refused"
        )

    def where(self, point: Mapping[str, Any]) -> str:
        """See `Runs`."""
        return ", ".join(
            [*(f"{axis.path} {axis.shown(point[axis.heading])}" for axis in self.varied), point["candidate"]]
        )

    def groups(self, summaries: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, dict[str, Any]]]:
        """A marker for each candidate in the colour of its verdict, and what most often has the least margin."""
        several = len(self.candidates) > 1
        for verdict, color in _COLORS.items():
            for number, (_, name) in enumerate(self.candidates):
                rows = summaries[(summaries["verdict"] == verdict.value) & (summaries["candidate"] == name)]
                label = f"{name}: {verdict.value}" if several else verdict.value
                deciding = rows["least_margin"].mode()
                label += f", least margin: {deciding[0]}" if deciding.size else ""
                marker = _MARKERS[number % len(_MARKERS)]
                if not rows.empty:
                    yield rows, {"label": label, "linestyle": "none", "marker": marker, "color": color}

    def indices(self, point: int) -> tuple[int, ...]:
        """Of the value of each path at a grid point."""
        places = []
        for axis in reversed(self.varied):
            point, index = divmod(point, len(axis.values))
            places.append(index)
        return tuple(reversed(places))

    def values(self, point: int) -> tuple[float | str, ...]:
        """The value of each path at a grid point."""
        return tuple(axis.values[index] for axis, index in zip(self.varied, self.indices(point), strict=True))

    def described(self, point: int) -> SystemFile:
        """The description at a grid point; raises StrandspringError if there is no such system."""
        content = self.content
        pairs = zip(self.varied, self.indices(point), strict=True)
        # Places last, which other paths count from the first on.
        for axis, index in sorted(pairs, key=lambda pair: pair[0].counts_places):
            content = axis.applied(content, self._table, index)
        return system_of_content(content, self.files)

    def distinct_files(self) -> Iterator[SystemFile]:
        """The description as it is, and with each text that is varied, as far as these are possible."""
        for content in with_texts(self.content, self._table, self.varied):
            with suppress(StrandspringError):
                yield system_of_content(content, self.files)

    @cached_property
    def untested(self) -> tuple[FigureKind, ...]:
        """The kinds of figures whose limits none of the cases tests."""
        file = system_of_content(self.content, self.files)
        return file.limits.untested([file.cases[number] for number, _ in self.cases])

    @cached_property
    def _table(self) -> SystemTable:
        return SystemTable.model_validate(self.content)

    def rows(self, runs: Iterable[int]) -> list[SystemRow]:
        """Execute runs."""
        described = lru_cache(maxsize=1)(self.described)  # runs that follow each other share it
        return [self._row(run, described) for run in runs]

    def _row(self, run: int, described: Callable[[int], SystemFile]) -> SystemRow:
        place = self.place(run)
        try:
            file = described(place.point)
            name, system = file.candidates[self.candidates[place.candidate][0]]
            case = file.cases[self.cases[place.case][0]]
            drawn = Drawn.from_models(system, file.models)
            unknowns = Unknowns(drawn, self.draws, self.seed, file.options.rest_omega)
            answer = answer_case(name, system, case, file.limits, unknowns, self.step or file.options.step)
        except StrandspringError as refusal:
            return SystemRow(run, outcome=refusal.words(Reader.FILE))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:
            # One extreme system must not end a study of thousands.
            return SystemRow(run, outcome=f"No motion was found: {problem}.")
        return system_row(run, answer)
