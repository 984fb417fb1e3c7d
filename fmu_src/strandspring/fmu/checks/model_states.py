"""The continuous states of the form with states along a path, and their rates, as the model has them."""

from __future__ import annotations

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...kernel.branches import maxwell_columns
from ...kernel.path import OmegaStart, PathSolver


def states_along(p: SpringParameters, displacement: FloatArray, time: FloatArray, start: OmegaStart) -> FloatArray:
    """Absorbed energy [J], omega of each mechanism and elongation of each branch [m] at the samples, shape (S, K)."""
    solver = PathSolver(p)
    elongations, _ = maxwell_columns([branch.time_constant for branch in p.branches], displacement, time)
    energy = solver.absorbed_energy(displacement, start, time)
    return np.concatenate([[energy], solver.omegas(displacement, start), elongations])


def rates_of(
    p: SpringParameters, states: FloatArray, velocity: FloatArray, force: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rates of these states, shape (S, K), and a size of each, shape (S,).

    Parameters
    ----------
    p : SpringParameters
    states : ndarray, shape (S, K)            As `states_along` gives them.
    velocity, force : ndarray, shape (K,)     [m/s], [N].
    """
    rates, scales = [force * velocity], [float(np.max(np.abs(force)))]
    for mechanism, omega in zip(p.mechanisms, states[1:], strict=False):
        # Paper eq. (11)
        rho, sigma, sign = mechanism.rho, mechanism.sigma, velocity * np.sign(omega)
        rates.append(rho * velocity * (1.0 - (sigma * sign - sigma + 1.0) * np.abs(omega) ** mechanism.n))
        scales.append(rho * max(1.0, 2.0 * sigma))
    for branch, elongation in zip(p.branches, states[1 + len(p.mechanisms) :], strict=True):
        rates.append(velocity - elongation / branch.time_constant)
        scales.append(1.0 + float(np.max(np.abs(elongation))) / branch.time_constant)
    return np.array(rates), np.array(scales)
