"""The paper's two-stage method as it is printed (section 3): no iteration, no initial values, no refit.

One mean period of K samples, at uniform phases, is smoothed by a moving average over 2*h + 1 samples, h = K/48 (section
3.3, ref. 29). With x0 the mean of x over the period, and y = x - x0, the steady section |y| <= 0.9 times the amplitude
has the loading branch Fu and the unloading branch Fl at the same displacements, and stage 1 is

    FE = (Fu + Fl)/2,   FA = (Fu - Fl)/(Fu(x0) - Fl(x0)),   kappa = (Fu(x0) - Fl(x0))/2       (14), (20), (19)

with polynomials of y fitted to FE and FA by linear least squares. Stage 2 reads one branch: with Omega = (r - FE)/FA,
smoothed with the same h, and its difference quotient Omega' at four points,

    rho   = Omega'(H0)/kappa                                                    where Omega = 0        (23)
    n     = ln{[Omega'(H2) - rho*kappa]/[Omega'(H3) - rho*kappa]}/ln[Omega(H2)/Omega(H3)]              (24)
    sigma = 1/2*{[Omega'(H1)/(rho*kappa) - 1]/|Omega(H1)/kappa|^n + 1}                                 (25)

H1, H2 and H3 are the first samples after the reversal at which Omega/kappa reaches -0.5, 0.35 and 0.7. The paper leaves
open h, the steady section, N and M, the branch and the points; all of them are options, and are kept with the result.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from ..errors import RecordError
from ..identification.least_squares.stages import Hysteresis
from ..identification.methods.fitted import Fitted
from ..identification.methods.method import Method
from ..identification.points.sample_points import SamplePoints
from ..identification.points.steady_part import SteadyRecord
from ..identification.search.solution import cautions_of, spring_within_limits
from ..kernel.arrays import FloatArray
from ..model.outcomes import IdentificationError, Outcome
from .periods import Periods, one_record, whole_periods

_DEGREES = (4, 4)
_USUAL_DEGREE = 3  # "usually less than 4"
_ROUNDING = 1e-12  # by which a mean period may go back within a stroke, share of its range
_WINDOWS = 48  # half windows of the moving average in a period


@dataclass(frozen=True)
class PaperOptions(Method):
    """Options of the paper's method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; (4, 4) if None.
    steady : float                 Half the steady section, share of the amplitude.
    smoothing : int or None        Half width h of the moving average in samples; K/48, but at least 1, if None.
    branch : str                   That of stage 2: "loading" or "unloading".
    levels : (float, float, float) Omega/kappa at H1, H2 and H3 of the loading branch; on the other with the other sign.
    """

    name: ClassVar[str] = "paper"

    steady: float = 0.9
    smoothing: int | None = None
    branch: Literal["loading", "unloading"] = "loading"
    levels: tuple[float, float, float] = (-0.5, 0.35, 0.7)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.steady <= 1.0:
            raise ValueError(f"`steady` must be above 0 and at most 1, got {self.steady}.")
        if self.smoothing is not None and not 0 <= self.smoothing <= 10_000:
            raise ValueError(f"`smoothing` must be within [0, 10000] samples, got {self.smoothing}.")
        if self.branch not in ("loading", "unloading"):
            raise ValueError(f"`branch` must be loading or unloading, got {self.branch!r}.")
        if not (len(self.levels) == 3 and -1.0 < self.levels[0] < 0.0 < self.levels[1] < self.levels[2] < 1.0):
            raise ValueError(f"`levels` must be three with -1 < H1 < 0 < H2 < H3 < 1, got {self.levels}.")

    @property
    def simpler(self) -> Sequence[Method]:
        """None: the paper has no choice by the data."""
        return ()

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Both stages on the mean period of one record; `choices` of the result holds what the paper leaves open.

        Raises
        ------
        RecordError           If there are several records, or the record is not periodic.
        IdentificationError   If a formula has no value, or its value is that of no spring.
        """
        record = one_record(parts, where, "the paper's method")
        try:
            periods = whole_periods(record.displacement, record.force, record.time)
        except RecordError as problem:
            raise RecordError(f"{where}: {problem}") from None
        try:
            return self._fit(periods, parts[0].loops, where)
        except _NoValueError as problem:
            raise IdentificationError(Outcome.PAPER_FORMULAS, where, f" ({problem})") from None

    def _fit(self, periods: Periods, loops: SamplePoints, where: str) -> Fitted:
        """Both stages."""
        samples = periods.displacement.size
        half_width = max(1, round(samples / _WINDOWS)) if self.smoothing is None else self.smoothing
        if 2 * half_width >= samples:
            raise _NoValueError(f"a window of {2 * half_width + 1} samples is longer than the period of {samples}")
        loop = _Loop.of(periods.displacement, _periodic_mean(periods.mean_force, half_width))
        x0, reach = float(periods.displacement.mean()), 0.5 * self.steady * float(np.ptp(loop.x))
        degrees = self.degrees or _DEGREES
        about_x0 = loop.beyond(x0)
        kE, kA, kappa = _first_stage(about_x0, reach, degrees)
        side = 1.0 if self.branch == "loading" else -1.0
        y, force = about_x0.branch(side)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            Omega = _shrinking_mean((force - polynomial.polyval(y, kE)) / polynomial.polyval(y, kA), half_width)
            read = _second_stage(side * y, side * Omega / kappa, self.levels)
        hysteresis = Hysteresis(read.rho, max(read.sigma, 0.5), read.n)
        spring = spring_within_limits(
            where,
            kE=tuple(kE.tolist()),
            kA=(1.0, *(kA[1:] / kA[0]).tolist()),  # the model file has FA(x0) = 1
            kappa_omega=kappa * float(kA[0]),
            **asdict(hysteresis),
            displacement_offset=x0,
            displacement_min=float(loop.x[0]),
            displacement_max=float(loop.x[-1]),
        )
        cautions = cautions_of(loops, hysteresis, loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n))
        cautions += [Outcome.PAPER_DEGREES] if max(degrees) > _USUAL_DEGREE else []
        cautions += [Outcome.SIGMA_RAISED] if read.sigma < 0.5 else []
        choices: dict[str, Any] = {
            "degrees": degrees, "smoothing": half_width, "samples_per_period": samples, "periods": periods.count,
            "x0": x0, "steady_section": (x0 - reach, x0 + reach), "kappa": kappa, "FA_at_x0": float(kA[0]),
            "sigma_of_eq_25": read.sigma, **{f"x_{name}": x0 + side * at for name, at in read.places.items()},
        }  # fmt: skip
        return Fitted(spring, dict.fromkeys(cautions, ""), 0.5 * (1.0 - self.steady), choices=choices)


