"""A spring FMU moved by a prescribed displacement, with force and displacement of the same time in every row.

Most co-simulation masters set the input that holds at the start of a step and read outputs at its end. A table of their
results pairs each force with the displacement one step later, which draws a loop that the spring does not have. Here
the displacement at the end of a step is set before the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from ..kernel.path import as_path
from .fmu_spring import FmuSpring

_MODEL_VALUES: Mapping[str, float] = {}
_STEP = 1e-3  # s


@dataclass(frozen=True, eq=False)
class PrescribedMotion:
    """What a spring FMU answers to a displacement path; all of shape (K,), row by row at the same time.

    Attributes
    ----------
    time : ndarray              [s].
    displacement : ndarray      In the coordinates of the FMU [m].
    force : ndarray             Restoring force [N].
    stiffness : ndarray         Tangent in the direction of motion [N/m].
    absorbed_energy : ndarray   Integral of the force over the displacement since the first row [J].
    """

    time: FloatArray
    displacement: FloatArray
    force: FloatArray
    stiffness: FloatArray
    absorbed_energy: FloatArray


def simulate_fmu(
    fmu: Path | str,
    displacement: ArrayLike,
    time: ArrayLike | None = None,
    parameters: Mapping[str, float] = _MODEL_VALUES,
) -> PrescribedMotion:
    """Move a spring FMU of either back end and either version of FMI along a displacement path, by co-simulation.

    Parameters
    ----------
    fmu : path
    displacement : array_like, shape (K,)   In the coordinates of the FMU [m]; the path starts at the first sample.
    time : array_like, shape (K,), optional   Rising [s]; without it 1 ms apart from 0. The force depends on the path
                                            alone, so that time changes no result.
    parameters : mapping of str to float, optional   Values of FMU parameters that replace those of the model, by their
                                            names in the FMU, such as `kE_1`.

    Returns
    -------
    PrescribedMotion

    Raises
    ------
    ValueError          If a displacement is not finite, or `time` does not rise or fit.
    CosimulationError   If the file is not a spring FMU, was built with `states`, cannot be run on this computer,
                        or refuses a parameter.

    Warns
    -----
    UserWarning         If the displacement leaves the identified range, where the force is extrapolated, by more than
                        1 % of it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, simulate_fmu
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> with TemporaryDirectory() as folder:
    ...     motion = simulate_fmu(spring.build_fmu(folder), [0.0, 0.01, 0.0])
    >>> motion.force.round(3).tolist() == spring.response([0.0, 0.01, 0.0]).round(3).tolist()
    True
    """
    path = as_path(displacement).copy()
    times = _rising(_STEP * np.arange(path.size) if time is None else time, path.size)
    with FmuSpring(fmu, parameters=parameters) as spring:
        responses = [spring.start(float(path[0]), float(times[0]))]
        steps = zip(times[:-1].tolist(), np.diff(times).tolist(), path[1:].tolist(), strict=True)
        responses += [spring.commit(*step) for step in steps]
        spring.warn_outside(stacklevel=2)
    force, energy, stiffness = np.array(responses).T
    return PrescribedMotion(times, path, force, stiffness, energy)


def _rising(time: ArrayLike, samples: int) -> FloatArray:
    """Check times for so many samples."""
    times = np.array(time, dtype=float)
    if times.shape != (samples,):
        raise ValueError(f"`time` must have the shape ({samples},) of `displacement`, got {times.shape}.")
    if not np.isfinite(times).all():
        raise ValueError("`time` must be finite [s].")
    falling = np.flatnonzero(np.diff(times) <= 0.0)
    if falling.size:
        k = int(falling[0])
        raise ValueError(f"`time` must rise [s], got {times[k + 1]} after {times[k]} at index {k + 1}.")
    return times
