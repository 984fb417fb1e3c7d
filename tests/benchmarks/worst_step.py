"""What the worst step of the kernel costs: python tests/benchmarks/worst_step.py [--steps 1e7] [--core FOLDER]

A step is a commit, the force, the stiffness, omega and, with energies, the energy integrated and read. Adversarial
paths are followed several times, and the least time of each step counts, so that the machine's noise is out; nothing
is asserted.
"""

from __future__ import annotations

import argparse
import ctypes
import itertools
import math
import platform
import sys
import tempfile
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))
import strandspring
from kernel_tools import c_parameters
from strandspring import SpringParameters
from strandspring.compiled import zig
from strandspring.compiled.targets import host_target

N, SIGMA = (0.05, 0.5, 1.0, 2.0, 10.0, 100.0), (0.5, 1.0, 10.0, 1000.0)
SATURATIONS = (0.1, 0.7, 3.0, 10.0, 50.0, 400.0, 1e4)  # rho times the range
DEGREES = range(9)
ROUNDS = 7
EVICTED = 48 << 20
SEED = 16
RANGE = 0.02  # [m]
console = Console(width=130)


def driver(folder: Path, core: Path) -> ctypes.CDLL:
    """The kernel with the options of the FMU, and the loops that time it."""
    here = Path(__file__).parent
    sources = {path.name: path.read_bytes() for path in core.iterdir() if path.suffix in (".c", ".h")}
    sources |= {name: (here / name).read_bytes() for name in ("worst_step.c", "ticks.h")}
    flags = ("-O2", "-D_GNU_SOURCE", "-Wno-unused-function")
    library = folder / "worst.so"
    library.write_bytes(zig.shared_library(host_target(), sources, ("worst_step.c",), "worst", flags))
    loaded = ctypes.CDLL(str(library))
    loaded.worst_spring.restype = ctypes.c_void_p
    loaded.worst_free.argtypes = [ctypes.c_void_p]
    loaded.worst_ticks_per_ns.restype = loaded.worst_tabulate.restype = loaded.worst_steps.restype = ctypes.c_double
    loaded.worst_steps.argtypes = [
        ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t, ctypes.c_void_p,
    ]  # fmt: skip
    return loaded


def spring(n: float, sigma: float, saturations: float, degree: int) -> SpringParameters:
    """FA is 1 + 0.9*T(x~) but for its scale; FE is of the same degree."""
    wave = np.polynomial.chebyshev.cheb2poly([1.0, *(0.0,) * (degree - 1), 0.9] if degree else [1.0])
    powers = (2.0 / RANGE) ** np.arange(degree + 1)
    kA = wave / wave[0] * powers
    kE = np.random.default_rng(degree).uniform(-1.0, 1.0, degree + 1) * powers
    rho = saturations / RANGE
    return SpringParameters(
        tuple(kE), tuple(kA), 25.0, rho, sigma, n, 0.05, 0.05 - RANGE / 2, 0.05 + RANGE / 2
    )  # fmt: skip


def adversarial_path(random: np.random.Generator, count: int) -> np.ndarray:
    """Jumps over the range and beyond, a turn at every step or at some, of all sizes, in stretches."""
    path = [0.05]
    way = 1.0
    while len(path) < count:
        kind, length = random.integers(5), int(random.integers(5, 60))
        if kind == 0:  # from anywhere to anywhere
            path.extend(random.uniform(0.05 - 0.8 * RANGE, 0.05 + 0.8 * RANGE, length))
        elif kind == 1:  # a turn at every step, long
            size = random.uniform(0.2, 1.3) * RANGE / 2
            path.extend(0.05 + size * random.uniform(0.5, 1.0, length) * (-1.0) ** np.arange(length))
        elif kind == 2:  # a turn at every step, of any size
            size = RANGE * 10.0 ** random.uniform(-8.0, 0.0, length)
            path.extend(path[-1] + np.cumsum(size * (-1.0) ** np.arange(length)))
        elif kind == 3:  # without turns
            way = -way
            size = RANGE * 10.0 ** random.uniform(-5.0, 0.0)
            path.extend(path[-1] + way * np.cumsum(random.uniform(0.0, size, length)))
        else:  # within the range
            path.extend(random.uniform(0.05 - RANGE / 2, 0.05 + RANGE / 2, length))
        path[-1] = float(np.clip(path[-1], 0.05 - 3.0 * RANGE, 0.05 + 3.0 * RANGE))
    return np.array(path[:count])


