"""Figures of a load case with their ranges beside their limits, and the verdict on them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from ...findings import Finding, Outcome
from ...ground.gravity import STANDARD_GRAVITY
from ...ground.result_columns import ResultColumn
from ..bodies.loads import LoadCase
from ..signals.shock_spectra import RequiredSpectrum


class CaseVerdict(Enum):
    """The verdict on a candidate in a load case; the value is how people name it.

    Of several cases the last of their verdicts is that on all of them.
    """

    NO_LIMITS = "no limits"  # none applies to the case; all ranges are within the identified ranges
    PASSES = "pass"  # all ranges are within their limits, and within the identified ranges
    NOT_TESTED = "not tested"  # of all cases: they pass, but none of them tests some limit
    UNDECIDED = "not decided"  # a limit lies within the range of its figure
    FAILS = "fail"  # a range is beyond its limit
    OUTSIDE = "outside"  # a spring leaves its identified range: the figures are extrapolated
    REFUSED = "refused"  # it cannot be simulated


class FigureKind(Enum):
    """What a figure is of; the value is how people name it."""

    ACCELERATION = "acceleration"  # largest absolute acceleration of a point [m/s^2]
    SWAY = "sway"  # largest displacement of a point from rest, relative to the base [m]
    SWAY_X = "sway along x"  # likewise, its component
    SWAY_Y = "sway along y"
    SWAY_Z = "sway along z"
    TILT = "tilt"  # largest rotation of a body from rest, relative to the base [rad]
    STROKE = "stroke"  # largest share of a spring's way from rest to the end of its identified range
    FORCE = "force"  # largest of an axis of a mount, its weight, damper and stops included [N]
    MOUNT_FORCE = "mount force"  # largest of a mount, its axes together [N]
    REACTION = "reaction"  # largest force of all mounts on the base, weight included [N]
    SRS = "shock response"  # largest share of the allowed shock response spectrum of a point that its own takes
    RMS_ACCELERATION = "rms acceleration"  # of a point along an axis, once it has settled [m/s^2]
    THREE_SIGMA = "3 sigma acceleration"  # of a point, three times the largest rms of x, y and z [m/s^2]
    RMS_SWAY = "rms sway"  # of a point along an axis, about its mean [m]

    @property
    def unit(self) -> str:
        """In which figures are held; empty for a share."""
        return self.column.unit

    def is_of(self, case: LoadCase) -> bool:
        """Whether a load case has such figures."""
        return case.is_shock if self is FigureKind.SRS else self not in _SETTLED or case.settling > 0.0

    @property
    def untested(self) -> Finding:
        """That a limit of it is not tested."""
        needed = "pulse, drop, srs, record or force" if self is FigureKind.SRS else "random, sine or settling record"
        return Finding(Outcome.LIMIT_NOT_TESTED, {"limit": self.value, "needed": needed})

    @property
    def column(self) -> ResultColumn:
        """How its figures are presented."""
        unit, shown, factor = _UNITS[self]
        return ResultColumn(self.name.lower(), unit, self.value, self.value, shown, factor)


_SETTLED = (FigureKind.RMS_ACCELERATION, FigureKind.THREE_SIGMA, FigureKind.RMS_SWAY)
# In SI, for people, and the factor between them.
_ACCELERATION, _LENGTH = ("m/s^2", "g", 1.0 / STANDARD_GRAVITY), ("m", "mm", 1e3)
_FORCE = ("N", "N", 1.0)
_UNITS = {
    FigureKind.ACCELERATION: _ACCELERATION,
    FigureKind.SWAY: _LENGTH,
    FigureKind.SWAY_X: _LENGTH,
    FigureKind.SWAY_Y: _LENGTH,
    FigureKind.SWAY_Z: _LENGTH,
    FigureKind.TILT: ("rad", "deg", math.degrees(1.0)),
    FigureKind.STROKE: ("", "%", 100.0),
    FigureKind.FORCE: _FORCE,
    FigureKind.MOUNT_FORCE: _FORCE,
    FigureKind.REACTION: _FORCE,
    FigureKind.SRS: ("", "%", 100.0),
    FigureKind.RMS_ACCELERATION: _ACCELERATION,
    FigureKind.THREE_SIGMA: _ACCELERATION,
    FigureKind.RMS_SWAY: _LENGTH,
}


@dataclass(frozen=True)
class Limits:
    """Limits to which the answers of every case are held; what has none is only reported.

    Parameters
    ----------
    of_kind : mapping   Of each kind of figure, the largest value by the name of its subject, in SI units.
    of_all : mapping    Of each kind of figure, the largest value where the subject has none of its own. Strokes end
                        with the identified range whether or not there is a limit of them.
    spectra : mapping   Shock response spectra by the name of the point, all of one quality factor; the limit of kind
                        SRS is 1 at these points.
    """

    of_kind: Mapping[FigureKind, Mapping[str, float]] = field(default_factory=dict)
    of_all: Mapping[FigureKind, float] = field(default_factory=dict)
    spectra: Mapping[str, RequiredSpectrum] = field(default_factory=dict)

    def limit_of(self, kind: FigureKind, subject: str) -> float | None:
        """The limit of a figure, if there is one."""
        otherwise = 1.0 if kind is FigureKind.STROKE else None
        return self.of_kind.get(kind, {}).get(subject, self.of_all.get(kind, otherwise))

    def tested(self, cases: Sequence[LoadCase]) -> dict[FigureKind, tuple[str, ...]]:
        """The names of the load cases that test the limit of each kind of figure; none where it is not tested."""
        kinds = [kind for kind in FigureKind if kind in self.of_all or self.of_kind.get(kind)]
        return {kind: tuple(case.name for case in cases if kind.is_of(case)) for kind in kinds}

    def untested(self, cases: Sequence[LoadCase]) -> tuple[FigureKind, ...]:
        """The kinds of figures whose limits no load case tests."""
        return tuple(kind for kind, names in self.tested(cases).items() if not names)


@dataclass(frozen=True)
class Figure:
    """A figure of a load case.

    Parameters
    ----------
    quantity : FigureKind
    subject : str             Name of the point, body or axis of a mount.
    value : float             With the springs as identified and omega 0 at rest; of random vibration the mean of all
                              realisations. In SI units, like the others.
    error : float             A bound of its numerical error.
    low, high : float         Between which it lies by all that is unknown: omega at rest, springs, the realisation,
                              steps, and what the model leaves out, as far as cautions give it a size.
    limit : float or None
    beyond : float or None    Share of the draws beyond the limit; None without draws or without a limit.
    """

    quantity: FigureKind
    subject: str
    value: float
    error: float
    low: float
    high: float
    limit: float | None = None
    beyond: float | None = None

    @property
    def margin(self) -> float | None:
        """Share of the limit that the upper end of the range leaves; negative beyond it, None without a limit."""
        return None if self.limit is None else 1.0 - self.high / self.limit

    @property
    def share(self) -> float:
        """The upper end of the range as a share of the limit; NaN without a limit."""
        return math.nan if self.limit is None else self.high / self.limit

    @property
    def is_within(self) -> bool:
        """Whether the whole range is within the limit."""
        return self.limit is None or self.high <= self.limit

    @property
    def is_beyond(self) -> bool:
        """Whether the whole range is beyond the limit."""
        return self.limit is not None and self.low > self.limit


def judged(figures: Sequence[Figure], is_outside: bool, is_limited: bool) -> CaseVerdict:
    """The verdict on figures, of which extrapolated ones never pass, nor those without a limit of the file."""
    if is_outside:
        return CaseVerdict.OUTSIDE
    if any(figure.is_beyond for figure in figures):
        return CaseVerdict.FAILS
    if not all(figure.is_within for figure in figures):
        return CaseVerdict.UNDECIDED
    return CaseVerdict.PASSES if is_limited else CaseVerdict.NO_LIMITS


def of_all_cases(verdicts: Iterable[CaseVerdict], untested: Sequence[FigureKind]) -> CaseVerdict:
    """The verdict on a candidate in all its load cases together, which leave some limits untested."""
    return max([*verdicts, *(CaseVerdict.NOT_TESTED for _ in untested)], key=list(CaseVerdict).index)
