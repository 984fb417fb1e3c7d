"""How well the records decide the energy of loops smaller than the largest: what a spring is used for, mostly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.parameters import SpringParameters
from ..joint import JointCovariance
from ..kernel.path import PathSolver
from .search import Candidate
from .solution import spring_of

AMPLITUDE = 0.3  # of the loops judged, share of the largest
_STEP = 0.05  # of the differences, in standard errors
_SAMPLES = 200  # of one period
_CYCLES = 3  # until the loop is steady
_NORMAL_95 = 1.96  # standard errors to either side
_CLOSE = 10.0  # difference of the criterion up to which two fits are about as good
_AS_GOOD = 1.1  # misfit in that of the best up to which another fit is as good
_UNDECIDED = 0.07  # uncertainty of the energy that is reported, share of it
_MISFIT = 0.1  # misfit beyond noise that is reported, share of half the height of those loops
_APART = 0.05  # difference between the energies of two fits that is reported, share of it


def loop_energy(spring: SpringParameters) -> float:
    """Energy of the steady loop of a sine about mid-range with the share AMPLITUDE of the range [J]."""
    middle, half = spring.displacement_offset, 0.5 * (spring.displacement_max - spring.displacement_min)
    phase = np.linspace(0.0, 2.0 * np.pi * _CYCLES, _SAMPLES * _CYCLES + 1)
    path = middle + AMPLITUDE * half * np.sin(phase)
    force = PathSolver(spring).force(path)
    last = slice(-_SAMPLES - 1, None)
    return float(np.trapezoid(force[last], path[last]))


def undecided_energy(
    spring: SpringParameters,
    uncertainty: dict[str, Any],
    alternatives: Sequence[Sequence[Candidate]],
    misfit: float = 0.0,
) -> str:
    """What the records leave undecided of that energy, in words; empty if it is little.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : dict                Content of the model file's field, with the joint covariance.
    alternatives : sequence of sequences of Candidate   Each with the fit that gave the spring first, and others with
                                      their criterion by the same count.
    misfit : float                    rms misfit that is not noise [N].
    """
    energy = loop_energy(spring)
    parts = []
    joint = JointCovariance.of(spring, uncertainty)
    if joint is not None and (error := _relative_error(spring, joint, energy)) > _UNDECIDED:
        parts.append(f"known to +- {100.0 * min(error, 9.99):.0f} % at {100.0 * AMPLITUDE:.0f} % of the amplitude")
    reach = AMPLITUDE * (spring.displacement_max - spring.displacement_min)
    half_height = energy / (2.0 * reach)
    if misfit > _MISFIT * half_height:
        parts.append(
            f"the misfit that is not noise is {100.0 * misfit / half_height:.0f} % of the mean half height of the "
            f"loops at {100.0 * AMPLITUDE:.0f} % of the amplitude"
        )
    rivals = [
        other
        for best, *others in alternatives
        for other in others
        if other.criterion < best.criterion + _CLOSE and other.misfit < _AS_GOOD * best.misfit
    ]
    springs = [spring_of(other.basis, other.refinement.backbone, other.refinement.hysteresis) for other in rivals]
    energies = [loop_energy(other) for other in springs]
    if any(abs(other / energy - 1.0) > _APART for other in energies):
        ratios = [other / energy for other in energies]
        next_best = springs[0]
        parts.append(
            f"another fit that is about as good has n {next_best.n:.3g}, sigma {next_best.sigma:.3g}, "
            f"rho {next_best.rho:.3g} 1/m; such fits give {min(ratios):.2g} to {max(ratios):.2g} times the energy"
        )
    return "; ".join(parts)


def _relative_error(spring: SpringParameters, joint: JointCovariance, energy: float) -> float:
    """Half of the 95 % interval of the energy as a share of it, by differences along each direction."""
    size = len(joint.root)
    square = 0.0
    # FE takes no part in the energy: its directions still move the other coefficients along with it.
    for unit in np.eye(size) * _STEP:
        try:
            square += ((loop_energy(joint.moved(spring, unit.tolist())) - energy) / _STEP) ** 2
        except ValueError:
            return np.inf
    return _NORMAL_95 * float(np.sqrt(square)) / abs(energy)
