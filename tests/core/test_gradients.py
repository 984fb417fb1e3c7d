"""Derivatives by the steps in C and at points of records, against difference quotients and analytic cases."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from kernel_tools import FloatArray, Kernel, c_parameters
from springs import EXAMPLES, along, force_scale
from strandspring import SpringParameters
from strandspring.core.parameters import SCALARS
from strandspring.kernel.path import PathSolver
from strandspring.kernel.points import RecordPoints

# Strokes that end while omega recovers, near saturation, below and above the range; the last is the first motion.
PATHS = {
    "recovering": [0.0, 0.3, -0.2, 0.15, 0.1403], "saturating": [0.0, 0.6, -0.5, 0.1, -0.02, 0.31],
    "below": [0.4, 0.9, -0.3, -0.25, -1.3], "above": [0.0, -0.5, 1.2, 1.1, 1.25], "first": [0.1, 0.17],
}  # fmt: skip
LISTS = ("kE", "kA", "FE_knots", "FE_forces")


def response_to(p: SpringParameters, path: FloatArray, name: str, index: int, change: float) -> FloatArray:
    """Force and stiffness at the end of the path, from omega = 0.3, after one quantity has been changed."""
    changed, path, omega = c_parameters(p), path.copy(), 0.3
    if name == "displacement":
        path[-1] += change
    elif name == "omega_start":
        omega += change
    elif name in LISTS:
        getattr(changed, name)[index] += change
    else:
        setattr(changed, name, getattr(changed, name) + change)
    return Kernel(changed).along(path, omega)[0][1:3, -1]


def quantities(p: SpringParameters) -> list[tuple[str, int, float]]:
    """Whatever there is a derivative by: name, index and over what the response changes."""
    span = p.displacement_max - p.displacement_min
    found = [("displacement", 0, min(span, 1.0 / p.rho)), ("omega_start", 0, 1.0)]
    # A knot may move by a share of the distance to the next.
    found += [("FE_knots", i, 0.1 * span) for i in range(len(p.FE_knots))]
    for name in ("kE", "kA", "FE_forces"):
        found += [(name, i, abs(c) or p.kappa_omega / span**i) for i, c in enumerate(getattr(p, name))]
    return found + [(name, 0, span if name.startswith("displacement") else getattr(p, name)) for name in SCALARS]


@pytest.mark.long
@pytest.mark.parametrize("way", PATHS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_gradients_are_the_difference_quotients_of_the_response(name: str, way: str) -> None:
    p = EXAMPLES[name]
    path = along(p, PATHS[way])
    response, gradients = Kernel(p).along(path, 0.3)
    # The stiffness is the slope of the force, also before the first motion.
    assert gradients[0]["by_displacement"] == pytest.approx(response[2], rel=1e-12)
    scales = np.array([force_scale(p, path), np.abs(response[2]).max()])
    for quantity, index, size in quantities(p):
        # Tables of neighbouring n and sigma differ by rounding, 1e-13 over a step of 1e-4: 1e-9. A formula of order 4
        # leaves (1e-4*rho*travel)^4, or 1e-9 for the longest stroke, 60 in xi, but there omega is saturated.
        step = 1e-4 * size
        at = {k: response_to(p, path, quantity, index, k * step) for k in (-2, -1, 1, 2)}
        expected = (8.0 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12.0 * step)
        by = gradients[:, -1][f"by_{quantity}"]
        found = by[:, index] if quantity in LISTS else by
        assert np.all(np.abs(found - expected) * size <= 1e-7 * scales), (quantity, index, found, expected)


RHO = 4.0
TURNS = np.array([0.1, 0.8, -0.2, 0.1, -0.05, 0.02, -0.9, 0.3, 0.29, 0.6])


def points_of(turns: FloatArray) -> tuple[NDArray[np.int64], FloatArray, NDArray[np.int64], FloatArray]:
    """Direction and length of the strokes between turning points, stroke and travel of 20 points on each."""
    length = np.diff(turns)
    stroke = np.repeat(np.arange(length.size), 20)
    travel = np.tile(np.arange(1, 21) / 20.0, length.size) * np.abs(length)[stroke]
    return np.sign(length).astype(int), np.abs(length), stroke, travel


def path_of(turns: FloatArray) -> FloatArray:
    """The same points as a path."""
    direction, _, stroke, travel = points_of(turns)
    return np.append(turns[0], turns[stroke] + direction[stroke] * travel)


def omega_along(path: FloatArray, rho: float, sigma: float, n: float, start: float) -> FloatArray:
    return PathSolver(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0)).omega(path, start)[1:]


@pytest.mark.parametrize(("n", "sigma"), [(0.22, 3.0), (1.0, 1.0), (9.0, 40.0)])
def test_derivatives_at_points_are_difference_quotients_of_paths(n: float, sigma: float) -> None:
    at, path = np.array([RHO, sigma, n, -0.4]), path_of(TURNS)
    direction, length, stroke, travel = points_of(TURNS)
    columns = np.tile(direction, 2), np.tile(length, 2), np.append(stroke, stroke + length.size), np.tile(travel, 2)
    both = RecordPoints(np.arange(3) * length.size, np.arange(3) * travel.size, *columns)
    found = both.omega(*at[:3].tolist(), np.array([0.9, -0.4]))  # by logarithms; of the second record
    omega, derivatives = found[0][travel.size :], found[1][:, travel.size :] / [*([value] for value in at[:3]), [1.0]]
    # xi is rounded in other ways; W' is at most 2 sigma.
    assert omega == pytest.approx(omega_along(path, *at.tolist()), abs=1e-14 * (1 + 20 * sigma))
    for row, size in enumerate((RHO, sigma, n, 1.0)):
        # Tables of neighbouring n and sigma differ by 1e-13, over a step of 2e-4 by 1e-9; fourth order leaves 1e-9.
        moved = {k: at + 2e-4 * k * size * np.eye(4)[row] for k in (-2, -1, 1, 2)}
        response = {k: omega_along(path, *m.tolist()) for k, m in moved.items()}
        quotient = (8.0 * (response[1] - response[-1]) - (response[2] - response[-2])) / (2.4e-3 * size)
        # Where omega passes zero the quotient crosses the cusp of n < 1.
        smooth = np.min([np.abs(values) for values in response.values()], axis=0) > 0.02
        assert np.count_nonzero(smooth) > 100
        error = np.abs(derivatives[row] - quotient)[smooth].max() * size
        assert error <= 2e-7 * max(np.abs(derivatives[row]).max() * size, 1.0)
