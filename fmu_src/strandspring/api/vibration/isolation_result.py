"""What isolation of one mass and of a whole system have in common: the computation, and results as text and tables.

A part is one of those that are compared: a model, or a candidate of a description.
"""

from __future__ import annotations

import math
import os
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

from numpy.typing import NDArray

from ...ground.files import write_csv
from ...vibration.one_mass.system import DEFAULT_SHARES
from ..common.progress import Progress
from ..common.result import Result
from ..common.text_table import table_lines

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")


class ResonanceColumn(NamedTuple):
    """A column of the printed resonances.

    Attributes
    ----------
    name : str        Attribute of the resonance.
    heading : str     With the unit.
    factor : float    From SI to that unit.
    digits : int
    """

    name: str
    heading: str
    factor: float = 1.0
    digits: int = 4

    def cell(self, resonance: Any) -> str:
        """What stands there."""
        value = getattr(resonance, self.name)
        if isinstance(value, str):
            return value
        at_end = " (end of band)" if self.name == "frequency" and not resonance.inside else ""
        return "-" if math.isnan(value) else f"{self.factor * value:.{self.digits}g}{at_end}"


class AnyIsolation(Result):
    """Steady motions of all parts, each with its `label` and its `responses`."""

    _resonance: ClassVar[type[Any]]

    @property
    @abstractmethod
    def parts(self) -> Sequence[Any]:
        """Those that are compared."""

    @abstractmethod
    def _named(self, part: Any, response: Any) -> dict[str, Any]:
        """What a response is of, the part first."""

    @abstractmethod
    def _columns(self, part: Any, response: Any) -> Mapping[str, NDArray[Any]]:
        """All points of a curve."""

    @abstractmethod
    def _csv(self) -> pd.DataFrame:
        """What `save_csv` writes."""

    @abstractmethod
    def lines(self, width: int | None = None) -> list[str]:
        """Static equilibrium, resonances and cautions in words, in tables of at most a width."""

    def summary(self) -> str:
        """Static equilibrium, resonances and cautions in words."""
        return "\n".join(self.lines())

    @property
    def every(self) -> Iterator[tuple[Any, Any]]:
        """Each part with each of its responses."""
        return ((part, response) for part in self.parts for response in part.responses)

    @property
    def curves(self) -> dict[str, tuple[Any, ...]]:
        """Responses of each part by its label."""
        return {part.label: part.responses for part in self.parts}

    def resonances(self) -> pd.DataFrame:
        """One row for each resonance: what it is of, and its attributes in SI units."""
        import pandas as pd

        names = [field.name for field in fields(self._resonance)]
        return pd.DataFrame(
            [
                {**self._named(part, response), **dict(zip(names, astuple(resonance), strict=True))}
                for part, response in self.every
                for resonance in response.resonances
            ]
        )

    def to_frame(self) -> pd.DataFrame:
        """All points of the curves in their order: what they are of, and the figures of each motion."""
        import pandas as pd

        curves = (pd.DataFrame({**self._named(*pair), **self._columns(*pair)}) for pair in self.every)
        return pd.concat(curves, ignore_index=True)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all points of the curves, with units in the header.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        table = self._csv()
        write_csv(Path(path), table.columns, table.itertuples(index=False))

    def _table(
        self, columns: Sequence[ResonanceColumn], width: int | None, chosen: Callable[[Any], Sequence[Any]]
    ) -> list[str]:
        """The chosen resonances of each response, the part first if there are several."""
        first, rows = int(len(self.parts) == 1), []
        for part, response in self.every:
            head = {**self._named(part, response), "level": response.level_text}
            cells = [[column.cell(resonance) for column in columns] for resonance in chosen(response)]
            rows += [[*head.values(), *row][first:] for row in cells]
        headings = [*head, *(column.heading for column in columns)][first:]
        return table_lines(headings, rows, {"model", "candidate", "excitation", "point", "motion"}, width)


def default_levels(travels: Sequence[float]) -> tuple[tuple[float, ...], str, int]:
    """Shares of the smallest free travel [m] as levels, how they were chosen in words, and which part that is."""
    least = min(travels)
    sentence = f"Levels: 0.5, 1 and 2 % of the free travel of {1e3 * least:.4g} mm"
    return tuple(share * least for share in DEFAULT_SHARES), sentence, travels.index(least)


def computed(
    tasks: Sequence[tuple[str, Callable[[Callable[[float], None]], T]]], points: int, progress: Progress
) -> list[T]:
    """Run named tasks one after the other; each is given a function to report its finished points with."""
    total = len(tasks) * points

    def advance(name: str, before: int, count: float) -> None:
        progress(name, before + count, total)

    results = [task(partial(advance, name, k * points)) for k, (name, task) in enumerate(tasks)]
    progress("done", total, total)
    return results
