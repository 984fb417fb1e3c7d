"""omega at points of strokes with its derivatives, as those who check them want it."""

from __future__ import annotations

import numpy as np

from strandspring.kernel.arrays import FloatArray, IntArray
from strandspring.kernel.points import RecordPoints


def omega_with_derivatives(
    rho: float,
    sigma: float,
    n: float,
    omega_start: float,
    direction: IntArray,
    length: FloatArray,
    stroke: IntArray,
    travel: FloatArray,
    coarse: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """omega at points of one record, and its derivatives by rho, sigma, n and omega_start."""
    points = RecordPoints.of_one(direction, length, stroke, travel)
    omega, derivatives = points.omega(rho, sigma, n, np.array([omega_start]), coarse)
    derivatives[:3] /= np.array([rho, sigma, n])[:, None]
    return omega, derivatives
