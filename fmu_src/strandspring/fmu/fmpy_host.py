"""FMUs on this computer: the folder that holds its binaries, and the library that FMPy must load.

FMPy assumes that every computer has an x86 processor, so the path of the library is always given to it.
"""

from __future__ import annotations

from pathlib import Path

import fmpy

from ..compiled.targets import LINUX_ARM, LINUX_X86, MACOS_ARM, MACOS_X86, WINDOWS_X86, host_target
from ..errors import BuildError

# Below ``binaries/``. The folder darwin64 holds universal binaries.
_FOLDERS = {
    LINUX_X86: "linux64",
    LINUX_ARM: "aarch64-linux",
    WINDOWS_X86: "win64",
    MACOS_X86: "darwin64",
    MACOS_ARM: "darwin64",
}


def host_folder() -> str | None:
    """The folder below ``binaries/`` for this computer; None if our FMUs do not support it."""
    try:
        return _FOLDERS[host_target()]
    except BuildError:
        return None


def library_path(unzipped: str, model_identifier: str) -> str:
    """The shared library of an unzipped FMU for this computer; FMPy raises if there is none."""
    return str(Path(unzipped, "binaries", str(host_folder()), f"{model_identifier}{fmpy.sharedLibraryExtension}"))
