"""What a study comes to at each grid point: quantiles of the figures, and the runs that were refused."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .definition import DONE, GridPoint, RunRow, Study

FIGURES = (
    "rest", "sag", "frequency", "transmissibility", "amplitude", "stiffness", "loss_factor", "isolation_frequency",
)  # fmt: skip
_SHARES = (0.05, 0.5, 0.95)
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")


@dataclass(frozen=True)
class Quantiles:
    """Quantiles of 5, 50 and 95 % of one figure, linear between the sorted runs."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class GridPointSummary:
    """One grid point over all its draws.

    Attributes
    ----------
    point : GridPoint
    runs, refused : int
    reason : str or None     The most frequent reason among the refused, as its first run gives it.
    at_end : int             Runs whose greatest transmissibility lies at an end of the band.
    extrapolating : int      Runs in which the spring leaves the identified range.
    figures : dict           Quantiles by figure, over the runs that tell it; None if none does.
    """

    point: GridPoint
    runs: int
    refused: int
    reason: str | None
    at_end: int
    extrapolating: int
    figures: dict[str, Quantiles | None]


def summarize(study: Study, rows: Sequence[RunRow]) -> list[GridPointSummary]:
    """Summaries of all grid points from the rows of a whole study, in the order of their numbers."""
    grid = study.grid
    return [_summary(point, rows[k :: len(grid)]) for k, point in enumerate(grid)]


def _summary(point: GridPoint, rows: Sequence[RunRow]) -> GridPointSummary:
    refusals = [row.outcome for row in rows if row.outcome != DONE]
    return GridPointSummary(
        point=point,
        runs=len(rows),
        refused=len(refusals),
        reason=_most_frequent(refusals),
        at_end=sum(row.inside is False for row in rows),
        extrapolating=sum(row.extrapolating is True for row in rows),
        figures={name: _quantiles([getattr(row, name) for row in rows if row.outcome == DONE]) for name in FIGURES},
    )


def _most_frequent(sentences: Sequence[str]) -> str | None:
    """The first of the sentences that most others differ from in their numbers only."""
    if not sentences:
        return None
    kinds = [_NUMBER.sub("#", sentence) for sentence in sentences]
    return sentences[kinds.index(Counter(kinds).most_common(1)[0][0])]


def _quantiles(values: Sequence[float | None]) -> Quantiles | None:
    told = [value for value in values if value is not None]
    return Quantiles(*np.quantile(told, _SHARES).tolist()) if told else None
