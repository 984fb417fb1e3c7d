"""Springs drawn from the uncertainty of an identification.

The coefficients of FE and FA and the logarithms of kappa_omega, rho, sigma and n are jointly normal about the
identified values, with the joint covariance of the model file, which is what the identification itself says: it
fits ln(rho), ln(sigma) and ln(n), and its errors follow by linear propagation. So kappa_omega, rho and n stay positive
for every draw. A sigma drawn below 1/2 becomes 1/2, as the identification ends there too; n and sigma are kept in the
same way within the ranges of the model. A draw with an FA that is not positive is no spring, and is drawn again.

Older model files hold standard errors and correlations of kappa_omega, rho, sigma and n only; with these FE and FA
stay as identified.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ..core.parameters import N_RANGE, SIGMA_RANGE, SpringParameters
from ..errors import ModelError
from .joint import HYSTERETIC_UNITS, JointCovariance
from .stated_uncertainty import PAIRS

DRAWN = tuple(HYSTERETIC_UNITS)
_RANGES = {"sigma": SIGMA_RANGE, "n": N_RANGE}
# Standard error over value beyond which a parameter counts as undetermined.
_LARGEST_RELATIVE = 10.0
_TRIES = 1000  # draws before a spread is refused that hardly holds a spring
_NEGATIVE = -1e-6  # least eigenvalue of a correlation matrix, for coefficients written with few digits


@dataclass(frozen=True)
class Quantiles:
    """5, 50 and 95 % quantiles of a figure over draws of springs, linear between the sorted draws."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class Spread:
    """Joint scatter of the parameters of a spring.

    Parameters
    ----------
    relative : tuple of 4 floats                Standard deviations of the logarithms of kappa_omega, rho, sigma and n.
    correlation : tuple of 4 tuples of 4 floats
    joint : JointCovariance or None             Of all coefficients, which takes the place of the others.
    """

    relative: tuple[float, ...]
    correlation: tuple[tuple[float, ...], ...]
    joint: JointCovariance | None = None

    @classmethod
    def of(cls, spring: SpringParameters, uncertainty: Mapping[str, Any]) -> Spread:
        """The spread in a model file's `uncertainty`, which has been checked when that was loaded.

        A parameter whose standard error is null was at its bound and is taken as known; a correlation that is not
        given, or null, is 0.

        Raises
        ------
        ModelError   If no standard error is given, one is too large, or the correlations contradict each other.
        """
        errors = {name: float(uncertainty.get(name) or 0.0) for name in DRAWN}
        if not any(errors.values()):
            raise ModelError(
                'field "uncertainty" holds no standard errors of kappa_omega, rho, sigma or n to draw from; identify '
                "with the refined method, or ask for no draws (`draws=0`)."
            )
        relative = {name: error / getattr(spring, name) for name, error in errors.items()}
        for name, share in relative.items():
            if share > _LARGEST_RELATIVE:
                raise ModelError(
                    f'field "uncertainty.{name}" says that {name} is known to {100.0 * share:.0f} % only, too little '
                    "to draw from; identify from records that determine it, or ask for no draws (`draws=0`)."
                )
        correlation = _correlation(uncertainty.get("correlation") or {})
        least = float(np.linalg.eigvalsh(correlation)[0])
        if least < _NEGATIVE:
            raise ModelError(
                'field "uncertainty.correlation" is not possible, because the coefficients contradict each other '
                f"(least eigenvalue {least:.3g}); correct this field."
            )
        joint = JointCovariance.of(spring, uncertainty)
        return cls(tuple(relative.values()), tuple(tuple(row) for row in correlation.tolist()), joint)

    @cached_property
    def root(self) -> list[list[float]]:
        """Matrix from independent standard normal numbers to changes of the logarithms, 4 rows of 4.

        The symmetric root of the correlation is unique, where the signs of eigenvectors depend on the library that
        finds them.
        """
        values, vectors = np.linalg.eigh(np.array(self.correlation))
        symmetric = vectors @ np.diag(np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        return [[share * value for value in row] for share, row in zip(self.relative, symmetric.tolist(), strict=True)]

    def draw(self, spring: SpringParameters, seed: int, number: int) -> SpringParameters:
        """Draw a spring; the same seed and number give the same spring, whatever was drawn before.

        Raises
        ------
        ModelError   If hardly any draw is a physically possible spring.
        """
        generator = np.random.default_rng((seed, number))
        if self.joint is not None:
            return _possible(self.joint, spring, generator)
        normal = generator.standard_normal(len(DRAWN))
        drawn = {}
        for name, row in zip(DRAWN, self.root, strict=True):
            change = math.fsum(share * z for share, z in zip(row, normal.tolist(), strict=True))
            low, high = _RANGES.get(name, (0.0, math.inf))
            drawn[name] = min(max(getattr(spring, name) * math.exp(change), low), high)
        return replace(spring, **drawn)


def _possible(joint: JointCovariance, spring: SpringParameters, generator: np.random.Generator) -> SpringParameters:
    """The first physically possible spring that is drawn."""
    for _ in range(_TRIES):
        with suppress(ValueError):
            return joint.moved(spring, generator.standard_normal(len(joint.root)).tolist())
    raise ModelError(
        f"None of {_TRIES} springs drawn from the model's uncertainty is physically possible (FA > 0); identify from "
        "records that determine FA, with a lower degree of FA, or ask for no draws (`draws=0`)."
    )


def _correlation(given: Mapping[str, float | None]) -> np.ndarray:
    """Correlation matrix of the drawn parameters, shape (4, 4)."""
    matrix = np.eye(len(DRAWN))
    for (i, j), pair in zip(combinations(range(len(DRAWN)), 2), PAIRS, strict=True):
        matrix[i, j] = matrix[j, i] = given.get(pair) or 0.0
    return matrix
