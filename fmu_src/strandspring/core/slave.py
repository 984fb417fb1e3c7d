"""The spring as a slave of pythonfmu: every call goes to `SpringInstance`; messages wait in the slave's log queue.

The binary of pythonfmu 0.7 answers an exception with fmi2Fatal and its text.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import wraps
from typing import Any, ClassVar

from .facade import Fmi2Slave, Fmi2Status
from .instance import RefusedCallError, SpringInstance
from .parameters import SpringParameters
from .state import State, from_bytes, to_bytes


def _survived(method: Callable[..., Any]) -> Callable[..., Any]:
    """The method, after whose exceptions the instance can still be used and freed.

    The binary releases the slave, its class and its log with each exception, and again with the instance: without
    another reference to each, the host would crash.
    """

    @wraps(method)
    def call(self: SpringSlave, *arguments: Any) -> Any:
        try:
            return method(self, *arguments)
        except BaseException:
            for released in (self, type(self), self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(released))
            raise

    return call


def _reader(kind: str) -> Callable[..., Any]:
    """The method that reads variables of one type."""
    return _survived(lambda self, vrs: self._spring.read(vrs, kind))


def _writer(kind: str) -> Callable[..., Any]:
    """The method that sets variables of one type."""
    return _survived(lambda self, vrs, values: self._spring.write(vrs, values, kind))


class SpringSlave(Fmi2Slave):  # type: ignore[misc]
    """Base of the slave class that each FMU defines with its own parameters.

    Attributes
    ----------
    identified : SpringParameters   Start values of the parameters.
    omegas : (float, float)         Start values of omega of both mechanisms.
    fmu_guid : str                  GUID of the FMU.
    """

    identified: ClassVar[SpringParameters]
    omegas: ClassVar[tuple[float, float]]
    fmu_guid: ClassVar[str]

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._spring = SpringInstance(self.identified, lambda text: self.log(text, Fmi2Status.warning), self.omegas)

    @_survived
    def exit_initialization_mode(self) -> None:
        self._spring.end_initialization()

    @_survived
    def do_step(self, current_time: float, step_size: float) -> bool:
        self._spring.step(current_time, step_size)
        return True

    get_real = _reader("Real")
    get_integer = _reader("Integer")
    get_boolean = _reader("Boolean")
    get_string = _reader("String")
    set_real = _writer("Real")
    set_integer = _writer("Integer")
    set_boolean = _writer("Boolean")
    set_string = _writer("String")

    def _get_fmu_state(self) -> State:
        return self._spring.state

    @_survived
    def _set_fmu_state(self, state: State | str) -> None:
        if isinstance(state, str):
            raise RefusedCallError(state)
        self._spring.revert(state)

    @classmethod
    def _fmu_state_to_bytes(cls, state: State | str) -> bytes:
        return state.encode("utf-8") if isinstance(state, str) else to_bytes(state, cls.fmu_guid)

    @classmethod
    def _fmu_state_from_bytes(cls, data: bytes) -> State | str:
        """The state or, where an exception would cost an unknown instance, the sentence with which it is refused."""
        try:
            return from_bytes(data, cls.fmu_guid)
        except ValueError as problem:
            return str(problem)
