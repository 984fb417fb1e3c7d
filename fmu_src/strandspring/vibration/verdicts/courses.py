"""Histories of a load case with the spectra of the points, and of the base beside them.

They are of one more run. A shock is run with steps fine enough for a shock response spectrum up to 2 kHz, random
vibration with five steps in a period of its highest frequency, where that takes no more rows than are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from ...errors import MountedSystemError
from ...findings import Finding, Outcome
from ...kernel.arrays import FloatArray
from ...kernel.motion import Histories
from ..bodies.loads import ChannelKind, LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun, run_with_histories
from ..signals.shock_spectra import RequiredSpectrum, ShockSpectrum, octave_frequencies, shock_spectrum
from ..signals.spectra import PowerSpectrum, power_spectrum

_DAMPING = 0.05  # of critical
SRS_PER_OCTAVE, SRS_LOWEST, SRS_HIGHEST = 12, 1.0, 2000.0
_SAMPLES_PER_PERIOD = 10.0  # at the upper end of a shock response spectrum
_OF_RANDOM = 2.5  # samples in half a period of the highest frequency of random vibration
_SEGMENTS = 16.0  # of the history of a power spectrum, before they overlap
_MOST_ROWS, _MOST_NUMBERS = 400_000, 10_000_000  # of histories
_ROUNDING = 1e-9  # of a number of steps

S = TypeVar("S")


@dataclass(frozen=True, eq=False)
class Courses:
    """Histories of a load case and their spectra.

    Attributes
    ----------
    run : CaseRun                           From whose static equilibrium they are.
    step, interval : float                  Of the integration, and of the rows [s].
    histories : Histories
    base : ndarray, shape (K, 3)            Acceleration of the base, averages about each row's time [m/s^2].
    shock : tuple of tuple of ShockSpectrum       Of each point along x, y and z; empty for a vibration.
    base_shock : tuple of ShockSpectrum           Of the base along x, y and z; empty where it is not accelerated.
    power : tuple of tuple of PowerSpectrum       Of each point; empty unless the case is random.
    base_power : tuple of PowerSpectrum
    findings : tuple of Finding              About its spectra.
    allowed : mapping                       Allowed shock response spectra by the name of the point.
    """

    run: CaseRun
    step: float
    interval: float
    histories: Histories
    base: FloatArray
    shock: tuple[tuple[ShockSpectrum, ...], ...] = ()
    base_shock: tuple[ShockSpectrum, ...] = ()
    power: tuple[tuple[PowerSpectrum, ...], ...] = ()
    base_power: tuple[PowerSpectrum, ...] = ()
    findings: tuple[Finding, ...] = ()
    allowed: Mapping[str, RequiredSpectrum] = field(default_factory=dict)

    @property
    def damping(self) -> float:
        """Of the oscillators of shock response spectra, as a share of critical: of allowed spectra, else of Q = 10."""
        return next((required.damping for required in self.allowed.values()), _DAMPING)

    def with_finding(self, kind: Outcome, **numbers: object) -> Courses:
        """The same with one more finding about its spectra."""
        found = Finding(kind, {"interval": self.interval, **numbers})
        return replace(self, findings=(*self.findings, found))

    def spectra(self, spectrum: Callable[[FloatArray], S]) -> tuple[tuple[tuple[S, ...], ...], tuple[S, ...]]:
        """Spectra of the accelerations along x, y and z: of each point, and of the base unless it stands still."""
        of_points = tuple(tuple(map(spectrum, point.T)) for point in self.histories.acceleration.swapaxes(0, 1))
        return of_points, tuple(map(spectrum, self.base.T)) if self.base.any() else ()

    @property
    def size(self) -> int:
        """How many numbers its histories hold."""
        histories = self.histories
        return histories.acceleration.size + histories.sway.size + histories.displacement.size + histories.force.size


def courses(
    system: MountedSystem, case: LoadCase, run: CaseRun, allowed: Mapping[str, RequiredSpectrum] | None = None
) -> Courses:
    """Run a load case once more for its histories, and take its spectra.

    Parameters
    ----------
    system : MountedSystem
    case : LoadCase
    run : CaseRun            Where to begin, and with which step at most.
    allowed : mapping        Shock response spectra by the name of the point, all of one quality factor.
    """
    numbers = 6 * len(system.points) + 2 * len(system.axes)
    most = max(2, min(_MOST_ROWS, _MOST_NUMBERS // max(1, numbers)))
    step, rows = run.step, math.ceil(case.duration / run.step)
    fastest = SRS_HIGHEST * _SAMPLES_PER_PERIOD if case.is_shock else 0.0
    if case.is_random:
        fastest = _OF_RANDOM / min(channel.signal.shortest for channel in case.channels)
    # As many steps for one as the spectrum asks for and the rows allow.
    step /= max(1, min(math.ceil(step * fastest * (1.0 - _ROUNDING)), most // rows))
    histories = run_with_histories(system, case, run.start, step, most)
    interval = step * math.ceil(case.steps(step) / most)
    base = _base_acceleration(case, interval, histories.time.size)
    made = Courses(run, step, interval, histories, base, allowed=allowed or {})
    if interval > step * (1.0 + _ROUNDING):
        made = made.with_finding(Outcome.HISTORIES_THINNED, every=round(interval / step), frequency=0.5 / interval)
    if case.is_shock:
        return _with_shock_spectra(made)
    return _with_power_spectra(made, case) if case.is_random else made


def _base_acceleration(case: LoadCase, interval: float, rows: int) -> FloatArray:
    total = np.zeros((rows, 3))
    for channel in case.channels:
        if channel.kind is ChannelKind.BASE_ACCELERATION:
            # Averages over half intervals, so that each row's is centred on its time.
            halves = np.append(0.0, channel.signal.averages(0.5 * interval, 2 * rows))[: 2 * rows]
            total += 0.5 * (halves[0::2] + halves[1::2])[:, None] * np.array(channel.direction)
    return total


def _with_shock_spectra(motion: Courses) -> Courses:
    highest = min(SRS_HIGHEST, 1.0 / (_SAMPLES_PER_PERIOD * motion.interval))
    if highest <= SRS_LOWEST:
        return motion.with_finding(Outcome.NO_SHOCK_SPECTRA)
    frequency = octave_frequencies(SRS_LOWEST, highest, SRS_PER_OCTAVE)
    shock, base_shock = motion.spectra(
        lambda history: shock_spectrum(history, motion.interval, frequency, motion.damping)
    )
    if highest < SRS_HIGHEST * (1.0 - _ROUNDING):
        motion = motion.with_finding(Outcome.SHOCK_SPECTRA_END, frequency=highest)
    return replace(motion, shock=shock, base_shock=base_shock)


def _with_power_spectra(motion: Courses, case: LoadCase) -> Courses:
    first = math.ceil(case.settling / motion.interval)
    last = min(motion.histories.time.size, math.floor(case.load_end / motion.interval))
    resolution = _SEGMENTS / max((last - first) * motion.interval, motion.interval)
    try:
        power, base_power = motion.spectra(
            lambda history: power_spectrum(history[first:last], motion.interval, resolution)
        )
    except MountedSystemError as problem:
        return motion.with_finding(Outcome.NO_POWER_SPECTRA, reason=str(problem))
    return replace(motion, power=power, base_power=base_power)