class _NoValueError(ValueError):
    """Why a formula has no value on a record, in words."""


class _Loop(NamedTuple):
    """Loading and unloading branch at the same rising displacements [m], [N], shape (P,) each."""

    x: FloatArray
    upper: FloatArray
    lower: FloatArray

    @classmethod
    def of(cls, displacement: FloatArray, force: FloatArray) -> _Loop:
        """The branches of a period at the displacements of its loading branch."""
        low = int(np.argmin(displacement))
        x, r = (np.append(np.roll(column, -low), column[low]) for column in (displacement, force))
        top = int(np.argmax(x))
        back = max(-np.diff(x[: top + 1]).min(), np.diff(x[top:]).max())
        if back > _ROUNDING * (x[top] - x[0]):
            raise _NoValueError("a period holds more than two strokes")
        # Equal displacements, as a coarse resolution makes them, have one mean force.
        (up, upper), (down, lower) = (_distinct(x[part], r[part]) for part in (slice(top + 1), slice(top, None)))
        return cls(up, upper, np.interp(up, down, lower))

    def beyond(self, x0: float) -> _Loop:
        """The same with displacements from x0 on."""
        return self._replace(x=self.x - x0)

    def branch(self, side: float) -> tuple[FloatArray, FloatArray]:
        """Displacement and force of the loading branch or, for a negative side, of the unloading one, as it is run."""
        return (self.x, self.upper) if side > 0.0 else (self.x[::-1], self.lower[::-1])


