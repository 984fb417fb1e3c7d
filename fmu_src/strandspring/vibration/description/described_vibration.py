"""Base accelerations of the tables [[case]] of SYSTEM.toml: pulses, constant levels, vibration, shocks by spectrum."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import singledispatch

from ...errors import MountedSystemError
from ...ground.gravity import STANDARD_GRAVITY
from ..bodies.loads import ChannelKind, LoadChannel, Signal
from ..bodies.parts import Vector
from ..signals.level_table import LevelTable
from ..signals.pulses import HeldAcceleration
from ..signals.random_signal import RandomVibration
from ..signals.shock_spectra import RequiredSpectrum
from ..signals.shock_synthesis import synthesized_shock
from ..signals.sine_signals import SineDwell, SineSweep
from . import quantity_text as q
from .case_tables import (
    DirectedCase,
    HeldCase,
    PulseCase,
    RandomCase,
    RandomTable,
    SineCase,
    SpectrumCase,
    SpectrumTable,
    SweepCase,
    ToneTable,
)
from .described_signals import pulse_of, sweep_amplitude
from .named_files import NamedFiles
from .record_columns import RecordColumn, read_columns
from .table_types import located

AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_STATED = 0.05  # by which a density may differ from the rms that is stated with it


@dataclass(frozen=True)
class Vibration:
    """Base acceleration.

    Parameters
    ----------
    kind : str                     See `LoadCase`.
    signals : tuple of Signal      All along the direction of the case.
    duration : float               [s]
    text : str
    settling : float               [s]
    ends : bool                    Whether the case ends with the load, as its rms or static answer is asked for.
    by_axis : tuple of (str, Signal)   Along axes of their own, instead.
    """

    kind: str
    signals: tuple[Signal, ...]
    duration: float
    text: str
    settling: float = 0.0
    ends: bool = False
    by_axis: tuple[tuple[str, Signal], ...] = ()

    def channels(self, direction: Vector) -> tuple[LoadChannel, ...]:
        """What drives the base along a direction, or along the axes."""
        pairs = [(signal, direction) for signal in self.signals]
        pairs += [(signal, AXES[axis]) for axis, signal in self.by_axis]
        return tuple(LoadChannel(ChannelKind.BASE_ACCELERATION, signal, along) for signal, along in pairs)


@singledispatch
def vibration_of(table: DirectedCase, files: NamedFiles, afterwards: float) -> Vibration:  # noqa: ARG001
    """The base acceleration of a case.

    Parameters
    ----------
    table : DirectedCase
    files : NamedFiles      Those that tables name.
    afterwards : float      Five periods of the slowest vibration [s].

    Raises
    ------
    MountedSystemError      If the keys do not fit together; the message names the field.
    """
    raise TypeError(f"No vibration is made of {type(table).__name__}.")


@vibration_of.register
def _(table: PulseCase, _files: NamedFiles, _afterwards: float) -> Vibration:
    signal, text = pulse_of(table, table.peak, table.velocity, "velocity", STANDARD_GRAVITY, "g")
    return Vibration("pulse", (signal,), table.duration or 0.0, text)


@vibration_of.register
def _(table: HeldCase, _files: NamedFiles, afterwards: float) -> Vibration:
    held = table.acceleration
    rise = 2.0 * afterwards if held.rise is None else held.rise
    duration = rise + afterwards if held.duration is None else held.duration
    with located("acceleration"):
        signal = HeldAcceleration(held.level, duration, rise)
    text = f"constant acceleration of {_in_g(held.level)}, reached within {rise:.4g} s and held up to {duration:.4g} s"
    return Vibration("acceleration", (signal,), duration, text, ends=True)


@vibration_of.register
def _(table: SpectrumCase, _files: NamedFiles, _afterwards: float) -> Vibration:
    srs = table.srs
    with located("srs"):
        required = required_spectrum(srs)
        shock = synthesized_shock(required, srs.duration, srs.seed)
    levels = required.levels
    peak = max(abs(float(shock.value.min())), float(shock.value.max()))
    text = (
        f"shock within {shock.deviation[0]:+.2f} and {shock.deviation[1]:+.2f} dB of a response spectrum from "
        f"{levels.lowest:.6g} to {levels.highest:.6g} Hz at Q = {required.quality:.4g}, synthesized by "
        f"{shock.wavelets} wavelets in {srs.duration:.4g} s with a peak of {_in_g(peak)}"
    )
    return Vibration("srs", (shock,), shock.duration, text)


def required_spectrum(table: SpectrumTable) -> RequiredSpectrum:
    """The spectrum of a table; raises MountedSystemError if its keys do not fit together."""
    if table.q is not None and table.damping is not None:
        raise MountedSystemError("must have either `q` or `damping`, got both; leave one out.")
    if table.damping is not None:
        return RequiredSpectrum(LevelTable(table.levels), 0.5 / table.damping)
    return RequiredSpectrum(LevelTable(table.levels), 10.0 if table.q is None else table.q)


@vibration_of.register
def _(table: SineCase, _files: NamedFiles, _afterwards: float) -> Vibration:
    sine = table.sine
    with located("sine"):
        rate = 2.0 * math.pi * sine.frequency
        if sine.amplitude is not None and sine.displacement is None:
            amplitude = sine.amplitude
        elif sine.displacement is not None and sine.amplitude is None:
            amplitude = rate * rate * sine.displacement
        else:
            raise MountedSystemError("must have either `amplitude` or `displacement`; give one of them.")
        signal = SineDwell(amplitude, sine.frequency, sine.duration, sine.soft_start)
    text = f"sine of {_in_g(amplitude)} at {sine.frequency:.6g} Hz for {sine.duration:.4g} s"
    settling = 0.5 * sine.duration if table.settling is None else table.settling
    return Vibration("sine", (signal,), sine.duration, text, settling, ends=True)


@vibration_of.register
def _(table: SweepCase, _files: NamedFiles, _afterwards: float) -> Vibration:
    sweep = table.sweep
    rate, is_logarithmic = sweep.rate
    with located("sweep"):
        amplitude = sweep_amplitude(sweep)
        if is_logarithmic:
            signal = SineSweep.at_octaves_per_minute(sweep.first, sweep.last, 60.0 * rate, amplitude)
        else:
            signal = SineSweep.at_hertz_per_second(sweep.first, sweep.last, rate, amplitude)
    pace = f"{60.0 * rate:.4g} oct/min" if is_logarithmic else f"{rate:.4g} Hz/s"
    text = f"sine sweep from {sweep.first:.6g} to {sweep.last:.6g} Hz at {pace}"
    return Vibration("sweep", (signal,), signal.duration, text)


@vibration_of.register
def _(table: RandomCase, files: NamedFiles, _afterwards: float) -> Vibration:
    random = table.random
    settling = 0.1 * random.duration if table.settling is None else table.settling
    with located("random"):
        densities = _densities(random, files)
        signals = {
            axis: RandomVibration(density, random.duration, random.seed, number)
            for number, (axis, density) in enumerate(densities.items())
        }
        levels = " and ".join(_with_stated_level(random, axis, density) for axis, density in densities.items())
        lowest = min(density.lowest for density in densities.values())
        highest = max(density.highest for density in densities.values())
        text = f"random vibration of {levels} rms from {lowest:.6g} to {highest:.6g} Hz for {random.duration:.4g} s"
        if "" in signals:
            tones = [_tone(number, tone, random.duration) for number, tone in enumerate(random.sine)]
            text = f"{text}, with sines of {', '.join(words for _, words in tones)}" if tones else text
            return Vibration(
                "random", (signals[""], *(tone for tone, _ in tones)), random.duration, text, settling, ends=True
            )
        if random.sine:
            raise MountedSystemError("`sine` is for random vibration along one direction; give one `psd` for it.")
    return Vibration(
        "random", (), random.duration, f"{text}, uncorrelated", settling, ends=True, by_axis=tuple(signals.items())
    )


def _densities(table: RandomTable, files: NamedFiles) -> dict[str, LevelTable]:
    """The density along each axis; "" for the direction of the case."""
    if (table.psd is None) == (table.file is None):
        raise MountedSystemError("must have either `psd` or `file`; give one of them.")
    if isinstance(table.psd, dict):
        return {axis: LevelTable(points) for axis, points in table.psd.items()}
    if table.psd is not None:
        return {"": LevelTable(table.psd)}
    wanted = {
        "frequency": RecordColumn(1, q.FREQUENCY, "Hz"),
        "density": RecordColumn(2, q.ACCELERATION_DENSITY, table.unit),
    }
    columns = read_columns(files.record(table.file or ""), wanted)
    return {"": LevelTable(tuple(zip(columns["frequency"].tolist(), columns["density"].tolist(), strict=True)))}


def _with_stated_level(table: RandomTable, axis: str, density: LevelTable) -> str:
    """The rms of a density beside the stated one, in words."""
    level = density.root_mean_square
    by_axis: Mapping[str, float] = {}
    if table.grms is not None:
        by_axis = dict(table.grms.items()) if isinstance(table.grms, dict) else {"": table.grms}
    if table.grms is not None and (axis == "") != ("" in by_axis):
        raise MountedSystemError("`grms` must be one level where `psd` is one density, and else a level for each axis.")
    stated = by_axis.get(axis)
    if stated is not None and abs(level - stated) > _STATED * stated:
        raise MountedSystemError(
            f"the density{f' along {axis}' if axis else ''} has {_in_g(level)} rms, and `grms` states {_in_g(stated)}; "
            "correct the density, its units or `grms`."
        )
    words = _in_g(level) if stated is None else f"{_in_g(level)} ({_in_g(stated)} stated)"
    return f"{axis} {words}" if axis else words


def _tone(number: int, table: ToneTable, duration: float) -> tuple[Signal, str]:
    """A sine on random, and it in words."""
    ends = table.first, table.last
    with located("sine", number):
        if table.frequency is not None and ends == (None, None):
            text = f"{_in_g(table.amplitude)} at {table.frequency:.6g} Hz"
            return SineDwell(table.amplitude, table.frequency, duration), text
        if table.frequency is not None or table.first is None or table.last is None:
            raise MountedSystemError("must have either `frequency`, or `first` and `last`; correct the keys.")
        levels = LevelTable(tuple((frequency, table.amplitude) for frequency in sorted((table.first, table.last))))
        text = f"{_in_g(table.amplitude)} from {table.first:.6g} to {table.last:.6g} Hz"
        return SineSweep(table.first, table.last, duration, levels), text


def _in_g(acceleration: float) -> str:
    return f"{acceleration / STANDARD_GRAVITY:.4g} g"
