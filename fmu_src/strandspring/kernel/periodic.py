"""The Fourier basis of the steady motions that the kernel balances."""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np

from .arrays import address
from .structures import structures


class FourierBasis:
    """1, cos(k tau), sin(k tau) at K equal phases.

    A series has N = 2H + 1 coefficients: the mean, then those of the cosines and those of the sines of orders 1 to H.

    Parameters
    ----------
    harmonics, samples : int   H >= 1; K > 2H, a multiple of 4, and K >= 8.

    Attributes
    ----------
    order : ndarray, shape (N,)         0, 1 .. H, 1 .. H.
    functions : ndarray, shape (N, K)   1, cosines and sines of orders 1 to H.
    structure : ctypes.Structure        The same for the kernel, orders 1 to 2H; valid while the basis lives.
    """

    def __init__(self, harmonics: int, samples: int) -> None:
        if not (harmonics >= 1 and samples > max(2 * harmonics, 7) and samples % 4 == 0):
            raise ValueError(
                "`harmonics` must be >= 1 and `samples` a multiple of 4, > 2*harmonics and >= 8, got "
                f"{harmonics!r} and {samples!r}."
            )
        self.harmonics = harmonics
        self.samples = samples
        orders = np.arange(1, harmonics + 1)
        self.order = np.concatenate([[0], orders, orders]).astype(np.float64)
        phase = 2.0 * np.pi * np.arange(samples) / samples
        # Every angle is that of a sample.
        angle = phase[np.outer(np.arange(1, 2 * harmonics + 1), np.arange(samples)) % samples]
        rows = np.vstack([np.ones((1, samples)), np.cos(angle), np.sin(angle)])
        self.functions = np.vstack([rows[: harmonics + 1], rows[2 * harmonics + 1 : 3 * harmonics + 1]])
        self._quarters = np.ascontiguousarray(rows[:, : samples // 4 + 1])
        self.structure: ctypes.Structure = structures()["FourierBasis"](
            harmonics=harmonics, samples=samples, rows=address(self._quarters)
        )


@lru_cache(maxsize=8)
def fourier_basis(harmonics: int, samples: int) -> FourierBasis:
    """The basis of H harmonics and K samples, which all balances share."""
    return FourierBasis(harmonics, samples)
