"""One instance of a spring FMU, run through FMPy: trial displacements, steps that commit, rollback.

Works with either back end and either version of FMI. The FMU's force is a direct feed-through of its displacement, so a
trial needs no step. FMI does not require that of an FMU; where it must not be relied on, step within
`FmuSpring.rollback`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from ctypes import byref, c_double, c_uint
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.model_description import ModelDescription

from ..core.parameters import ARRAYS, LARGEST_DISPLACEMENT
from ..errors import StrandspringError
from ..fmu.checks.fmpy_host import SLAVES, fmi_version, library_path
from ..ground.scratch import TemporaryFolder
from ..kernel.path import warn_outside

_MODEL_VALUES: Mapping[str, float] = {}
_keys = count(1)
_instances: WeakValueDictionary[int, Messages] = WeakValueDictionary()


class CosimulationError(StrandspringError):
    """Invalid arguments, a failing FMU, or a simulation that cannot be completed."""


class DivergenceError(CosimulationError):
    """A displacement that no spring can mean."""


class Response(NamedTuple):
    """Response of a spring to a displacement.

    Attributes
    ----------
    force : float             [N].
    absorbed_energy : float   Integral of the force over the displacement since the start [J].
    stiffness : float         Tangent in the direction of motion [N/m].
    """

    force: float
    absorbed_energy: float
    stiffness: float


class FmuSpring:
    """An instance of a spring FMU; a context manager that frees it.

    `start` is called once, then any number of `trial` and `commit`. A trial changes nothing; a commit extends the
    spring's path.

    Parameters
    ----------
    fmu : path
    name : str                           Name of the instance, at the beginning of its error messages.
    parameters : mapping of str to float Values of FMU parameters that replace those of the model, by their names in the
                                         FMU.

    Attributes
    ----------
    displacement_min, displacement_max : float   Identified range [m].
    messages : list of str             Log messages of the FMU.
    warns : bool                       Whether a path outside the identified range gives a UserWarning; at first True.

    Raises
    ------
    CosimulationError   If the file is not a spring FMU for co-simulation with all outputs, has no such parameter, or
                        cannot be run on this computer.
    """

    def __init__(self, fmu: Path | str, name: str = "spring", parameters: Mapping[str, float] = _MODEL_VALUES) -> None:
        description = _read_description(fmu)
        given = _checked(parameters, fmu, name, description)
        interface, fmi = description.coSimulation, fmi_version(description)
        references = {variable.name: variable.valueReference for variable in description.modelVariables}
        starts = {variable.name: variable.start for variable in description.modelVariables} | given
        self.name, self.warns = name, True
        self.displacement_min = float(starts["displacement_min"])
        self.displacement_max = float(starts["displacement_max"])
        self._path: list[float] = []  # committed
        self._judged = 0  # samples of it
        self.messages = Messages(fmi)
        self._parameters = [references[name] for name in given]
        self._parameter_values = [*given.values()]
        # FMPy's own calls by lists take longer than the FMU itself.
        self._input, self._input_value = (c_uint * 1)(references["displacement"]), (c_double * 1)()
        self._outputs = (c_uint * 3)(*(references[output] for output in Response._fields))
        self._output_values = (c_double * 3)()
        self._folder = TemporaryFolder()
        unzipped = str(self._folder.path)
        try:
            fmpy.extract(str(fmu), unzipdir=unzipped)
            self._slave = SLAVES[fmi](
                guid=description.guid,
                unzipDirectory=unzipped,
                modelIdentifier=interface.modelIdentifier,
                instanceName=name,
                libraryPath=library_path(unzipped, interface.modelIdentifier, fmi),
            )
            self._slave.instantiate(**self.messages.arguments)
        except Exception as problem:  # FMPy raises plain exceptions
            self._folder.close()
            raise CosimulationError(f"{name}: {fmu} cannot be run here: {problem}") from None

    def __enter__(self) -> FmuSpring:
        return self

    def __exit__(self, *_: object) -> None:
        self.close(stacklevel=3)

    def close(self, stacklevel: int = 2) -> None:
        """Terminate and free the instance; warn of a path outside the identified range that was not yet warned of."""
        if self.started:
            self._slave.terminate()
        self._slave.freeInstance()
        self._folder.close()
        self.warn_outside(stacklevel)

    def warn_outside(self, stacklevel: int = 1) -> None:
        """Warn if the path committed since the last call leaves the identified range by more than 1 % of it."""
        path, self._judged = self._path[self._judged :], len(self._path)
        if path and self.warns:
            warn_outside(np.array(path), self.displacement_min, self.displacement_max, stacklevel + 1)

    @property
    def started(self) -> bool:
        """Whether `start` has been called."""
        return bool(self._path)

    @property
    def committed_displacement(self) -> float:
        """End of the committed path [m]; NaN before `start`."""
        return self._path[-1] if self._path else math.nan

    def start(self, displacement: float, time: float = 0.0) -> Response:
        """Begin the path at a displacement [m] and time [s]."""
        self._call(partial(self._slave.setupExperiment, startTime=time))
        self._call(self._slave.enterInitializationMode)
        if self._parameters:
            self._call(self._slave.setReal, self._parameters, self._parameter_values)
        self._set(displacement)
        self._call(self._slave.exitInitializationMode)
        self._path.append(displacement)
        return self._get()

    def trial(self, displacement: float) -> Response:
        """Response to the straight path from the committed displacement to a trial displacement [m]."""
        self._set(displacement)
        return self._get()

    def commit(self, time: float, step: float, displacement: float) -> Response:
        """Commit the straight path to a displacement [m] by a step; times in s."""
        self._set(displacement)
        self._call(self._slave.doStep, time, step)
        self._path.append(displacement)
        return self._get()

    @contextmanager
    def rollback(self) -> Iterator[None]:
        """Revert the FMU to its present state when the block ends."""
        state, samples = self._call(self._slave.getFMUstate), len(self._path)
        try:
            yield
        finally:
            del self._path[samples:]
            self._judged = min(self._judged, samples)
            self._call(self._slave.setFMUstate, state)
            self._call(self._slave.freeFMUstate, state)

    def _set(self, displacement: float) -> None:
        if not abs(displacement) <= LARGEST_DISPLACEMENT:
            raise DivergenceError(f"{self.name}: {displacement:.3g} m is beyond what a displacement can mean.")
        self._input_value[0] = displacement
        self._call(self._slave.fmi2SetReal, self._slave.component, self._input, 1, self._input_value)

    def _get(self) -> Response:
        self._call(self._slave.fmi2GetReal, self._slave.component, self._outputs, 3, self._output_values)
        return Response(*self._output_values)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except FMICallException as problem:
            reason = self.messages[-1] if self.messages else "The FMU logged no reason."
            raise CosimulationError(f"{self.name}: {problem.function} failed. {reason}") from None


def _read_description(fmu: Path | str) -> ModelDescription:
    """The model description, if it is that of a spring that can be moved by co-simulation."""
    try:
        description = fmpy.read_model_description(str(fmu))
    except Exception as problem:  # FMPy raises plain exceptions
        raise CosimulationError(f"{fmu} cannot be read as an FMU: {str(problem).strip()}") from None
    if fmi_version(description) not in SLAVES:
        raise CosimulationError(
            f"{fmu} is an FMU of FMI {description.fmiVersion}, but this needs FMI 2.0 or 3.0: build it again."
        )
    variables = {v.name for v in description.modelVariables}
    for missing in ("displacement", *Response._fields):
        if missing not in variables:
            raise CosimulationError(f"{fmu} is not a spring FMU: it has no variable `{missing}`.")
    if description.coSimulation is None:
        raise CosimulationError("{fmu} has no co-simulation: build it without {to[states=True]}.", fmu=fmu)
    return description


def _checked(
    parameters: Mapping[str, float], fmu: Path | str, name: str, description: ModelDescription
) -> dict[str, float]:
    """Values of parameters by name, if the FMU has those and they are numbers."""
    known = {v.name for v in description.modelVariables if v.causality == "parameter"}
    checked = {}
    for parameter, value in parameters.items():
        if parameter not in known:
            is_list = parameter in ARRAYS and f"{parameter}_0" in known
            instead = f"; its elements are parameters: give `{parameter}_0` and so on" if is_list else ""
            raise CosimulationError(f"{name}: {fmu} has no parameter `{parameter}`{instead}.")
        try:
            checked[parameter] = float(value)
        except (TypeError, ValueError):
            raise CosimulationError(f"{name}: `{parameter}` must be a number, got {value!r}.") from None
    return checked


try:
    from fmpy import logging as _proxies
except OSError:  # FMPy has no such library for this platform; messages then keep their placeholders
    _proxies = None


class Messages(list[str]):
    """Log messages of one instance.

    Attributes
    ----------
    arguments : dict   Of FMPy's method that instantiates the FMU, by a version of FMI, 2 or 3.
    """

    def __init__(self, fmi: int) -> None:
        super().__init__()
        # In FMI 3.0 an instance has a logger of its own; there and in Python-backed FMUs warnings need logging.
        own: dict[str, Any] = {"callbacks": self._callbacks()} if fmi == 2 else {"logMessage": self._append}
        self.arguments = {"loggingOn": True, **own}

    def _append(self, _environment: Any, _status: int, _category: bytes, message: bytes) -> None:
        self.append(message.decode("utf-8", "replace"))

    def _callbacks(self) -> fmi2CallbackFunctions:
        """What hands the messages of an instance of FMI 2.0 to this list."""
        callbacks = fmi2CallbackFunctions()
        # FMPy's proxy, which fills in placeholders, forwards to the logger registered last. So there is one logger for
        # all, and the environment identifies the instance.
        callbacks.logger = _LOGGER
        callbacks.allocateMemory = defaultCallbacks.allocateMemory
        callbacks.freeMemory = defaultCallbacks.freeMemory
        callbacks.componentEnvironment = next(_keys)
        _instances[callbacks.componentEnvironment] = self
        if _proxies is not None:
            _proxies.addLoggerProxy(byref(callbacks))
        return callbacks


def _receive(environment: int, _name: Any, status: int, category: bytes, message: bytes) -> None:
    messages = _instances.get(environment)
    if messages is not None:
        messages._append(environment, status, category, message)


_LOGGER = fmi2CallbackLoggerTYPE(_receive)
