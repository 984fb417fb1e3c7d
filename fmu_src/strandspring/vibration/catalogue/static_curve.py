"""A static load-deflection curve as a table of FE: smooth, rising, and through the stated points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ...core.parameters import KNOTS, LEAST_SPACING
from ...core.spline import pieces
from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

Curve = Sequence[tuple[float, float]]  # deflections [m] and forces [N]

MOST_POINTS = KNOTS[1]
_LARGEST_DEPARTURE = 0.01  # of the spline from the monotone curve through the points, over the span of force
_CELLS = 20  # between knots, where departures are looked for


def with_origin(curve: Curve, is_symmetric: bool) -> list[tuple[float, float]]:
    """The points in rising order, with 0 N at 0 m and, of a symmetric curve, those of negative deflection.

    Raises
    ------
    MountedSystemError   If the points do not rise, or force and deflection differ in sign.
    """
    points = sorted({(0.0, 0.0), *curve})
    if is_symmetric:
        if points[0][0] < 0.0 < points[-1][0]:
            raise MountedSystemError(
                "`curve` must have deflections of one sign where `symmetric = true` adds the other; leave out one of "
                "them."
            )
        points = sorted({*points, *((-x, -force) for x, force in points)})
    for (x, force), (next_x, next_force) in pairwise(points):
        if not (x < next_x and force < next_force):
            raise MountedSystemError(
                f"`curve` must have forces that rise with deflection and 0 N at 0 mm, got {force:.6g} N at "
                f"{1e3 * x:.6g} mm and {next_force:.6g} N at {1e3 * next_x:.6g} mm; correct the points."
            )
    return points


def knots_of(points: Curve, low: float, high: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Knots and forces of the table of FE from `low` to `high` [m].

    Between the points runs a monotone cubic (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980), of which knots are
    taken halfway in the widest gaps until there are as many as a table may have.

    Parameters
    ----------
    points : sequence of tuple   As `with_origin` gives them.
    low, high : float            Within the points [m].

    Raises
    ------
    MountedSystemError           If there are too many points, they are too close together, or the table departs from
                                 them.
    """
    deflections, forces = np.array(points).T
    from scipy.interpolate import PchipInterpolator  # slow to import, and only this needs it

    monotone = PchipInterpolator(deflections, forces)
    knots = sorted({low, high, *(x for x in deflections.tolist() if low < x < high)})
    if len(knots) > MOST_POINTS:
        raise MountedSystemError(
            f"`curve` must have at most {MOST_POINTS} points over the stroke, with those that `symmetric` adds, got "
            f"{len(knots)}; leave some out."
        )
    gap, at = min((after - before, before) for before, after in pairwise(knots))
    if gap < LEAST_SPACING * (high - low):
        raise MountedSystemError(
            f"`curve` must have points {LEAST_SPACING:.1%} of the stroke apart or more, got {1e3 * gap:.3g} mm between "
            f"two at {1e3 * at:.6g} mm; leave one out."
        )
    while len(knots) < MOST_POINTS:
        _, before, after = max((after - before, before, after) for before, after in pairwise(knots))
        knots = sorted([*knots, 0.5 * (before + after)])
    at_knots = monotone(knots).tolist()
    _check_departure(knots, at_knots, monotone)
    return tuple(knots), tuple(at_knots)


def _check_departure(knots: list[float], forces: list[float], monotone: PchipInterpolator) -> None:
    """Refuse a curve so kinked that the table of FE does not follow it."""
    worst, where = 0.0, 0.0
    for (left, right), piece in zip(pairwise(knots), pieces(knots, forces), strict=True):
        places: FloatArray = np.linspace(left, right, _CELLS)
        departures = np.abs(np.polynomial.polynomial.polyval(places - piece.origin, piece.force) - monotone(places))
        if departures.max() > worst:
            worst, where = float(departures.max()), float(places[departures.argmax()])
    if worst > _LARGEST_DEPARTURE * (forces[-1] - forces[0]):
        raise MountedSystemError(
            f"`curve` bends too sharply near {1e3 * where:.4g} mm: a smooth curve through the points is off by "
            f"{worst:.3g} N there; give it more points there, or describe a stop by `stops` and end the stroke before "
            "it."
        )
