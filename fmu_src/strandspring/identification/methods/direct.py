"""Methods that do not iterate: our two-stage method, and the scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..points.sample_points import join
from ..points.steady_part import SteadyRecord
from ..search.scan import scan
from ..search.two_stage import two_stage
from .fitted import Fitted, fitted
from .method import Method


@dataclass(frozen=True)
class TwoStageOptions(Method):
    """Options of our two-stage method: the paper's two stages, each by least squares over whole strokes.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    """

    name: ClassVar[str] = "two-stage"

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify without start values."""
        loops = join([part.loops for part in parts])
        return fitted(loops, two_stage(loops, self.degrees), where)


@dataclass(frozen=True)
class ScanOptions(Method):
    """Options of the scan.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    """

    name: ClassVar[str] = "scan"

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify by the best point of the grid."""
        loops = join([part.loops for part in parts])
        return fitted(loops, scan(loops, self.degrees), where)
