"""Shock response spectra of points beside those that are allowed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun, run_with_histories
from ..signals.shock_spectra import RequiredSpectrum, shock_spectrum

_SAMPLES_PER_PERIOD = 10.0  # at the upper end of a spectrum
_PER_OCTAVE = 12
_MOST_ROWS = 2_000_000  # of histories


def spectrum_shares(
    spectra: Mapping[str, RequiredSpectrum], system: MountedSystem, case: LoadCase, run: CaseRun, coarser: float = 1.0
) -> FloatArray:
    """Of each point with an allowed spectrum the largest share of it that the spectrum of its acceleration takes, over
    all frequencies of the former and along x, y and z, shape (P,).

    Parameters
    ----------
    spectra : mapping     Allowed ones, by the name of the point.
    system : MountedSystem
    case : LoadCase
    run : CaseRun         From which static equilibrium, and with which step at most.
    coarser : float       Factor of the step.

    Raises
    ------
    MountedSystemError    If that takes too many steps, or the motion diverges.
    """
    if not spectra:
        return np.empty(0)
    highest = max(required.levels.highest for required in spectra.values())
    step = coarser * min(run.step, 1.0 / (_SAMPLES_PER_PERIOD * highest))
    rows = case.steps(step)
    if rows > _MOST_ROWS:
        raise MountedSystemError(
            f"{case.name}: its shock response spectra up to {highest:g} Hz would take {rows:,} steps, more than "
            f"{_MOST_ROWS:,}; shorten the case, or end the limit `srs` at a lower frequency."
        )
    histories = run_with_histories(system, case, run.start, step, rows)
    numbers = {point.name: number for number, point in enumerate(system.points)}
    shares = []
    for name, required in spectra.items():
        frequency = required.frequencies(_PER_OCTAVE)
        along = histories.acceleration[:, numbers[name]].T
        found = [shock_spectrum(axis, step, frequency, required.damping).maximax for axis in along]
        shares.append(float((np.max(found, axis=0) / required.at(frequency)).max()))
    return np.array(shares)
