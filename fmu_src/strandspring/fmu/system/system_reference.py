"""A short run of a system by the kernel, which its FMU must repeat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import MountedSystemError
from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray
from ...kernel.motion import Histories, MotionFigures
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.parts import BASE
from ...vibration.bodies.rest import rest
from ..related_files import Related, experiment
from .system_block import channel_rows_of
from .system_variables import SystemFmuOptions, base_directions, system_variables

_STEPS, _PARTS = 250, 4  # of co-simulation, and of each of them
_SHARE = 0.1  # of gravity and of weight, that is shaken with


def reference_step(options: SystemFmuOptions) -> float:
    """The step of co-simulation of the reference [s]."""
    return _PARTS * options.step


def reference_run(
    system: MountedSystem, options: SystemFmuOptions
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Inputs and outputs by name, each of shape (K,): constant inputs, whose values at the ends of steps are known.

    Raises
    ------
    MountedSystemError   If the bodies cannot rest, or a spring rests outside its identified range.
    """
    bases = [(-1.0) ** k * _SHARE * STANDARD_GRAVITY for k in range(len(base_directions(system)))]
    forces = [_SHARE * STANDARD_GRAVITY * system.bodies[force.body].mass for force in options.forces]
    inputs = np.tile(np.array([*bases, *forces])[:, None], (1, _STEPS))
    _, motion = expected_motion(system, options, inputs, options.step, _PARTS)
    directions = [
        axis.direction if mount.support == BASE else (0.0, 0.0, 0.0)
        for mount, axis in zip(system.axis_mounts, system.axes, strict=True)
    ]
    reaction = motion.force @ np.array(directions)
    histories = (motion.acceleration, motion.sway, motion.force, motion.displacement, reaction)
    columns = np.hstack([history.reshape(_STEPS + 1, -1) for history in histories])[:-1].T
    table = system_variables(system, options)
    # Without angles and the energy, of which there are no histories.
    names = [v.name for v in table if v.causality == "output" and v.unit not in ("rad", "J")]
    given = [v.name for v in table if v.causality == "input"]
    return dict(zip(given, inputs, strict=True)), dict(zip(names, columns, strict=True))


def expected_motion(
    system: MountedSystem, options: SystemFmuOptions, inputs: FloatArray, step: float, parts: int
) -> tuple[MotionFigures, Histories]:
    """What the kernel gives for inputs that hold over steps of `parts` internal ones of `step` each.

    Parameters
    ----------
    system : MountedSystem
    options : SystemFmuOptions
    inputs : ndarray, shape (C, K)    Of the FMU, over each step of co-simulation.
    step : float                      Internal step [s].
    parts : int

    Returns
    -------
    MotionFigures
    Histories                         A row for each point of communication; sway is from rest.

    Raises
    ------
    MountedSystemError                If the bodies cannot rest, a spring rests outside its identified range, or the
                                      motion diverges.
    """
    motion = system.solver
    start = rest(system, options.omega_start)
    figures, histories = motion.run(
        channel_rows_of(system, options),
        np.repeat(inputs, parts, axis=1),
        step,
        np.array(system.gravity),
        start.coordinates,
        start.omega,
        np.zeros(3),
        stride=parts,
    )
    if figures.steps < inputs.shape[1] * parts:
        raise MountedSystemError(
            f"The motion diverges in the reference run of the FMU after {figures.steps * step:.3g} s; take a smaller "
            "`step`, or mounts whose force does not fall beyond their identified range."
        )
    return figures, replace(histories, sway=histories.sway - histories.sway[0])


def reference_experiment(system: MountedSystem, options: SystemFmuOptions) -> dict[str, Related]:
    """The same as an experiment with its reference result, as related files by name."""
    about = "Constant accelerations of the base and forces, from static equilibrium"
    return experiment("constant inputs", about, reference_step(options), *reference_run(system, options))
