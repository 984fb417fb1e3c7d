"""The universal saturation function W of the normalized Bouc-Wen model, tabulated by the compiled kernel.

`strandspring.core.saturation` derives it.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library
from .structures import constants, structures


class SaturationTable:
    """W and its inverse for one pair (n, sigma); some 170 kB, made in a third of a millisecond.

    Parameters
    ----------
    n, sigma : float     Within the bounds of `SpringParameters`.
    derivatives : bool   Tabulate the derivatives by n and sigma too, for `RecordPoints.omega`.
    energies : bool      Tabulate what absorbed energies need; each turn of a path is then integrated.
    coarse : bool        To 1e-8 only, in a quarter of the time.
    """

    def __init__(
        self, n: float, sigma: float, derivatives: bool = False, energies: bool = False, coarse: bool = False
    ) -> None:
        self.n = n
        self.sigma = sigma
        self._memory = np.empty(ctypes.sizeof(structures()["SpringTable"]) // 8)
        choices = {"WITH_DERIVATIVES": derivatives, "WITH_ENERGIES": energies, "COARSE": coarse}
        with_ = sum(constants()[f"SPRING_{name}"] for name, is_chosen in choices.items() if is_chosen)
        library().kernel_tabulate(self.address, n, sigma, with_)

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while the table lives."""
        return address(self._memory)

    def inverse(self, u: FloatArray) -> FloatArray:
        """xi at which W is u, elementwise, -1 <= u <= 1; the largest xi of the table for 1."""
        u = floats(u)
        xi = np.empty_like(u)
        library().kernel_inverse(self.address, u.size, address(u), address(xi))
        return xi


def table(
    n: float, sigma: float, derivatives: bool = False, energies: bool = False, coarse: bool = False
) -> SaturationTable:
    """The table of a pair (n, sigma), which springs share."""
    shared = _coarse if coarse and not derivatives and not energies else _shared
    return shared(n, sigma, derivatives, energies, coarse)


_shared = lru_cache(maxsize=16)(SaturationTable)
_coarse = lru_cache(maxsize=48)(SaturationTable)  # the scan asks for the same 28 ever again
