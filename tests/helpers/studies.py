"""A study of cheap runs for the tests, and what counts them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring import SpringParameters
from strandspring.campaigns.studies.definition import Study
from strandspring.model.joint import HYSTERETIC_UNITS, JointCovariance, joint_names
from strandspring.vibration.one_mass.options import Curve, Excitation
from synthetic import spring_of

FloatArray = NDArray[np.float64]

SPRING = spring_of(1.0, 1.0)
NAMES = list(HYSTERETIC_UNITS)
SHARES = {"kappa_omega": 0.04, "rho": 0.1, "sigma": 0.08, "n": 0.06}
ERRORS = {name: share * getattr(SPRING, name) for name, share in SHARES.items()}
CORRELATION = {"kappa_omega,rho": -0.6, "rho,n": 0.3, "sigma,n": 0.7}


def correlations(pairs: Mapping[str, float]) -> FloatArray:
    """As a matrix."""
    matrix = np.eye(4)
    for pair, value in pairs.items():
        i, j = (NAMES.index(name) for name in pair.split(","))
        matrix[i, j] = matrix[j, i] = value
    return matrix


def joint_of(p: SpringParameters, root: FloatArray) -> dict[str, Any]:
    """What a model file says of this lower root of the covariance of all parameters."""
    names = joint_names(p.elastic_name, len(getattr(p, p.elastic_name)), len(p.kA) - 1)
    return {"parameters": names, "root": [row[: k + 1].tolist() for k, row in enumerate(root)]}


def uncertainty_of_hysteresis(errors: Mapping[str, float], correlation: Mapping[str, float]) -> dict[str, Any]:
    """The uncertainty of a file of SPRING whose FE and FA are known, from standard errors and correlations."""
    shares = np.diag([errors[name] / getattr(SPRING, name) for name in NAMES])
    root = np.zeros((len(SPRING.kE) + len(SPRING.kA) + 3,) * 2)
    root[-4:, -4:] = np.linalg.cholesky(shares @ correlations(correlation) @ shares)
    return {**errors, "correlation": {**correlation}, "joint": joint_of(SPRING, root)}


UNCERTAINTY = uncertainty_of_hysteresis(ERRORS, CORRELATION)
SPREAD = JointCovariance.to_draw_from(SPRING, UNCERTAINTY)
# Runs of some 10 ms each below resonance; the last mass is more than the spring can carry.
CHEAP = Study(
    SPRING, Excitation.BASE_DISPLACEMENT, (4.0, 5.0, 400.0), (1e-4,), draws=20, seed=7, spread=SPREAD,
    curve=Curve((2.0, 2.5), 2),
)  # fmt: skip


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
