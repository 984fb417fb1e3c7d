"""One spring FMU as a unit of a larger system, run through FMPy: set a displacement, read the response, step.

Works with either back end. The FMU's force is a direct feed-through of its displacement, so a displacement can be
tried without a step. FMI 2.0 does not ask that of an FMU; where it must not be relied on, `SpringUnit.restored` takes a
step back that was tried.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from ctypes import c_double, c_uint
from pathlib import Path
from typing import Any, NamedTuple

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import ModelDescription

from ..errors import StrandspringError
from ..fmu.native.platforms import host_name
from .messages import Messages

_NO_START: Mapping[str, float] = {}


class CosimulationError(StrandspringError):
    """A system cannot be simulated as asked."""


class Response(NamedTuple):
    """What the spring answers to a displacement.

    Attributes
    ----------
    force : float             [N].
    absorbed_energy : float   Integral of the force over the displacement since the start [J].
    stiffness : float         Tangent in the direction of motion [N/m].
    """

    force: float
    absorbed_energy: float
    stiffness: float


class SpringUnit:
    """An instance of a spring FMU; `spring_unit` makes one and frees it.

    Attributes
    ----------
    name : str
    displacement_min, displacement_max : float   Identified range [m].
    can_interpolate : bool    Whether it takes derivatives of its displacement.
    reached : float           Where the committed path ends [m]; NaN before it begins.
    messages : list of str    What the FMU logged.
    """

    def __init__(self, name: str, description: ModelDescription, folder: str, start: Mapping[str, float]) -> None:
        interface = description.coSimulation
        references = {variable.name: variable.valueReference for variable in description.modelVariables}
        values = {variable.name: variable.start for variable in description.modelVariables} | dict(start)
        self.name = name
        self.displacement_min = float(values["displacement_min"])
        self.displacement_max = float(values["displacement_max"])
        self.can_interpolate = bool(interface.canInterpolateInputs)
        self.messages = Messages()
        self._derivable = bool(interface.providesDirectionalDerivative)
        self._start = {references[name]: value for name, value in start.items()}
        self._displacement = references["displacement"]
        self._force = references["force"]
        # FMPy's own calls by lists take longer than the FMU itself.
        self._input, self._given = (c_uint * 1)(self._displacement), (c_double * 1)()
        self._outputs = (c_uint * 3)(*(references[output] for output in Response._fields))
        self._answer = (c_double * 3)()
        self.reached = math.nan
        self._slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=interface.modelIdentifier,
            instanceName=name,
            # FMPy takes every computer for one of x86.
            libraryPath=str(
                Path(folder, "binaries", str(host_name()), f"{interface.modelIdentifier}{fmpy.sharedLibraryExtension}")
            ),
        )
        self._slave.instantiate(callbacks=self.messages.callbacks)

    @property
    def started(self) -> bool:
        """Whether the path has begun."""
        return not math.isnan(self.reached)

    def start(self, displacement: float, time: float = 0.0) -> Response:
        """Begin the path at a displacement [m] and time [s]."""
        self._checked(self._slave.setupExperiment, None, time)
        self._checked(self._slave.enterInitializationMode)
        if self._start:
            self._checked(self._slave.setReal, list(self._start), list(self._start.values()))
        self._set(displacement)
        self._checked(self._slave.exitInitializationMode)
        self.reached = displacement
        return self._read()

    def tried(self, displacement: float) -> Response:
        """The response to the straight path from the committed point to a displacement [m]; leaves no trace."""
        self._set(displacement)
        return self._read()

    def stepped(self, time: float, step: float, displacement: float) -> Response:
        """Commit the straight path to a displacement [m] by a step; times in s."""
        self._set(displacement)
        self._checked(self._slave.doStep, time, step)
        self.reached = displacement
        return self._read()

    def stepped_along(self, time: float, step: float, displacement: float, first: float, second: float) -> Response:
        """Commit the path displacement + first*tau + second*tau^2/2, with 0 <= tau <= step.

        Parameters
        ----------
        displacement, first, second : float   Value and derivatives where the step begins [m, m/s, m/s^2].

        Raises
        ------
        CosimulationError   If the FMU does not take input derivatives.
        """
        if not self.can_interpolate:
            raise CosimulationError(
                f"{self.name}: the FMU takes no derivatives of its displacement; build it with --backend native, or "
                "take a straight course."
            )
        self._set(displacement)
        self._checked(
            self._slave.setRealInputDerivatives, [self._displacement] * 2, [1, 2], [first, second]
        )  # fmt: skip
        self._checked(self._slave.doStep, time, step)
        self.reached = displacement + step * (first + 0.5 * step * second)
        return self._read()

    def directional_derivative(self) -> float:
        """d force/d displacement at the displacement set last, by fmi2GetDirectionalDerivative [N/m].

        Raises
        ------
        CosimulationError   If the FMU does not offer it.
        """
        if not self._derivable:
            raise CosimulationError(
                f"{self.name}: the FMU has no directional derivatives; build it with --backend native, or use its "
                "`stiffness`."
            )
        found = self._checked(self._slave.getDirectionalDerivative, [self._force], [self._displacement], [1.0])
        return float(found[0])

    @contextmanager
    def restored(self) -> Iterator[None]:
        """Take the FMU back to its present state at the end."""
        state, reached = self._checked(self._slave.getFMUstate), self.reached
        try:
            yield
        finally:
            self.reached = reached
            self._checked(self._slave.setFMUstate, state)
            self._checked(self._slave.freeFMUstate, state)

    def free(self) -> None:
        """Terminate and free the instance."""
        if self.started:
            self._slave.terminate()
        self._slave.freeInstance()

    def _set(self, displacement: float) -> None:
        self._given[0] = displacement
        self._checked(self._slave.fmi2SetReal, self._slave.component, self._input, 1, self._given)

    def _read(self) -> Response:
        self._checked(self._slave.fmi2GetReal, self._slave.component, self._outputs, 3, self._answer)
        return Response(*self._answer)

    def _checked(self, call: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return call(*arguments)
        except FMICallException as problem:
            said = self.messages[-1] if self.messages else "The FMU gave no reason."
            raise CosimulationError(f"{self.name}: {problem.function} failed. {said}") from None


@contextmanager
def spring_unit(fmu: Path | str, name: str = "spring", start: Mapping[str, float] = _NO_START) -> Iterator[SpringUnit]:
    """An instance of a spring FMU, before its path starts; freed at the end.

    Parameters
    ----------
    fmu : path
    name : str                         Of the instance; messages begin with it.
    start : mapping of str to float    Values of the FMU's parameters that differ from the model's, by name.

    Raises
    ------
    CosimulationError   If the file is not the FMU of a spring, has no such parameter, or cannot be run here.
    """
    try:
        description = fmpy.read_model_description(str(fmu))
    except Exception as problem:  # FMPy raises plain exceptions
        raise CosimulationError(f"{fmu} cannot be read as an FMU: {str(problem).strip()}") from None
    names = {v.name for v in description.modelVariables}
    for missing in ("displacement", *Response._fields):
        if missing not in names:
            raise CosimulationError(f"{fmu} is not the FMU of a spring: it has no variable `{missing}`.")
    parameters = {v.name for v in description.modelVariables if v.causality == "parameter"}
    for unknown in sorted(start.keys() - parameters):
        raise CosimulationError(f"{name}: {fmu} has no parameter `{unknown}`.")
    with tempfile.TemporaryDirectory(prefix="strandspring-", ignore_cleanup_errors=True) as folder:
        fmpy.extract(str(fmu), unzipdir=folder)
        try:
            unit = SpringUnit(name, description, folder, start)
        except Exception as problem:
            raise CosimulationError(f"{name}: {fmu} cannot be run here: {problem}") from None
        try:
            yield unit
        finally:
            unit.free()
