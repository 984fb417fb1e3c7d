"""Figures of a load case beside their limits, and the verdict on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from ...ground.gravity import STANDARD_GRAVITY
from ...ground.result_columns import ResultColumn
from ...model.joint import Quantiles


class CaseVerdict(Enum):
    """The verdict on a candidate in a load case; the value is how people name it."""

    PASSES = "pass"  # within all limits and the identified ranges
    CLOSE = "close"  # a limit lies within the numerical error
    FAILS = "fail"  # a limit is exceeded
    OUTSIDE = "outside"  # a spring leaves its identified range: the figures are extrapolated
    REFUSED = "refused"  # it cannot be simulated


class FigureKind(Enum):
    """What a figure is of; the value is how people name it."""

    ACCELERATION = "acceleration"  # largest absolute acceleration of a point [m/s^2]
    SWAY = "sway"  # largest displacement of a point from rest, relative to the base [m]
    TILT = "tilt"  # largest rotation of a body from rest, relative to the base [rad]
    STROKE = "stroke"  # largest share of a spring's way from rest to the end of its identified range
    FORCE = "force"  # largest of an axis of a mount, its weight, damper and stops included [N]
    RMS_ACCELERATION = "rms acceleration"  # of a point along an axis, once it has settled [m/s^2]
    RMS_SWAY = "rms sway"  # likewise, about its mean [m]

    @property
    def unit(self) -> str:
        """In which figures are held; empty for a share."""
        return self.column.unit

    @property
    def column(self) -> ResultColumn:
        """How its figures are presented."""
        unit, shown, factor = _UNITS[self]
        return ResultColumn(self.name.lower(), unit, self.value, self.value, shown, factor)


# In SI, for people, and the factor between them.
_ACCELERATION, _LENGTH = ("m/s^2", "g", 1.0 / STANDARD_GRAVITY), ("m", "mm", 1e3)
_UNITS = {
    FigureKind.ACCELERATION: _ACCELERATION,
    FigureKind.SWAY: _LENGTH,
    FigureKind.TILT: ("rad", "deg", math.degrees(1.0)),
    FigureKind.STROKE: ("", "%", 100.0),
    FigureKind.FORCE: ("N", "N", 1.0),
    FigureKind.RMS_ACCELERATION: _ACCELERATION,
    FigureKind.RMS_SWAY: _LENGTH,
}


@dataclass(frozen=True)
class Figure:
    """A figure of a load case: the worst of all static equilibria from which it was run.

    Parameters
    ----------
    quantity : FigureKind
    subject : str             Name of the point, body or axis of a mount.
    value, error : float      With its numerical error, in SI units.
    min : float               The smallest among the static equilibria.
    share : float             omega at rest of the worst, in the sense of each spring's static force.
    limit : float or None
    spread : Quantiles or None   By the uncertainty of the springs; None if nothing was drawn.
    """

    quantity: FigureKind
    subject: str
    value: float
    error: float
    min: float
    share: float
    limit: float | None = None
    spread: Quantiles | None = None

    @property
    def margin(self) -> float | None:
        """Share of the limit that is left; negative beyond it, None without a limit."""
        return None if self.limit is None else 1.0 - self.value / self.limit

    @property
    def is_exceeded(self) -> bool:
        """Whether it is beyond its limit."""
        return self.limit is not None and self.value > self.limit

    @property
    def is_close(self) -> bool:
        """Whether its limit lies within the numerical error."""
        return self.limit is not None and abs(self.value - self.limit) <= self.error


@dataclass(frozen=True)
class CaseSpread:
    """What draws of a load case gave.

    Attributes
    ----------
    draws, seed : int
    refused : int              Draws that could not be simulated.
    reason : str               Why, most often.
    failing : float            Share of the draws, refused ones included, that exceed a limit or leave a range.
    """

    draws: int
    seed: int
    refused: int
    reason: str
    failing: float


def judged(figures: Sequence[Figure], is_outside: bool) -> CaseVerdict:
    """The verdict on figures, of which extrapolated ones never pass."""
    if is_outside:
        return CaseVerdict.OUTSIDE
    if any(figure.is_exceeded and not figure.is_close for figure in figures):
        return CaseVerdict.FAILS
    return CaseVerdict.CLOSE if any(figure.is_close for figure in figures) else CaseVerdict.PASSES
