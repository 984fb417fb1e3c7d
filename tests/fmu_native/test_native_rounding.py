"""FMUs of hosts that round otherwise than to the nearest return, and are as accurate."""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmu_tools import SPRING, built
from kernel_tools import HERE
from native_tools import library
from strandspring.core.parameters import SpringParameters
from system_fmu3_tools import system_library3
from system_fmu_tools import BOX, system_library

SPRINGS, STEPS = 20, 60
# By name as in fenv.h of the processor.
MODES = {
    "x86_64": {"nearest": 0, "downward": 0x400, "upward": 0x800, "towards zero": 0xC00},
    "aarch64": {"nearest": 0, "upward": 0x400000, "downward": 0x800000, "towards zero": 0xC00000},
}

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() not in MODES, reason="sets the rounding of these"
)


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray | str]:
    """Drawn springs, a path for each, and FMUs; a system has drawn springs, two each."""
    random = np.random.default_rng(52)
    n, sigma = 10.0 ** random.uniform(-2.0, 2.0, SPRINGS), 0.5 + 10.0 ** random.uniform(-2.0, 2.99, SPRINGS)
    springs = np.column_stack([310.0 * 10.0 ** random.uniform(-1.0, 1.0, SPRINGS), sigma, n,
                               random.uniform(-1.0, 1.0, SPRINGS)])  # fmt: skip
    low, width = SPRING.displacement_min, SPRING.displacement_max - SPRING.displacement_min
    paths = low + width * random.uniform(-0.2, 1.2, (SPRINGS, STEPS))

    def drawn(k: int) -> Callable[[SpringParameters], SpringParameters]:
        return lambda spring: replace(spring, n=n[2 * k + (spring.n < 1.0)], sigma=sigma[2 * k + (spring.n < 1.0)])

    systems = [BOX.with_springs(drawn(k)) for k in range(SPRINGS // 2)]
    return {
        "springs": springs,
        "paths": paths,
        "python": str(built(tmp_path_factory.mktemp("python"))),
        "fmi2": str(library().folder),
        "fmi3": str(library(fmi=3).folder),
        "fmi2 real time": str(library(real_time=True).folder),
        **{f"system2 {k}": str(system_library(system).folder) for k, system in enumerate(systems)},
        "system3": str(system_library3(systems[0]).folder),
    }


def outputs(given: dict[str, np.ndarray | str], mode: str, folder: Path) -> dict[str, np.ndarray]:
    """All outputs at every step of each instance by the name of the FMU."""
    number = MODES[platform.machine()][mode]
    np.savez(folder / "given.npz", allow_pickle=False, mode=number, **given)
    command = [sys.executable, str(HERE / "rounded.py"), str(folder / "given.npz"), str(folder / "found.npz")]
    # Minutes, where it takes seconds: an instance that never returns.
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return dict(np.load(folder / "found.npz"))


@pytest.fixture(scope="module")
def usual(given: dict[str, np.ndarray | str], tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    return outputs(given, "nearest", tmp_path_factory.mktemp("usual"))


@pytest.mark.parametrize("mode", ["downward", "upward", "towards zero"])
def test_instances_return_and_are_accurate_whatever_the_host_rounds(
    mode: str, given: dict[str, np.ndarray | str], usual: dict[str, np.ndarray], tmp_path: Path
) -> None:
    found = outputs(given, mode, tmp_path)
    assert any(np.any(found[name] != usual[name]) for name in usual)  # so it was rounded otherwise
    for name, expected in usual.items():
        size = np.abs(expected).max(axis=-2, keepdims=True)
        error = np.max(np.abs(found[name] - expected) / np.where(size > 0.0, size, 1.0), axis=-2)
        print(f"{name}, {mode}: {np.max(error):.1e}")
        # Roundings to one side add up over a table's pieces and the path's reversals.
        assert np.max(error) < 1e-10, name
