"""What isolation of one mass and of a whole system have in common: the computation, and results as text and tables.

A part is one of those that are compared: a model, or a candidate of a description.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from numpy.typing import NDArray

from ...campaigns.jobs.threads import in_threads
from ...ground.one_thread import one_thread
from ...ground.result_columns import ResultColumn
from ...vibration.one_mass.options import DEFAULT_SHARES
from ..common.progress import Progress
from ..common.result import PlottedResult
from ..common.table import Table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Part = TypeVar("Part", bound=Any)

# Of every resonance.
FREQUENCY = ResultColumn("frequency", "Hz", "resonance", "resonance", "Hz")
ISOLATION_FREQUENCY = ResultColumn("isolation_frequency", "Hz", "isolation begins", "isolates from", "Hz")
_BAND = ResultColumn("band", "", "place in the band", "band")


class AnyIsolation(PlottedResult):
    """Steady motions of all parts, each with its `label` and its `responses`."""

    _details: ClassVar[Sequence[str]] = ()  # keys of the figures that few have to know

    @property
    @abstractmethod
    def _parts(self) -> Sequence[Any]:
        """Those that are compared."""

    @abstractmethod
    def _of(self, part: Any, response: Any) -> dict[ResultColumn, Any]:
        """What a response is of: the part first, and the level last."""

    @abstractmethod
    def _curve(self, part: Any, response: Any) -> Mapping[ResultColumn, NDArray[Any]]:
        """All points of a curve."""

    @abstractmethod
    def _fill(self, figure: Figure) -> list[Axes]:
        """Draw everything into an empty figure with a constrained layout, and return its axes."""

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

        return pd.DataFrame(
            [
                {**_by_key(self._of(part, response)), **vars(resonance)}
                for part, response in self.every
                for resonance in response.resonances
            ]
        )

    @property
    def table(self) -> Table:
        """All points of the curves in their order: what they are of, and the figures of each motion."""
        columns: dict[ResultColumn, None] = {}
        rows = []
        for part, response in self.every:
            of, curve = self._of(part, response), self._curve(part, response)
            columns |= dict.fromkeys((*of, *curve))
            keys = [column.key for column in curve]
            points = zip(*(values.tolist() for values in curve.values()), strict=True)
            rows += [{**_by_key(of), **dict(zip(keys, point, strict=True))} for point in points]
        return Table(tuple(columns), rows)

    def _resonance_table(self, figures: Sequence[ResultColumn], chosen: Callable[[Any], Sequence[Any]]) -> Table:
        """The chosen resonances of each response; which part it is only if there are several."""
        columns: dict[str, ResultColumn] = {}
        rows = []
        for part, response in self.every:
            (first, label), *others = self._of(part, response).items()
            columns = {column.key: replace(column, short=column.words) for column, _ in ((first, label), *others)}
            of = {first.key: label if len(self._parts) > 1 else None, **_by_key(dict(others))}
            of["level"] = response.level_text
            ends = {True: None, False: "at its end"}
            rows += [{**vars(peak), **of, _BAND.key: ends[peak.inside]} for peak in chosen(response)]
        varied = {"level", *(column.key for column in figures if column.unit)}
        return Table((*columns.values(), *figures, _BAND), rows, details=self._details, varied=varied)

    def _overview(self) -> pd.DataFrame:
        return self.resonances()

    def _draw(self, figure: Figure) -> None:
        self._fill(figure)

    def _drawn(self) -> list[Axes]:
        """Everything in a new figure of pyplot."""
        from matplotlib import pyplot as plt

        return self._fill(plt.figure(figsize=self._size, layout="constrained"))


def _by_key(values: Mapping[ResultColumn, Any]) -> dict[str, Any]:
    return {column.key: value for column, value in values.items()}


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
