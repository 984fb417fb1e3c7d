"""How certain the refined parameters are: standard errors, correlations, 95 % intervals, joint covariance.

At the optimum the covariance of all coefficients (Legendre coefficients of FE and G, ln rho, ln sigma, ln n,
omega_start) follows from the Jacobian and from residuals that are correlated from sample to sample, see
`coloured_noise`. The errors of kE, kA, kappa_omega, rho, sigma and n follow by linear propagation, and the intervals
by `intervals`. A parameter at its bound is taken as known by the others.

Share of 95 % intervals that hold the truth, 200 records of the model itself, 1000 samples in 3 cycles, degrees (3,2),
noise of 0.3 N on a loop 50 N high: 96 to 97 % at an autocorrelation from sample to sample of 0, 95 to 98 % at 0.9, and
96 to 97 % at 0.99, where the covariance of independent noise times the autocorrelation time of the residuals gives
96, 94 to 97, and 99 to 100 %. With ten springs and noise of 0.2 to 1 N the shares are 91 to 99 %.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from ...kernel.arrays import FloatArray
from ...model.joint import joint_names
from ..least_squares.linearised import Linearised, is_sigma_free
from ..least_squares.projection import Refinement
from ..least_squares.stages import SIGMA_BOUNDS
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from .intervals import Interval, around, intervals_95, quantile_95

_NAMES = ("kappa_omega", "rho", "sigma", "n")
# Two parameters with a larger correlation are not separated by the records, unless both are known this well for all
# that; one with a larger relative error is hardly known.
_CORRELATED = 0.98
_WELL_KNOWN = 0.02
_UNCERTAIN = 0.5
_UNSURE_RECOVERY = 0.1  # standard error of ln(sigma) from which a sigma at its bound 1/2 is uncertain
_DIGITS = 9  # of the joint covariance in the model file
_MEANING = (
    "standard errors (one standard deviation) and 95 % intervals for residuals that are correlated from sample to "
    "sample; the intervals of kappa_omega, rho, sigma and n are null on a side on which the records do not bound them"
)


def uncertainty(linear: Linearised) -> dict[str, Any]:
    """Standard errors and intervals of a refined fit: content of the model file's field `uncertainty`.

    The correlations are those of the logarithms of kappa_omega, rho, sigma and n; an error that is unknown is None, as
    at a bound. The joint covariance is that of kE (or FE_forces), of kA without kA[0], and of these logarithms.
    """
    basis, h = linear.basis, linear.refinement.hysteresis
    change = _propagation(linear)
    natural = change @ linear.root
    errors = np.linalg.norm(natural, axis=1)
    n_E, n_A = basis.elastic + 1, basis.amplifier + 1
    logarithms = errors[-4:]
    scale = np.where(logarithms > 0.0, logarithms, np.nan)
    matrix = np.clip(natural[-4:] @ natural[-4:].T / np.outer(scale, scale), -1.0, 1.0)  # but for rounding
    correlation = {(a, b): float(matrix[i, j]) for (i, a), (j, b) in combinations(enumerate(_NAMES), 2)}
    values = (float(basis.powers(linear.refinement.backbone.amplified)[0]), h.rho, h.sigma, h.n)
    shares = dict(zip(_NAMES, scale.tolist(), strict=True))
    intervals = intervals_95(linear, change[-4:], logarithms)
    further = () if linear.further is None else linear.further.names
    root = _lower(np.delete(natural, n_E + len(further), axis=0))  # kA[0] is 1
    return {
        "meaning": _MEANING,
        basis.elastic_name: errors[:n_E].tolist(),
        "kA": errors[-4 - n_A : -4].tolist(),
        **{name: _plain(value * shares[name]) for name, value in zip(_NAMES, values, strict=True)},
        "interval_95": {name: list(ends) for name, ends in intervals.items()},
        **_of_further(linear, change[n_E : n_E + len(further)], errors[n_E : n_E + len(further)]),
        "autocorrelation_time": linear.estimate.time,
        "force_rms": float(np.sqrt(np.mean(linear.force_error**2))),
        "force_max": float(np.max(linear.force_error)),
        "correlation": {f"{a},{b}": _plain(value) for (a, b), value in correlation.items()},
        "joint": {
            "meaning": "rows of the lower triangular root L of the joint covariance L*L'",
            "parameters": joint_names(basis.elastic_name, n_E, n_A - 1, further),
            "root": [[float(f"{v:.{_DIGITS}g}") for v in row[: k + 1]] for k, row in enumerate(root)],
        },
        "indistinct": _indistinct(shares, intervals, correlation),
    }


def _of_further(linear: Linearised, change: FloatArray, errors: FloatArray) -> dict[str, Any]:
    """Standard error and 95 % interval of each parameter that a wider class has, by name; empty without any."""
    if linear.further is None:
        return {}
    reach = quantile_95(linear.estimate.degrees_of_freedom(change)) * errors
    rows: dict[str, dict[str, Any]] = {}
    for name, value, error, half in zip(
        linear.further.names, linear.further.values, errors.tolist(), reach.tolist(), strict=True
    ):
        is_logarithm = name.startswith("ln ")
        if not error > 0.0:
            rows[name.removeprefix("ln ")] = {"standard_error": None, "interval_95": [None, None]}
            continue
        ends: Interval = around(value, half) if is_logarithm else (value - half, value + half)
        rows[name.removeprefix("ln ")] = {
            "standard_error": value * error if is_logarithm else error,
            "interval_95": list(ends),
        }
    return {"further": rows}


def _indistinct(
    shares: Mapping[str, float], intervals: Mapping[str, Interval], correlation: Mapping[tuple[str, str], float]
) -> list[str]:
    """Sentences about parameters that are strongly correlated in these records, or hardly known.

    Parameters
    ----------
    shares : mapping        Standard errors of the logarithms; nan at a bound.
    intervals, correlation : mapping
    """
    sentences = []
    for name, (low, high) in intervals.items():
        least = SIGMA_BOUNDS[0] * 1.001 if name == "sigma" else 0.0
        if low is None and high is None:
            sentences.append(f"{name} is not known from these records")
        elif high is None and low is not None and low > least:
            sentences.append(f"{name} > {low:.2g}: these records bound it from below only (95 %)")
        elif high is None:
            sentences.append(f"{name} >= {least:.2g}: these records do not bound it")
        elif low is None:
            sentences.append(f"{name} < {high:.2g}: these records bound it from above only (95 %)")
        elif shares[name] > _UNCERTAIN:
            sentences.append(f"{name} is known to lie between {low:.2g} and {high:.2g} only (95 %)")
    sentences += [
        f"{a} and {b} are strongly correlated in these records ({value:.3f})"
        for (a, b), value in correlation.items()
        if abs(value) > _CORRELATED and max(shares[a], shares[b]) > _WELL_KNOWN
    ]
    return sentences


def is_sigma_uncertain(loops: SamplePoints, basis: Basis, refinement: Refinement) -> bool:
    """Whether sigma lies on a bound because the points do not show how the force recovers after a reversal.

    The lower bound is a physical one, which springs may lie on: there the standard error that sigma would have
    decides, unless n is on a bound too.
    """
    if is_sigma_free(refinement.hysteresis):
        return False
    linear = Linearised.from_refinement(loops, basis, refinement)
    if refinement.hysteresis.sigma > SIGMA_BOUNDS[0] * 1.001 or not linear.free[2]:
        return True
    freed = linear.freed(1)
    place = freed.column(1)
    # For correlated residuals or for independent ones, whichever is larger: those of a fit that is not refined are
    # neither. A coefficient that no point depends on has the error 0 here.
    weight = refinement.full_weight
    independent = freed.estimate.scale[place] * np.sqrt(np.mean(weight * freed.misfit**2))
    error = max(float(np.linalg.norm(rows)) for rows in (freed.root[place], independent))
    return not 0.0 < error <= _UNSURE_RECOVERY


def _propagation(linear: Linearised) -> FloatArray:
    """Derivatives of kE, of what a wider class has, kA and the logarithms of kappa_omega, rho, sigma, n by the fitted
    coefficients.
    """
    basis = linear.basis
    elastic, amplified = basis.elastic_matrix(), basis.powers_matrix(basis.amplifier)
    powers = amplified @ linear.refinement.backbone.amplified
    n_E, n_A = elastic.shape[0], amplified.shape[0]
    further = linear.further
    added = 0 if further is None else len(further.names)
    change = np.zeros((n_E + added + n_A + 4, linear.jacobian.shape[1]))
    change[:n_E, :n_E] = elastic
    if further is not None:
        change[n_E : n_E + added, linear.further_columns] = further.change
    own = change[added:]
    # kA = powers/powers[0], kappa_omega = powers[0].
    ratio = (amplified - np.outer(powers / powers[0], amplified[0])) / powers[0]
    ratio[0] = 0.0
    own[n_E : n_E + n_A, n_E : n_E + n_A] = ratio
    own[n_E + n_A, n_E : n_E + n_A] = amplified[0] / powers[0]
    for k in range(3):
        if linear.free[k]:
            own[n_E + n_A + 1 + k, linear.column(k)] = 1.0
    return change


def _lower(root: FloatArray) -> FloatArray:
    """The lower triangular root with a diagonal >= 0 of the same covariance, shape (m, m)."""
    rows, columns = root.shape
    square = np.hstack([root, np.zeros((rows, max(0, rows - columns)))])
    triangle = np.asarray(np.linalg.qr(square.T, mode="r")).T
    return np.asarray(triangle * np.where(np.diag(triangle) < 0.0, -1.0, 1.0))


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
