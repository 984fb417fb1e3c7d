"""What FMUs log, kept in a list for each instance instead of printed."""

from __future__ import annotations

from ctypes import byref
from itertools import count
from typing import Any
from weakref import WeakValueDictionary

from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

try:
    from fmpy import logging as _proxies
except OSError:  # FMPy has no such library for this computer; messages then keep their placeholders
    _proxies = None


class Messages(list[str]):
    """What one instance logs.

    Attributes
    ----------
    callbacks : fmi2CallbackFunctions   To instantiate the FMU with.
    """

    def __init__(self) -> None:
        super().__init__()
        self.callbacks = fmi2CallbackFunctions()
        # FMPy's proxy, which puts arguments into placeholders, passes on to the logger it saw last: there must be but
        # one, and the environment tells instances apart.
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = defaultCallbacks.allocateMemory
        self.callbacks.freeMemory = defaultCallbacks.freeMemory
        self.callbacks.componentEnvironment = next(_keys)
        _receivers[self.callbacks.componentEnvironment] = self
        if _proxies is not None:
            _proxies.addLoggerProxy(byref(self.callbacks))


_keys = count(1)
_receivers: WeakValueDictionary[int, Messages] = WeakValueDictionary()


def _receive(environment: int, _name: Any, _status: int, _category: Any, message: bytes) -> None:
    receiver = _receivers.get(environment)
    if receiver is not None:
        receiver.append(message.decode("utf-8", "replace"))


_LOGGER = fmi2CallbackLoggerTYPE(_receive)
