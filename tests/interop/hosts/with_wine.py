"""The same simulator for Windows, run by wine."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from motion import TIMES, displacement
from portable_host import responses, unpacked, windows_host, wine


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    program = wine()
    assert program is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        library = unpacked(Path(fmu), "win64", folder / "fmu")
        host, settings = windows_host(folder, program)
        values = responses(host, Path(fmu), [library], displacement(TIMES), env=settings)
    return TIMES, *values[:, 0].T
