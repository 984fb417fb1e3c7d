"""How well the records decide the energy of loops smaller than the largest: what a spring is used for, mostly."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...kernel.points import RecordPoints
from ...model.joint import JointCovariance
from ...model.outcomes import IdentificationError, Outcome
from ..certainty.intervals import NORMAL_95
from ..certainty.saved_spring import LoopEnergy
from ..points.sample_points import ONE_AMPLITUDE
from ..rig.corrected import Corrected
from ..rig.effect_columns import Effect, Rig
from ..rig.effect_search import hinted_effects
from ..rig.effect_texts import in_words
from ..search.search import CLOSE, Candidate
from ..search.solution import spring_of

AMPLITUDE = 0.3  # of the loops judged, share of the largest
_SAMPLES = 101  # of a stroke
_CYCLES = 40  # until the loop is steady
_AS_GOOD = 1.1  # misfit in that of the best up to which another fit is as good
_AS_SMALL = 1.2  # smallest amplitude in that of the loops judged up to which these were recorded
_UNDECIDED = 0.07  # uncertainty of the energy that is reported, share of it
_MISFIT = 0.1  # misfit beyond noise that is reported, share of half the height of those loops
_COUNTLESS = 10.0  # times that half height from which on a misfit is not given as a number
_VOID = 1e-3  # energy of a loop that is none, in that of the saturated force along it
# Powers of the amplitude with which the energy of a loop falls, of 0.06 to 0.36 of it at 0.3 of the amplitude: nine in
# ten of the mounts of 13 classes drawn in tests/benchmarks/zoo.py.
_POWERS = (0.85, 2.34)
_LESS, _MORE = 0.2, 1.3  # by which the power differs towards smaller loops
_MARGIN = 0.07  # error of what was recorded, share of it
_APART = 0.05  # difference between the energies of two fits that is reported, share of it
# Effects that a loop of a single amplitude is known from by its form alone.
_LIKE_LOOPS = {
    Effect.DELAY: "a delay",
    Effect.VISCOSITY: "viscous damping",
    Effect.PLAY: "play",
    Effect.CURVED_DRIFT: "the relaxation that a curved drift may come from",
}


@dataclass(frozen=True)
class SmallLoops:
    """Energy of loops about mid-range with the share AMPLITUDE of the range.

    Attributes
    ----------
    amplitude : float    [m]
    energy : float       Of the spring, a cycle [J].
    low, high : float    What it may be by the records, whatever the class of the mount [J].
    """

    amplitude: float
    energy: float
    low: float
    high: float

    @property
    def sentence(self) -> str:
        """The figures in words."""
        return (
            f"loops of {1e3 * self.amplitude:.3g} mm take {self.energy:.3g} J a cycle, {self.low:.2g} to "
            f"{self.high:.2g} J if the mount is of another class"
        )


def loop_energy(spring: SpringParameters, period: float | None = None) -> float:
    """Energy of the steady loop of a sine about mid-range with the share AMPLITUDE of the range [J].

    Branches take some by the period of the sine [s], and count as taking none without one.
    """
    energy = sum(_energy_with_derivatives(mechanism)[0] for mechanism in spring.mechanisms)
    amplitude = AMPLITUDE * 0.5 * (spring.displacement_max - spring.displacement_min)
    if period is None:
        return energy
    for branch in spring.branches:
        angle = 2.0 * math.pi * branch.time_constant / period
        energy += math.pi * amplitude**2 * branch.stiffness * angle / (1.0 + angle**2)  # by its loss modulus
    return energy


@lru_cache(maxsize=16)  # the spring found and its rivals are judged more than once
def _energy_with_derivatives(spring: SpringParameters) -> tuple[float, FloatArray]:
    """That of the first mechanism, and its derivatives by kA[1:] and by the logarithms that `JointCovariance` takes."""
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
    rivals: Sequence[SpringParameters],
    smallest: float,
    misfit: float = 0.0,
    doubts: Sequence[str] = (),
    period: float | None = None,
) -> str:
    """What the records leave undecided of that energy, and what would decide it, in words; empty if it is little.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : dict                Content of the model file's field, with the joint covariance.
    rivals : sequence of SpringParameters   Of other fits that are about as good.
    smallest : float                  Amplitude of the smallest loops recorded [m].
    misfit : float                    rms misfit that is not noise [N].
    doubts : sequence of str          Further reasons why the energy of loops that were not recorded is undecided.
    period : float or None            Of a cycle recorded [s].
    """
    energy, (_, derivatives) = loop_energy(spring, period), _energy_with_derivatives(spring)
    reach = AMPLITUDE * (spring.displacement_max - spring.displacement_min)
    void = _VOID * 2.0 * spring.kappa_omega * reach
    parts = []
    joint = JointCovariance.from_uncertainty(spring, uncertainty)
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
    energies = [loop_energy(other) for other in rivals]
    if any(abs(other - energy) > max(_APART * energy, void) for other in energies):
        next_best = rivals[0]
        parts += [
            f"at {100.0 * AMPLITUDE:.0f} % of the amplitude {_in_words([energy], void)} a cycle, equally good fits "
            f"{_in_words(energies, void)}",
            f"the next one has n {next_best.n:.3g}, sigma {next_best.sigma:.3g}, rho {next_best.rho:.3g} 1/m",
        ]
    parts += doubts
    return "; ".join([*parts, _advice(spring, smallest)]) if parts else ""


def small_loops(
    spring: SpringParameters,
    uncertainty: Mapping[str, Any],
    recorded: Sequence[LoopEnergy],
    others: Sequence[float] = (),
    period: float | None = None,
) -> SmallLoops:
    """Energy of small loops, and the range it may have if the mount is of another class than the model.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : mapping                Content of the model file's field; may be empty.
    recorded : sequence of LoopEnergy    The largest amplitude first.
    others : sequence of float           Energies of small loops that the records do not rule out [J].
    period : float or None               Of a cycle recorded [s].
    """
    energy, (_, derivatives) = loop_energy(spring, period), _energy_with_derivatives(spring)
    joint = JointCovariance.from_uncertainty(spring, uncertainty)
    error = 0.0 if joint is None else min(_relative_error(energy, derivatives, joint), 1.0) * energy
    amplitude = AMPLITUDE * 0.5 * (spring.displacement_max - spring.displacement_min)
    possible = [energy - error, energy + error, *others, *_from_recorded(recorded, amplitude)]
    return SmallLoops(amplitude, energy, max(min(possible), 0.0), max(possible))


def _from_recorded(recorded: Sequence[LoopEnergy], amplitude: float) -> list[float]:
    """Least and greatest energy at an amplitude [J] by those recorded, whatever the class of the mount.

    Energies follow powers of the amplitude: 1 for dry friction, 2 for viscous force. Where two were recorded, theirs
    goes on, and rises towards small loops.
    """
    loops = [loop for loop in recorded if loop.measured > 0.0]
    if not loops:
        return []
    near = min(range(len(loops)), key=lambda k: abs(math.log(loops[k].amplitude / amplitude)))
    # Its neighbour on the other side of the amplitude, or the next larger one.
    beyond = near + 1 if loops[near].amplitude > amplitude and near + 1 < len(loops) else near - 1
    if beyond < 0:
        beyond = 1 if len(loops) > 1 else 0
    anchor, other = loops[near], loops[beyond]
    if anchor is other:
        low, high = _POWERS
    else:
        power = math.log(anchor.measured / other.measured) / math.log(anchor.amplitude / other.amplitude)
        power = min(max(power, _POWERS[0]), _POWERS[1])
        low, high = power - _LESS, power + _MORE
    ratio = amplitude / anchor.amplitude
    energies = [anchor.measured * ratio**exponent for exponent in (low, high)]
    margin = _MARGIN + anchor.spread / anchor.measured
    return [min(energies) * max(1.0 - margin, 0.0), max(energies) * (1.0 + margin)]


def rival_springs(alternatives: Sequence[Sequence[Candidate]]) -> list[SpringParameters]:
    """The springs of other fits that are about as good, without those beyond the limits of a spring.

    Parameters
    ----------
    alternatives : sequence of sequences of Candidate   Each with the fit that gave the spring first, and others with
                                                        their criterion by the same count.
    """
    fits = [
        other
        for best, *others in alternatives
        for other in others
        if other.criterion < best.criterion + CLOSE and other.misfit < _AS_GOOD * best.misfit
    ]
    return list(springs_of(fits))


def springs_of(fits: Sequence[Candidate]) -> Iterator[SpringParameters]:
    """The springs of fits, without those beyond the limits of a spring."""
    for fit in fits:
        with suppress(IdentificationError):
            yield spring_of(fit.basis, fit.refinement.backbone, fit.hysteresis, "")


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


def one_amplitude_doubts(
    rig: Rig, state: Corrected, cautions: Sequence[Outcome], intervals: Mapping[str, Any]
) -> list[str]:
    """Why loops of one amplitude do not decide the energy of smaller ones.

    Parameters
    ----------
    rig : Rig
    state : Corrected              The spring that was found.
    cautions : sequence of Outcome
    intervals : mapping            Of the parameters, an open end being None.
    """
    unseen = ["the strokes do not saturate"] if Outcome.NO_STEADY_SECTION in cautions else []
    for name, outcome in (("n", Outcome.N_AT_BOUND), ("sigma", Outcome.SIGMA_AT_BOUND)):
        if outcome in cautions:
            unseen.append(f"{name} ended at its bound")
        elif None in intervals[name]:
            unseen.append(f"{name} is known on one side only")
    doubts = [f"the form of the loop is little known, since {' and '.join(unseen)}"] if unseen else []
    removed = [name for effect, name in _LIKE_LOOPS.items() if effect in state.sizes]
    if removed:
        doubts.append(f"at one amplitude {' and '.join(removed)} can hardly be distinguished from part of the loop")
    if hinted := hinted_effects(rig, state):
        doubts.append(f"there is a trace of {in_words(hinted)}, too weak to be removed")
    return doubts
