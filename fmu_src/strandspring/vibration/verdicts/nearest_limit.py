"""Which figure of an answer is nearest to its limit."""

from __future__ import annotations

import math

from .answers import CaseAnswer
from .verdicts import Figure


def of_limit(figure: Figure) -> float:
    """The upper end of its range as a share of its limit; NaN if it has none."""
    return math.nan if figure.limit is None else figure.high / figure.limit


def nearest_limit(answer: CaseAnswer) -> Figure | None:
    """The figure of an answer that is nearest to its limit or furthest beyond it; None if none has a limit."""
    limited = [figure for figure in answer.figures if figure.limit is not None]
    return max(limited, key=of_limit, default=None)
