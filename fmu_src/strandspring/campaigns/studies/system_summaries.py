"""Summary of a study of a SYSTEM.toml for each candidate at each grid point: verdict, governing limit, quantiles."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...model.spread import Quantiles
from ...vibration.verdicts.verdicts import Verdict
from .quantiles import SHARES, Reasons, quantiles
from .summary_sequence import SummarySequence
from .system_study import SystemRow, SystemStudy

FIGURES = ("acceleration", "sway", "tilt", "stroke", "margin")
_VERDICTS = tuple(Verdict)  # from the best to the worst
_RANK = {verdict.value: rank for rank, verdict in enumerate(_VERDICTS)}
_NONE = -1


@dataclass(frozen=True)
class SystemSummary:
    """One candidate at one grid point, over all cases and draws.

    Attributes
    ----------
    point : int                 Of the grid.
    values : tuple              Of each path.
    candidate : str
    verdict : Verdict           The worst of all cases and draws.
    passing : float             Share of the draws that pass all cases.
    refused : int               Runs.
    reason : str or None        The most frequent reason for a refusal.
    governing : str or None     The limit that most often has the least margin of a draw, with its case.
    figures : dict              Quantiles over the draws of the worst of all cases; margins are shares of limits that
                                are left. None if no run has it.
    """

    point: int
    values: tuple[float | str, ...]
    candidate: str
    verdict: Verdict
    passing: float
    refused: int
    reason: str | None
    governing: str | None
    figures: dict[str, Quantiles | None]


class Rows(Protocol):
    """Rows by the number of the run."""

    def __getitem__(self, run: int, /) -> SystemRow: ...


class SystemSummaries(SummarySequence[SystemSummary]):
    """Summaries of all candidates at all grid points, held as arrays.

    Parameters
    ----------
    study : SystemStudy
    rows : Rows     Of the whole study.
    """

    def __init__(self, study: SystemStudy, rows: Rows) -> None:
        self._study = study
        self._draws, self._width = max(study.draws, 1), len(study.candidates)
        size = study.grid_size * self._width
        self._quantiles = np.empty((size, len(FIGURES), len(SHARES) if self._draws > 1 else 1))
        self._counts = np.zeros((size, 3), np.int32)  # worst rank, passing draws, refused runs
        self._governing = np.full(size, _NONE, np.int32)
        self._names: dict[str, int] = {}
        self._reasons = Reasons()
        for point in range(study.grid_size):
            self._sum_up(point, rows)

    def _sum_up(self, point: int, rows: Rows) -> None:
        """Fill in the summaries of a grid point."""
        study, cases = self._study, len(self._study.cases)
        figures = np.full((self._draws, self._width, len(FIGURES)), np.nan)
        governing: list[Counter[str]] = [Counter() for _ in range(self._width)]
        refusals: list[list[str]] = [[] for _ in range(self._width)]
        first = point * study.runs_per_point
        for draw in range(self._draws):
            for candidate in range(self._width):
                start = first + (draw * self._width + candidate) * cases
                of_cases = [rows[run] for run in range(start, start + cases)]
                known = [row for row in of_cases if row.verdict != Verdict.REFUSED.value]
                refusals[candidate] += [row.outcome for row in of_cases if row.verdict == Verdict.REFUSED.value]
                counts = self._counts[point * self._width + candidate]
                worst = max(_RANK[row.verdict] for row in of_cases)
                counts += (0, worst == 0, len(of_cases) - len(known))
                counts[0] = max(counts[0], worst)
                if known:
                    figures[draw, candidate] = np.fmax.reduce([_figures(row) for row in known])
                    nearest = min(known, key=_margin)
                    case = study.cases[study.place(nearest.run).case][1]
                    governing[candidate][f"{nearest.governing} in {case}"] += 1
        figures[..., -1] *= -1.0
        place = slice(point * self._width, (point + 1) * self._width)
        self._quantiles[place] = figures[0, :, :, None] if self._draws == 1 else quantiles(figures)
        for candidate in range(self._width):
            index = point * self._width + candidate
            if governing[candidate]:
                name = governing[candidate].most_common(1)[0][0]
                self._governing[index] = self._names.setdefault(name, len(self._names))
            if refusals[candidate]:
                self._reasons.add(index, refusals[candidate])

    def __len__(self) -> int:
        return len(self._counts)

    def summary(self, index: int) -> SystemSummary:
        """The summary of a candidate at a grid point; candidates come first."""
        point, candidate = divmod(index, self._width)
        rank, passing, refused = self._counts[index].tolist()
        governing = int(self._governing[index])
        return SystemSummary(
            point=point,
            values=self._study.values(point),
            candidate=self._study.candidates[candidate][1],
            verdict=_VERDICTS[rank],
            passing=passing / self._draws,
            refused=refused,
            reason=self._reasons.most_frequent.get(index),
            governing=None if governing == _NONE else list(self._names)[governing],
            figures={
                name: None if np.isnan(values[0]) else Quantiles(*np.broadcast_to(values, len(SHARES)).tolist())
                for name, values in zip(FIGURES, self._quantiles[index], strict=True)
            },
        )

    @property
    def refused(self) -> int:
        """Number of refused runs of the study."""
        return int(self._counts[:, 2].sum())

    def count(self, verdict: object) -> int:
        """How many candidates at grid points have a verdict."""
        return int(np.count_nonzero(self._counts[:, 0] == _VERDICTS.index(verdict))) if verdict in _VERDICTS else 0


def _margin(row: SystemRow) -> float:
    """The least margin of a row; -inf where a spring without free travel has left its range."""
    margins = (row.acceleration_margin, row.sway_margin, row.tilt_margin, row.stroke_margin)
    if row.stroke is None:
        return float("-inf")
    return min((margin for margin in margins if margin is not None), default=float("inf"))


def _figures(row: SystemRow) -> list[float]:
    """The figures of a row in the order of `FIGURES`, each the larger the worse, NaN where unknown."""
    found = (max(row.accelerations, default=None), row.sway, row.tilt, row.stroke)
    margin = _margin(row)
    return [*(np.nan if one is None else one for one in found), -margin if np.isfinite(margin) else np.nan]
