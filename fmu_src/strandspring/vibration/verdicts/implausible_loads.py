"""Loads that are possible but hardly meant: levels and times in another unit, and records with an offset."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, islice

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ..bodies.loads import ChannelKind, LoadCase, Signal
from ..bodies.mounted import MountedSystem
from ..signals.pulses import HeldAcceleration, Pulse
from ..signals.random_signal import RandomVibration
from ..signals.recorded_signal import RecordedSignal
from ..signals.sine_signals import SineDwell, SineSweep
from .implausible_sizes import natural_frequencies

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


def implausible_loads(system: MountedSystem, case: LoadCase) -> Iterator[str]:
    """A sentence for each load of a case that is hardly meant, with what was read and what it may have been."""
    speed = math.hypot(*case.velocity)
    if speed > _SPEED:
        yield f"The fall ends at {speed:.4g} m/s; check the unit of its `height` or `velocity`."
    for channel in case.channels:
        if channel.kind is ChannelKind.BASE_ACCELERATION:
            yield from _acceleration(channel.signal)
        elif channel.kind is ChannelKind.FORCE:
            yield from _force(channel.signal, system.bodies[channel.body].mass)
        elif isinstance(channel.signal, RecordedSignal):
            yield from _turning(channel.signal)
        if isinstance(channel.signal, RecordedSignal):
            yield from _sampling(channel.signal, natural_frequencies(system))


def _acceleration(signal: Signal) -> Iterator[str]:
    """What is hardly meant in a signal of base acceleration."""
    match signal:
        case HeldAcceleration():
            yield from _level("constant acceleration", signal.peak, _AMPLITUDE, "its `level`")
        case Pulse():
            yield from _level("peak", abs(signal.peak), _PEAK)
            yield from _pulse_duration(signal)
            speed = abs(getattr(signal, "velocity_change", 0.0))
            if speed > _SPEED:
                yield (
                    f"The pulse changes the velocity of the base by {speed:.4g} m/s; check the units of `peak` (g or "
                    "m/s^2) and `duration` (ms or s)."
                )
        case RandomVibration():
            level = signal.density.root_mean_square
            yield from _level("rms", level, _AMPLITUDE, "the density (g^2/Hz or (m/s^2)^2/Hz)")
            edges = np.geomspace(signal.density.lowest, signal.density.highest, 200)
            travel = math.sqrt(float(np.sum(signal.density.by_band(edges) / (2.0 * np.pi * edges[:-1]) ** 4)))
            if travel > _TRAVEL:
                yield _travels(3.0 * travel, "the density and its lowest frequency")
        case SineDwell():
            yield from _sine(signal.amplitude, signal.frequency)
        case SineSweep():
            of_points = (_sine(amplitude, frequency) for frequency, amplitude in signal.amplitude.points)
            yield from islice(chain.from_iterable(of_points), 1)
        case RecordedSignal():
            yield from _recorded(signal)


def _sine(amplitude: float, frequency: float) -> Iterator[str]:
    yield from _level("amplitude", amplitude, _AMPLITUDE)
    travel = amplitude / (2.0 * math.pi * frequency) ** 2
    if travel > _TRAVEL:
        yield _travels(travel, f"the amplitude and its frequency of {frequency:.4g} Hz")


def _travels(travel: float, checked: str) -> str:
    return f"The base would move by +-{travel:.3g} m; check the units of {checked}."


def _recorded(signal: RecordedSignal) -> Iterator[str]:
    peak = float(np.abs(signal.value).max())
    yield from _level("peak of the record", peak, _PEAK, "its column (g, m/s^2 or a sensor's mV)")
    offset, duration = float(np.median(signal.value)), signal.duration
    first = float(signal.value[0])
    drift = 0.5 * abs(offset) * duration**2
    if all(abs(abs(value) - STANDARD_GRAVITY) <= _GRAVITY * STANDARD_GRAVITY for value in (offset, first)):
        yield (
            f"The record of base acceleration begins at {_in_g(first)} and has a median of {_in_g(offset)}, as of a "
            "sensor that measures gravity, which acts on the bodies already; subtract it, and check which axis is "
            "vertical."
        )
    elif drift > _DRIFT:
        yield (
            f"The record of base acceleration has an offset (median) of {_in_g(offset)}, which within {duration:.4g} "
            f"s would move the base by {drift:.3g} m; subtract the offset if it is that of a sensor."
        )


def _turning(signal: RecordedSignal) -> Iterator[str]:
    fastest = float(np.abs(signal.value).max())
    if fastest > _SPIN:
        yield f"The base turns at up to {fastest:.4g} rad/s; check the unit of its column, which may be deg/s."
    offset = float(np.median(signal.value))
    turned = abs(offset) * signal.duration
    if turned > 2.0 * math.pi:
        yield (
            f"The angular velocity of the base has an offset (median) of {offset:.3g} rad/s, "
            f"which turns it by {math.degrees(turned):.0f} degrees; subtract the offset if it is that of a sensor."
        )


def _sampling(signal: RecordedSignal, frequencies: tuple[float, ...]) -> Iterator[str]:
    rate = (signal.time.size - 1) / signal.duration
    slowest = min(frequencies, default=math.inf)
    if rate < _SAMPLES * slowest < math.inf:
        yield (
            f"The record is sampled {rate:.4g} times per second and lasts {signal.duration:.4g} s, while the slowest "
            f"natural frequency is {slowest:.3g} Hz; check the unit of its times, which may be ms read as s."
        )
    elif rate > _FASTEST:
        yield (
            f"The record is sampled {rate:.3g} times per second and lasts {signal.duration:.3g} s; check the unit of "
            "its times, which may be s read as ms."
        )


def _force(signal: Signal, mass: float) -> Iterator[str]:
    if isinstance(signal, Pulse):
        yield from _pulse_duration(signal)
    if isinstance(signal, RecordedSignal):
        peak = float(np.abs(signal.value).max())
    else:
        peak = abs(float(getattr(signal, "peak", math.nan)))
    share = peak / (mass * STANDARD_GRAVITY)
    if not math.isnan(share) and not _PUSH[0] <= share <= _PUSH[1]:
        yield (
            f"The force of up to {peak:.4g} N is {share:.3g} times the weight of its body of {mass:.4g} kg; check the "
            "units of both (N or kN, kg or g)."
        )


def _pulse_duration(signal: Pulse) -> Iterator[str]:
    if not _PULSE[0] <= signal.duration <= _PULSE[1]:
        yield f"The pulse lasts {signal.duration:.4g} s; check the unit of `duration`, in which ms and s differ."


def _level(
    what: str, value: float, usual: tuple[float, float], unit_of: str = "its `peak` or amplitude"
) -> Iterator[str]:
    if not usual[0] <= value / STANDARD_GRAVITY <= usual[1]:
        yield (
            f"The {what} is {_in_g(value)} ({value:.4g} m/s^2), outside the usual {usual[0]:g} to {usual[1]:g} g; "
            f"check the unit of {unit_of}."
        )


def _in_g(acceleration: float) -> str:
    return f"{acceleration / STANDARD_GRAVITY:.4g} g"
