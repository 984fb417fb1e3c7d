"""What a study says of each candidate at each grid point: refusals, and quantiles of the figures over the draws."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .runs import Runs

if TYPE_CHECKING:
    import pandas as pd

QUANTILES = {"q05": 0.05, "median": 0.5, "q95": 0.95}  # by the end of a column's name


def read_results(study: Runs[Any], results: Path, names: list[str] | None = None) -> pd.DataFrame:
    """The results of a study, all columns or some by their names."""
    import pandas as pd

    return pd.read_csv(results, header=0, names=[column.key for column in study.columns], usecols=names)


def summaries(study: Runs[Any], results: Path) -> pd.DataFrame:
    """One row for each candidate at each grid point.

    Parameters
    ----------
    study : Runs
    results : Path   CSV file.

    Returns
    -------
    DataFrame        The columns of `Runs.grid`, of what was counted, and three of quantiles for each figure, such as
                     "sway_q05", "sway_median" and "sway_q95", in SI units; linear between the sorted draws, and NaN
                     where no run has the figure.
    """
    import pandas as pd

    runs = read_results(study, results, study.summed_up)
    place = study.place(np.arange(len(runs)))
    group = place.point * (np.max(place.candidate) + 1) + place.candidate
    counts, figures = study.sum_up(runs.assign(group=group, draw=place.draw, case=place.case))
    of_groups = figures.groupby("group")[[figure.key for figure in study.figures]]
    quantiles = {end: of_groups.quantile(share) for end, share in QUANTILES.items()}
    columns = {f"{figure.key}_{end}": quantiles[end][figure.key] for figure in study.figures for end in QUANTILES}
    return study.grid().join(counts).join(pd.DataFrame(columns))


def most_frequent(texts: pd.Series[str], groups: pd.Series[int]) -> pd.Series[str]:
    """The most frequent text of each group, of equally frequent ones the first."""
    return texts.groupby(groups).agg(lambda of: Counter(of).most_common(1)[0][0])
