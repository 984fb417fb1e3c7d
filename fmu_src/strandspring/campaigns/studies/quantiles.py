"""Summary of a study at each grid point: quantiles of the figures, and the refused runs."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from operator import attrgetter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...model.spread import Quantiles
from .definition import DONE, GridPoint, RunRow, Study
from .summary_sequence import SummarySequence

FIGURES = (
    "rest", "sag", "frequency", "transmissibility", "amplitude", "stiffness", "loss_factor", "isolation_frequency",
)  # fmt: skip
SHARES = (0.05, 0.5, 0.95)
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")
_BLOCK = 1 << 16  # runs that are summed up at a time, unless a grid point has more
_MOST_WORDINGS = 10_000  # reasons that are kept with their numbers

_figures_of = attrgetter(*FIGURES)


@dataclass(frozen=True)
class GridPointSummary:
    """One grid point over all its draws.

    Attributes
    ----------
    point : GridPoint
    runs, refused : int
    reason : str or None     The most frequent reason for a refusal, as worded in its first run; in studies with very
                             many different ones with # for each number.
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


class Summaries(SummarySequence[GridPointSummary]):
    """Summaries of all grid points of a study, held as arrays: a grid may have a million points.

    Parameters
    ----------
    study : Study
    rows : Rows     Of the whole study.
    """

    def __init__(self, study: Study, rows: Rows) -> None:
        self._study = study
        self._reasons = Reasons()
        self._draws = max(study.draws, 1)
        size = study.grid_size
        # The quantiles of one run are all the same.
        self._quantiles = np.empty((size, len(FIGURES), 1 if self._draws == 1 else len(SHARES)))
        self._counts = np.empty((size, 3), np.int32)  # refused, at an end, extrapolating
        width = max(1, _BLOCK // self._draws)
        for first in range(0, size, width):
            self._sum_up(range(first, min(first + width, size)), rows)

    def _sum_up(self, indices: range, rows: Rows) -> None:
        """Fill in the summaries of consecutive grid points."""
        figures = np.full((self._draws, len(indices), len(FIGURES)), np.nan)
        counts = np.zeros((len(indices), 3), np.int32)
        reasons: dict[int, list[str]] = {}
        for draw in range(self._draws):
            for column, index in enumerate(indices):
                row = rows[draw * self._study.grid_size + index]
                counts[column] += (row.outcome != DONE, row.inside is False, row.extrapolating is True)
                if row.outcome == DONE:
                    figures[draw, column] = _figures_of(row)  # None becomes NaN
                else:
                    reasons.setdefault(index, []).append(row.outcome)
        self._counts[indices.start : indices.stop] = counts
        self._quantiles[indices.start : indices.stop] = (
            figures[0, :, :, None] if self._draws == 1 else quantiles(figures)
        )
        for index, sentences in reasons.items():
            self._reasons.add(index, sentences)

    def __len__(self) -> int:
        return self._study.grid_size

    def summary(self, index: int) -> GridPointSummary:
        """The summary of a grid point."""
        refused, at_end, extrapolating = self._counts[index].tolist()
        return GridPointSummary(
            point=self._study.grid_point(index),
            runs=self._draws,
            refused=refused,
            reason=self._reasons.most_frequent.get(index),
            at_end=at_end,
            extrapolating=extrapolating,
            figures={
                name: None if np.isnan(values[0]) else Quantiles(*np.broadcast_to(values, len(SHARES)).tolist())
                for name, values in zip(FIGURES, self._quantiles[index], strict=True)
            },
        )

    @property
    def refused(self) -> int:
        """Number of refused runs of the study."""
        return int(self._counts[:, 0].sum())


class Reasons:
    """The most frequent reasons at grid points."""

    def __init__(self) -> None:
        self.most_frequent: dict[int, str] = {}
        self._texts: dict[str, str] = {}  # each is held once

    def add(self, index: int, sentences: list[str]) -> None:
        """Note the most frequent one of all sentences at a grid point; those that differ in numbers only are one."""
        kinds: Counter[str] = Counter()
        wordings: dict[str, str] = {}
        for sentence in sentences:
            kind = _NUMBER.sub("#", sentence)
            kinds[kind] += 1
            wordings.setdefault(kind, sentence)
        kind = kinds.most_common(1)[0][0]
        text = wordings[kind]
        if text not in self._texts and len(self._texts) >= _MOST_WORDINGS:
            text = kind
        self.most_frequent[index] = self._texts.setdefault(text, text)


def quantiles(figures: FloatArray) -> FloatArray:
    """Quantiles over the first axis, linear between the sorted values, shape (P, figures, 3).

    Parameters
    ----------
    figures : ndarray, shape (K, P, figures)   NaN where unknown; overwritten.
    """
    figures.sort(axis=0)  # NaN last
    last = np.maximum(np.sum(np.isfinite(figures), axis=0) - 1, 0)
    result = np.empty((*figures.shape[1:], len(SHARES)))
    for k, share in enumerate(SHARES):
        position = share * last
        below: NDArray[np.intp] = np.floor(position).astype(np.intp)
        low = np.take_along_axis(figures, below[None], axis=0)[0]
        high = np.take_along_axis(figures, np.minimum(below + 1, last)[None], axis=0)[0]
        result[..., k] = low + (position - below) * (high - low)
    return result
