"""Posterior distribution of the parameters by Monte Carlo, for records that leave them strongly correlated.

The likelihood is that of the misfit under the likeliest kind of correlated noise (`coloured_noise`); the coefficients
of FE and FA, in which the force is linear, are integrated out. The prior is flat in the logarithms of rho, sigma and n
within the bounds of the search, in omega_start, and in the coefficients. The samples are drawn by the affine-invariant
ensemble sampler of emcee (Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125, 2013).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.coloured_noise import whitened
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Problem

_WALKERS = 32  # at least, and four for each number that is drawn
_BURNED = 4  # one in so many steps is left out, at the beginning
_ENOUGH = 50.0  # autocorrelation times that a chain should last
_SPREAD = 0.5  # of the walkers at the beginning, in standard errors
_LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)


def posterior(linear: Linearised, steps: int, seed: int) -> dict[str, Any]:
    """Quantiles of kappa_omega, rho, sigma and n as content of the model file's field `uncertainty.posterior`.

    Parameters
    ----------
    linear : Linearised   Of the refined fit.
    steps, seed : int     Steps of each walker; seed of all random numbers.
    """
    import emcee

    target = _Target(linear)
    size = target.start.size
    walkers = max(_WALKERS, 4 * size)
    generator = np.random.default_rng(seed)
    spread = _SPREAD * np.minimum(target.errors, 0.5)
    begin = target.start + spread * generator.standard_normal((walkers, size))
    begin = np.clip(begin, target.low + 1e-6, target.high - 1e-6)
    sampler = emcee.EnsembleSampler(walkers, size, target, blobs_dtype=[("mean", float), ("error", float)])
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(begin, steps)
    kept = slice(steps // _BURNED, None)
    chain = sampler.get_chain()[kept].reshape(-1, size)
    blobs = sampler.get_blobs()[kept].reshape(-1)
    kappa_omega = blobs["mean"] + blobs["error"] * generator.standard_normal(blobs.size)
    columns = dict(zip(("kappa_omega", "rho", "sigma", "n"), (kappa_omega, *np.exp(chain[:, :3].T)), strict=True))
    time = float(np.max(sampler.get_autocorr_time(tol=0, quiet=True)))
    return {
        "steps": steps,
        "walkers": walkers,
        "seed": seed,
        "autocorrelation_time": time if math.isfinite(time) else None,
        "long_enough": bool(steps >= _ENOUGH * time),
        "levels": list(_LEVELS),
        **{name: np.quantile(values, _LEVELS).tolist() for name, values in columns.items()},
    }


class _Target:
    """Logarithm of the posterior density at ln(rho), ln(sigma), ln(n), omega_start..."""

    def __init__(self, linear: Linearised) -> None:
        self.linear, self.fit = linear, linear.refinement
        h = self.fit.hysteresis
        self.problem = Problem(linear.loops, linear.basis, h, coarse=True)
        self.low, self.high = self.problem.low, self.problem.high
        logarithms = np.log([h.rho, h.sigma, h.n])
        self.start = np.clip(np.append(logarithms, self.fit.omega_start), self.low + 1e-3, self.high - 1e-3)
        errors = np.linalg.norm(linear.root[linear.linear_count :], axis=1)
        self.errors = np.full(self.start.size, 0.1)
        self.errors[linear.free] = np.maximum(errors, 1e-6)
        self.root = np.sqrt(self.fit.full_weight)
        self.records = [points for _, points in linear.loops.by_record]
        self.at_offset = linear.basis.powers_matrix(linear.basis.amplifier)[0]

    def __call__(self, theta: FloatArray) -> tuple[float, float, float]:
        """The logarithm, and mean and standard error of kappa_omega there."""
        if np.any((theta <= self.low) | (theta >= self.high)):
            return -math.inf, math.nan, math.nan
        loops = self.linear.loops
        omega, _ = self.problem.omega(theta)
        columns = self.problem.columns
        matrix = np.hstack([columns.elastic, omega[:, None] * columns.amplifier, loops.force[:, None]])
        white = whitened(matrix * self.root[:, None], self.records, self.linear.estimate.noise)
        q, r = np.linalg.qr(white[:, :-1])
        along = q.T @ white[:, -1]
        squares = float(white[:, -1] @ white[:, -1] - along @ along)
        inverse = np.linalg.inv(r)
        kappa_omega = inverse[columns.elastic.shape[1] :] @ along @ self.at_offset
        error = float(np.linalg.norm(self.at_offset @ inverse[columns.elastic.shape[1] :]))
        # The integral over the linear coefficients leaves the determinant of their covariance.
        return -0.5 * squares - float(np.log(np.abs(np.diag(r))).sum()), float(kappa_omega), error
