"""What happens on rigs that no effect of the identification describes; each is a fault of the simulated rig."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from rig import Case, Experiment, Fault, Generator, Run, draw_experiment, draw_spring, simulate
from strandspring import Record, SpringParameters

PER_CYCLE = 400  # samples in a cycle by default


def drawn_case(fault: Fault, seed: int, index: int, per_cycle: int = PER_CYCLE, **fixed: Any) -> Case:
    """Records of a drawn spring and experiment with such a fault, of its large size."""
    generator = np.random.default_rng([seed, index])
    spring, experiment = draw_spring(generator), draw_experiment(generator, **fixed)
    experiment = fault.programme(experiment, fault.large)
    experiment = replace(experiment, samples=per_cycle * sum(experiment.cycles))
    return simulate(spring, experiment, generator, replace(fault, programme=lambda given, _: given), "large")


def at_frequencies(
    generator: Generator,
    frequencies: Sequence[float],
    fault: Callable[[int, float], Fault],
    amplitudes: tuple[float, ...] = (1.0,),
    shape: Literal["sine", "triangle"] = "sine",
) -> tuple[SpringParameters, tuple[Record, ...]]:
    """A drawn spring and a record of it at each frequency [Hz], with faults of the record's number and frequency."""
    spring = draw_spring(generator)
    records = []
    for k, frequency in enumerate(frequencies):
        experiment = Experiment(
            shape, amplitudes, (3,) * len(amplitudes), frequency=frequency, samples=900 * len(amplitudes)
        )
        case = simulate(spring, experiment, generator, fault(k, frequency), "large")
        records += [replace(record, path=f"record_{k + 1}.csv") for record in case.records]
    return spring, tuple(records)


def less_friction(share: float, record: int) -> Callable[[int, float], Fault]:
    """The hysteretic force of one record is lower by this share."""

    def of(k: int, _: float) -> Fault:
        def act(run: Run, size: float, _: Generator) -> None:
            run.hysteretic = run.hysteretic * (1.0 - size)

        return Fault(share, share if k == record else 0.0, "of the friction", ("differ",), force=act)

    return of


def moving_mass(share: float, highest: float) -> Callable[[int, float], Fault]:
    """The inertia of a mass in sine tests, this share of the elastic force at the highest frequency [Hz]."""

    def of(_: int, frequency: float) -> Fault:
        def act(run: Run, size: float, _: Generator) -> None:
            x = run.path - run.truth.spring.displacement_offset
            run.force = run.force - size * (frequency / highest) ** 2 * run.elastic_scale * x / run.amplitude

        return Fault(share, share, "of the elastic force", ("mass",), signals=act)

    return of


def rubber(share: float) -> Callable[[int, float], Fault]:
    """Five Maxwell elements from 0.01 to 3 s, each with this share of the elastic stiffness."""

    def act(run: Run, size: float, _: Generator) -> None:
        from scipy.signal import lfilter

        moved = np.diff(run.path, prepend=run.path[0]) * size * run.elastic_scale / run.amplitude
        for time in (3.0, 0.8, 0.2, 0.05, 0.0125):
            keep = np.exp(-run.step / time)
            run.force = run.force + lfilter([keep], [1.0, -keep], moved)

    return lambda _, __: Fault(share, share, "of the stiffness", ("frequency",), signals=act)


def lagging(delay: float) -> Callable[[int, float], Fault]:
    """The force lags by so many seconds at every frequency."""

    def act(run: Run, size: float, _: Generator) -> None:
        run.force = np.interp(run.time - size, run.time, run.force)

    return lambda _, __: Fault(delay, delay, "s", ("delay",), signals=act)


def wearing(share: float, records: int, stiffness: bool = False) -> Callable[[int, float], Fault]:
    """Friction or stiffness that is lost at a constant rate over all records."""

    def of(k: int, _: float) -> Fault:
        def act(run: Run, size: float, _: Generator) -> None:
            left = 1.0 - size * (k + run.cycle / sum(run.experiment.cycles)) / records
            if stiffness:
                at_rest = run.truth.spring.kE[0]
                run.elastic = at_rest + (run.elastic - at_rest) * left
            else:
                run.hysteretic = run.hysteretic * left

        return Fault(share, share, "of it", ("wear",), force=act)

    return of


def humming(harmonic: float, share: float = 0.02, phase: float = 1.0) -> Fault:
    """A sinusoid at a multiple of the test's frequency, its rms this share of the force's deviation."""

    def act(run: Run, size: float, _: Generator) -> None:
        angle = 2.0 * np.pi * harmonic * run.experiment.frequency * run.time + phase
        run.force = run.force + size * np.sqrt(2.0) * float(np.std(run.force)) * np.sin(angle)

    return Fault(share, share, "of the force's deviation", ("hum",), signals=act)


def gapped(share: float) -> Fault:
    """A gap about the middle, this share of the amplitude wide, in which the spring does not move."""

    def act(run: Run, size: float, _: Generator) -> None:
        half, centre = 0.5 * size * run.amplitude, run.truth.spring.displacement_offset
        y = run.measured - centre
        run.path = centre + np.sign(y) * np.maximum(np.abs(y) - half, 0.0)

    return Fault(share, share, "of the amplitude", ("gap", "backlash"), motion=act)
