"""The printed numerical errors of runs against true ones, from a run of steps 16 times finer or from the reference."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from mounted_examples import GRAVITY, FloatArray, box, inclined_box, plane_box, three_axes, two_stages, unit
from reference_motion import half_sine, reference_motion
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.run_figures import RunFigures
from strandspring.vibration.bodies.simulation import CheckedRun, run_case, simulate_case
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import CORNERS, HalfSine, StraightPulse
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.signals.recorded_signal import RecordedSignal

SAWTOOTH = CORNERS["terminal-sawtooth"]
# Of the largest true error of its kind: where the term in h^2 all but cancels, the error is smaller and of no order.
LEAST_SHARE = 0.25
# The time of a peak at an edge of a pulse has no error, and these cases have no allowed spectra.
FLOORED = ("acceleration", "sway", "sway_components", "tilt", "force")
KINDS = [field.name for field in fields(RunFigures) if field.name not in ("acceleration_time", "spectra")]


@dataclass(frozen=True)
class Loaded:
    """A system, what drives it, and the coarser of the two steps of the run [s]."""

    system: MountedSystem
    case: LoadCase
    step: float = 1e-4


def of_base(signal: Signal) -> tuple[LoadChannel, ...]:
    return (LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(1.0, 2.0, 3.0)),)


SHOCK = LoadCase("half-sine", "pulse", 0.05, of_base(HalfSine(15.0 * GRAVITY, 0.011)))
RECOIL = LoadChannel(
    ChannelKind.FORCE, StraightPulse(6000.0, 0.006, SAWTOOTH), unit(1.0, 0.0, 0.3), 0, (0.05, 0.02, 0.1)
)  # fmt: skip
FLAT = LevelTable(((10.0, 0.01 * GRAVITY**2), (200.0, 0.01 * GRAVITY**2)))
# Straight between samples that lie on steps, for a base that is shaken and turns under dampers.
TIMES = np.arange(0.0, 0.1, 0.005)
ROUGH = RecordedSignal(TIMES, np.random.default_rng(3).normal(0.0, 1.0, TIMES.size))
TURNING = (
    LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, ROUGH, unit(1.0, -2.0, 1.0)),
    LoadChannel(ChannelKind.BASE_ACCELERATION, ROUGH, unit(1.0, 2.0, 3.0)),
)  # fmt: skip
CASES = {
    "half-sine": Loaded(inclined_box(), SHOCK),
    "half-sine, two stages": Loaded(two_stages(), replace(SHOCK, duration=0.1)),
    "recoil by a terminal sawtooth": Loaded(box(), LoadCase("recoil", "force", 0.05, (RECOIL,))),
    "drop": Loaded(
        inclined_box(), LoadCase("drop", "drop", 0.05, velocity=(1.0, 0.5, -2.0), weightless=True), 5e-5
    ),
    "turning record, dampers": Loaded(
        box(three_axes(damping=150.0)), LoadCase("record", "record", 0.1, TURNING), 5e-5
    ),
    "half-sine, stops": Loaded(plane_box(), replace(SHOCK, duration=0.06)),
    "terminal sawtooth": Loaded(
        inclined_box(),
        LoadCase("sawtooth", "pulse", 0.05, of_base(StraightPulse(15.0 * GRAVITY, 0.011, SAWTOOTH))),
        5e-5,
    ),
    "random": Loaded(
        inclined_box(), LoadCase("random", "random", 1.0, of_base(RandomVibration(FLAT, 1.0, 3)), 0.2), 2.5e-5
    ),
}  # fmt: skip


def ratios(printed: FloatArray, true: FloatArray) -> FloatArray:
    """Printed error over true error where that is among the larger of its kind."""
    larger = true >= LEAST_SHARE * true.max()
    return printed[larger] / true[larger]


def halved(loaded: Loaded) -> CheckedRun:
    return simulate_case(loaded.system, loaded.case, 0.0, loaded.step)


@pytest.mark.parametrize("name", CASES)
def test_printed_error_bounds_the_true_one(name: str) -> None:
    """By three times where the term in h^2 rules: of accelerations, sway, rms, tilt, displacements and so on."""
    loaded, run = CASES[name], halved(CASES[name])
    step = run.step / 16.0
    begin = rest(loaded.system, 0.0, loaded.case.weightless)
    finer = run_case(loaded.system, loaded.case, begin, step).figures
    for kind in KINDS:
        found, right = getattr(run.figures, kind), getattr(finer, kind)
        true = np.abs(found - right)
        assert 0.0 < true.max() < 1e-4 * np.abs(right).max(), kind
        # The finer run has an error of its own, 1/256 of that of the run.
        found_ratios = ratios(getattr(run.errors, kind), true)
        assert found_ratios.min() >= 2.4, kind
        if kind not in FLOORED:
            assert found_ratios.max() <= 3.6, kind


def test_printed_error_of_the_energy_absorbed_against_the_reference() -> None:
    loaded = CASES["half-sine"]
    run = halved(loaded)
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, half_sine(15.0 * GRAVITY, 0.011), unit(1.0, 2.0, 3.0))
    case = LoadCase("half-sine", "pulse", 0.05, (channel,))
    exact = reference_motion(loaded.system, case, np.array([0.0, case.duration]), rtol=1e-9)
    true = np.abs(run.figures.absorbed - exact.absorbed[-1])
    np.testing.assert_allclose(ratios(run.errors.absorbed, true), 3.0, atol=0.6)


def test_steps_divide_the_interval_of_a_record_whose_times_are_rounded() -> None:
    times = np.round(np.arange(103) / 1024.0, 6)
    signal = RecordedSignal(times, np.random.default_rng(3).normal(0.0, 1.0, times.size))
    run = simulate_case(box(), LoadCase("record", "record", 0.1, of_base(signal)))
    steps = times[-1] / (times.size - 1) / run.step
    assert steps == pytest.approx(round(steps), rel=1e-12)
