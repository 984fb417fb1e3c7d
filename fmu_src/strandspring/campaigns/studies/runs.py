"""What every study is: runs by their numbers, each of a draw, a candidate and a load case at a point of a grid."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, TypeVar

from ...errors import StrandspringError
from ...findings import Finding
from ...ground.result_columns import ResultColumn

if TYPE_CHECKING:
    import pandas as pd

DONE = "done"
_MOST_RUNS = 1_000_000

Row = TypeVar("Row")


class Place(NamedTuple):
    """Which run it is, or which of several: indices of the grid point, the draw, the candidate and the case."""

    point: Any
    draw: Any
    candidate: Any
    case: Any


class Runs(ABC, Generic[Row]):
    """A study, which knows the inputs of each run and how to execute it.

    Attributes
    ----------
    subject : str                   What is studied.
    row_type : type                 Dataclass of a row.
    refusal : type                  Error that is raised where the study or its execution is refused.
    figures : tuple of ResultColumn Those with quantiles over the draws.
    draws, seed : int               Draws at each grid point, 0 for none.
    rows_of_draws : bool            Whether each draw is a run of its own.
    rows_are : str                  What candidates at grid points are called.
    few : tuple of str              Keys of the figures that everybody has to know.
    drawn : (str, str)              Keys of the figures of a plot, along x and y.
    """

    subject: ClassVar[str]
    row_type: ClassVar[type[Any]]
    refusal: ClassVar[type[StrandspringError]]
    figures: ClassVar[tuple[ResultColumn, ...]]
    rows_of_draws: ClassVar[bool] = True
    rows_are: ClassVar[str] = "grid points"
    few: ClassVar[tuple[str, ...]]
    drawn: ClassVar[tuple[str, str]]
    draws: int
    seed: int

    @abstractmethod
    def __len__(self) -> int: ...

    @property
    @abstractmethod
    def columns(self) -> Sequence[ResultColumn]:
        """Of the results."""

    @property
    @abstractmethod
    def identity(self) -> tuple[Any, dict[str, Any]]:
        """What determines the numbers, as JSON can hold it: the content of the subject, and all options."""

    @abstractmethod
    def place(self, run: Any) -> Place:
        """Which run it is; of an array of them, which they are."""

    @abstractmethod
    def rows(self, runs: Iterable[int]) -> list[Row]:
        """Execute runs."""

    @abstractmethod
    def cells(self, row: Row) -> Iterable[object]:
        """The values of a row under `columns`."""

    @property
    @abstractmethod
    def summed_up(self) -> list[str]:
        """Names of the columns that `sum_up` needs."""

    @abstractmethod
    def grid(self) -> pd.DataFrame:
        """What each candidate at each grid point is, one row for each; candidates come first."""

    @abstractmethod
    def sum_up(self, runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
        """What the runs say of each candidate at each grid point.

        Parameters
        ----------
        runs : DataFrame   The columns `summed_up` of the results, "draw", "case", and as "group" the row in `grid`.

        Returns
        -------
        counts : DataFrame    "refused" and other columns that stand before the quantiles, with the group as index.
        figures : DataFrame   `figures` of each draw, and its "group".
        """

    @property
    def names(self) -> list[str]:
        """Of the columns in a data frame."""
        return [column.key for column in self.columns]

    @property
    @abstractmethod
    def head(self) -> Sequence[ResultColumn]:
        """What stands before the figures of a row of `summaries` in a table for people."""

    @property
    @abstractmethod
    def stated(self) -> Mapping[str, Any]:
        """What JSON holds of the study."""

    def stated_point(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """A row of `summaries` without its figures, for JSON."""
        return dict(point)

    @abstractmethod
    def headline(self, summaries: pd.DataFrame) -> str:
        """What was run, in words."""

    @abstractmethod
    def where(self, point: Mapping[str, Any]) -> str:
        """The grid point and the candidate of a row of `summaries` in words."""

    def findings(self, point: Mapping[str, Any]) -> Iterator[Finding]:  # noqa: ARG002 - of studies that count something
        """What is to be known of a row of `summaries`."""
        return iter(())

    @abstractmethod
    def groups(self, summaries: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, dict[str, Any]]]:
        """Rows that belong together in a plot, with the look of their line or marks."""

    def _check_counts(self, advice: str = "") -> None:
        """Refuse negative counts, and a study without runs or with too many; advice follows a semicolon."""
        for name in ("draws", "seed"):
            if getattr(self, name) < 0:
                raise self.refusal(f"`{name}` must be >= 0, got {getattr(self, name)!r}.")
        if not 0 < len(self) <= _MOST_RUNS:
            raise self.refusal(f"A study must have from 1 to {_MOST_RUNS} runs, got {len(self)}{advice}.")
