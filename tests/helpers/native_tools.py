"""FMUs reached by ctypes, call by call, for the tests of their FMI layers: nothing stands between."""

from __future__ import annotations

import ctypes
import functools
import itertools
import re
import zipfile
from collections.abc import Mapping, Sequence
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from importlib.resources import files
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import fmi2EventInfo

from fmu_tools import SPRING, callbacks_into
from kernel_tools import build_folder
from strandspring.core.parameters import SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms, host_folder
from strandspring.model.modelfile import ModelFile

# The headers of FMI, and the functions that they declare: of FMI 2.0, and of FMI 3.0.
HEADERS = Path(str(files("fmpy") / "c-code"))
FUNCTIONS = set(re.findall(r"FMI2_Export fmi2\w+TYPE +(fmi2\w+);", (HEADERS / "fmi2Functions.h").read_text()))
FUNCTIONS3 = set(re.findall(r"FMI3_Export fmi3\w+TYPE +(fmi3\w+);", (HEADERS / "fmi3Functions.h").read_text()))
OK, WARNING, DISCARD, ERROR = range(4)
MODEL_EXCHANGE, CO_SIMULATION = range(2)
# The same closed form, step by step in C and vectorised in Python.
ROUNDING = 1e-12


def close(found: Any, expected: Any, tolerance: float = ROUNDING) -> None:
    """Compare with rounding measured in the largest value."""
    expected = np.asarray(expected)
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance * np.abs(expected).max())


def write_native(folder: Path, contents: Mapping[str, bytes]) -> Path:
    """The model description and the C sources of a native FMU, in one new folder."""
    folder.mkdir()
    for name, content in contents.items():
        if name == "modelDescription.xml" or name.startswith("sources/"):
            write_file(folder / name.removeprefix("sources/"), content)
    return folder


def write_file(path: Path, content: bytes) -> None:
    """A file, and the folder that it lies in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


class Library:
    """The binary of an FMU for this computer, and its variables.

    Parameters
    ----------
    folder : Path   Where the FMU is unpacked.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        description = fmpy.read_model_description(str(folder))
        self.guid = str(description.guid)
        self.variables = description.modelVariables
        self.references = {v.name: v.valueReference for v in self.variables}
        fmi = int(description.fmiVersion[0])
        (self.path,) = (folder / "binaries" / str(host_folder(fmi))).iterdir()
        self.resources = (folder / "resources").as_uri().encode()
        self.functions = ctypes.CDLL(str(self.path))
        instantiate = "fmi2Instantiate" if fmi == 2 else "fmi3InstantiateCoSimulation"
        getattr(self.functions, instantiate).restype = c_void_p


@functools.cache
def library(parameters: SpringParameters = SPRING, **form: Any) -> Library:
    """The native FMU of a spring in one of its forms, built and unpacked once in a session."""
    folder = build_folder() / f"fmu{next(_numbers)}"
    fmu = build_native_fmu(ModelFile("spring", parameters), folder, chosen_platforms("host"), zero=0.0, **form)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return Library(folder)


_numbers = itertools.count(1)


