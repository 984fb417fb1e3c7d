"""Whether a built FMU is valid and answers as the model does: validated, then run through FMPy."""

from __future__ import annotations

import ctypes
import platform
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import fmpy
import numpy as np
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from ...core.branch_variables import SECOND
from ...core.parameters import SpringParameters
from ...core.variables import spring_parameters
from ...errors import BuildError
from ...ground.endings import kept_endings
from ...ground.scratch import TemporaryFolder
from ...kernel.arrays import FloatArray
from ...kernel.branches import maxwell_columns
from ...kernel.path import PathSolver
from ..archive import binary_sizes
from ..native.platforms import host_folder
from ..related_files import STEP, slow_cycles, times_of
from .fmpy_host import MODELS, SLAVES, fmi_version, library_path

# The FMU and the vectorised path share one source and differ by rounding.
FORCE_TOLERANCE = 1e-9  # of the largest force
_EVENTS = 100  # at one instant; the spring asks for one
OUTPUTS = ("force", "absorbed_energy")  # that are compared
_Drive: TypeAlias = Callable[[Any, ModelDescription, FloatArray], Iterator[None]]


class _WrongRatesError(Exception):
    """The derivatives of the FMU's states are not the model's."""


@dataclass(frozen=True)
class CheckReport:
    """What `examine_fmu` found.

    Attributes
    ----------
    path : Path
    problems : tuple of str        One sentence each; empty if the FMU is good.
    not_run : str or None          Why the FMU was validated but not run.
    interfaces : tuple of str      Those that were run: co-simulation, model exchange.
    steps : int                    Steps of each run.
    force_difference : float       Largest difference from the expected force [N].
    seconds : float                Time the steps of all runs took [s].
    followed : str                 What else was found along records, in words.
    """

    path: Path
    problems: tuple[str, ...]
    not_run: str | None = None
    interfaces: tuple[str, ...] = ()
    steps: int = 0
    force_difference: float = 0.0
    seconds: float = 0.0
    followed: str = ""

    @property
    def summary(self) -> str:
        """The report in one line."""
        if self.problems:
            return " ".join(self.problems)
        if self.not_run:
            return f"valid, but not run. {self.not_run}"
        within = f"within {self.force_difference:.1e} N" if self.force_difference else "exactly"
        return (
            f"valid; {self.steps} steps of {' and of '.join(self.interfaces)} took {1e3 * self.seconds:.0f} ms "
            f"and give the force of the model {within}{self.followed}"
        )

    @property
    def verdict(self) -> str:
        """The report in few words, if all is well."""
        return self.summary if self.problems or self.not_run else f"valid, agrees with the model{self.followed}"


def validated(path: Path) -> CheckReport:
    """The report on an FMU that has not been run."""
    try:
        problems = tuple(str(problem).strip() for problem in validate_fmu(str(path)))
    except (OSError, zipfile.BadZipFile) as problem:
        problems = (f"It cannot be read: {problem}.",)
    return CheckReport(path, problems, "an invalid FMU is not run" if problems else None)


def examine_fmu(path: Path) -> CheckReport:
    """Validate an FMU and compare a short run with the model; the report holds its problems."""
    report = validated(path)
    if report.problems:
        return report
    description = fmpy.read_model_description(str(path))
    try:
        parameters = described_spring(description)
    except (KeyError, TypeError, ValueError) as problem:
        return CheckReport(path, (f"It is not the FMU of a spring: {problem}",))
    displacement = slow_cycles(parameters)
    solver = PathSolver(parameters)
    way = (displacement, described_omegas(description), times_of(displacement))
    expected = np.array([solver.force(*way), solver.absorbed_energy(*way)]).T
    return compare_run(path, displacement, expected[:, : len(_references(description)[1])])


