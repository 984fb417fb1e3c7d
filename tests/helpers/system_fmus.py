"""FMUs of springs for the tests of co-simulation, each built once."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

from strandspring import SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.modelfile import ModelFile

_FOLDER = tempfile.TemporaryDirectory(prefix="strandspring-fmus-", ignore_cleanup_errors=True)
_BACKENDS: dict[str, Callable[..., Path]] = {"native": build_native_fmu, "python": build_python_fmu}

# Unloaded at 0 and loaded both ways, so that a mass set free returns to it.
RETURNING_MOUNT = SpringParameters(
    kE=(0.0, 1.2e4, 4.0e4, 1.0e6), kA=(1.0, 4.0), kappa_omega=160.0, rho=150.0, sigma=1.5, n=0.7,
    displacement_offset=0.0, displacement_min=-0.06, displacement_max=0.08,
)  # fmt: skip


@cache
def fmu(spring: SpringParameters, backend: str = "native") -> Path:
    """The FMU of a spring; displacement is counted as in the parameters."""
    name = f"spring_{abs(hash(spring))}_{backend}"
    return _BACKENDS[backend](ModelFile(name, spring), Path(_FOLDER.name), zero=0.0)
