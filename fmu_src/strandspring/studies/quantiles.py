"""Summary of a study at each grid point: quantiles of the figures, and the refused runs."""

from __future__ import annotations

import re
from array import array
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

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
    reason : str or None     The most frequent reason for a refusal, as worded in its first run.
    at_end : int             Runs whose peak transmissibility lies at an end of the band.
    extrapolating : int      Runs in which the spring leaves the identified range.
    figures : dict           Quantiles by figure, over the runs that have it; None if none has.
    """

    point: GridPoint
    runs: int
    refused: int
    reason: str | None
    at_end: int
    extrapolating: int
    figures: dict[str, Quantiles | None]


class Rows(Protocol):
    """Rows by the number of the run, such as a list or a `Journal`."""

    def __getitem__(self, run: int, /) -> RunRow: ...


def summarize(study: Study, rows: Rows) -> list[GridPointSummary]:
    """Summaries of all grid points from the rows of a whole study."""
    size = study.grid_size
    return [
        _summary(study.grid_point(index), (rows[run] for run in range(index, len(study), size)))
        for index in range(size)
    ]


def _summary(point: GridPoint, rows: Iterable[RunRow]) -> GridPointSummary:
    runs = at_end = extrapolating = 0
    reasons: Counter[str] = Counter()
    wordings: dict[str, str] = {}
    figures = {name: array("d") for name in FIGURES}
    for row in rows:
        runs += 1
        at_end += row.inside is False
        extrapolating += row.extrapolating is True
        if row.outcome != DONE:
            # Sentences that differ only in their numbers give the same reason.
            reason = _NUMBER.sub("#", row.outcome)
            reasons[reason] += 1
            wordings.setdefault(reason, row.outcome)
            continue
        for name, values in figures.items():
            if (value := getattr(row, name)) is not None:
                values.append(value)
    return GridPointSummary(
        point=point,
        runs=runs,
        refused=reasons.total(),
        reason=wordings[reasons.most_common(1)[0][0]] if reasons else None,
        at_end=at_end,
        extrapolating=extrapolating,
        figures={
            name: Quantiles(*np.quantile(values, _SHARES).tolist()) if values else None
            for name, values in figures.items()
        },
    )
