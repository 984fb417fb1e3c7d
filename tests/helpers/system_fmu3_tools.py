"""FMUs of FMI 3.0 of systems, for the tests of their FMI layer: as NativeSystem reaches those of FMI 2.0."""

from __future__ import annotations

import ctypes
import functools
import math
from ctypes import byref, c_bool, c_double, c_size_t, c_uint, c_void_p
from dataclasses import replace
from types import TracebackType
from typing import Any

from fmpy.fmi3 import fmi3LogMessageCallback

from native_tools import OK, Library, doubles
from strandspring.fmu.system.system_variables import SystemFmuOptions
from strandspring.vibration.bodies.mounted import MountedSystem
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem, system_library


def system_library3(system: MountedSystem = BOX, options: SystemFmuOptions = BOX_OPTIONS) -> Library:
    """The FMU of FMI 3.0 of a system, built and unpacked once in a session."""
    return system_library(system, replace(options, fmi=3))


class NativeSystem3(NativeSystem):
    """One instance of it; calls are understood by their names in FMI 2.0, too."""

    def __init__(
        self,
        of: Library | None = None,
        name: str = "one",
        token: str | None = None,
        events: bool = False,
        intermediate: int = 0,
    ) -> None:
        self.library = of or system_library3()
        self.messages: list[tuple[int, str, str]] = []
        self._logger = fmi3LogMessageCallback(
            lambda _, status, category, text: self.messages.append((status, category.decode(), text.decode()))
        )
        self.component = self.library.functions.fmi3InstantiateCoSimulation(
            name.encode(), (token or self.library.guid).encode(), None, c_bool(False), c_bool(True), c_bool(events),
            c_bool(True), None, c_size_t(intermediate), None, self._logger, None,
        )  # fmt: skip

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.library.functions.fmi3FreeInstance(c_void_p(self.component))

    def __getattr__(self, name: str) -> Any:
        call = name.replace("FMUstate", "FMUState").replace("DeSerialize", "Deserialize")
        return functools.partial(getattr(self.library.functions, f"fmi3{call}"), c_void_p(self.component))

    def SetReal(self, references: ctypes.Array[c_uint], count: c_size_t, values: Any) -> int:  # noqa: N802
        """fmi3SetFloat64."""
        return int(self.SetFloat64(references, count, values, count))

    def GetReal(self, references: ctypes.Array[c_uint], count: c_size_t, values: Any) -> int:  # noqa: N802
        """fmi3GetFloat64."""
        return int(self.GetFloat64(references, count, values, count))

    @property
    def extrapolating(self) -> bool:
        found = c_bool()
        assert self.GetBoolean(self.references("extrapolating"), c_size_t(1), byref(found), c_size_t(1)) == OK
        return found.value

    def enter_initialization(self, start_time: float = 0.0, stop_time: float | None = None) -> NativeSystem3:
        stop = 0.0 if stop_time is None else stop_time
        status = self.EnterInitializationMode(
            c_bool(False), c_double(0.0), c_double(start_time), c_bool(stop_time is not None), c_double(stop)
        )
        assert status == OK, self.said
        return self

    def go(self, time: float, size: float) -> int:
        """fmi3DoStep, which never ends early."""
        event, end, early, reached = c_bool(True), c_bool(True), c_bool(True), c_double(math.nan)
        status = int(
            self.DoStep(
                c_double(time), c_double(size), c_bool(True), byref(event), byref(end), byref(early), byref(reached)
            )
        )
        if status == OK:
            assert [event.value, end.value, early.value] == [False, False, False]
            assert reached.value == time + size
        else:  # refused by itself, or since no step may be done
            assert reached.value == self.get("time")[0] or math.isnan(reached.value)
        return status

    def set_so_many(self, count: int, **values: float) -> int:
        """fmi3SetFloat64 of as many values as is said."""
        references, numbers = self.references(*values), doubles([*values.values(), 0.0, 0.0])
        return int(self.SetFloat64(references, c_size_t(len(values)), numbers, c_size_t(count)))
