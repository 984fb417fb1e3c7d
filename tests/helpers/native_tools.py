"""FMUs reached by ctypes, call by call, for the tests of their FMI layers: nothing stands between.

All calls are those of FMI 2.0; `Native3` understands them in FMI 3.0.
"""

from __future__ import annotations

import ctypes
import functools
import itertools
import math
import re
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_uint, c_void_p
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

import fmpy
import numpy as np
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, fmi2EventInfo
from fmpy.fmi3 import fmi3LogMessageCallback

from kernel_tools import build_folder
from strandspring.fmu.native.platforms import host_folder

# The headers of FMI, and the functions that they declare: of FMI 2.0, and of FMI 3.0.
HEADERS = Path(str(files("fmpy") / "c-code"))
FUNCTIONS = set(re.findall(r"FMI2_Export fmi2\w+TYPE +(fmi2\w+);", (HEADERS / "fmi2Functions.h").read_text()))
FUNCTIONS3 = set(re.findall(r"FMI3_Export fmi3\w+TYPE +(fmi3\w+);", (HEADERS / "fmi3Functions.h").read_text()))
OK, WARNING, DISCARD, ERROR, FATAL = range(5)  # FATAL is the one error of PythonFMU
MODEL_EXCHANGE, CO_SIMULATION = range(2)
Self = TypeVar("Self", bound="Native")


def close(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    """Compare with rounding measured in the largest value: the same closed form, step by step and vectorised."""
    expected = np.asarray(expected)
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance * np.abs(expected).max())


def close_each(found: object, expected: np.ndarray, tolerance: float = 1e-12) -> None:
    """Each row within a tolerance of its largest value."""
    for one, other in zip(np.array(found), expected, strict=True):
        close(one, other, tolerance)


def doubles(values: Iterable[float]) -> ctypes.Array[c_double]:
    given = list(values)
    return (c_double * len(given))(*given)


class Library:
    """The binary of an FMU for this computer, or another one, and the FMU's variables.

    Parameters
    ----------
    folder : Path   Where the FMU is unpacked.
    """

    def __init__(self, folder: Path, binary: Path | None = None) -> None:
        self.folder = folder
        description = fmpy.read_model_description(str(folder))
        self.guid = str(description.guid)
        self.variables = description.modelVariables
        self.references = {v.name: v.valueReference for v in self.variables}
        self.fmi = int(description.fmiVersion[0])
        (self.path,) = [binary] if binary else (folder / "binaries" / str(host_folder(self.fmi))).iterdir()
        self.resources = (folder / "resources").as_uri().encode()
        self.functions = ctypes.CDLL(str(self.path))
        for kind in ("2Instantiate",) if self.fmi == 2 else ("3InstantiateCoSimulation", "3InstantiateModelExchange"):
            getattr(self.functions, f"fmi{kind}").restype = c_void_p


def unpacked(build: Callable[[Path], Path]) -> Library:
    """What an FMU, built into a new folder, is unpacked to."""
    folder = build_folder() / f"fmu{next(_numbers)}"
    with zipfile.ZipFile(build(folder)) as archive:
        archive.extractall(folder / "unpacked")
    return Library(folder / "unpacked")


_numbers = itertools.count(1)


