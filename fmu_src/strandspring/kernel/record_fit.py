"""Springs fitted to points of records by variable projection, in the compiled kernel (`kernel/c/fit/record_fit.h`)."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library
from .points import RecordPoints
from .saturation_table import COARSE, WITH_DERIVATIVES, table_memory
from .structures import structures


class FoundFit(NamedTuple):
    """What a fit has found.

    Attributes
    ----------
    variables : ndarray, shape (3 + R,)         ln(rho), ln(sigma), ln(n), omega_start of each record.
    coefficients : ndarray, shape (N + M,)      Of the fixed and of the moving columns; 0 where a column depends on
                                                those before it.
    omega : ndarray, shape (P,)
    derivatives : ndarray, shape (3 + R, P)     Of omega by the variables.
    converged : bool                            Whether it is a minimum: there is none where evaluations were used up.
    """

    variables: FloatArray
    coefficients: FloatArray
    omega: FloatArray
    derivatives: FloatArray
    converged: bool


class RecordFit:
    """The least-squares problem force = fixed*a + (omega*moving)*b in rho, sigma, n, each omega_start, a and b.

    Parameters
    ----------
    points : RecordPoints
    fixed, moving : ndarray, shapes (P, N), (P, M)   Of FE and whatever else is linear; of FA.
    force : ndarray, shape (P,)                      [N]
    low, high : ndarray, shape (3 + R,)              Bounds of the variables.
    coarse : bool                                    omega to 1e-8 only, the quicker for it where the points are few.
    """

    def __init__(
        self,
        points: RecordPoints,
        fixed: FloatArray,
        moving: FloatArray,
        force: FloatArray,
        low: FloatArray,
        high: FloatArray,
        coarse: bool,
    ) -> None:
        self._points, self._width = points, fixed.shape[1] + moving.shape[1]
        self._arrays = {
            "columns": floats(np.concatenate([fixed.T, moving.T])),
            "force": floats(force),
            "low": floats(low),
            "high": floats(high),
        }
        self._given = {
            "records": points.records,
            "strokes": points.strokes,
            "points": points.count,
            "fixed": fixed.shape[1],
            "moving": moving.shape[1],
            "with": WITH_DERIVATIVES + COARSE * coarse,
            **points.addresses,
            **{name: address(array) for name, array in self._arrays.items()},
        }

    def solve(self, start: FloatArray, root: FloatArray, tolerance: float, evaluations: int) -> FoundFit:
        """The fit with the least weighted squared misfit that is reached from a start.

        Parameters
        ----------
        start : ndarray, shape (3 + R,)   Of the variables, strictly within their bounds.
        root : ndarray, shape (P,)        Root of the weight of each squared misfit [1/N].
        tolerance : float                 Relative change of the squared misfit at which the iteration ends.
        evaluations : int                 At which it ends in any case.
        """
        kernel, memory = library(), table_memory()
        given = structures()["RecordFit"](
            **self._given, table=address(memory), root=address(root), tolerance=tolerance, evaluations=evaluations
        )
        here = ctypes.addressof(given)
        variables, coefficients = np.array(start, dtype=np.float64), np.empty(self._width)
        found = np.empty((1 + variables.size, self._points.count))
        workspace = np.empty(kernel.record_fit_workspace(here))
        converged = kernel.record_fit(
            here, address(variables), address(coefficients), address(found), address(workspace)
        )
        return FoundFit(variables, coefficients, found[0], found[1:], bool(converged))
