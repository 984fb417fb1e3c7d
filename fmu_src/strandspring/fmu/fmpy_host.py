"""The library of an FMU that FMPy must load on this computer.

FMPy assumes that every computer has an x86 processor, so the path of the library is always given to it.
"""

from __future__ import annotations

from pathlib import Path

import fmpy

from .native.platforms import host_folder


def library_path(unzipped: str, model_identifier: str) -> str:
    """The shared library of an unzipped FMU for this computer; FMPy raises if there is none."""
    return str(Path(unzipped, "binaries", str(host_folder()), f"{model_identifier}{fmpy.sharedLibraryExtension}"))
