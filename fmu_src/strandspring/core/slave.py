"""The spring as a slave of pythonfmu: every FMI call goes to `SpringInstance`.

When a callback raises, pythonfmu's binary returns fmi2Fatal and releases references to the instance, its log queue and
its class that it does not own: the host crashes after a few errors. `_keep` adds those references before an exception
leaves a callback. The binary logs the exception's text itself. No message may be queued before it: a logger written
in Python (FMPy's) would be called while the exception is pending, and swallow it, and from Python 3.13 on the message
too.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any, ClassVar
from weakref import WeakSet

from .facade import Fmi2Slave, Fmi2Status
from .instance import SpringInstance
from .parameters import SpringParameters
from .state import State, from_bytes, to_bytes


def _keep(*owned: object) -> None:
    for one in owned:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(one))


def keep_module(namespace: dict[str, Any]) -> None:
    """Add the reference to a slave module's namespace that pythonfmu's binary releases for each instance.

    Without it the namespace of a module that holds no functions is freed with the first instance.
    """
    _keep(namespace)


def _guarded(callback: Callable[..., Any]) -> Callable[..., Any]:
    """A callback of one instance whose exceptions do not corrupt the host."""

    @wraps(callback)
    def run(self: SpringSlave, *arguments: Any) -> Any:
        try:
            return callback(self, *arguments)
        except BaseException:
            _keep(self, self.log_queue, type(self))
            raise

    return run


def _guarded_for_class(callback: Callable[..., Any]) -> Callable[..., Any]:
    """The same for a class method, where the instance is unknown: references to all of them are added."""

    @wraps(callback)
    def run(cls: type[SpringSlave], *arguments: Any) -> Any:
        try:
            return callback(cls, *arguments)
        except BaseException:
            _keep(cls)
            for slave in cls.alive:
                _keep(slave, slave.log_queue)
            raise

    return run


def _reader(kind: str) -> Callable[..., Any]:
    """The callback that reads variables of one type."""
    return _guarded(lambda self, vrs: self._spring.read(vrs, kind))


def _writer(kind: str) -> Callable[..., Any]:
    """The callback that sets variables of one type."""
    return _guarded(lambda self, vrs, values: self._spring.write(vrs, values, kind))


class SpringSlave(Fmi2Slave):  # type: ignore[misc]
    """Base of the slave class that each FMU defines with its own parameters.

    Attributes
    ----------
    identified : SpringParameters   Start values of the parameters.
    fmu_guid : str                  GUID of the FMU.
    alive : WeakSet                 The instances of the class that exist.
    """

    identified: ClassVar[SpringParameters]
    fmu_guid: ClassVar[str]
    alive: ClassVar[WeakSet[SpringSlave]]

    def __init_subclass__(cls) -> None:
        cls.alive = WeakSet()

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.alive.add(self)
        # For each instance the binary adds the FMU's folder to the path, to find the slave's module, and never
        # removes it; the module is loaded by now.
        if self.resources in sys.path:
            sys.path.remove(self.resources)
        self._spring = SpringInstance(
            self.identified,
            warn=lambda message: self.log(message, Fmi2Status.warning),
            refuse=lambda message: self.log(message, Fmi2Status.error),
        )

    @_guarded
    def exit_initialization_mode(self) -> None:
        self._spring.end_initialization()

    @_guarded
    def do_step(self, current_time: float, step_size: float) -> bool:
        return self._spring.step(current_time, step_size)

    get_real = _reader("Real")
    get_integer = _reader("Integer")
    get_boolean = _reader("Boolean")
    get_string = _reader("String")
    set_real = _writer("Real")
    set_integer = _writer("Integer")
    set_boolean = _writer("Boolean")
    set_string = _writer("String")

    @_guarded
    def _get_fmu_state(self) -> State:
        return self._spring.state

    @_guarded
    def _set_fmu_state(self, state: State) -> None:
        self._spring.revert(state)

    @classmethod
    @_guarded_for_class
    def _fmu_state_to_bytes(cls, state: State) -> bytes:
        return to_bytes(state, cls.fmu_guid)

    @classmethod
    @_guarded_for_class
    def _fmu_state_from_bytes(cls, data: bytes) -> State:
        return from_bytes(data, cls.fmu_guid)
