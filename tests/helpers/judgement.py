"""Whether an identified spring is right: its small loops and its force on minor loops against the noise-free truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig import Case, FloatArray
from strandspring import Spring

SAMPLES = 2000  # a cycle, of the paths that are judged
WRONG_ENERGY = 0.10  # of loops at 30 % of the amplitude
WRONG_FORCE = 0.05  # share of the force's standard deviation on minor loops
SMALL_LOOP = 0.3


class Responds(Protocol):
    def response(self, displacement: FloatArray) -> FloatArray: ...


@dataclass(frozen=True)
class AtRate:
    """A spring, which may have branches, driven at so many cycles of large amplitude a second."""

    spring: Spring
    rate: float

    def response(self, displacement: FloatArray) -> FloatArray:
        times = np.arange(displacement.size) / (SAMPLES * self.rate)
        return self.spring.response(displacement, time=times if self.spring.parameters.branches else None)


@dataclass(frozen=True)
class Judgement:
    """Errors of an identified spring against the truth.

    Attributes
    ----------
    energy : float   Relative error of the energy of the steady loop at 30 % of the amplitude, with its sign.
    force : float    rms error on minor loops, means removed, as a share of the force's standard deviation.
    """

    energy: float
    force: float

    @property
    def wrong(self) -> bool:
        return not (abs(self.energy) <= WRONG_ENERGY and self.force <= WRONG_FORCE)

    @property
    def excess(self) -> float:
        """The larger error in units of what is allowed."""
        return max(abs(self.energy) / WRONG_ENERGY, self.force / WRONG_FORCE)


def judge(truth: Responds, identified: Responds, amplitude: float, centre: float) -> Judgement:
    """Compare a spring with the truth about the centre of the programme, offsets of the force left aside."""
    cycles, points = 10, SAMPLES
    small = centre + SMALL_LOOP * amplitude * np.sin(2.0 * np.pi * np.arange(cycles * points + 1) / points)
    last = slice(-points - 1, None)
    energies = [float(np.trapezoid(s.response(small)[last], small[last])) for s in (truth, identified)]
    minor, judged = minor_loops(amplitude, centre)
    forces = [s.response(minor)[judged] for s in (truth, identified)]
    error = float(np.std(forces[1] - forces[0]) / np.std(forces[0]))
    return Judgement(energies[1] / energies[0] - 1.0, error)


def minor_loops(amplitude: float, centre: float) -> tuple[FloatArray, slice]:
    """A path with a full cycle that sets the memory and nested minor loops, and which part of it these are."""
    phase = np.linspace(0.0, 6.0 * np.pi, 3 * SAMPLES + 1)
    full = 0.9 * np.sin(phase[:SAMPLES])
    nested = 0.55 * np.sin(phase) + 0.35 * np.sin(4.6 * phase)
    return centre + amplitude * np.concatenate([full, nested]), slice(full.size, None)


def judge_case(case: Case, identified: Responds | Spring) -> Judgement:
    """The judgement at the rate of the records by that of the right springs which comes closest."""
    if isinstance(identified, Spring):
        identified = AtRate(identified, 1.0 / case.experiment.period)
    return min(
        (judge(truth, identified, case.amplitude, case.centre + truth.shift) for truth in case.truths),
        key=lambda judgement: judgement.excess,
    )
