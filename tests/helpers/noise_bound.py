"""Cramer-Rao bounds: of n and rho where both force and displacement are noisy, of a delay and of wear."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.linalg import block_diag

from rig import Case, FloatArray
from strandspring.loops.strokes import find_strokes
from stroke_points import omega_with_derivatives

_DRAWS = 20_000
_STEP = 1e-6  # of the derivatives by the reversals, share of 1/rho


def bound(case: Case, displacement_noise: float) -> FloatArray:
    """Covariance of ln(n) and ln(rho) of an efficient unbiased estimate that knows both noises, shape (2, 2).

    sigma, the coefficients of FE and FA and omega at the start of each record are estimated too; the first stroke of
    each record is left out, as in the identification. Noise of the displacement of standard deviation s counts as
    noise of the force of variance (dF/dx)^2*s^2 (Fuller, Measurement Error Models, 1987); that of a reversal moves the
    strokes after it as a whole, so that the reversals are estimated as well, each measured once.

    Parameters
    ----------
    case : Case
    displacement_noise : float   Standard deviation [m]; 0 is a path that is known, the best that smoothing can do.
    """
    force_noise = _force_noise(case)
    common, starts, reversals = [], [], []
    for path in case.paths:
        at = _Sensitivities.of(case, path, _Course.of(path))
        root = 1.0 / np.sqrt(force_noise**2 + (at.slope * displacement_noise) ** 2)
        common.append(root[:, None] * at.coefficients)
        starts.append(root[:, None] * at.start)
        turned = _by_reversals(case, at.strokes, at.used)
        reversals.append(root[:, None] * at.G[:, None] * displacement_noise * turned)
    # omega lies within [-1, 1], and a reversal within the noise of its sample.
    return _covariance(np.vstack(common), np.hstack([block_diag(*starts), block_diag(*reversals)]))[:2, :2]


def delay_bound(case: Case, delay: float) -> float:
    """Standard deviation of a delay's efficient unbiased estimate that knows the noise of the force [s].

    The spring and omega at the start of each record are estimated too, as in `bound`. The sensitivities are those at
    the moments that the force was late for, which decide close to a reversal.

    Parameters
    ----------
    case : Case
    delay : float   By which the force lags [s].
    """
    force_noise = _force_noise(case)
    common, starts = [], []
    for path, record in zip(case.paths, case.records, strict=True):
        time, strokes = record.time, _Course.of(path)
        # The path of a sine between the samples; that of a triangle is straight.
        course = make_interp_spline(time, path, k=3 if case.experiment.shape == "sine" else 1)
        moment = np.clip(time - delay, time[0], time[-1])
        stroke = strokes.of_sample[np.searchsorted(time, moment)]
        ends = np.sort([strokes.ends[:-1], strokes.ends[1:]], axis=0)[:, stroke]
        x = np.clip(course(moment), *ends)
        travel = np.abs(x - strokes.ends[stroke])
        at = _Sensitivities.of(case, x, replace(strokes, of_sample=stroke, travel=travel))
        # Just before a moment that is a sample, as it may be a reversal.
        speed = course.derivative()(np.nextafter(moment, -np.inf))
        common.append(np.column_stack([-at.slope * speed[at.used], at.coefficients]) / force_noise)
        starts.append(at.start / force_noise)
    return float(np.sqrt(_covariance(np.vstack(common), block_diag(*starts))[0, 0]))


def wear_bound(case: Case, wear: float) -> float:
    """Standard deviation of the efficient unbiased estimate of the friction's wear that knows the force's noise [-].

    The spring and omega at the start of each record are estimated too, as in `bound`.

    Parameters
    ----------
    case : Case
    wear : float   Change of the hysteretic force from the first cycle to the last, share of it.
    """
    force_noise = _force_noise(case)
    common, starts = [], []
    total, begun = sum(case.experiment.cycles), 0
    elastic = len(case.spring.kE)
    for path, segments in zip(case.paths, case.experiment.segments, strict=True):
        at = _Sensitivities.of(case, path, _Course.of(path))
        cycles = sum(count for _, count in segments)
        over = (begun + cycles * np.linspace(0.0, 1.0, path.size)[at.used]) / total
        begun += cycles
        left = np.ones((over.size, at.coefficients.shape[1]))
        left[:, :3] += wear * over[:, None]
        left[:, 3 + elastic :] += wear * over[:, None]
        common.append(np.column_stack([over * at.G * at.omega, left * at.coefficients]) / force_noise)
        starts.append(left[:, :1] * at.start / force_noise)
    return float(np.sqrt(_covariance(np.vstack(common), block_diag(*starts))[0, 0]))


@dataclass(frozen=True)
class _Course:
    """Strokes of a path without noise, and the way from the reversal before each sample."""

    ends: FloatArray
    direction: NDArray[np.int64]
    length: FloatArray
    of_sample: NDArray[np.intp]
    travel: FloatArray

    @classmethod
    def of(cls, path: FloatArray) -> _Course:
        strokes = find_strokes(path)
        travel = np.abs(path - strokes.ends[strokes.of_sample])
        return cls(strokes.ends, strokes.direction, strokes.length, strokes.of_sample, travel)


@dataclass(frozen=True)
class _Sensitivities:
    """Derivatives of the force of the spring at the samples of a path that are used."""

    strokes: _Course
    used: NDArray[np.bool_]
    omega: FloatArray
    G: FloatArray
    slope: FloatArray  # by the displacement
    coefficients: FloatArray  # by ln(n), ln(rho), ln(sigma) and the coefficients of FE and FA, in columns
    start: FloatArray  # by omega at the start, one column

    @classmethod
    def of(cls, case: Case, path: FloatArray, strokes: _Course) -> _Sensitivities:
        p = case.spring
        used = strokes.of_sample > 0
        x, side = path[used] - p.displacement_offset, strokes.direction[strokes.of_sample[used]]
        omega, partials = _omega(case, strokes, used)
        G = p.kappa_omega * polyval(x, p.kA)
        u = side * omega
        rate = p.rho * (1.0 + np.where(u >= 0.0, -1.0, 2.0 * p.sigma - 1.0) * np.abs(u) ** p.n)
        slope = polyval(x, polyder(p.kE)) + p.kappa_omega * polyval(x, polyder(p.kA)) * omega + G * rate
        own = (G * partials[[2, 0, 1]] * np.array([[p.n], [p.rho], [p.sigma]])).T
        elastic, amplifier = (np.vander(x / case.amplitude, len(k), increasing=True) for k in (p.kE, p.kA))
        coefficients = np.hstack([own, elastic, omega[:, None] * amplifier])
        return cls(strokes, used, omega, G, slope, coefficients, G[:, None] * partials[3][:, None])


def _force_noise(case: Case) -> float:
    return case.experiment.noise * float(np.std(np.concatenate(case.forces)))


def _covariance(points: FloatArray, further: FloatArray) -> FloatArray:
    """Covariance of the coefficients of the first columns and of further ones, known beforehand to +- 1 each."""
    known = np.hstack([np.zeros((further.shape[1], points.shape[1])), np.eye(further.shape[1])])
    matrix = np.vstack([np.hstack([points, further]), known])
    scale = np.linalg.norm(matrix, axis=0)
    root = np.linalg.inv(np.linalg.qr(matrix / scale, mode="r")) / scale[:, None]
    return np.asarray(root @ root.T)


def share_within(covariance: FloatArray, limit: float) -> float:
    """Probability that both of two normal errors of zero mean lie within the limit, by draws of a fixed seed."""
    errors = np.random.default_rng(0).multivariate_normal(np.zeros(2), covariance, _DRAWS)
    return float(np.mean(np.abs(errors).max(axis=1) <= limit))


def _by_reversals(case: Case, strokes: _Course, used: NDArray[np.bool_]) -> FloatArray:
    """Derivatives of omega at the samples by the displacement of each reversal, shape (P, S - 1) [1/m]."""
    step = _STEP / case.spring.rho
    columns = []
    for reversal in range(1, strokes.length.size):
        omegas = []
        for sign in (1.0, -1.0):
            # A reversal further along lengthens the strokes on both of its sides.
            further = sign * step
            length, travel = strokes.length.copy(), strokes.travel.copy()
            length[reversal - 1 : reversal + 1] += further
            travel[strokes.of_sample == reversal] += further
            omegas.append(_omega(case, replace(strokes, travel=travel), used, length)[0])
        columns.append(strokes.direction[reversal - 1] * (omegas[0] - omegas[1]) / (2.0 * step))
    return np.stack(columns, axis=1)


def _omega(
    case: Case, strokes: _Course, used: NDArray[np.bool_], length: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """omega at the samples that are used, and its derivatives."""
    p = case.spring
    return omega_with_derivatives(
        p.rho, p.sigma, p.n, 0.0, strokes.direction, strokes.length if length is None else length,
        strokes.of_sample[used], strokes.travel[used],
    )  # fmt: skip