class Native:
    """One instance; variables go by name, and every call of FMI by its name without "fmi2" gives its status.

    Parameters
    ----------
    of : Library      That of SPRING by default.
    kind : int        CO_SIMULATION or MODEL_EXCHANGE.

    Attributes
    ----------
    component : int or None                     None if fmi2Instantiate refused.
    messages : list of (int, str, str)          Status, category and text.
    """

    def __init__(
        self,
        of: Library | None = None,
        kind: int = CO_SIMULATION,
        name: str = "one",
        guid: str | None = None,
        logging: bool = True,
        as_formats: bool = False,
    ) -> None:
        self.library = of or library()
        self.messages: list[tuple[int, str, str]] = []
        self._callbacks = callbacks_into(self.messages, as_formats)
        self.component = self.library.functions.fmi2Instantiate(
            name.encode(), kind, (guid or self.library.guid).encode(), self.library.resources,
            byref(self._callbacks), 0, logging,
        )  # fmt: skip

    def __enter__(self) -> Native:
        assert self.component is not None, self.messages
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.library.functions.fmi2FreeInstance(c_void_p(self.component))

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
        assert self.GetReal(self.references(*names), c_size_t(len(names)), found) == OK, self.messages[-1]
        return list(found)

    @property
    def extrapolating(self) -> bool:
        found = c_int(-1)
        assert self.GetBoolean(self.references("extrapolating"), c_size_t(1), byref(found)) == OK
        return {0: False, 1: True}[found.value]

    def enter_initialization(self, start_time: float = 0.0, stop_time: float | None = None) -> Native:
        stop = 0.0 if stop_time is None else stop_time
        assert self.SetupExperiment(0, c_double(0.0), c_double(start_time), stop_time is not None, c_double(stop)) == OK
        assert self.EnterInitializationMode() == OK
        return self

    def initialize(self, **start: float) -> Native:
        """Initialize with start values; the path starts at the offset unless they say otherwise."""
        self.enter_initialization()
        assert self.set(**{"displacement": self.get("displacement_offset")[0], **start}) == OK
        assert self.ExitInitializationMode() == OK, self.messages[-1]
        return self

    def step(self, displacement: float, *names: str, time: float = 0.0, size: float = 1e-3) -> list[float]:
        """Set the displacement, do a step, read."""
        assert self.set(displacement=displacement) == OK
        assert self.DoStep(c_double(time), c_double(size), 1) == OK, self.messages[-1]
        return self.get(*names)

    def set_derivatives(self, *values: float, orders: Sequence[int] = (1, 2), names: Sequence[str] = ()) -> int:
        """fmi2SetRealInputDerivatives, of the displacement unless `names` says otherwise."""
        count = len(values)
        references = self.references(*(names or ["displacement"] * count))
        return int(
            self.SetRealInputDerivatives(references, c_size_t(count), (c_int * count)(*orders[:count]), doubles(values))
        )

    def output_derivatives(self, *names: str) -> list[float]:
        found = (c_double * len(names))()
        orders = (c_int * len(names))(*[1] * len(names))
        assert self.GetRealOutputDerivatives(self.references(*names), c_size_t(len(names)), orders, found) == OK
        return list(found)

    def derivatives(self, unknowns: Sequence[str], **seeds: float) -> list[float]:
        """fmi2GetDirectionalDerivative."""
        found = (c_double * len(unknowns))()
        status = self.GetDirectionalDerivative(
            self.references(*unknowns), c_size_t(len(unknowns)), self.references(*seeds), c_size_t(len(seeds)),
            doubles(seeds.values()), found,
        )  # fmt: skip
        assert status == OK, self.messages[-1]
        return list(found)

    def snapshot(self) -> c_void_p:
        """fmi2GetFMUstate."""
        state = c_void_p()
        assert self.GetFMUstate(byref(state)) == OK
        return state

    def serialized(self, state: c_void_p | None = None) -> bytes:
        """The bytes of a state, of the present one by default."""
        taken = self.snapshot() if state is None else state
        size = c_size_t()
        assert self.SerializedFMUstateSize(taken, byref(size)) == OK
        content = ctypes.create_string_buffer(size.value)
        assert self.SerializeFMUstate(taken, content, size) == OK
        if state is None:
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

    def begin_continuous_time(self, **start: float) -> Native:
        """Initialize an instance of model exchange up to continuous-time mode."""
        self.initialize(**start)
        assert self.NewDiscreteStates(byref(fmi2EventInfo())) == OK
        assert self.EnterContinuousTimeMode() == OK
        return self

    def at(self, time: float, displacement: float) -> Native:
        """Evaluate model exchange at a point."""
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

    def event(self, displacement: float | None = None) -> None:
        """Go through event mode, where the displacement may jump."""
        assert self.EnterEventMode() == OK
        if displacement is not None:
            assert self.set(displacement=displacement) == OK
        assert self.NewDiscreteStates(byref(fmi2EventInfo())) == OK
        assert self.EnterContinuousTimeMode() == OK


def doubles(values: Any) -> ctypes.Array[c_double]:
    return (c_double * len(values))(*values)
