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
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from ..findings import Finding, IdentificationError, Outcome
from ..identification.method import Fitted
from ..identification.samples import Samples
from ..kernel.arrays import FloatArray
from .options import PaperOptions
from .periods import Hysteresis, one_record, polynomial_spring, whole_periods
from .two_stage import moving_mean


def candidates(options: PaperOptions, samples: Samples, where: str) -> Iterator[Fitted]:
    """Both stages on the mean period of one record; `choices` of the result holds what the paper leaves open.

    Raises
    ------
    RecordError           If there are several records, or the record is not periodic.
    IdentificationError   If a formula has no value, or its value is that of no spring.
    """
    record = one_record(samples, where, "the paper's method")
    try:
        yield _fitted(options, *whole_periods(record), where)
    except _NoValueError as problem:
        raise IdentificationError(Outcome.PAPER_FORMULAS, where, {"problem": str(problem)}) from None


def _fitted(options: PaperOptions, displacement: FloatArray, periods: FloatArray, where: str) -> Fitted:
    """Both stages."""
    samples, degrees = displacement.size, options.degrees or (4, 4)
    half_width = max(1, round(samples / 48)) if options.smoothing is None else options.smoothing
    window = 2 * half_width + 1
    if window > samples:
        raise _NoValueError(f"a window of {window} samples is longer than the period of {samples}")
    smooth = np.convolve(np.pad(periods.mean(axis=0), half_width, "wrap"), np.full(window, 1.0 / window), "valid")
    x, upper, lower = _branches(displacement, smooth)
    x0, reach = float(displacement.mean()), 0.5 * options.steady * float(np.ptp(x))
    y = x - x0
    kE, kA, kappa = _first_stage(y, upper, lower, reach, degrees)
    side, force = (1.0, upper) if options.branch == "loading" else (-1.0, lower)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        u = side * (force - polynomial.polyval(y, kE)) / polynomial.polyval(y, kA) / kappa
        # As the branch is run, an unloading one from above.
        travel, u = (side * y)[:: int(side)], u[:: int(side)]
        read, places = _second_stage(travel, moving_mean(u, half_width, np.array([0])), options.levels)
    h = read._replace(sigma=max(read.sigma, 0.5))
    spring = polynomial_spring(where, (float(x[0]), float(x[-1])), x0, 1.0, kE, kappa * kA, h)
    # "usually less than 4"
    findings = [Finding(Outcome.PAPER_DEGREES, {"degree": max(degrees)})] if max(degrees) > 3 else []
    findings += [Finding(Outcome.SIGMA_RAISED, {"sigma": read.sigma})] if read.sigma < 0.5 else []
    choices: dict[str, Any] = {
        "degrees": degrees, "smoothing": half_width, "samples_per_period": samples, "periods": len(periods),
        "x0": x0, "steady_section": (x0 - reach, x0 + reach), "kappa": kappa, "FA_at_x0": float(kA[0]),
        "sigma_of_eq_25": read.sigma, **{f"x_{name}": x0 + side * at for name, at in places.items()},
    }  # fmt: skip
    return Fitted(spring, tuple(findings), choices)


class _NoValueError(ValueError):
    """Why a formula has no value on a record, in words."""


def _branches(displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rising displacements of the loading branch of a period [m], and the force there and on the unloading one [N]."""
    low = int(np.argmin(displacement))
    x, r = (np.append(np.roll(column, -low), column[low]) for column in (displacement, force))
    top = int(np.argmax(x))
    if max(-np.diff(x[: top + 1]).min(), np.diff(x[top:]).max()) > 1e-12 * (x[top] - x[0]):  # of rounding
        raise _NoValueError("a period holds more than two strokes")
    branches = []
    for part in (slice(top + 1), slice(top, None)):
        # Equal displacements, as a coarse resolution makes them, have one mean force.
        distinct, place, count = np.unique(x[part], return_inverse=True, return_counts=True)
        branches.append((distinct, np.bincount(place, r[part]) / count))
    (up, upper), (down, lower) = branches
    return up, upper, np.interp(up, down, lower)


def _first_stage(
    y: FloatArray, upper: FloatArray, lower: FloatArray, reach: float, degrees: tuple[int, int]
) -> tuple[FloatArray, FloatArray, float]:
    """FE and FA as powers of the displacement, and kappa [N]: equations (14) to (20) where it is within the reach."""
    steady = np.abs(y) <= reach
    if np.count_nonzero(steady) <= max(degrees):
        raise _NoValueError("the steady section has too few samples")
    height = float(np.interp(0.0, y, upper - lower))
    if height <= 0.0:
        raise _NoValueError(f"eq. (19) gives kappa_omega = {0.5 * height:.4g} N")
    kE = polynomial.polyfit(y[steady], 0.5 * (upper + lower)[steady], degrees[0])
    kA = polynomial.polyfit(y[steady], (upper - lower)[steady] / height, degrees[1])
    return np.asarray(kE, np.float64), np.asarray(kA, np.float64), 0.5 * height


def _second_stage(travel: FloatArray, u: FloatArray, levels: Sequence[float]) -> tuple[Hysteresis, dict[str, float]]:
    """Equations (23) to (25) on a branch, and the travel of each point [m].

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
    return Hysteresis(rho, sigma, n), places
