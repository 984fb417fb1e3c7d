"""Time stepping in C on the kernel's spring, which harmonic balance is compared with."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import host_target
from strandspring.compiled.zig import shared_library
from strandspring.kernel.arrays import address
from strandspring.kernel.path import Law
from strandspring.vibration.one_mass.system import IsolatedMass, static_equilibrium
from tools import tool

REPEAT, MOST_PERIODS = 1e-5, 100_000


@dataclass(frozen=True)
class Stepped:
    """What time stepping ends in: first harmonic [m], half the stroke [m], periods run."""

    relative: complex
    amplitude: float
    periods: int


class Verlet:
    """A mass on springs under base displacement, stepped in equal parts of a period; compiled as the kernel is."""

    def __init__(self, system: IsolatedMass) -> None:
        tool("ziglang")
        unit = "kernel/c/verlet.c"
        sources = KERNEL.sources() | {unit: (Path(__file__).parent / "verlet.c").read_bytes()}
        target = host_target()
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            file = Path(folder) / f"verlet{target.system.suffix}"
            file.write_bytes(shared_library(target, sources, (unit,), "verlet", KERNEL.flags))
            self._library = ctypes.CDLL(str(file))
        for function in (self._library.verlet, self._library.verlet_accelerated):
            pointer, number = ctypes.c_void_p, ctypes.c_int
            function.argtypes = pointer, pointer, number, pointer, number, pointer
        self._library.verlet_accelerated.argtypes += (ctypes.c_void_p,)
        self._system = system
        self._law = Law(system.spring)
        self._start = static_equilibrium(system).displacement

    def run(self, level: float, frequency: float, steps: int = 512) -> Stepped:
        """Step from rest until periods repeat."""
        found = np.empty(3)
        periods = self._library.verlet(*self._arguments(level, frequency, steps), address(found))
        return _stepped(found, periods)

    def sweep(self, level: float, frequencies: Sequence[float], steps: int) -> list[Stepped]:
        """The fixed points of one period by Anderson's acceleration, each from the one before."""
        state, results = np.array([self._start, 0.0, 0.0]), []
        for frequency in frequencies:
            found = np.empty(3)
            arguments = self._arguments(level, frequency, steps)
            periods = self._library.verlet_accelerated(*arguments, address(state), address(found))
            results.append(_stepped(found, periods))
        return results

    def _arguments(self, level: float, frequency: float, steps: int) -> tuple[object, ...]:
        s = self._system
        strength = s.mass * (2.0 * np.pi * frequency) ** 2 * level
        shaking = (ctypes.c_double * 9)(
            s.parallel, s.series, s.mass, s.damping, s.static_load, strength, frequency, self._start, REPEAT
        )
        return self._law.address, shaking, steps, address(_wave(steps)), MOST_PERIODS


def _stepped(found: np.ndarray, periods: int) -> Stepped:
    assert periods > 0
    return Stepped(complex(found[0], -found[1]), float(found[2]), periods)


@cache
def _wave(steps: int) -> np.ndarray:
    """Cosine and sine at each step of a period."""
    phase = 2.0 * np.pi * np.arange(steps) / steps
    return np.column_stack([np.cos(phase), np.sin(phase)]).copy()
