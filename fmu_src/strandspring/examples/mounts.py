"""Stranded wire springs of the examples, and their FMUs.

Their parameters are plausible, not measured: hardening and asymmetric, with a tenth to a third of the force from
friction between the strands.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..core.parameters import SpringParameters
from ..fmu.native.native_fmu import build_native_fmu
from ..fmu.python_backed import build_python_fmu
from ..model.modelfile import ModelFile

BACKENDS: dict[str, Callable[..., Path]] = {"native": build_native_fmu, "python": build_python_fmu}

# Carries about 5 kg at 50 mm of compression, with a natural frequency of 11 Hz.
EQUIPMENT_MOUNT = SpringParameters(
    kE=(50.0, 2.0e4, 1.0e5, 2.0e7), kA=(1.0, 10.0, 100.0), kappa_omega=15.0, rho=400.0, sigma=1.0, n=0.5,
    displacement_offset=0.05, displacement_min=0.02, displacement_max=0.08,
)  # fmt: skip

# Two mounts of one series, under the light and the heavy end of a platform.
SOFT_CORNER = SpringParameters(
    kE=(120.0, 1.5e4, 8.0e4, 1.0e7), kA=(1.0, 6.0), kappa_omega=18.0, rho=350.0, sigma=1.2, n=0.8,
    displacement_offset=0.03, displacement_min=0.01, displacement_max=0.05,
)  # fmt: skip
STIFF_CORNER = SpringParameters(
    kE=(180.0, 2.4e4, 1.2e5, 1.5e7), kA=(1.0, 8.0, 60.0), kappa_omega=30.0, rho=300.0, sigma=1.0, n=0.6,
    displacement_offset=0.03, displacement_min=0.01, displacement_max=0.05,
)  # fmt: skip

# Between a gun and its mount: 0 is the battery position, where the spring is unloaded.
RECOIL_SPRING = SpringParameters(
    kE=(0.0, 1.2e4, 4.0e4, 1.0e6), kA=(1.0, 4.0), kappa_omega=160.0, rho=150.0, sigma=1.5, n=0.7,
    displacement_offset=0.0, displacement_min=-0.06, displacement_max=0.08,
)  # fmt: skip


def build_example_fmu(parameters: SpringParameters, name: str, folder: Path, backend: str = "native") -> Path:
    """Build the FMU of a spring in a folder; displacement is counted as in the parameters."""
    return BACKENDS[backend](ModelFile(name, parameters), folder, zero=0.0)


@contextmanager
def example_arguments(description: str | None) -> Iterator[tuple[Path, str]]:
    """A temporary folder, and the back end selected on the command line."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--backend", choices=list(BACKENDS), default="native", help="of the spring FMUs")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        yield Path(folder), arguments.backend