def _first_stage(loop: _Loop, reach: float, degrees: tuple[int, int]) -> tuple[FloatArray, FloatArray, float]:
    """FE and FA as powers of the displacement, and kappa [N]: equations (14) to (20) where it is within the reach."""
    steady = np.abs(loop.x) <= reach
    if np.count_nonzero(steady) <= max(degrees):
        raise _NoValueError("the steady section has too few samples")
    height = float(np.interp(0.0, loop.x, loop.upper - loop.lower))
    if height <= 0.0:
        raise _NoValueError(f"eq. (19) gives kappa_omega = {0.5 * height:.4g} N")
    kE = polynomial.polyfit(loop.x[steady], 0.5 * (loop.upper + loop.lower)[steady], degrees[0])
    kA = polynomial.polyfit(loop.x[steady], (loop.upper - loop.lower)[steady] / height, degrees[1])
    return np.asarray(kE, np.float64), np.asarray(kA, np.float64), 0.5 * height


def _distinct(x: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rising displacements without repetitions, and the mean force at each."""
    distinct, place, count = np.unique(x, return_inverse=True, return_counts=True)
    return distinct, np.bincount(place, force) / count


def _periodic_mean(force: FloatArray, half_width: int) -> FloatArray:
    """Moving average of a period that follows itself."""
    around = np.concatenate([force[force.size - half_width :], force, force[:half_width]])
    return np.convolve(around, np.full(2 * half_width + 1, 1.0 / (2 * half_width + 1)), "valid")


def _shrinking_mean(values: FloatArray, half_width: int) -> FloatArray:
    """Moving average along a branch, whose window shrinks symmetrically at the ends."""
    position = np.arange(values.size)
    reach = np.minimum(half_width, np.minimum(position, position[::-1]))
    sums = np.append(0.0, np.cumsum(values))
    return np.asarray((sums[position + reach + 1] - sums[position - reach]) / (2 * reach + 1))


class _Read(NamedTuple):
    """What stage 2 reads: rho [1/m], sigma, n, and the travel of each point [m]."""

    rho: float
    sigma: float
    n: float
    places: dict[str, float]


def _second_stage(travel: FloatArray, u: FloatArray, levels: Sequence[float]) -> _Read:
    """Equations (23) to (25) on a branch.

    Parameters
    ----------
    travel : ndarray, shape (P,)   Rising from the reversal on [m].
    u : ndarray, shape (P,)        Omega/kappa of the branch, times -1 on an unloading one.
    levels : three floats          Of u at H1, H2 and H3.
    """
    crossings = np.flatnonzero((u[:-1] < 0.0) & (u[1:] >= 0.0))
    if not (np.isfinite(u).all() and crossings.size):
        raise _NoValueError("Omega does not cross 0 on this branch")
    slope = np.gradient(u, travel)
    k = int(crossings[0])
    share = -u[k] / (u[k + 1] - u[k])
    rho = float(slope[k] + share * (slope[k + 1] - slope[k]))
    places = {"H0": float(travel[k] + share * (travel[k + 1] - travel[k]))}
    at = [int(np.argmax(u >= level)) for level in levels]  # 0 where there is none
    for number, level, sample in zip((1, 2, 3), levels, at, strict=True):
        if sample == 0 or bool(u[sample] >= 0.0) is (level < 0.0):
            raise _NoValueError(
                f"no sample between the reversal and its end can be H{number}, Omega/kappa >= {level:g}"
            )
        places[f"H{number}"] = float(travel[sample])
    if rho <= 0.0:
        raise _NoValueError(f"eq. (23) gives rho = {rho:.4g} 1/m")
    h1, h2, h3 = at
    n = float(np.log((slope[h2] - rho) / (slope[h3] - rho)) / np.log(u[h2] / u[h3]))
    if not 0.0 < n < math.inf:
        raise _NoValueError(f"eq. (24) gives n = {n:.4g}")
    sigma = float(0.5 * ((slope[h1] / rho - 1.0) / abs(u[h1]) ** n + 1.0))
    if not math.isfinite(sigma):
        raise _NoValueError(f"eq. (25) gives sigma = {sigma:.4g}")
    return _Read(rho, sigma, n, places)