def compare_run(path: Path, displacement: FloatArray, expected: FloatArray) -> CheckReport:
    """Run every interface of a valid FMU along a path, and compare force and absorbed energy.

    Parameters
    ----------
    path : Path
    displacement : ndarray, shape (K,)        [m].
    expected : ndarray, shape (K, 1 or 2)     Force [N] and, if the FMU has it, absorbed energy [J].
    """
    description = fmpy.read_model_description(str(path))
    not_run = why_not_here(path, fmi_version(description))
    if not_run:
        return CheckReport(path, (), not_run)
    with_states = bool(description.derivatives)
    interfaces: dict[str, _Drive] = {} if description.coSimulation is None else {"co-simulation": _by_steps}
    if description.modelExchange is not None:
        interfaces["model exchange"] = _by_states if with_states else _by_solver
    problems: tuple[str, ...] = ()
    differences = np.zeros(expected.shape[1])
    seconds = 0.0
    try:
        # An interrupt inside a Python-backed FMU would be taken for its fault.
        with kept_endings():
            for drive in interfaces.values():
                answers, took = _run(path, description, displacement, drive)
                seconds += took
                # NaN counts as the greater one.
                differences = np.maximum(differences, np.max(np.abs(answers - expected), axis=0))
    except _WrongRatesError as problem:
        return CheckReport(path, (str(problem),))
    except Exception as problem:  # FMPy raises plain exceptions
        return CheckReport(path, (f"It cannot be run: {problem}",))
    largest = np.max(np.abs(expected), axis=0)
    for name, unit, difference, scale in zip(OUTPUTS, ("N", "J"), differences.tolist(), largest.tolist(), strict=False):
        # Written so that NaN is a problem.
        if not difference <= FORCE_TOLERANCE * scale:
            problems += (f"Its {name} must be that of the model, but differs by up to {difference:.3g} {unit}.",)
    return CheckReport(path, problems, None, tuple(interfaces), displacement.size, float(differences[0]), seconds)


def described_spring(description: ModelDescription) -> SpringParameters:
    """The spring whose parameters are the start values in a model description."""
    start = {v.name: float(v.start) for v in description.modelVariables if v.causality == "parameter"}
    elements = ("kE_", "kA_", "FE_knots_", "second_kA_")
    counts = [sum(name.startswith(k) for name in start) for k in elements]
    counts.append(sum(name.endswith("_time_constant") for name in start))
    return spring_parameters(start, *counts)


def described_omegas(description: ModelDescription) -> tuple[float, float]:
    """Where omega of both mechanisms starts by a model description; 0 of a second one that is not there."""
    starts = {v.name.removesuffix("_start"): v.start for v in description.modelVariables}
    return float(starts["omega"]), float(starts.get(f"{SECOND}omega", 0.0))


@contextmanager
def running(path: Path, model_exchange: bool = False) -> Iterator[Any]:
    """An instance of the FMU, before its initialization, as FMPy's FMU2Slave or FMU2Model, or with their methods."""
    description = fmpy.read_model_description(str(path))
    fmi = fmi_version(description)
    kind, interface = (
        (MODELS[fmi], description.modelExchange) if model_exchange else (SLAVES[fmi], description.coSimulation)
    )
    with TemporaryFolder() as place:
        folder = str(place)
        fmpy.extract(str(path), unzipdir=folder)
        slave = kind(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=interface.modelIdentifier,
            instanceName="check",
            libraryPath=library_path(folder, interface.modelIdentifier, fmi),
        )
        slave.instantiate()
        try:
            yield slave
        finally:
            slave.freeInstance()


def _run(
    path: Path, description: ModelDescription, displacement: FloatArray, drive: _Drive
) -> tuple[FloatArray, float]:
    """Force [N] and absorbed energy [J], shape (K, 1 or 2), and time [s] of a run."""
    given, outputs = _references(description)
    with running(path, drive is not _by_steps) as instance:
        instance.setupExperiment(startTime=0.0)
        instance.enterInitializationMode()
        instance.setReal(given, [float(displacement[0])])
        instance.exitInitializationMode()
        answers = list(instance.getReal(outputs))
        began = time.perf_counter()
        for _ in drive(instance, description, displacement):
            answers += instance.getReal(outputs)
        seconds = time.perf_counter() - began
        instance.terminate()
    return np.array(answers).reshape(-1, len(outputs)), seconds


def _by_steps(slave: Any, description: ModelDescription, displacement: FloatArray) -> Iterator[None]:
    """By co-simulation; yields where outputs are read."""
    given, _ = _references(description)
    for k, value in enumerate(displacement[1:].tolist()):
        slave.setReal(given, [value])
        slave.doStep(k * STEP, STEP)
        yield


