"""What the isolation of one mass and of a whole system have in common: resonances, plots, and the computation.

A part is one of those that are compared, a model or a candidate of a description.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ...campaigns.jobs.threads import in_threads
from ...findings import Finding
from ...ground.one_thread import one_thread
from ...ground.result_columns import ResultColumn
from ...vibration.one_mass.options import DEFAULT_SHARES
from ..common.model_source import Progress
from ..common.result import PlottedResult, picked
from ..common.table import Table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...report.drawing import Chart

Part = TypeVar("Part", bound=Any)

# Of every resonance: the level and this as text, and whether it is at an end of the band.
LEVELS = (ResultColumn("level", "", "level"), ResultColumn("level_text", "1", "", "level"))
BAND = ResultColumn("band", "", "", "band")


class AnyIsolation(PlottedResult):
    """Steady motions of parts that are compared, each with its `label` and its `responses`."""

    _parts_in: ClassVar[str]  # attribute that holds them

    @property
    @abstractmethod
    def _peak_columns(self) -> Sequence[ResultColumn]:
        """Of resonances; the first is the label of the part."""

    @property
    @abstractmethod
    def _panels(self) -> list[Chart]:
        """Of the plot, in two rows."""

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
        return Table(columns, rows)

    def resonances(self) -> pd.DataFrame:
        """One row for each resonance: what it is of, and its attributes in SI units."""
        return self._peaks.frame()

    _overview = resonances

    def _shown(self, columns: Sequence[ResultColumn]) -> Sequence[ResultColumn]:
        """Columns without the first, the label of the part, where there is one part only."""
        return columns[int(len(self._parts) == 1) :]

    def _peak_table(self, details: Sequence[str] = ()) -> Table:
        """Resonances in text."""
        columns = self._shown(self._peak_columns)
        varied = [column.key for column in columns if column.unit]
        return replace(self._peaks, columns=columns, details=details, varied=varied)

    def _drawn(self, ax: Axes | Sequence[Axes] | None) -> list[Axes]:
        """Everything in a new figure of pyplot, or as many panels as there are axes."""
        if ax is None:
            from matplotlib import pyplot as plt

            figure = plt.figure(figsize=self._size, layout="constrained")
            self._draw(figure)
            return figure.axes
        axes = self._axes(ax)
        for one, panel in zip(axes, self._panels, strict=False):
            panel.draw(one, has_legend=one is axes[0])
        return axes


def default_levels(travels: Mapping[str, float]) -> tuple[tuple[float, ...], str]:
    """Shares of the smallest free travel [m] of parts by their labels as levels, and in words how they were chosen."""
    label, least = min(travels.items(), key=lambda travel: travel[1])
    way = f"{1e3 * least:.4g} mm"
    of = f"smallest free travel, {way} of {label}" if len(travels) > 1 else f"free travel of {way}"
    return tuple(share * least for share in DEFAULT_SHARES), f"Levels: 0.5, 1 and 2 % of the {of}."


def with_responses(
    parts: Sequence[Part], motions: Sequence[Callable[[Part], Any]], points: int, progress: Progress
) -> tuple[Part, ...]:
    """The parts, dataclasses with a label, with their responses, computed in threads with so many points each."""
    pairs = [(part, respond) for part in parts for respond in motions]
    responses: list[Any] = []
    # The systems of equations are too small to be shared among threads.
    with one_thread():
        for response in in_threads(partial(respond, part) for part, respond in pairs):
            part, _ = pairs[len(responses)]
            responses.append(response)
            progress(f"{part.label}, {response.where}", len(responses) * points, len(pairs) * points)
    each = iter(responses)
    return tuple(replace(part, responses=tuple(islice(each, len(motions)))) for part in parts)
