"""A simulator in C without Python, portable_host.c."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from motion import TIMES, displacement
from portable_host import compiled_host, responses, unpacked
from strandspring.fmu.native.platforms import host_folder


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        library = unpacked(Path(fmu), str(host_folder()), folder / "fmu")
        values = responses(compiled_host(folder), Path(fmu), [library], displacement(TIMES))
    return TIMES, *values[:, 0].T
