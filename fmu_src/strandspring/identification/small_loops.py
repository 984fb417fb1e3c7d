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
_ONE_AMPLITUDE = 0.9  # smallest amplitude in the largest from which there is one only
_AS_SMALL = 1.2  # smallest amplitude in that of the loops judged up to which these were recorded
_UNDECIDED = 0.07  # uncertainty of the energy that is reported, share of it


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
    smallest: float,
) -> str:
    """What the records leave undecided of that energy, and what would decide it, in words; empty if it is little.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : dict                Content of the model file's field, with the joint covariance.
    alternatives : sequence of sequences of Candidate   Each with the fit that gave the spring first, and others with
                                      their criterion by the same count.
    smallest : float                  Amplitude of the smallest loops recorded [m].
    """
    energy = loop_energy(spring)
    parts = []
    joint = JointCovariance.of(spring, uncertainty)
    if joint is not None and (error := _relative_error(spring, joint, energy)) > _UNDECIDED:
        known = f"known to +- {100.0 * error:.0f} %" if error < 1.0 else "undetermined"
        parts.append(f"{known} at {100.0 * AMPLITUDE:.0f} % of the amplitude")
    rivals = [
        other
        for best, *others in alternatives
        for other in others
        if other.criterion < best.criterion + _CLOSE and other.misfit < _AS_GOOD * best.misfit
    ]
    springs = [spring_of(other.basis, other.refinement.backbone, other.refinement.hysteresis) for other in rivals]
    energies = [loop_energy(other) for other in springs]
    if any(abs(other / energy - 1.0) > _UNDECIDED for other in energies):
        next_best = springs[0]
        parts.append(
            f"another fit that is about as good has n {next_best.n:.3g}, sigma {next_best.sigma:.3g}, "
            f"rho {next_best.rho:.3g} 1/m; at {100.0 * AMPLITUDE:.0f} % of the amplitude such fits give "
            f"{min(energies):.3g} to {max(energies):.3g} J a cycle, this one {energy:.3g} J"
        )
    return "; ".join([*parts, _advice(spring, smallest)]) if parts else ""


def _advice(spring: SpringParameters, smallest: float) -> str:
    """Which record would decide, given the amplitude of the smallest loops recorded [m]."""
    half = 0.5 * (spring.displacement_max - spring.displacement_min)
    wanted = f"{1e3 * AMPLITUDE * half:.2g} mm"
    if smallest >= _ONE_AMPLITUDE * half:
        return (
            "all loops have about one amplitude, so that how the force divides into FE and loop rests on the form of "
            f"the model: record loops of about {wanted} too"
        )
    if smallest > _AS_SMALL * AMPLITUDE * half:
        return f"the smallest loops recorded have {1e3 * smallest:.2g} mm: record some of about {wanted} too"
    return f"loops of {1e3 * smallest:.2g} mm were recorded: record more cycles of them, or with less noise"


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
