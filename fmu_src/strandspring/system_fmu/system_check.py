"""Whether the FMU of a system is valid and moves as the kernel does: validated, then run through FMPy."""

from __future__ import annotations

import time
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
from fmpy.validation import validate_fmu

from ..errors import BuildError
from ..fmu.check import FORCE_TOLERANCE, CheckReport, running, why_not_here
from ..kernel.arrays import FloatArray
from ..kernel.motion import MotionFigures
from ..systems.mounted import STANDARD_GRAVITY, MountedSystem
from ..systems.rest import rest
from ..systems.solving import solver
from .system_block import channel_rows_of
from .system_variables import SystemFmuOptions, base_directions

_STEPS, _PARTS = 250, 4  # of co-simulation, and of each of them
_SHARE = 0.1  # of gravity and of weight, that is shaken with
# Of the largest of each kind; both come from one source and differ by rounding.
_KINDS = ("accelerations", "sway", "forces", "displacements")


def check_system_fmu(path: Path, system: MountedSystem, options: SystemFmuOptions) -> CheckReport:
    """Validate the FMU of a system and compare a short run with the kernel.

    Raises
    ------
    BuildError   If there are problems; the text lists them.
    """
    report = examine_system_fmu(path, system, options)
    if report.problems:
        raise BuildError(f"{path} must not be used: {report.summary}")
    return report


def examine_system_fmu(path: Path, system: MountedSystem, options: SystemFmuOptions) -> CheckReport:
    """The same, with the problems in the report."""
    try:
        problems = tuple(str(problem).strip() for problem in validate_fmu(str(path)))
    except (OSError, zipfile.BadZipFile) as problem:
        problems = (f"It cannot be read: {problem}.",)
    if problems:
        return CheckReport(path, problems, "an invalid FMU is not run")
    not_run = why_not_here(path)
    if not_run:
        return CheckReport(path, (), not_run)
    inputs = _inputs(system, options)
    expected = expected_motion(system, options, inputs, options.step, _PARTS)
    try:
        found, seconds = _run(path, system, options, inputs)
    except Exception as problem:  # FMPy raises plain exceptions
        return CheckReport(path, (f"It cannot be run: {problem}",))
    differences = {}
    for kind in _KINDS:
        reference = getattr(expected, kind)
        largest = np.abs(reference).max(initial=0.0)
        difference = np.abs(found[kind] - reference).max(initial=0.0)
        differences[kind] = float(difference)
        # Written so that NaN is a problem.
        if not difference <= FORCE_TOLERANCE * largest:
            problems += (
                f"Its {kind} must be those of the kernel, but differ by up to {difference:.3g} of {largest:.3g}.",
            )
    return CheckReport(path, problems, None, ("co-simulation",), _STEPS, differences["forces"], seconds)


def expected_motion(
    system: MountedSystem, options: SystemFmuOptions, inputs: FloatArray, step: float, parts: int
) -> MotionFigures:
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
    MotionFigures                     With a row of its histories for each point of communication; sway is from rest.

    Raises
    ------
    MountedSystemError                If the bodies cannot rest, or a spring rests outside its identified range.
    """
    motion = solver(system)
    start = rest(system, options.omega_start, solve=motion)
    figures = motion.run(
        channel_rows_of(system, options),
        np.repeat(inputs, parts, axis=1),
        step,
        np.array(system.gravity),
        start.pose,
        start.omega,
        np.zeros(3),
        stride=parts,
        histories=True,
    )
    sway = np.asarray(figures.sway)
    return replace(figures, sway=sway - sway[0])


def _inputs(system: MountedSystem, options: SystemFmuOptions) -> FloatArray:
    """Constant accelerations and forces, so that their values at the ends of steps are known, shape (C, K)."""
    bases = [(-1.0) ** k * _SHARE * STANDARD_GRAVITY for k in range(len(base_directions(system)))]
    forces = [_SHARE * STANDARD_GRAVITY * system.bodies[force.body].mass for force in options.forces]
    return np.tile(np.array([*bases, *forces])[:, None], (1, _STEPS))


def _run(
    path: Path, system: MountedSystem, options: SystemFmuOptions, inputs: FloatArray
) -> tuple[dict[str, FloatArray], float]:
    """Histories by kind, and the time that the steps took [s]."""
    described = fmpy.read_model_description(str(path)).modelVariables
    given = [v.valueReference for v in described if v.causality == "input"]
    outputs = [v.valueReference for v in described if v.causality == "output"]
    size = _PARTS * options.step
    with running(path) as slave:
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.setReal(given, inputs[:, 0].tolist())
        slave.exitInitializationMode()
        rows = [slave.getReal(outputs)]
        began = time.perf_counter()
        for k, values in enumerate(inputs.T.tolist()):
            slave.setReal(given, values)
            slave.doStep(k * size, size)
            rows.append(slave.getReal(outputs))
        seconds = time.perf_counter() - began
        slave.terminate()
    points, axes = len(system.points), sum(len(mount.axes) for mount in system.mounts)
    table = np.array(rows)
    ends = np.cumsum([3 * points, 3 * points, axes, axes])
    accelerations, sway, forces, displacements, _ = np.split(table, ends, axis=1)
    return {
        "accelerations": accelerations.reshape(-1, points, 3),
        "sway": sway.reshape(-1, points, 3),
        "forces": forces,
        "displacements": displacements,
    }, seconds
