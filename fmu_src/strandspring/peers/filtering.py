"""A record filtered before the two-stage identification (paper section 3.3)."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from ..errors import RecordError
from ..records.record import Record

Filter = Literal["moving-average", "low-pass", "fourier"]


def filtered_record(record: Record, kind: Filter) -> Record:
    """The record with its force filtered; the moving average comes later, along the strokes.

    "low-pass" keeps the samples, "fourier" gives one mean period twice over at uniform phases. Both choose their
    cut-off from the record's noise.

    Raises
    ------
    RecordError   If the record holds no whole periods, or too few samples.
    """
    if kind == "moving-average":
        return record
    # SciPy's signal processing takes a third of a second to import, and most identifications go without.
    from ..identification.periods import whole_periods
    from .filters import fourier_filter, low_pass

    try:
        if kind == "low-pass":
            return replace(record, force=low_pass(record.force))
        periods = whole_periods(record.displacement, record.force, record.time)
        flat = fourier_filter(periods.force.ravel(), periods.count)
        period = flat[: periods.displacement.size]
    except ValueError as problem:
        raise RecordError(f"{record.path}: {problem}") from None
    twice = np.concatenate([np.tile(np.arange(period.size), 2), [0]])
    return replace(record, displacement=periods.displacement[twice], force=period[twice], time=None)
