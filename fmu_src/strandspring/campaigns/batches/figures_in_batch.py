"""Engineering figures of all springs at amplitudes that they have in common, and who differs from the others."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.loop import steady_loop
from .spring_row import IDENTIFIED, SpringRow

# Figures of the steady loop about the offset, at the common amplitude and at half of it, with their units.
FIGURES = {
    "secant stiffness": "N/m",
    "energy per cycle": "J",
    "loss factor": "1",
    "secant stiffness at half the amplitude": "N/m",
    "energy per cycle at half the amplitude": "J",
    "loss factor at half the amplitude": "1",
}
# What outliers are found by: how stiff a spring is, how much it absorbs, and how well the model describes it. sigma and
# n are left out, because few records determine them well; what they do to the loops is in the energies.
_LOOPS = [name for name in FIGURES if not name.startswith("loss factor")]
JUDGED = (*_LOOPS, "kappa_omega", "rho", "rmse")
_ONE_SIDED = "rmse"  # a spring that fits better than the others is no outlier
_USUAL = 0.9  # share of the median range; springs of less do not decide the common amplitude
_SLACK = 1e-3  # share of the range by which a loop may leave it
_DIGITS = 3
LIMIT = 3.5
# Fewer springs have no scatter to speak of.
FEWEST = 8
_NORMAL = 1.482602  # standard deviation over median absolute deviation, of normal numbers
_NORMAL_MEAN = 1.253314  # standard deviation over mean absolute deviation, likewise
_LEAST = 1e-3  # least s: springs that differ by less than 0.35 % are alike, however alike the others are


def common_amplitude(rows: Iterable[SpringRow]) -> float | None:
    """The largest amplitude that all springs reach within their identified range, rounded down to 3 digits [m].

    Springs of less than 90 % of the median range are left aside. None without an identified spring.
    """
    halves = np.array([_half_range(row) for row in rows if row.status == IDENTIFIED])
    if not halves.size:
        return None
    least = float(halves[halves >= _USUAL * np.median(halves)].min())
    step = 10.0 ** (math.floor(math.log10(least)) - _DIGITS + 1)
    rounded = float(f"{math.floor(least / step * (1.0 + 1e-9)) * step:.{_DIGITS}g}")
    return rounded if rounded > 0.0 else least


def _half_range(row: SpringRow) -> float:
    p = row.spring
    return 0.5 * (p.displacement_max - p.displacement_min)


def figures_at(row: SpringRow, amplitude: float) -> list[float]:
    """The `FIGURES` of an identified spring; NaN where the loop leaves its range, or a loss factor is undefined."""
    if amplitude > (1.0 + _SLACK) * _half_range(row):
        return [math.nan] * len(FIGURES)
    p = row.spring
    solver = PathSolver(p)
    values = []
    for reach in (amplitude, 0.5 * amplitude):
        loop = steady_loop(solver, p.displacement_offset - reach, p.displacement_offset + reach).figures
        values += [loop.secant_stiffness, loop.energy_per_cycle, loop.loss_factor]
    return values


def outlying(values: dict[str, FloatArray]) -> dict[int, list[str]]:
    """Figures in which springs differ from the batch.

    Parameters
    ----------
    values : dict   Array of shape (K,) for each of `JUDGED`; NaN where unknown.

    Returns
    -------
    dict            Names of the figures for each place of an outlier.
    """
    names: dict[int, list[str]] = {}
    for name in JUDGED:
        z = modified_z(values[name])
        for place in np.flatnonzero(z > LIMIT if name == _ONE_SIDED else np.abs(z) > LIMIT).tolist():
            names.setdefault(place, []).append(name)
    return dict(sorted(names.items()))


def modified_z(figures: FloatArray) -> FloatArray:
    """Modified z-scores of the logarithms of a figure, by the robust rule of Iglewicz and Hoaglin (1993).

    z = (ln f - median)/s over the batch, with s = 1.4826 times the median absolute deviation of ln f, which is the
    standard deviation of normal numbers. |z| > 3.5 is an outlier. Logarithms, because the figures are positive and
    their scatter is relative.

    Of a clean batch of normal figures this flags in each figure a share of springs that falls with the size of the
    batch, because the median and s are estimated: 2 % of the springs with 8, 1 % with 15, 0.4 % with 30, 0.2 % with 50,
    0.1 % with 100, 0.05 % with 1000 or more. Several figures together flag up to as many times more.

    Parameters
    ----------
    figures : ndarray, shape (K,)   NaN where unknown; below 0 counts as 0.

    Returns
    -------
    ndarray, shape (K,)             0 where unknown, and of fewer than `FEWEST` known figures; -inf of figures that are
                                    not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from strandspring.campaigns.batches.figures_in_batch import modified_z
    >>> modified_z(np.array([9.8, 9.9, 10.0, 10.0, 10.1, 10.2, 10.3, 20.0])).round(1).tolist()
    [-1.1, -0.7, -0.2, -0.2, 0.2, 0.7, 1.1, 31.1]
    """
    z = np.zeros(figures.size)
    known = np.isfinite(figures)
    if np.sum(known) < FEWEST:
        return z
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.log(np.maximum(figures[known], 0.0))
        median = float(np.median(logarithms))
        if not np.isfinite(median):  # most are not positive
            return z
        distance = np.abs(logarithms - median)
        scale = _NORMAL * float(np.median(distance))
        if scale == 0.0:  # more than half are equal
            scale = _NORMAL_MEAN * float(np.mean(distance[np.isfinite(distance)]))
        z[known] = (logarithms - median) / max(scale, _LEAST)
    return z
