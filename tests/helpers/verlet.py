"""Time stepping in C on the kernel's spring, which harmonic balance is compared with."""

from __future__ import annotations

import ctypes
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import host_target
from strandspring.compiled.zig import shared_library
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
    """A mass on springs under base displacement, stepped from rest; compiled as the kernel is."""

    def __init__(self, system: IsolatedMass) -> None:
        tool("ziglang")
        unit = "kernel/c/verlet.c"
        sources = KERNEL.sources() | {unit: (Path(__file__).parent / "verlet.c").read_bytes()}
        target = host_target()
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            file = Path(folder) / f"verlet{target.system.suffix}"
            file.write_bytes(shared_library(target, sources, (unit,), "verlet", KERNEL.flags))
            self._verlet = ctypes.CDLL(str(file)).verlet
        self._verlet.argtypes = ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p
        self._system = system
        self._law = Law(system.spring)
        self._start = static_equilibrium(system).displacement

    def run(self, level: float, frequency: float) -> Stepped:
        """Step until periods repeat."""
        s = self._system
        strength = s.mass * (2.0 * np.pi * frequency) ** 2 * level
        shaking = (ctypes.c_double * 9)(
            s.parallel, s.series, s.mass, s.damping, s.static_load, strength, frequency, self._start, REPEAT
        )
        found = (ctypes.c_double * 3)()
        periods = self._verlet(self._law.address, shaking, MOST_PERIODS, found)
        assert periods > 0
        return Stepped(complex(found[0], -found[1]), found[2], periods)
