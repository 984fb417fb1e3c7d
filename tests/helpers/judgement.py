"""Whether an identified spring is right: its small loops and its force on minor loops against the noise-free truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig import Case, FloatArray
from strandspring import Spring

SAMPLES = 2000  # a cycle, of the paths that are judged
WRONG_ENERGY = 0.10  # of loops at 30 % of the amplitude
WRONG_FORCE = 0.05  # share of the force's standard deviation on minor loops
SMALL_LOOP = 0.3


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
    def excess(self) -> float:
        """The larger error in units of what is allowed."""
        return max(abs(self.energy) / WRONG_ENERGY, self.force / WRONG_FORCE)

    @property
    def wrong(self) -> bool:
        return not self.excess <= 1.0


def minor_loops(amplitude: float, centre: float) -> tuple[FloatArray, slice]:
    """A path with a full cycle that sets the memory and nested minor loops, and which part of it these are."""
    phase = np.linspace(0.0, 6.0 * np.pi, 3 * SAMPLES + 1)
    full = 0.9 * np.sin(phase[:SAMPLES])
    nested = 0.55 * np.sin(phase) + 0.35 * np.sin(4.6 * phase)
    return centre + amplitude * np.concatenate([full, nested]), slice(full.size, None)


def judge_case(case: Case, identified: Spring) -> Judgement:
    """The judgement by that of the right springs which comes closest, at the rate of the records.

    Loops lie about the centre of the programme, and offsets of the force are left aside.
    """
    rate = 1.0 / case.experiment.period

    def force(path: FloatArray) -> FloatArray:
        times = np.arange(path.size) / (SAMPLES * rate)
        return identified.response(path, time=times if identified.parameters.branches else None)

    judgements = []
    for truth in case.truths:
        centre = case.centre + truth.shift
        small = centre + SMALL_LOOP * case.amplitude * np.sin(2.0 * np.pi * np.arange(10 * SAMPLES + 1) / SAMPLES)
        last = slice(-SAMPLES - 1, None)
        energies = [float(np.trapezoid(of(small)[last], small[last])) for of in (truth.response, force)]
        minor, judged = minor_loops(case.amplitude, centre)
        true, predicted = (of(minor)[judged] for of in (truth.response, force))
        error = float(np.std(predicted - true) / np.std(true))
        judgements.append(Judgement(energies[1] / energies[0] - 1.0, error))
    return min(judgements, key=lambda judgement: judgement.excess)
