"""How well the records decide the energy of loops smaller than the largest: what a spring is used for, mostly."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np

from ..core.parameters import SpringParameters
from ..joint import JointCovariance
from ..kernel.arrays import FloatArray
from ..kernel.points import RecordPoints
from .intervals import NORMAL_95
from .loops import ONE_AMPLITUDE
from .outcomes import IdentificationError
from .search import CLOSE, Candidate
from .solution import spring_of

AMPLITUDE = 0.3  # of the loops judged, share of the largest
_SAMPLES = 101  # of a stroke
_CYCLES = 40  # until the loop is steady
_AS_GOOD = 1.1  # misfit in that of the best up to which another fit is as good
_AS_SMALL = 1.2  # smallest amplitude in that of the loops judged up to which these were recorded
_UNDECIDED = 0.07  # uncertainty of the energy that is reported, share of it
_MISFIT = 0.1  # misfit beyond noise that is reported, share of half the height of those loops
_COUNTLESS = 10.0  # times that half height from which on a misfit is not given as a number
_VOID = 1e-3  # energy of a loop that is none, in that of the saturated force along it
_APART = 0.05  # difference between the energies of two fits that is reported, share of it


def loop_energy(spring: SpringParameters) -> float:
    """Energy of the steady loop of a sine about mid-range with the share AMPLITUDE of the range [J]."""
    return _energy_with_derivatives(spring)[0]


@lru_cache(maxsize=1)  # the spring found is judged more than once
def _energy_with_derivatives(spring: SpringParameters) -> tuple[float, FloatArray]:
    """That energy, and its derivatives by kA without kA[0] and by the logarithms that `JointCovariance` takes."""
    amplitude = AMPLITUDE * 0.5 * (spring.displacement_max - spring.displacement_min)
    direction = np.array([1, -1] * _CYCLES + [1])
    length = np.append(amplitude, np.full(2 * _CYCLES, 2.0 * amplitude))
    travel = amplitude * (1.0 - np.cos(np.linspace(0.0, np.pi, _SAMPLES)))
    # FE returns what it takes, so that the force is that of omega alone; the last cycle is the steady one.
    stroke = np.repeat(direction.size - np.array([1, 2]), _SAMPLES)
    points = RecordPoints.of_one(direction, length, stroke, np.tile(travel, 2))
    omega, partials = points.omega(spring.rho, spring.sigma, spring.n, np.zeros(1), coarse=True)
    rising = travel - amplitude
    place = np.concatenate([rising, -rising])
    powers = place ** np.arange(len(spring.kA))[:, None]
    FA = np.array(spring.kA) @ powers
    integrands = spring.kappa_omega * np.vstack(
        [
            omega * powers[1:],
            FA * omega,
            *(FA * partials[:3]),
        ]
    )
    up, down = np.split(integrands, 2, axis=1)
    integrals = np.asarray(np.trapezoid(up - down, travel, axis=1))
    return float(integrals[len(spring.kA) - 1]), integrals


def undecided_energy(
    spring: SpringParameters,
    uncertainty: dict[str, Any],
    alternatives: Sequence[Sequence[Candidate]],
    smallest: float,
    misfit: float = 0.0,
    doubts: Sequence[str] = (),
) -> str:
    """What the records leave undecided of that energy, and what would decide it, in words; empty if it is little.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : dict                Content of the model file's field, with the joint covariance.
    alternatives : sequence of sequences of Candidate   Each with the fit that gave the spring first, and others with
                                      their criterion by the same count.
    smallest : float                  Amplitude of the smallest loops recorded [m].
    misfit : float                    rms misfit that is not noise [N].
    doubts : sequence of str          Further reasons why the energy of loops that were not recorded is undecided.
    """
    energy, derivatives = _energy_with_derivatives(spring)
    reach = AMPLITUDE * (spring.displacement_max - spring.displacement_min)
    void = _VOID * 2.0 * spring.kappa_omega * reach
    parts = []
    joint = JointCovariance.of(spring, uncertainty)
    error = 0.0 if joint is None else _relative_error(energy, derivatives, joint)
    if error > _UNDECIDED and error * abs(energy) > void:
        known = f"known to +- {100.0 * error:.0f} %" if error < 1.0 else "undetermined"
        parts.append(f"{known} at {100.0 * AMPLITUDE:.0f} % of the amplitude")
    half_height = max(energy, void) / (2.0 * reach)
    if misfit > _MISFIT * half_height:
        # A model may have loops of hardly any height there.
        few = misfit < _COUNTLESS * half_height
        size = f"{100.0 * misfit / half_height:.0f} % of" if few else f"more than {_COUNTLESS:g} times"
        parts.append(
            f"the misfit that is not noise is {size} the mean half height of the loops at {100.0 * AMPLITUDE:.0f} % of "
            "the amplitude"
        )
    rivals = [
        other
        for best, *others in alternatives
        for other in others
        if other.criterion < best.criterion + CLOSE and other.misfit < _AS_GOOD * best.misfit
    ]
    springs = list(_springs(rivals))
    energies = [loop_energy(other) for other in springs]
    if any(abs(other - energy) > max(_APART * energy, void) for other in energies):
        next_best = springs[0]
        parts += [
            f"at {100.0 * AMPLITUDE:.0f} % of the amplitude {_in_words([energy], void)} a cycle, equally good fits "
            f"{_in_words(energies, void)}",
            f"the next one has n {next_best.n:.3g}, sigma {next_best.sigma:.3g}, rho {next_best.rho:.3g} 1/m",
        ]
    parts += doubts
    return "; ".join([*parts, _advice(spring, smallest)]) if parts else ""


def extrapolated_energy(spring: SpringParameters, uncertainty: Mapping[str, Any], amplitude: float) -> str:
    """How far the energy of loops smaller than this amplitude [m] is known if the model holds, in words."""
    known = f"below {1e3 * amplitude:.3g} mm"
    joint = JointCovariance.of(spring, uncertainty)
    if joint is None:
        return known
    error, share = 100.0 * _relative_error(*_energy_with_derivatives(spring), joint), 100.0 * AMPLITUDE
    return f"{known}; if the model holds there, to +- {error:.2g} % at {share:.0f} % of that amplitude"


def _springs(fits: Sequence[Candidate]) -> Iterator[SpringParameters]:
    """The springs of fits, without those beyond the limits of a spring."""
    for fit in fits:
        with suppress(IdentificationError):
            yield spring_of(fit.basis, fit.refinement.backbone, fit.refinement.hysteresis, "")


def _advice(spring: SpringParameters, smallest: float) -> str:
    """Which record would decide, given the amplitude of the smallest loops recorded [m]."""
    half = 0.5 * (spring.displacement_max - spring.displacement_min)
    wanted = f"{1e3 * AMPLITUDE * half:.2g} mm"
    if smallest >= ONE_AMPLITUDE * half:
        return f"one amplitude does not tell FE from the loop: record loops of about {wanted} too"
    if smallest > _AS_SMALL * AMPLITUDE * half:
        return f"the smallest loops recorded have {1e3 * smallest:.2g} mm: record some of about {wanted} too"
    return f"loops of {1e3 * smallest:.2g} mm were recorded: record more cycles of them, or with less noise"


def _in_words(energies: Sequence[float], void: float) -> str:
    """Energies [J] as one, a range, or none where it is less than `void`."""
    low, high = min(energies), max(energies)
    if high <= void:
        return "no energy"
    if high - low <= _APART * high:
        return f"{0.5 * (low + high):.3g} J"
    return f"{low if low > void else 0.0:.3g} to {high:.3g} J"


def _relative_error(energy: float, derivatives: FloatArray, joint: JointCovariance) -> float:
    """Half of the 95 % interval of the energy as a share of it."""
    root = np.zeros((len(joint.root), len(joint.root)))
    for row, values in zip(root, joint.root, strict=True):
        row[: len(values)] = values
    return NORMAL_95 * float(np.linalg.norm(derivatives @ root[-derivatives.size :])) / max(abs(energy), math.ulp(0.0))
