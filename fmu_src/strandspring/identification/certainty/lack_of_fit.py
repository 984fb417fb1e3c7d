"""How far a fit is from the records, measured by what matters: the hysteretic force and the energy of the loops.

RNL compares the misfit with the whole force, so that a preload flatters it. Here it is compared with the height of the
loop, and divided into what comes back in every cycle and what does not: the part that both branches have in common is
the shape of the elastic force, the part in which they differ that of the loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.projection import Refinement
from ..points.residuals import CELLS, autocorrelation_time, branch_cells
from ..points.sample_points import SamplePoints

_REPORTED = 0.1  # misfit beyond noise that is reported, share of the hysteretic force
_BEYOND = 1.5  # misfit over noise from which it is more than noise
_LONG = 1.5  # autocorrelation time, in points, from which residuals are not white


@dataclass(frozen=True)
class LackOfFit:
    """Misfit of a fit.

    Attributes
    ----------
    over_noise : float             rms misfit over the rms that noise alone gives [-].
    autocorrelation_time : float   Of the residuals [points].
    of_height : float              rms misfit as a share of the mean height of the loops [-].
    beyond_noise : float           rms misfit that noise does not explain, as a share of the rms force but FE [-].
    energy : float                 Energy that the misfit makes of the loops, as a share of the model's [-].
    elastic, loop, changes : float Shares of the mean squared misfit: shape of the elastic force, shape of the loop, and
                                   what differs from cycle to cycle, noise included [-].
    """

    over_noise: float
    autocorrelation_time: float
    of_height: float
    beyond_noise: float
    energy: float
    elastic: float
    loop: float
    changes: float

    @classmethod
    def from_fit(cls, loops: SamplePoints, fit: Refinement, hysteretic: FloatArray, noise: float) -> LackOfFit:
        """The misfit of a refined fit, given all force but FE at the points and the rms that noise alone gives the
        residuals [N].
        """
        residuals = fit.backbone.misfit(loops.force, fit.omega)
        misfit, height = loops.rms(residuals), loops.rms(hysteretic)
        elastic, loop = _repeated(loops, residuals)
        square = max(misfit**2, 1e-300)
        return cls(
            over_noise=misfit / max(noise, 1e-12 * loops.rms(loops.force), 1e-300),
            autocorrelation_time=autocorrelation_time(np.sqrt(loops.weight) * residuals),
            of_height=misfit / max(2.0 * height, 1e-300),
            beyond_noise=float(np.sqrt(max(misfit**2 - noise**2, 0.0))) / max(height, 1e-300),
            energy=loops.work(residuals) / max(loops.work(hysteretic), 1e-300),
            elastic=elastic / square,
            loop=loop / square,
            changes=max(1.0 - (elastic + loop) / square, 0.0),
        )

    @property
    def is_structured(self) -> bool:
        """Whether the misfit is more than noise."""
        return self.over_noise > _BEYOND or self.autocorrelation_time > _LONG

    @property
    def is_reported(self) -> bool:
        """Whether the misfit is more than noise, and not small against the hysteretic force."""
        return self.is_structured and self.beyond_noise > _REPORTED

    @property
    def advice(self) -> str:
        """Where most of the misfit lies, and which test would show why."""
        share = f"{100.0 * self.beyond_noise:.0f} % of the hysteretic force; "
        if self.changes > max(self.elastic, self.loop):
            return share + (
                "mostly different from cycle to cycle, as from slipping, relaxation or outliers: repeat the test, and "
                "compare its cycles"
            )
        if self.elastic >= self.loop:
            return share + (
                "mostly in the shape of the elastic force: identify a smaller range of displacement "
                "(`displacement_range=...`)"
            )
        return share + (
            "mostly in the shape of the loop: compare other classes of models with `with_rivals()`, and repeat one "
            "amplitude at another frequency"
        )

    @property
    def sentence(self) -> str:
        """The figures in words."""
        return (
            f"fit: misfit {self.over_noise:.3g} times the noise, {100.0 * self.of_height:.2g} % of the loops' height; "
            f"energy of the loops {100.0 * self.energy:+.2g} %"
        )


def _repeated(loops: SamplePoints, residuals: FloatArray) -> tuple[float, float]:
    """Mean squares of what mean loading and unloading residuals have in common, and of half their difference [N^2]."""
    cells = branch_cells(loops)
    weight = np.bincount(cells, weights=loops.weight, minlength=2 * CELLS)
    count = np.bincount(cells, minlength=2 * CELLS)
    total = np.bincount(cells, weights=loops.weight * residuals, minlength=2 * CELLS)
    squares = np.bincount(cells, weights=loops.weight * residuals**2, minlength=2 * CELLS)
    mean = total / np.maximum(weight, 1e-300)
    scatter = np.maximum(squares / np.maximum(weight, 1e-300) - mean**2, 0.0) / np.maximum(count, 1)
    down, up = np.split(mean, 2)
    noise = np.split(scatter, 2)
    share = np.split(weight, 2)
    both = (share[0] > 0.0) & (share[1] > 0.0)
    cell_weight = (share[0] + share[1]) * both
    # What the scatter within a cell gives a mean is removed.
    chance = 0.25 * (noise[0] + noise[1])
    parts = (np.maximum((0.5 * (up + side * down)) ** 2 - chance, 0.0) for side in (1.0, -1.0))
    elastic, loop = (float(cell_weight @ part) / max(float(cell_weight.sum()), 1e-300) for part in parts)
    return elastic, loop