def timed(
    kernel: ctypes.CDLL, parameters: SpringParameters, path: np.ndarray, energies: bool, evicted: int
) -> np.ndarray:
    """Ticks of each step."""
    handle = kernel.worst_spring(ctypes.byref(c_parameters(parameters)), 3 if energies else 1)
    ticks = np.zeros(path.size, np.uint32)
    kernel.worst_steps(
        handle, energies, path.size, path.ctypes.data, 2 if evicted else ROUNDS, evicted, ticks.ctypes.data
    )
    kernel.worst_free(handle)
    return ticks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=float, default=1e7)
    parser.add_argument("--core", type=Path, default=Path(strandspring.__file__).parent / "core" / "c" / "spring")
    parser.add_argument("--degrees", type=int, nargs="*", default=list(DEGREES))
    chosen = parser.parse_args()
    cases = list(itertools.product(N, SIGMA, SATURATIONS))
    count = max(math.ceil(chosen.steps / len(DEGREES) / len(cases)), 50)
    with tempfile.TemporaryDirectory() as folder:
        kernel = driver(Path(folder), chosen.core)
        per_ns = kernel.worst_ticks_per_ns()
        sizes = (ctypes.c_size_t * 3)()
        kernel.worst_sizes(sizes)
        console.print(f"{platform.machine()}, seed {SEED}, {count} steps of each of {len(cases)} "
                      f"springs of a degree; table {sizes[0]} bytes, law {sizes[1]}, memory {sizes[2]}")  # fmt: skip
        table = Table(title="One step [ns]")
        for column in (
            "degree",
            "energy",
            "worst",
            "99.99 %",
            "median",
            "worst/median",
            "worst at",
            "evicted: worst",
            "median",
        ):
            table.add_column(column, justify="right")
        for energies, degree in itertools.product((False, True), chosen.degrees):
            random = np.random.default_rng(SEED + degree)
            found, worst, cold = [], (0, cases[0]), []
            for k, case in enumerate(cases):
                parameters, path = spring(*case, degree), adversarial_path(random, count)
                ticks = timed(kernel, parameters, path, energies, 0)
                found.append(ticks)
                worst = max(worst, (int(ticks.max()), case))
                if k % 31 == 0:
                    cold.append(timed(kernel, parameters, path[:12], energies, EVICTED))
            each, chilled = np.concatenate(found) / per_ns, np.concatenate(cold) / per_ns
            median = float(np.median(each))
            table.add_row(
                str(degree), "yes" if energies else "no", f"{each.max():.0f}", f"{np.quantile(each, 0.9999):.0f}",
                f"{median:.0f}", f"{each.max() / median:.1f}", ", ".join(f"{value:g}" for value in worst[1]),
                f"{chilled.max():.0f}", f"{np.median(chilled):.0f}",
            )  # fmt: skip
        console.print(table)
        for with_, name in (
            (0, "W alone"),
            (1, "with derivatives"),
            (2, "with energies"),
            (3, "with both"),
            (4, "coarse"),
        ):
            times = [kernel.worst_tabulate(ctypes.byref(c_parameters(spring(n, s, 3.0, 8))), with_, 30)
                     for n in N for s in SIGMA]  # fmt: skip
            console.print(f"Table and law {name}: {np.median(times) / 1e3:.0f} us, at most {max(times) / 1e3:.0f} us")


if __name__ == "__main__":
    main()
