"""Log messages of FMUs, collected in a list per instance instead of printed."""

from __future__ import annotations

from ctypes import byref
from itertools import count
from typing import Any
from weakref import WeakValueDictionary

from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

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


_keys = count(1)
_instances: WeakValueDictionary[int, Messages] = WeakValueDictionary()


def _receive(environment: int, _name: Any, status: int, category: bytes, message: bytes) -> None:
    messages = _instances.get(environment)
    if messages is not None:
        messages._append(environment, status, category, message)


_LOGGER = fmi2CallbackLoggerTYPE(_receive)
