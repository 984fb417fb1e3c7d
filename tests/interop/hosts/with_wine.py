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
        # Both copies want the same address, so one of them is moved.
        libraries = [unpacked(Path(fmu), "win64", folder / copy) for copy in ("one", "two")]
        host, settings = windows_host(folder, program)
        values = responses(host, Path(fmu), libraries, displacement(TIMES), env=settings)
    np.testing.assert_array_equal(values[:, 0], values[:, 1])
    return TIMES, *values[:, 0].T
