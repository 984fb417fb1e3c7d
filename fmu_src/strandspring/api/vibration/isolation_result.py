"""What isolation of one mass and of a whole system have in common: the computation, and results as text and tables.

A part is one of those that are compared: a model, or a candidate of a description.
"""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, fields, replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from numpy.typing import NDArray

from ...campaigns.jobs.threads import in_threads
from ...ground.files import write_csv
from ...ground.one_thread import one_thread
from ...ground.result_columns import ResultColumn, cells
from ...vibration.one_mass.system import DEFAULT_SHARES
from ..common.progress import Progress
from ..common.result import PlottedResult
from ..common.table import table_lines, without_constants

if TYPE_CHECKING:
    import pandas as pd

Part = TypeVar("Part", bound=Any)


# Figures of every resonance.
FREQUENCY = ResultColumn("frequency", "Hz", "resonance", "resonance", "Hz")
ISOLATION_FREQUENCY = ResultColumn("isolation_frequency", "Hz", "isolation begins", "isolates from", "Hz")


class AnyIsolation(PlottedResult):
    """Steady motions of all parts, each with its `label` and its `responses`."""

    _resonance: ClassVar[type[Any]]

    @property
    @abstractmethod
    def _parts(self) -> Sequence[Any]:
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

    @property
    def every(self) -> Iterator[tuple[Any, Any]]:
        """Each part with each of its responses."""
        return ((part, response) for part in self._parts for response in part.responses)

    @property
    def curves(self) -> dict[str, tuple[Any, ...]]:
        """Responses of each part by its label."""
        return {part.label: part.responses for part in self._parts}

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
        self,
        columns: Sequence[ResultColumn],
        width: int | None,
        chosen: Callable[[Any], Sequence[Any]],
        brief: bool = False,
    ) -> list[str]:
        """The chosen resonances of each response, the part first if there are several; what all of them share, if it is
        to be brief, in a line before.
        """
        first, rows = int(len(self._parts) == 1), []
        for part, response in self.every:
            head = {**self._named(part, response), "level": response.level_text}
            for resonance in chosen(response):
                at_end = {} if resonance.inside else {FREQUENCY.key: " (end of band)"}
                shown = zip(columns, cells(columns, resonance), strict=True)
                row = [text + at_end.get(column.key, "") for column, text in shown]
                rows.append([*head.values(), *row][first:])
        figures = [column.heading for column in columns]
        headings, shared = [*head, *figures][first:], ""
        if brief:
            headings, rows, shared = without_constants(headings, rows, {"level", *figures} - {"motion"})
        table = table_lines(headings, rows, {"model", "candidate", "excitation", "point", "motion"}, width)
        return [f"Throughout: {shared}", *table] if shared else table


def default_levels(travels: Sequence[float]) -> tuple[tuple[float, ...], str, int]:
    """Shares of the smallest free travel [m] as levels, how they were chosen in words, and which part that is."""
    least = min(travels)
    sentence = f"Levels: 0.5, 1 and 2 % of the free travel of {1e3 * least:.4g} mm"
    return tuple(share * least for share in DEFAULT_SHARES), sentence, travels.index(least)


def with_responses(
    parts: Sequence[Part],
    motions: Sequence[tuple[str, Callable[[Part, Callable[[float], None]], Any]]],
    points: int,
    progress: Progress,
) -> tuple[Part, ...]:
    """The parts with their responses, computed in threads.

    Parameters
    ----------
    parts : sequence of dataclasses with `label` and `responses`
    motions : sequence     Of each the name and a callable, which is given the part and a function to report its
                           finished points with.
    points : int           Of each response.
    progress : callable
    """
    total = len(parts) * len(motions) * points
    one_at_a_time, done = Lock(), [0.0] * (len(parts) * len(motions))

    def respond(number: int, part: Part, name: str, of_part: Callable[[Part, Callable[[float], None]], Any]) -> Any:
        def advance(count: float) -> None:
            with one_at_a_time:
                done[number] = count
                progress(f"{part.label}, {name}", sum(done), total)

        response = of_part(part, advance)
        advance(points)
        return response

    pairs = enumerate((part, *motion) for part in parts for motion in motions)
    # Its systems of equations are too small to be shared among threads.
    with one_thread():
        responses = list(in_threads(partial(respond, number, *pair) for number, pair in pairs))
    count = len(motions)
    finished = [replace(part, responses=tuple(responses[k * count : (k + 1) * count])) for k, part in enumerate(parts)]
    progress("done", total, total)
    return tuple(finished)
