"""Pulses and amplitudes of sweeps as the tables [[case]] of SYSTEM.toml give them."""

from __future__ import annotations

import math
from collections.abc import Callable

from ...errors import MountedSystemError
from ..bodies.loads import Signal
from ..signals.level_table import LevelTable, displacement_limited
from ..signals.pulses import CORNERS, HalfSine, StraightPulse, VelocityStep, VersedSine, trapezoid
from .case_tables import ForceTableOfCase, PulseCase, SweepTable

_SMOOTH: dict[str, Callable[[float, float], Signal]] = {"half-sine": HalfSine, "versed-sine": VersedSine}
_DEFAULT_RAMP = 0.1  # rise and fall of a trapezoid, shares of its duration


def pulse_of(
    table: PulseCase | ForceTableOfCase,
    peak: float | None,
    step: float | None,
    step_name: str,
    unit: float,
    unit_name: str,
) -> tuple[Signal, str]:
    """A pulse of one of the classical shapes, and it in words.

    Parameters
    ----------
    table : PulseCase or ForceTableOfCase
    peak : float or None         Largest value, in SI units.
    step : float or None         What a velocity step has instead, in SI units.
    step_name : str              Its key.
    unit, unit_name              Of the peak in the words.

    Raises
    ------
    MountedSystemError           If the keys do not fit together.
    """
    ramps = (table.rise, table.fall)
    if table.pulse == "velocity-step":
        if step is None or any(value is not None for value in (peak, table.duration, *ramps)):
            raise MountedSystemError(
                f"a velocity step has `{step_name}` and neither peak nor duration; correct the keys."
            )
        return VelocityStep(step), f"velocity step, {step_name} {step:.6g} {'N s' if step_name == 'impulse' else 'm/s'}"
    if peak is None or table.duration is None or step is not None:
        raise MountedSystemError(
            f"a pulse has `peak` and `duration`, and only a velocity step has `{step_name}`; correct the keys."
        )
    text = f"{table.pulse} of {peak / unit:.6g} {unit_name}, {1e3 * table.duration:.6g} ms"
    if table.pulse == "trapezoid":
        rise, fall = (_DEFAULT_RAMP * table.duration if ramp is None else ramp for ramp in ramps)
        return trapezoid(peak, table.duration, rise, fall), text
    if any(ramp is not None for ramp in ramps):
        raise MountedSystemError("only a trapezoid has `rise` and `fall`; leave them out.")
    shape = table.pulse or ""
    if shape in _SMOOTH:
        return _SMOOTH[shape](peak, table.duration), text
    return StraightPulse(peak, table.duration, CORNERS[shape]), text


def sweep_amplitude(table: SweepTable) -> LevelTable:
    """Amplitude of a sweep over frequency [m/s^2].

    Raises
    ------
    MountedSystemError   If its keys do not fit together.
    """
    low, high = sorted((table.first, table.last))
    if table.table is not None:
        if table.amplitude is not None or table.displacement is not None:
            raise MountedSystemError("has a `table` of amplitudes, so `amplitude` and `displacement` must be left out.")
        return LevelTable(table.table)
    if not low < high:
        raise MountedSystemError(f"must go from one frequency to another, got {low:g} Hz for both; use `sine`.")
    if table.amplitude is not None and table.displacement is not None:
        return displacement_limited(table.displacement, table.amplitude, low, high)
    if table.amplitude is not None:
        return LevelTable(((low, table.amplitude), (high, table.amplitude)))
    if table.displacement is None:
        raise MountedSystemError("must have `amplitude`, `displacement` or both, or a `table`; give one.")
    a, b = ((2.0 * math.pi * frequency) ** 2 * table.displacement for frequency in (low, high))
    return LevelTable(((low, a), (high, b)))
