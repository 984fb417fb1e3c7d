"""C sources of the package, and the headers of FMI, which FMPy brings."""

from __future__ import annotations

import posixpath
import re
from importlib.util import find_spec
from pathlib import Path

from ..errors import BuildError

PACKAGE = Path(__file__).resolve().parent.parent

# By version of FMI.
FMI_HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}

_INCLUDED = re.compile(rb'^ *#include "([^"]+)"', re.MULTILINE)


def c_sources(*files: str) -> dict[str, bytes]:
    """Content of each C file by its path below the package: of these and of all that they include, but for FMI's."""
    contents: dict[str, bytes] = {}
    waiting = list(files)
    while waiting:
        path = waiting.pop()
        if path not in contents:
            contents[path] = (PACKAGE / path).read_bytes()
            folder = posixpath.dirname(path)
            included = (posixpath.join(folder, name.decode()) for name in _INCLUDED.findall(contents[path]))
            waiting += [posixpath.normpath(name) for name in included if (PACKAGE / name).is_file()]
    return dict(sorted(contents.items()))


def sources_in_fmu(file: str, fmi: int) -> dict[str, bytes]:
    """Those of the FMU that a file is all of, with FMI's headers unless importers have them, as those of FMI 3.0 do."""
    return c_sources(file) | (fmi_headers(fmi) if fmi == 2 else {})


def fmi_headers(fmi: int) -> dict[str, bytes]:
    """The headers of a version of FMI by their path below the package, beside the source that includes them."""
    return {f"core/c/fmi{fmi}/{name}": fmi_header(name) for name in FMI_HEADERS[fmi]}


def fmi_header(name: str) -> bytes:
    """A header of FMI, which FMPy brings.

    Raises
    ------
    BuildError   If it is not there.
    """
    # Not by importing it, which takes long.
    specification = find_spec("fmpy")
    folders = [] if specification is None else list(specification.submodule_search_locations or ())
    try:
        return Path(*folders, "c-code", name).read_bytes()
    except OSError:
        raise BuildError(f"The header {name} is missing; install fmpy 0.3.20 or newer.") from None