class Native:
    """One instance; variables go by name, and every call of FMI by its name without "fmi2" gives its status.

    Parameters
    ----------
    of : Library
    kind : int     CO_SIMULATION or MODEL_EXCHANGE.

    `messages` are of status, category and text; `found` has the last directional derivatives.
    """

    time, input = 0.0, "displacement"  # how far its path has come, and what moves along it
    boolean: Any = c_int

    def __init__(self, of: Library, kind: int = CO_SIMULATION) -> None:
        self.library, self.kind = of, kind
        self.messages: list[tuple[int, str, str]] = []
        self.component = self._instantiated(of.functions, of.guid.encode())

    def _instantiated(self, functions: ctypes.CDLL, guid: bytes) -> Any:
        def log(_environment: int, _name: bytes, status: int, category: bytes, text: bytes) -> None:
            self.messages.append((status, (category or b"").decode(), text.decode().replace("%%", "%")))

        memory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
        self._callbacks = fmi2CallbackFunctions(fmi2CallbackLoggerTYPE(log), *memory)
        return functions.fmi2Instantiate(b"one", self.kind, guid, self.library.resources, byref(self._callbacks), 0, 1)

    def __enter__(self: Self) -> Self:
        assert self.component is not None, self.messages
        return self

    def __exit__(self, *_: object) -> None:
        self.FreeInstance()

    def __getattr__(self, name: str) -> Any:
        return functools.partial(getattr(self.library.functions, f"fmi2{name}"), c_void_p(self.component))

    @property
    def said(self) -> str:
        """The text of the last message."""
        return self.messages[-1][2]

    def references(self, *names: str) -> ctypes.Array[c_uint]:
        return (c_uint * len(names))(*(self.library.references[name] for name in names))

    def set(self, **values: float) -> int:
        """fmi2SetReal."""
        return int(self.SetReal(self.references(*values), c_size_t(len(values)), doubles(values.values())))

    def get(self, *names: str) -> list[float]:
        """fmi2GetReal."""
        found = (c_double * len(names))()
        assert self.GetReal(self.references(*names), c_size_t(len(names)), found) == OK, self.said
        return list(found)

    @property
    def extrapolating(self) -> bool:
        found = self.boolean(-1)
        assert self.GetBoolean(self.references("extrapolating"), c_size_t(1), byref(found)) == OK
        return {0: False, 1: True}[found.value]

    def enter_initialization(self: Self, start_time: float = 0.0, stop_time: float | None = None) -> Self:
        stop = 0.0 if stop_time is None else stop_time
        assert self.SetupExperiment(0, c_double(0.0), c_double(start_time), stop_time is not None, c_double(stop)) == OK
        assert self.EnterInitializationMode() == OK, self.said
        return self

    def initialize(self: Self, **start: float) -> Self:
        """Initialize with start values; a spring's path starts at the offset unless they say otherwise."""
        self.enter_initialization()
        if "displacement_offset" in self.library.references:
            start = {"displacement": self.get("displacement_offset")[0], **start}
        assert self.set(**start) == OK, self.said
        assert self.ExitInitializationMode() == OK, self.said
        return self

    def begin(self: Self, **start: float) -> Self:
        """To where a path begins: step mode, or continuous-time mode."""
        self.initialize(**start)
        if self.kind == MODEL_EXCHANGE:
            self._leave_event_mode()
        return self

    def advance(self, value: float, size: float = 1e-3) -> None:
        """Commit the straight path to a displacement [m], or another input, in a time [s]."""
        if self.kind == MODEL_EXCHANGE:
            if self.accept(self.time + size, value):
                self.event()
        else:
            assert self.set(**{self.input: value}) == OK, self.said
            assert self.go(self.time, size) == OK, self.said
        self.time += size

    def along(self, path: np.ndarray, time: np.ndarray, *names: str) -> list[list[float]]:
        """Outputs after each step of a path."""
        rows = []
        for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
            self.advance(x, h)
            rows.append(self.get(*names))
        return rows

    def go(self, time: float, size: float) -> int:
        """fmi2DoStep."""
        return int(self.DoStep(c_double(time), c_double(size), 1))

    def tune(self, **values: float) -> int:
        """The status of setting values where parameters may be set between steps."""
        if self.kind == CO_SIMULATION or "omega_start" not in self.library.references:
            return self.set(**values)
        assert self.EnterEventMode() == OK
        status = self.set(**values)
        self._leave_event_mode()
        return status

    def set_derivatives(self, *values: float, orders: Sequence[int] = (1, 2), names: Sequence[str] = ()) -> int:
        """fmi2SetRealInputDerivatives, of the displacement unless `names` says otherwise."""
        references, count = self.references(*(names or ["displacement"] * len(values))), len(values)
        given = (c_int * count)(*orders[:count]), doubles(values)
        return int(self.SetRealInputDerivatives(references, c_size_t(count), *given))

    def output_derivatives(self, *given: str | int) -> Any:
        """Over time, or the status of what is refused, which writes nothing; the last may be followed by its order."""
        names = [name for name in given if isinstance(name, str)]
        orders = (c_int * len(names))(*[1] * (len(names) - 1), given[-1] if isinstance(given[-1], int) else 1)
        found = doubles([7.0] * len(names))
        status = int(self.GetRealOutputDerivatives(self.references(*names), c_size_t(len(names)), orders, found))
        assert status == OK or list(found) == [7.0] * len(names)
        return list(found) if status == OK else status

    def directional(self, unknowns: Sequence[str], seeds: Mapping[str, float]) -> int:
        """The status of fmi2GetDirectionalDerivative; `found` has its values."""
        self.found = doubles([7.0] * len(unknowns))
        return int(
            self.GetDirectionalDerivative(
                self.references(*unknowns), c_size_t(len(unknowns)), self.references(*seeds), c_size_t(len(seeds)),
                doubles(seeds.values()), self.found,
            )
        )  # fmt: skip

    def snapshot(self) -> c_void_p:
        """fmi2GetFMUstate."""
        state = c_void_p()
        assert self.GetFMUstate(byref(state)) == OK
        return state

    def serialized(self) -> bytes:
        """The bytes of the present state."""
        taken, size = self.snapshot(), c_size_t()
        assert self.SerializedFMUstateSize(taken, byref(size)) == OK
        content = ctypes.create_string_buffer(size.value)
        assert self.SerializeFMUstate(taken, content, size) == OK
        assert self.FreeFMUstate(byref(taken)) == OK
        return content.raw

    def restore(self, content: bytes) -> int:
        """The status of deserializing a state and, if that works, of setting it."""
        state = c_void_p()
        status = int(self.DeSerializeFMUstate(content, c_size_t(len(content)), byref(state)))
        if status == OK:
            status = int(self.SetFMUstate(state))
            assert self.FreeFMUstate(byref(state)) == OK
        return status

    # Model exchange

    def at(self: Self, time: float, displacement: float) -> Self:
        """Evaluate at a point."""
        assert self.SetTime(c_double(time)) == OK
        assert self.set(displacement=displacement) == OK
        return self

    @property
    def indicator(self) -> float:
        found = c_double()
        assert self.GetEventIndicators(byref(found), c_size_t(1)) == OK
        return found.value

    def accept(self, time: float, displacement: float) -> bool:
        """Complete an integrator step at a point; whether event mode is asked for."""
        enter, terminate = c_int(-1), c_int(-1)
        assert self.at(time, displacement).CompletedIntegratorStep(1, byref(enter), byref(terminate)) == OK
        assert terminate.value == 0
        return {0: False, 1: True}[enter.value]

    def event(self) -> None:
        """Go through event mode."""
        assert self.EnterEventMode() == OK
        self._leave_event_mode()

    def _leave_event_mode(self) -> None:
        assert self.NewDiscreteStates(byref(fmi2EventInfo())) == OK
        assert self.EnterContinuousTimeMode() == OK

    def set_states(self, *values: float) -> int:
        """fmi2SetContinuousStates."""
        return int(self.SetContinuousStates(doubles(values), c_size_t(len(values))))

    def rates(self, count: int = 2) -> list[float]:
        """fmi2GetDerivatives."""
        found = (c_double * count)()
        assert self.GetDerivatives(found, c_size_t(count)) == OK, self.said
        return list(found)


