"""Cramer-Rao bounds: of n and rho where both force and displacement are noisy, and of a delay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.linalg import block_diag

from rig import Case, FloatArray, strokes_of
from strandspring import Spring, SpringParameters

_STEP = 1e-6  # of logarithms, of omega, and of reversals in shares of 1/rho


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
    force_noise, step = _force_noise(case), _STEP / case.spring.rho
    common, starts, reversals = [], [], []
    for path in case.paths:
        turns = strokes_of(path)[1:-1]
        used = np.arange(path.size) > turns[0]
        slope, coefficients, start = _sensitivities(case, path, used)
        root = 1.0 / np.sqrt(force_noise**2 + (slope * displacement_noise) ** 2)[:, None]
        turned = np.zeros((path.size, turns.size))
        for k, turn in enumerate(turns):
            ends = [path.copy(), path.copy()]
            for end, way in zip(ends, (step, -step), strict=True):
                end[turn] += way
            forces = [Spring(case.spring).response(end) for end in ends]
            turned[turn + 1 :, k] = (forces[0] - forces[1])[turn + 1 :] / (2.0 * step)
        common.append(root * coefficients)
        starts.append(root * start)
        reversals.append(root * displacement_noise * turned[used])
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
    common, starts = [], []
    for path, record in zip(case.paths, case.records, strict=True):
        # The path of a sine between the samples; that of a triangle is straight.
        course = make_interp_spline(record.time, path, k=3 if case.experiment.shape == "sine" else 1)
        moment = np.clip(record.time - delay, record.time[0], record.time[-1])
        turns = strokes_of(path)[1:-1]
        # The reversals stand between the moments, each before what comes later.
        place = np.searchsorted(record.time[turns], moment, side="right")
        at = np.arange(moment.size) + place
        whole = np.insert(course(moment), np.searchsorted(place, np.arange(turns.size), side="right"), path[turns])
        used = at[place > 0]
        slope, coefficients, start = _sensitivities(case, whole, used)
        # Just before a moment that is a sample, as it may be a reversal.
        speed = course.derivative()(np.nextafter(moment, -np.inf))[place > 0]
        common.append(np.column_stack([-slope * speed, coefficients]))
        starts.append(start)
    noise = _force_noise(case)
    return float(np.sqrt(_covariance(np.vstack(common) / noise, block_diag(*starts) / noise)[0, 0]))


def _sensitivities(
    case: Case, path: FloatArray, used: NDArray[np.generic]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of the force at samples: by x, by ln(n), ln(rho), ln(sigma), kE and kA, and by omega at the start."""
    p, spring = case.spring, Spring(case.spring)

    def of(name: str, factor: float) -> SpringParameters:
        return replace(p, **{name: factor * getattr(p, name)})

    own = [
        (Spring(of(name, np.exp(_STEP))).response(path) - Spring(of(name, np.exp(-_STEP))).response(path))[used]
        / (2.0 * _STEP)
        for name in ("n", "rho", "sigma")
    ]
    y = (path[used] - p.displacement_offset) / case.amplitude
    elastic, amplifier = (np.vander(y, len(k), increasing=True) for k in (p.kE, p.kA))
    start = (spring.response(path, _STEP) - spring.response(path, -_STEP))[used] / (2.0 * _STEP)
    columns = np.column_stack([*own, elastic, spring.omega(path)[used, None] * amplifier])
    return spring.stiffness(path)[used], columns, start[:, None]


def _force_noise(case: Case) -> float:
    return case.experiment.noise * float(np.std(np.concatenate(case.forces)))


def _covariance(points: FloatArray, further: FloatArray) -> FloatArray:
    """Covariance of the coefficients of the first columns and of further ones, known beforehand to +- 1 each."""
    known = np.hstack([np.zeros((further.shape[1], points.shape[1])), np.eye(further.shape[1])])
    matrix = np.vstack([np.hstack([points, further]), known])
    scale = np.linalg.norm(matrix, axis=0)
    root = np.linalg.inv(np.linalg.qr(matrix / scale, mode="r")) / scale[:, None]
    return np.asarray(root @ root.T)
