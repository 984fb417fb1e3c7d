"""Calibration through the FMU alone: a record, the native FMU's tunable parameters and its directional derivatives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from fmu_tools import SPRING, instance, wandering_path
from strandspring import Spring

TUNED = ("kappa_omega", "rho", "sigma", "n")
BOUNDS = [(1.0, 10.0, 0.5, 0.05), (500.0, 5000.0, 20.0, 10.0)]
# Far from the truth, as catalogue values of another spring would be.
GUESS = (40.0, 150.0, 2.5, 0.6)


def test_scipy_finds_the_parameters_by_the_fmus_derivatives(native_fmu: Path, tmp_path: Path) -> None:
    path = wandering_path(SPRING, 500, seed=11)
    record = Spring(SPRING).response(path)
    evaluations = 0

    def simulated(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force [N], shape (K,), and its derivatives by the parameters, shape (K, 4)."""
        nonlocal evaluations
        evaluations += 1
        with instance(native_fmu, tmp_path) as one:
            one.initialize(displacement=path[0], **dict(zip(TUNED, values.tolist(), strict=True)))
            force, parameters = [one.references["force"]], [one.references[name] for name in TUNED]
            rows = []
            for k, value in enumerate(path.tolist()):
                if k:
                    one.step(value, time=1e-3 * k)
                slopes = [one.slave.getDirectionalDerivative(force, [p], [1.0])[0] for p in parameters]
                rows.append([*one.get("force"), *slopes])
        columns = np.array(rows)
        return columns[:, 0], columns[:, 1:]

    fit = least_squares(
        lambda values: simulated(values)[0] - record, GUESS, jac=lambda values: simulated(values)[1],
        bounds=BOUNDS, x_scale="jac", ftol=1e-14, xtol=1e-14, gtol=1e-14,
    )  # fmt: skip
    truth = np.array([getattr(SPRING, name) for name in TUNED])
    print(f"{evaluations} runs, errors {np.abs(fit.x / truth - 1.0)}")
    np.testing.assert_allclose(fit.x, truth, rtol=1e-4)
