"""The generalised Bouc-Wen model of Song and Der Kiureghian (2006) along a path, for comparison with the spring's law.

It is compiled because the six signs of its psi change within a stroke, so that it has no closed form over a stroke, and
one fit needs some ten thousand passes over a record: a loop in Python would take minutes.
"""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library


def generalised_path(displacement: FloatArray, rho: float, n: float, beta: FloatArray) -> FloatArray:
    """z at each displacement, 0 at the first.

    dz/dx = rho*(1 - |z|^n*psi) with psi = beta_1*sgn(dx*z) + beta_2*sgn(x*dx) + beta_3*sgn(x*z) + beta_4*sgn(dx)
    + beta_5*sgn(z) + beta_6*sgn(x).

    Parameters
    ----------
    displacement : ndarray, shape (K,)   [m]
    rho, n : float                       [1/m], [-].
    beta : ndarray, shape (6,)           [-]

    Returns
    -------
    ndarray, shape (K,)                  z in units of its scale [-].
    """
    path, beta = floats(displacement), floats(beta)
    z = np.empty(path.size)
    library().generalised_path(path.size, address(path), rho, n, address(beta), address(z))
    return z
