"""What studies have in common: where their runs are executed, and tables of their rows and quantiles."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from ...campaigns.jobs.cluster import Cluster, cluster_of
from ...campaigns.jobs.runners import Local, Runner
from ...errors import StrandspringError
from ...ground.arguments import workers_of
from ...ground.scratch import TemporaryFolder
from ...model.spread import Quantiles

if TYPE_CHECKING:
    import pandas as pd

Summary = TypeVar("Summary")


class Rows(NamedTuple):
    """The rows of a study: in a file that was asked for, or in memory.

    Attributes
    ----------
    output : Path or None
    table : DataFrame or None   Where there is no file.
    read : callable             Reads the file.
    """

    output: Path | None
    table: pd.DataFrame | None
    read: Callable[[Path], pd.DataFrame]

    def frame(self) -> pd.DataFrame:
        """The rows, for the caller to change."""
        if self.table is not None:
            return self.table.copy()
        assert self.output is not None  # noqa: S101 - rows are kept where there is no file
        return self.read(self.output)


def executed(
    run: Callable[[Path], Summary], output: str | os.PathLike[str] | None, read: Callable[[Path], pd.DataFrame]
) -> tuple[Summary, Rows]:
    """The summary of a study, and its rows.

    Parameters
    ----------
    run : callable         Executes the study with its results in a file.
    output : path or None  The file; a temporary one if None.
    read : callable        Reads the file.
    """
    if output is not None:
        return run(Path(output)), Rows(Path(output), None, read)
    with TemporaryFolder() as folder:
        results = folder / "results.csv"
        return run(results), Rows(None, read(results), read)


def runner_of(
    workers: int | None,
    scheduler: str | Cluster | None,
    notify: Callable[[str], None],
    refusal: type[StrandspringError],
) -> Runner:
    """Processes of this machine or a cluster; raises `refusal` if both are asked for."""
    workers = workers_of(workers)
    if workers not in (None, 1) and scheduler is not None:
        raise refusal("`workers` and `scheduler` exclude each other; give one of them.")
    return Local(workers) if scheduler is None else cluster_of(scheduler, notify)


def quantile_columns(figures: Mapping[str, Quantiles | None]) -> dict[str, float]:
    """The quantiles of 5, 50 and 95 % of each figure as columns of a table, NaN where unknown."""
    return {
        f"{name}_{end}": np.nan if known is None else getattr(known, attribute)
        for name, known in figures.items()
        for end, attribute in (("q05", "low"), ("median", "median"), ("q95", "high"))
    }
