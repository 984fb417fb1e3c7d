"""The steady loop: what the spring repeats when its displacement goes to and fro between two turning points.

omega on a stroke is d*W(xi0 + rho*s) whatever its direction d, so the steady loop has omega = -w at its low and +w at
its high turning point. With xi the beginning of a stroke of length L, W(xi) = -w and W(xi + rho*L) = w: one rising
equation W(xi) + W(xi + rho*L) = 0 for xi, and no cycles to run until they repeat.
"""

from __future__ import annotations

import numpy as np

from ..core.parameters import SpringParameters
from .arrays import address
from .library import library
from .path import OmegaStart
from .saturation_table import table


def steady_start(parameters: SpringParameters, stroke: float) -> OmegaStart:
    """Where omega starts at the low turning point of the steady loop, of one mechanism or of each of two.

    Parameters
    ----------
    parameters : SpringParameters
    stroke : float                  Distance between the turning points [m], >= 0.
    """
    omegas = [-steady_omega(mechanism, stroke) for mechanism in parameters.mechanisms]
    return omegas[0] if len(omegas) == 1 else (omegas[0], omegas[1])


def steady_omega(parameters: SpringParameters, stroke: float) -> float:
    """omega of the first mechanism at the high turning point of the steady loop; it is the opposite at the low one.

    Parameters
    ----------
    parameters : SpringParameters
    stroke : float                  Distance between the turning points [m], >= 0.
    """
    saturation = table(parameters.n, parameters.sigma)
    way, omega, xi = np.full(2, parameters.rho * stroke), np.zeros(1), np.empty(2)
    library().spring_steady(
        saturation.address,
        2,
        address(way),
        -1,
        address(omega),
        address(xi),
    )
    return float(omega[0])
