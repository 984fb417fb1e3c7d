"""What the parameters of a spring can take over of a small change of the force, by a linear problem about a fit."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from .corrected import Corrected


class Tangent:
    """The changes of the force that changes of FE, FA, rho, sigma and n can make, weighted.

    Attributes
    ----------
    root : ndarray, shape (P,)     Roots of the points' weights.
    misfit : ndarray, shape (P,)   Weighted residuals that they do not reach [N].

    Parameters
    ----------
    state : Corrected
    """

    def __init__(self, state: Corrected) -> None:
        fit, loops, refinement = state.fit, state.loops, state.fit.refinement
        columns = fit.basis.columns(loops.displacement)
        self.root = np.sqrt(loops.weight)
        yielding = refinement.derivatives * refinement.backbone.G
        rows = np.concatenate([columns.elastic.T, refinement.omega * columns.amplifier.T, yielding])
        rows *= self.root / np.maximum(np.abs(rows).max(axis=1), 1e-300)[:, None]
        self._reached, _ = np.linalg.qr(rows.T)
        self.misfit = self.beside(self.root * refinement.backbone.misfit(loops.force, refinement.omega))

    def beside(self, values: FloatArray) -> FloatArray:
        """What they do not reach of weighted values, shape (P,) or (P, columns)."""
        return np.asarray(values - self._reached @ (self._reached.T @ values))
