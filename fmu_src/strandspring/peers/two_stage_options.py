"""The two-stage method with what the paper tried: its three-point formulas, and filters against noise (section 3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from ..errors import RecordError
from ..identification.methods.fitted import Fitted, fitted
from ..identification.methods.method import Method
from ..identification.points.sample_points import join
from ..identification.points.steady_part import SteadyRecord
from ..identification.search.two_stage import Stages, two_stage, whole_branches
from ..records.record import Record
from .periods import whole_periods
from .three_point import three_point_stages

_FORMULAS: dict[str, Stages] = {"whole-branch": whole_branches, "three-point": three_point_stages}
_FILTERS = ("moving-average", "low-pass", "fourier")


@dataclass(frozen=True)
class TwoStageOptions(Method):
    """Options of the two-stage method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    formulas : str                 "whole-branch" least squares, or the paper's "three-point" formulas.
    smoothing : int or None        Half width of the moving average in points; from the noise if None.
    filter : str                   What is done against noise first: only the "moving-average", or a zero-phase
                                   "low-pass" or the "fourier" series of whole periods before it.
    """

    name: ClassVar[str] = "two-stage"

    formulas: Literal["whole-branch", "three-point"] = "whole-branch"
    smoothing: int | None = None
    filter: Literal["moving-average", "low-pass", "fourier"] = "moving-average"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value, allowed in (("formulas", self.formulas, _FORMULAS), ("filter", self.filter, _FILTERS)):
            if value not in allowed:
                raise ValueError(f"`{name}` must be one of {', '.join(allowed)}, got {value!r}.")
        if self.smoothing is not None and not 0 <= self.smoothing <= 10_000:
            raise ValueError(f"`smoothing` must be within [0, 10000] points, got {self.smoothing}.")

    def prepare(self, record: Record) -> Record:
        """The record with its force filtered; the moving average comes later, along the strokes.

        "low-pass" keeps the samples, "fourier" gives one mean period twice over at uniform phases. Both choose their
        cut-off from the record's noise.

        Raises
        ------
        RecordError   If the record holds no whole periods, or too few samples.
        """
        if self.filter == "moving-average":
            return record
        if record.compared is not None and self.filter == "fourier":
            raise RecordError(
                f"{record.path}: the Fourier filter takes whole periods; select no range of displacement, or use "
                "another `filter=...`."
            )
        # SciPy's signal processing takes a third of a second to import, and most identifications go without.
        from .filters import fourier_filter, low_pass

        try:
            if self.filter == "low-pass":
                return replace(record, force=low_pass(record.force))
            periods = whole_periods(record.displacement, record.force, record.time)
            flat = fourier_filter(periods.force.ravel(), periods.count)
        except ValueError as problem:
            raise RecordError(f"{record.path}: {problem}") from None
        size = periods.displacement.size
        twice = np.concatenate([np.tile(np.arange(size), 2), [0]])
        return replace(record, displacement=periods.displacement[twice], force=flat[:size][twice], time=None)

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify without start values."""
        loops = join([part.loops for part in parts])
        return fitted(loops, two_stage(loops, self.degrees, _FORMULAS[self.formulas], self.smoothing), where)
