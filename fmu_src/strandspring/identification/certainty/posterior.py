"""Posterior distribution of the parameters by Monte Carlo, for records that leave them strongly correlated.

The likelihood is that of the misfit under the likeliest kind of correlated noise (`coloured_noise`); the coefficients
of FE and FA, in which the force is linear, are integrated out. The prior is flat in the logarithms of rho, sigma and n
within the bounds of the search, in omega_start, and in the coefficients. Draws come from Student's distribution and are
weighted by the posterior over its density (importance sampling). It begins at the fit, with the covariance that this
likelihood has there, and follows the weighted mean and covariance of its draws. Where few draws still take all the
weight, the effective number sum(w)^2/sum(w^2) being too small, the affine-invariant ensemble sampler of emcee takes
over (Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125, 2013).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...model.joint import HYSTERETIC_UNITS
from ..least_squares.coloured_noise import whitened
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Problem

_DRAWS = 2000  # of importance sampling
_MOVES, _TRIED = 6, 500  # times that the distribution of draws is moved at most, by so many draws each
_LEAST = 1e-30  # power of the densities to which weights are flattened at most
_FLAT = 0.1  # least effective share of the draws that move it: weights are flattened until then
_EFFECTIVE = 1000.0  # draws of equal weight that are enough
_FREEDOM = 6.0  # degrees of freedom of the draws: tails that reach beyond those of the posterior
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
    steps, seed : int     Steps of each walker where importance sampling does not do; seed of all random numbers.
    """
    target, generator = _Target(linear), np.random.default_rng(seed)
    places, densities, weight = _drawn(target, generator)
    effective = float(np.sum(weight) ** 2 / max(np.sum(weight**2), 1e-300))
    how: dict[str, Any] = {"long_enough": True}
    if effective < _EFFECTIVE:
        places, densities, how = _walked(target, steps, generator, seed)
        effective, weight = how.pop("effective"), np.ones(len(places))
    kappa_omega = densities[:, 1] + densities[:, 2] * generator.standard_normal(len(densities))
    columns = dict(zip(("kappa_omega", "rho", "sigma", "n"), (kappa_omega, *np.exp(places[:, :3].T)), strict=True))
    order = {name: np.argsort(values, kind="stable") for name, values in columns.items()}
    share = {name: np.cumsum(weight[at]) / np.sum(weight) for name, at in order.items()}
    return {
        "steps": steps,
        "seed": seed,
        "effective_draws": effective,
        **how,
        "levels": list(_LEVELS),
        **{name: np.interp(_LEVELS, share[name], values[order[name]]).tolist() for name, values in columns.items()},
    }


def drawn_in_words(posterior: Mapping[str, Any]) -> str:
    """How a posterior of a model file was drawn, and whether that can be trusted."""
    effective = posterior.get("effective_draws")
    size = f"{posterior['steps']} steps" if effective is None else f"{effective:.0f} effective draws"
    doubt = "" if posterior["long_enough"] else "; too few steps to be trusted, ask for more with `posterior=...`"
    return f"of {size} (seed {posterior['seed']}{doubt})"


def disagreement(posterior: Mapping[str, Any], fitted: SpringParameters) -> str:
    """A sentence on the parameters of the fit that its posterior excludes; "" where there are none."""
    excluded = [
        name for name in HYSTERETIC_UNITS if not posterior[name][0] <= getattr(fitted, name) <= posterior[name][-1]
    ]
    if not excluded:
        return ""
    return (
        f"The posterior excludes the {' and '.join(excluded)} of the fit: it weighs a misfit that lasts over many "
        "samples otherwise; trust neither interval alone."
    )


