"""The compiled kernel, found, loaded and declared as its C sources define it."""

from __future__ import annotations

import ctypes
import re
from functools import cache

from ..compiled.images import KERNEL, image
from ..compiled.targets import host_target

_TYPES = {"void": None, "int": ctypes.c_int, "size_t": ctypes.c_size_t, "double": ctypes.c_double}
_DEFINITION = re.compile(rf"^({'|'.join(_TYPES)}) (\w+)\(([^)]*)\)\n\{{", re.MULTILINE)


@cache
def library() -> ctypes.CDLL:
    """The library for this computer; its calls release the interpreter's lock.

    Arrays and structures are passed by their addresses.

    Raises
    ------
    BuildError   If it has not been compiled and cannot be compiled now.
    """
    loaded = ctypes.CDLL(str(image(KERNEL, host_target())))
    own = (text.decode("utf-8") for path, text in KERNEL.sources().items() if path.startswith("kernel/"))
    for result, name, arguments in _DEFINITION.findall("".join(own)):
        function = getattr(loaded, name, None)
        if function is not None:  # not one of those that stay within the library
            function.restype = _TYPES[result]
            function.argtypes = [
                ctypes.c_void_p if "*" in argument else _TYPES[argument.split()[0]] for argument in arguments.split(",")
            ]
    return loaded
