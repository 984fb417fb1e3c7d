"""A study of cheap runs for the tests, and what counts them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from strandspring.campaigns.studies.definition import Study
from strandspring.core.parameters import SpringParameters
from strandspring.model.joint import HYSTERETIC_UNITS, JointCovariance, joint_names
from strandspring.vibration.one_mass.system import Excitation
from synthetic import spring_of

SPRING = spring_of(1.0, 1.0)
ERRORS = {
    "kappa_omega": 0.04 * SPRING.kappa_omega,
    "rho": 0.1 * SPRING.rho,
    "sigma": 0.08 * SPRING.sigma,
    "n": 0.06 * SPRING.n,
}
CORRELATION = {"kappa_omega,rho": -0.6, "rho,n": 0.3, "sigma,n": 0.7}


def uncertainty_of_hysteresis(
    spring: SpringParameters, errors: Mapping[str, float], correlation: Mapping[str, float]
) -> dict[str, Any]:
    """The uncertainty of a model file whose FE and FA are known, from standard errors and correlations."""
    names = list(HYSTERETIC_UNITS)
    matrix = np.eye(len(names))
    for pair, value in correlation.items():
        i, j = (names.index(name) for name in pair.split(","))
        matrix[i, j] = matrix[j, i] = value
    shares = np.array([errors.get(name, 0.0) / getattr(spring, name) for name in names])
    elastic = len(getattr(spring, spring.elastic_name))
    joint = np.zeros((elastic + len(spring.kA) + 3,) * 2)
    # By eigenvectors, since correlations of 1 have no Cholesky factor; R of a QR decomposition is triangular.
    values, vectors = np.linalg.eigh(matrix)
    root = shares[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    joint[-4:, -4:] = np.linalg.qr(root.T)[1].T
    return {
        **errors,
        "correlation": {**correlation},
        "joint": {
            "parameters": joint_names(spring.elastic_name, elastic, len(spring.kA) - 1),
            "root": [row[: k + 1].tolist() for k, row in enumerate(joint)],
        },
    }


UNCERTAINTY = uncertainty_of_hysteresis(SPRING, ERRORS, CORRELATION)
SPREAD = JointCovariance.to_draw_from(SPRING, UNCERTAINTY)
# Runs of some 10 ms each below resonance; the last mass is more than the spring can carry.
CHEAP = Study(
    SPRING,
    Excitation.BASE_DISPLACEMENT,
    masses=(4.0, 5.0, 400.0),
    levels=(1e-4,),
    draws=20,
    seed=7,
    spread=SPREAD,
    band=(2.0, 2.5),
    points=2,
)
COMMAND = [
    "study", "mount.json", "--mass", "4", "--mass", "5", "--mass", "400", "--base-displacement", "0.1",
    "--draws", "20", "--seed", "7", "--band", "2", "2.5", "--points", "2", "--zero", "rig",
]  # fmt: skip


class Counter:
    """How many runs were finished at first and in the end; does something once so many are."""

    def __init__(self, after: int = 0, act: Callable[[], object] | None = None) -> None:
        self.first: int | None = None
        self.last = 0
        self._after, self._act = after, act

    def __call__(self, runs: int) -> None:
        self.first = runs if self.first is None else self.first
        self.last = runs
        if self._act is not None and runs >= self._after:
            act, self._act = self._act, None
            act()