def _drawn(target: _Target, generator: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draws of theta, shape (N, v), what the target says there, shape (N, 3), and weights, shape (N,)."""
    centre, root = target.start, target.root_of_covariance
    for _ in range(_MOVES):
        places, _, logarithm = _sample(target, centre, root, _TRIED, generator)
        if np.count_nonzero(np.isfinite(logarithm)) < _FLAT * _TRIED:  # most draws lie beyond the bounds
            break
        power = 1.0
        while (weight := np.exp(power * logarithm)).sum() ** 2 < _FLAT * _TRIED * (weight**2).sum() and power > _LEAST:
            power *= 0.7
        centre = weight @ places / weight.sum()
        off = np.sqrt(weight / weight.sum())[:, None] * (places - centre)
        root = np.linalg.cholesky(off.T @ off + np.diag(np.full(centre.size, 1e-12)))
        if power == 1.0 and weight.sum() ** 2 > 0.5 * _TRIED * (weight**2).sum():
            break
    places, values, logarithm = _sample(target, centre, root, _DRAWS, generator)
    return places, values, np.exp(logarithm)


def _sample(
    target: _Target, centre: FloatArray, root: FloatArray, count: int, generator: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places, what the target says there, and logarithms of their weights, the largest being 0; -inf beyond bounds."""
    size = centre.size
    normal = generator.standard_normal((count, size))
    stretch = np.sqrt(_FREEDOM / generator.chisquare(_FREEDOM, count))
    places = centre + stretch[:, None] * normal @ root.T
    density = -0.5 * (_FREEDOM + size) * np.log1p(stretch**2 * np.sum(normal**2, axis=1) / _FREEDOM)
    values = np.array([target(place) for place in places])
    logarithm = values[:, 0] - density
    return places, np.nan_to_num(values), logarithm - max(float(logarithm.max()), -1e300)


def _walked(
    target: _Target, steps: int, generator: np.random.Generator, seed: int
) -> tuple[FloatArray, FloatArray, dict[str, Any]]:
    """The same by the ensemble sampler, all of one weight, and how long its chain is."""
    import emcee

    size = target.start.size
    walkers = max(_WALKERS, 4 * size)
    spread = _SPREAD * np.minimum(target.errors, 0.5)
    begin = target.start + spread * generator.standard_normal((walkers, size))
    begin = np.clip(begin, target.low + 1e-6, target.high - 1e-6)
    sampler = emcee.EnsembleSampler(walkers, size, target, blobs_dtype=[("mean", float), ("error", float)])
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(begin, steps)
    kept = slice(steps // _BURNED, None)
    chain = sampler.get_chain()[kept].reshape(-1, size)
    blobs = sampler.get_blobs()[kept].reshape(-1)
    time = float(np.max(sampler.get_autocorr_time(tol=0, quiet=True)))
    how = {
        "walkers": walkers,
        "autocorrelation_time": time if math.isfinite(time) else None,
        "long_enough": bool(steps >= _ENOUGH * time),
        "effective": len(chain) / time if math.isfinite(time) else 0.0,
    }
    return chain, np.stack([np.zeros(blobs.size), blobs["mean"], blobs["error"]], axis=1), how


class _Target:
    """Logarithm of the posterior density at theta: ln(rho), ln(sigma), ln(n), omega_start..."""

    def __init__(self, linear: Linearised) -> None:
        self.linear, self.fit = linear, linear.refinement
        h = self.fit.hysteresis
        self.problem = Problem(linear.loops, linear.basis, h, coarse=True)
        self.low, self.high = self.problem.low, self.problem.high
        logarithms = np.log([h.rho, h.sigma, h.n])
        self.start = np.clip(np.append(logarithms, self.fit.omega_start), self.low + 1e-3, self.high - 1e-3)
        self.root = np.sqrt(self.fit.full_weight)
        self.records = [points for _, points in linear.loops.by_record]
        self.root_of_covariance = self._root_of_covariance()
        self.errors = np.linalg.norm(self.root_of_covariance, axis=1)
        self.at_offset = linear.basis.powers_matrix(linear.basis.amplifier)[0]

    def _root_of_covariance(self) -> FloatArray:
        """Of theta in this likelihood, the force being linear; what is not free there gets an error of 0.1."""
        linear = self.linear
        free = np.append(linear.free, linear.is_start_free)
        of_record = linear.loops.record[linear.loops.stroke][:, None] == np.flatnonzero(linear.is_start_free)
        matrix = np.hstack([linear.jacobian, linear.by_start[:, None] * of_record]) * self.root[:, None]
        white = whitened(matrix, self.records, linear.estimate.noise)
        inverse = np.linalg.pinv(np.linalg.qr(white, mode="r"))[linear.linear_count :]
        covariance = np.diag(np.where(free, 1e-12, 0.01))
        covariance[np.ix_(free, free)] += inverse @ inverse.T
        return np.linalg.cholesky(covariance)

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