# Calls that FMI 3.0 names otherwise, or that take the number of values there: after arguments i, the one of argument j.
OTHERWISE: dict[str, tuple[str, list[tuple[int, int]]]] = {
    "GetFMUstate": ("GetFMUState", []), "SetFMUstate": ("SetFMUState", []), "FreeFMUstate": ("FreeFMUState", []),
    "SerializedFMUstateSize": ("SerializedFMUStateSize", []), "SerializeFMUstate": ("SerializeFMUState", []),
    "DeSerializeFMUstate": ("DeserializeFMUState", []), "GetDerivatives": ("GetContinuousStateDerivatives", []),
    "SetReal": ("SetFloat64", [(2, 1)]), "GetReal": ("GetFloat64", [(2, 1)]), "GetBoolean": ("GetBoolean", [(2, 1)]),
    "GetRealOutputDerivatives": ("GetOutputDerivatives", [(3, 1)]),
    "GetDirectionalDerivative": ("GetDirectionalDerivative", [(5, 1), (4, 3)]),
    "GetAdjointDerivative": ("GetAdjointDerivative", [(5, 3), (4, 1)]),
}  # fmt: skip


class Native3(Native):
    """The same of FMI 3.0: its calls are understood by their names and arguments of FMI 2.0."""

    boolean = c_bool

    def _instantiated(self, functions: ctypes.CDLL, guid: bytes) -> Any:
        self._logger = fmi3LogMessageCallback(
            lambda _, status, category, text: self.messages.append((status, category.decode(), text.decode()))
        )
        begin = b"one", guid, None, c_bool(False), c_bool(True)
        if self.kind == MODEL_EXCHANGE:
            return functions.fmi3InstantiateModelExchange(*begin, None, self._logger)
        none = c_bool(False), c_bool(True), None, c_size_t(0), None
        return functions.fmi3InstantiateCoSimulation(*begin, *none, self._logger, None)

    def __getattr__(self, name: str) -> Any:
        renamed, places = OTHERWISE.get(name, (name, []))
        function = getattr(self.library.functions, f"fmi3{renamed}")

        def call(*given: Any) -> Any:
            arguments = list(given)
            for after, count in places:
                arguments.insert(after + 1, given[count])
            return function(c_void_p(self.component), *arguments)

        return call

    def SetupExperiment(self, *experiment: Any) -> int:  # noqa: N802
        """Kept, for it is given with the next call."""
        self._experiment = experiment
        return OK

    def EnterInitializationMode(self) -> int:  # noqa: N802
        return int(self.__getattr__("EnterInitializationMode")(*self._experiment))

    def NewDiscreteStates(self, _: Any) -> int:  # noqa: N802
        """fmi3UpdateDiscreteStates, which asks for nothing."""
        flags = [c_bool(True) for _ in range(5)]
        status = int(self.__getattr__("UpdateDiscreteStates")(*map(byref, flags), byref(c_double())))
        assert status != OK or not any(flag.value for flag in flags)
        return status

    def CompletedIntegratorStep(self, no_set: int, enter: Any, terminate: Any) -> int:  # noqa: N802
        flags = c_bool(True), c_bool(True)
        status = int(self.__getattr__("CompletedIntegratorStep")(c_bool(bool(no_set)), *map(byref, flags)))
        enter._obj.value, terminate._obj.value = (int(flag.value) for flag in flags)
        return status

    def DoStep(self, time: Any, size: Any, _: int) -> int:  # noqa: N802
        """fmi3DoStep, which never ends early."""
        flags, reached = [c_bool(True) for _ in range(3)], c_double(math.nan)
        status = int(self.__getattr__("DoStep")(time, size, c_bool(True), *map(byref, flags), byref(reached)))
        if status == OK:
            assert [flag.value for flag in flags] == [False] * 3
            assert reached.value == time.value + size.value
        else:  # refused by itself, or since no step may be done
            assert math.isnan(reached.value) or reached.value == self.get("time")[0]
        return status

    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> list[float]:
        """fmi3GetAdjointDerivative."""
        found = (c_double * len(knowns))()
        status = self.GetAdjointDerivative(
            self.references(*unknowns), c_size_t(len(unknowns)), self.references(*knowns), c_size_t(len(knowns)),
            doubles(seed), found,
        )  # fmt: skip
        assert status == OK, self.said
        return list(found)
