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
    callbacks : fmi2CallbackFunctions   Argument for instantiating the FMU.
    """

    def __init__(self) -> None:
        super().__init__()
        self.callbacks = fmi2CallbackFunctions()
        # FMPy's proxy, which fills in placeholders, forwards to the logger registered last. So there is one logger for
        # all, and the environment identifies the instance.
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = defaultCallbacks.allocateMemory
        self.callbacks.freeMemory = defaultCallbacks.freeMemory
        self.callbacks.componentEnvironment = next(_keys)
        _instances[self.callbacks.componentEnvironment] = self
        if _proxies is not None:
            _proxies.addLoggerProxy(byref(self.callbacks))


_keys = count(1)
_instances: WeakValueDictionary[int, Messages] = WeakValueDictionary()


def _receive(environment: int, _name: Any, _status: int, _category: Any, message: bytes) -> None:
    messages = _instances.get(environment)
    if messages is not None:
        messages.append(message.decode("utf-8", "replace"))


_LOGGER = fmi2CallbackLoggerTYPE(_receive)