def _by_solver(model: Any, description: ModelDescription, displacement: FloatArray) -> Iterator[None]:
    """The same by model exchange, as a solver does that accepts every sample."""
    given, _ = _references(description)
    _continue(model)
    for k, value in enumerate(displacement[1:].tolist(), start=1):
        model.setTime(k * STEP)
        model.setReal(given, [value])
        yield
        wants_event, _ = model.completedIntegratorStep()
        if wants_event:
            model.enterEventMode()
            _continue(model)


def _by_states(model: Any, description: ModelDescription, displacement: FloatArray) -> Iterator[None]:
    """The same where omega is a continuous state: at states of the model, of which the rates must be those of omega."""
    given, _ = _references(description)
    inputs = [*given, next(v.valueReference for v in description.modelVariables if v.name == "velocity")]
    states, velocity, expected, scales = _states_along(description, displacement)
    count = len(states)
    values, rates = (ctypes.c_double * count)(), (ctypes.c_double * count)()
    found_rates = []
    _continue(model)
    for k, point in enumerate(np.array([displacement, velocity, *states]).T[1:].tolist(), start=1):
        model.setTime(k * STEP)
        model.setReal(inputs, point[:2])
        values[:] = point[2:]
        model.setContinuousStates(values, count)
        yield
        model.getDerivatives(rates, count)
        found_rates.append(list(rates))
    errors = np.max(np.abs(np.transpose(found_rates) - expected[:, 1:]), axis=1) / scales
    if not np.all(errors <= FORCE_TOLERANCE):
        names = " and ".join(v.name for v in description.modelVariables if v.name.startswith("der("))
        sizes = " and ".join(f"{error:.3g}" for error in errors.tolist())
        raise _WrongRatesError(
            f"Its states must change as the model's, but {names} differ by {sizes} of their largest values."
        )


def _states_along(
    description: ModelDescription, displacement: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """At the samples: absorbed energy [J], omega of each mechanism and elongation of each branch [m], shape (S, K); the
    velocity [m/s]; the rates of these states that the model has, shape (S, K); a size of each rate, shape (S,).
    """
    p, start, times = described_spring(description), described_omegas(description), times_of(displacement)
    solver, velocity = PathSolver(p), np.sign(np.diff(displacement, prepend=displacement[0]))
    force = solver.force(displacement, start, times)
    states, rates = [solver.absorbed_energy(displacement, start, times)], [force * velocity]
    scales = [float(np.max(np.abs(force)))]
    for mechanism, omega in zip(p.mechanisms, solver.omegas(displacement, start), strict=True):
        # Paper eq. (11)
        rho, sigma, sign = mechanism.rho, mechanism.sigma, velocity * np.sign(omega)
        states.append(omega)
        rates.append(rho * velocity * (1.0 - (sigma * sign - sigma + 1.0) * np.abs(omega) ** mechanism.n))
        scales.append(rho * max(1.0, 2.0 * sigma))
    elongations, _ = maxwell_columns([branch.time_constant for branch in p.branches], displacement, times)
    for branch, elongation in zip(p.branches, elongations, strict=True):
        states.append(elongation)
        rates.append(velocity - elongation / branch.time_constant)
        scales.append(1.0 + float(np.max(np.abs(elongation))) / branch.time_constant)
    return np.array(states), velocity, np.array(rates), np.array(scales)


def _references(description: ModelDescription) -> tuple[list[int], list[int]]:
    references = {v.name: v.valueReference for v in description.modelVariables}
    return [references["displacement"]], [references[name] for name in OUTPUTS if name in references]


def _continue(model: Any) -> None:
    """From event mode to continuous-time mode."""
    for _ in range(_EVENTS):
        needed, *_ = model.newDiscreteStates()
        if not needed:
            break
    else:
        raise BuildError(f"it asks for more than {_EVENTS} events at one instant")
    model.enterContinuousTimeMode()


def why_not_here(path: Path, fmi: int = 2) -> str | None:
    """Why this computer cannot run an FMU of a version of FMI."""
    if host_folder(fmi) in binary_sizes(path):
        return None
    computer = f"{platform.system()} {platform.machine().lower()}"
    return f"The FMU has no binary for this computer ({computer}), so it was not run."
