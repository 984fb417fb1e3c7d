"""FE as a table: Python's pieces and the kernels' against SciPy's cubic spline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from kernel_tools import Kernel, random_table
from springs import TABLE, along
from strandspring import SpringParameters
from strandspring.core.law import SpringLaw
from strandspring.core.restoring import elastic_force, tangent_stiffness
from strandspring.core.work import elastic_work
from strandspring.kernel.path import PathSolver

tables = pytest.mark.parametrize(
    "p", [TABLE, *(random_table(np.random.default_rng(seed)) for seed in range(20))], ids=range(21)
)


def by_scipy(p: SpringParameters, x: np.ndarray, forces: Sequence[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force, slope and work from the offset at x, along the tangents outside the range."""
    spline = CubicSpline(np.array(p.FE_knots) - p.displacement_offset, forces, bc_type="not-a-knot")
    inside = np.clip(x, p.x_min, p.x_max)
    out, force, slope = x - inside, spline(inside), spline(inside, 1)
    work = spline.antiderivative()
    return force + slope * out, slope, work(inside) - work(0.0) + out * (force + 0.5 * slope * out)


@tables
def test_force_slope_and_work_are_those_of_the_spline(p: SpringParameters) -> None:
    law = SpringLaw(p)
    path = along(p, np.concatenate([np.linspace(-1.4, 1.4, 301), np.linspace(-1.0, 1.0, 50)]))
    x = path - p.displacement_offset
    force, slope, work = by_scipy(p, x, p.FE_forces)
    scales = np.max(np.abs(force)), np.max(np.abs(slope)), np.max(np.abs(work))
    # The hysteretic stiffness, alike for both directions where omega is 0.
    hysteretic = p.kappa_omega * p.rho * np.polynomial.polynomial.polyval(np.clip(x, p.x_min, p.x_max), p.kA)
    in_python = np.array(
        [(elastic_force(law, at), tangent_stiffness(law, at, 0.0, 1), elastic_work(law, at)) for at in x.tolist()]
    ).T
    in_python[1] -= hysteretic
    for found, expected, scale in zip(in_python, (force, slope, work), scales, strict=True):
        assert np.max(np.abs(found - expected)) <= 1e-12 * (scale + np.max(hysteretic) * (expected is slope))
    in_kernel = PathSolver(p).force_with_partials(path, np.zeros_like(path))
    for found, expected, scale in zip(in_kernel, (force, slope), scales, strict=False):
        assert np.max(np.abs(found - expected)) <= 1e-12 * scale


@tables
def test_derivatives_by_the_forces_are_the_cardinal_splines(p: SpringParameters) -> None:
    path = along(p, np.linspace(-1.3, 1.3, 157))
    x, count = path - p.displacement_offset, len(p.FE_knots)
    cardinal = [by_scipy(p, x, unit) for unit in np.eye(count)]
    for row, gradients in enumerate(Kernel(p).gradients(path, 0.2)):
        expected = np.array([one[row] for one in cardinal]).T
        found = np.array([gradient.FE_forces[:count] for gradient in gradients])
        assert np.max(np.abs(found - expected)) <= 1e-12 * np.max(np.abs(expected))
