"""Loads that are possible but hardly meant: levels and times in another unit, and records with an offset."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, islice

import numpy as np

from ...findings import Finding, Outcome
from ...ground.gravity import STANDARD_GRAVITY
from ..bodies.loads import ChannelKind, LoadCase, Signal
from ..bodies.mounted import MountedSystem
from ..signals.pulses import HeldAcceleration, Pulse
from ..signals.random_signal import RandomVibration
from ..signals.recorded_signal import RecordedSignal
from ..signals.sine_signals import SineDwell, SineSweep
from .implausible_values import natural_frequencies

_PEAK = (0.05, 2000.0)  # [g] of a shock
_SPEED = 30.0  # [m/s] that a shock gives
_PULSE = (2e-5, 1.0)  # [s] that a shock lasts
_AMPLITUDE = (1e-3, 100.0)  # [g] of a vibration, peak or rms
_TRAVEL = 0.5  # [m] of the base in a vibration
_SAMPLES = 4.0  # in a period of the slowest natural frequency, below which a record misses the vibration
_FASTEST = 5e5  # [Hz] at which records are sampled
_SPIN = 50.0  # [rad/s] of a base
_DRIFT = 1.0  # [m] that an offset moves the base
_GRAVITY = 0.15  # by which a sensor that measures gravity is off, as a share
_PUSH = (1e-3, 2000.0)  # [g] that a force gives to its body
_PERIODS = 10.0  # of the slowest vibration, below which the rms of random vibration depends on chance


def implausible_loads(system: MountedSystem, case: LoadCase) -> Iterator[Finding]:
    """Loads of a case that are hardly meant, with what was read."""
    speed = math.hypot(*case.velocity)
    if speed > _SPEED:
        yield Finding(Outcome.FALL_SPEED, {"speed": speed})
    for channel in case.channels:
        if channel.kind is ChannelKind.BASE_ACCELERATION:
            yield from _acceleration(channel.signal)
        elif channel.kind is ChannelKind.FORCE:
            yield from _force(channel.signal, system.bodies[channel.body].mass)
        elif isinstance(channel.signal, RecordedSignal):
            yield from _turning(channel.signal)
        if isinstance(channel.signal, RecordedSignal):
            yield from _sampling(channel.signal, natural_frequencies(system))
    yield from _short(system, case)
    if np.dot(case.velocity, system.gravity) < 0.0:
        yield Finding(Outcome.FALL_UPWARD)


def _acceleration(signal: Signal) -> Iterator[Finding]:
    """What is hardly meant in a signal of base acceleration."""
    match signal:
        case HeldAcceleration():
            yield from _level("constant acceleration", signal.peak, _AMPLITUDE, "its level")
        case Pulse():
            yield from _level("peak", abs(signal.peak), _PEAK)
            yield from _pulse_duration(signal)
            speed = abs(getattr(signal, "velocity_change", 0.0))
            if speed > _SPEED:
                yield Finding(Outcome.PULSE_SPEED, {"speed": speed})
        case RandomVibration():
            level = signal.density.root_mean_square
            yield from _level("rms", level, _AMPLITUDE, "the density (g^2/Hz or (m/s^2)^2/Hz)")
            edges = np.geomspace(signal.density.lowest, signal.density.highest, 200)
            travel = math.sqrt(float(np.sum(signal.density.by_band(edges) / (2.0 * np.pi * edges[:-1]) ** 4)))
            if travel > _TRAVEL:
                yield _travels("density", 3.0 * travel, signal.density.lowest)
        case SineDwell():
            yield from _sine(signal.amplitude, signal.frequency)
        case SineSweep():
            of_points = (_sine(amplitude, frequency) for frequency, amplitude in signal.amplitude.points)
            yield from islice(chain.from_iterable(of_points), 1)
        case RecordedSignal():
            yield from _recorded(signal)


def _sine(amplitude: float, frequency: float) -> Iterator[Finding]:
    yield from _level("amplitude", amplitude, _AMPLITUDE)
    travel = amplitude / (2.0 * math.pi * frequency) ** 2
    if travel > _TRAVEL:
        yield _travels("amplitude", travel, frequency)


def _travels(quantity: str, travel: float, frequency: float) -> Finding:
    return Finding(Outcome.BASE_TRAVEL, {"quantity": quantity, "travel": travel, "frequency": frequency})


def _recorded(signal: RecordedSignal) -> Iterator[Finding]:
    peak = float(np.abs(signal.value).max())
    yield from _level("peak of the record", peak, _PEAK, "its column (g, m/s^2 or a sensor's mV)")
    offset, duration = float(np.median(signal.value)), signal.duration
    first = float(signal.value[0])
    drift = 0.5 * abs(offset) * duration**2
    if all(abs(abs(value) - STANDARD_GRAVITY) <= _GRAVITY * STANDARD_GRAVITY for value in (offset, first)):
        yield Finding(Outcome.GRAVITY_RECORDED, {"first": first, "median": offset})
    elif drift > _DRIFT:
        yield Finding(Outcome.BASE_OFFSET, {"median": offset, "duration": duration, "drift": drift})


def _turning(signal: RecordedSignal) -> Iterator[Finding]:
    fastest = float(np.abs(signal.value).max())
    if fastest > _SPIN:
        yield Finding(Outcome.BASE_TURNS, {"rate": fastest})
    offset = float(np.median(signal.value))
    turned = abs(offset) * signal.duration
    if turned > 2.0 * math.pi:
        yield Finding(Outcome.TURNING_OFFSET, {"median": offset, "angle": turned})


def _sampling(signal: RecordedSignal, frequencies: tuple[float, ...]) -> Iterator[Finding]:
    numbers = {"rate": (signal.time.size - 1) / signal.duration, "duration": signal.duration}
    slowest = min(frequencies, default=math.inf)
    if numbers["rate"] < _SAMPLES * slowest < math.inf:
        yield Finding(Outcome.SAMPLED_SLOWLY, {**numbers, "frequency": slowest})
    elif numbers["rate"] > _FASTEST:
        yield Finding(Outcome.SAMPLED_FAST, numbers)


def _force(signal: Signal, mass: float) -> Iterator[Finding]:
    if isinstance(signal, Pulse):
        yield from _pulse_duration(signal)
    if isinstance(signal, RecordedSignal):
        peak = float(np.abs(signal.value).max())
    else:
        peak = abs(float(getattr(signal, "peak", math.nan)))
    share = peak / (mass * STANDARD_GRAVITY)
    if not math.isnan(share) and not _PUSH[0] <= share <= _PUSH[1]:
        yield Finding(Outcome.PUSH, {"force": peak, "share": share, "mass": mass})


def _pulse_duration(signal: Pulse) -> Iterator[Finding]:
    if not _PULSE[0] <= signal.duration <= _PULSE[1]:
        yield Finding(Outcome.PULSE_DURATION, {"duration": signal.duration})


def _level(
    what: str, value: float, usual: tuple[float, float], key: str = "its peak or amplitude"
) -> Iterator[Finding]:
    low, high = (STANDARD_GRAVITY * end for end in usual)
    if not low <= value <= high:
        yield Finding(Outcome.LEVEL, {"quantity": what, "level": value, "usual": ((low, high),), "key": key})


def _short(system: MountedSystem, case: LoadCase) -> Iterator[Finding]:
    """The duration of random vibration against the slowest natural vibration."""
    taken = case.duration - case.settling
    periods = taken * min(natural_frequencies(system), default=np.inf)
    if case.is_random and periods < _PERIODS:
        yield Finding(Outcome.SHORT_RANDOM, {"duration": taken, "periods": periods, "factor": _PERIODS / periods})
