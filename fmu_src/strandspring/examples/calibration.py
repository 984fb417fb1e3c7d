"""Calibration of a spring by SciPy: thousands of parameter sets by one call, then least squares with exact gradients.

python -m strandspring.examples.calibration prints the parameters with their standard errors, and what they leave
unsure of the energy that a cycle absorbs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from strandspring import Spring, SpringParameters

NAMES = ("kappa_omega", "rho", "sigma", "n")
UNITS = ("N", "1/m", "-", "-")
LOW, HIGH = np.array([20.0, 50.0, 0.6, 0.2]), np.array([500.0, 800.0, 5.0, 3.0])  # where the parameters are sought
NOISE = 1.0  # N, of the measured force
TRUE = Spring(SpringParameters((0.0, 1.2e4, 4e4), (1.0, 4.0), 160.0, 250.0, 1.5, 0.7, 0.0, -0.03, 0.03))


def main() -> None:
    rng = np.random.default_rng(1)
    phase = np.linspace(0.0, 6.0 * np.pi, 600)
    path = np.repeat([0.03, 0.02, 0.01], 200) * np.sin(phase)
    measured = TRUE.response(path) + NOISE * rng.standard_normal(path.size)

    # The best of many sets is where least squares begin: there is no minimum to be caught in.
    sets = LOW * (HIGH / LOW) ** rng.random((2000, len(NAMES)))
    many = TRUE.responses(path, dict(zip(NAMES, sets.T, strict=True)))
    start = sets[np.argmin(((many.force - measured) ** 2).sum(axis=1))]

    def misfit(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(TRUE.responses(path, dict(zip(NAMES, values, strict=True))).force[0] - measured) / NOISE

    def jacobian(values: NDArray[np.float64]) -> NDArray[np.float64]:
        gradients = TRUE.responses(path, dict(zip(NAMES, values, strict=True)), by=NAMES).gradients["force"]
        return np.column_stack([gradients[name][0] for name in NAMES]) / NOISE

    fit = least_squares(misfit, start, jacobian, bounds=(LOW, HIGH), x_scale=start)
    slopes = jacobian(fit.x)
    covariance = np.linalg.inv(slopes.T @ slopes)
    for name, unit, value, error in zip(NAMES, UNITS, fit.x, np.sqrt(np.diag(covariance)), strict=True):
        print(f"{name:12} {value:8.4g} +- {error:.2g} {unit} (true {getattr(TRUE.parameters, name):g})")

    # The energy of a cycle that repeats, over draws from the uncertainty.
    draws = rng.multivariate_normal(fit.x, covariance, 500)
    cycles = 0.02 * np.sin(np.linspace(0.0, 4.0 * np.pi, 401))
    many = TRUE.responses(cycles, dict(zip(NAMES, draws.T, strict=True)), quantities=["absorbed_energy"])
    energies = many.absorbed_energy[:, -1] - many.absorbed_energy[:, 200]
    true = TRUE.absorbed_energy(cycles)
    mean, spread = energies.mean(), energies.std()
    print(f"energy of a cycle of 20 mm {mean:.4g} +- {spread:.2g} J (true {true[-1] - true[200]:.4g})")


if __name__ == "__main__":
    main()
