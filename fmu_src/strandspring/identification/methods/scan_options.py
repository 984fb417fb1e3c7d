"""The scan as a method of identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..points.sample_points import join
from ..points.steady_part import SteadyRecord
from ..search.scan import scan
from .fitted import Fitted, fitted
from .method import Method


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
