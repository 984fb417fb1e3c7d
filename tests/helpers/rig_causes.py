"""What happens on rigs that no effect of the identification describes; each is a fault of the simulated rig."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import butter, sosfiltfilt

from rig import Case, Fault, Generator, Run, draw_experiment, draw_spring, simulate

PER_CYCLE = 400  # samples in a cycle by default


def drawn_case(fault: Fault, seed: int, index: int, per_cycle: int = PER_CYCLE, **fixed: Any) -> Case:
    """Records of a drawn spring and experiment with such a fault, of its large size."""
    generator = np.random.default_rng([seed, index])
    spring, experiment = draw_spring(generator), draw_experiment(generator, **fixed)
    experiment = fault.programme(experiment, fault.large)
    experiment = replace(experiment, samples=per_cycle * sum(experiment.cycles))
    return simulate(spring, experiment, generator, replace(fault, programme=lambda given, _: given), "large")


def band_limited(harmonic: float, order: int = 4) -> Fault:
    """Both columns through a Butterworth filter forth and back, its cutoff so many times the test's frequency."""

    def act(run: Run, size: float, _: Generator) -> None:
        interval = run.step * run.stride
        sections = butter(order, size * run.experiment.frequency, fs=1.0 / interval, output="sos")
        for row in (1, 2):
            run.samples[row] = sosfiltfilt(sections, run.samples[row])

    return Fault(harmonic, harmonic, "times the frequency", ("band", "filter"), sampled=act)
