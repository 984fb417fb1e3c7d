"""What the compiled kernel costs as Python calls it, as ratios within one run: python tests/benchmarks/kernel.py

`Spring.response` is compared with a C loop of `pow` over as many samples, compiled for the same target with the same
options. Machines are noisy, so nothing here is asserted; both sides take turns, and each figure is the best of several.
"""

from __future__ import annotations

import ctypes
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from strandspring import Spring, SpringParameters

SPRING = SpringParameters(
    (5.0, 3000.0, 2e4, 1e6), (1.0, 10.0, 100.0), 25.0, 400.0, 1.0, 0.5, 0.05, 0.03, 0.07
)  # fmt: skip
# Amplifiers of higher degree, whose moments may not serve for the energy.
DEGREES = (2, 4, 8)
ROUNDS = 9
SMOOTH, TURNING, MANY = 1_000_000, 100_000, 10_000_000
POW_LOOP = """
#include <math.h>
#include <stddef.h>
void powers(size_t count, const double *x, double exponent, double *result)
{
    for (size_t i = 0; i < count; i++)
        result[i] = pow(x[i], exponent);
}
"""
console = Console(width=110)


def smooth_path(samples: int = SMOOTH, cycles: int = 20) -> np.ndarray:
    return 0.05 + 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi * cycles, samples))


def turning_path(samples: int = TURNING) -> np.ndarray:
    """A path of random strokes, each to the other side of the one before: every sample turns."""
    size = np.random.default_rng(1).uniform(0.0, 0.02, samples)
    return 0.05 + size * (-1.0) ** np.arange(samples)


def compiled_powers(folder: Path) -> ctypes.CDLL:
    """The loop of `pow`, by the compiler and with the options of the kernel."""
    source, library = folder / "powers.c", folder / "powers.so"
    source.write_text(POW_LOOP)
    subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-O3", "-std=c11", "-ffp-contract=off", "-shared", "-fPIC",
         "-o", library, source, "-lm"],
        check=True,
    )  # fmt: skip
    return ctypes.CDLL(str(library))


def in_turns(works: list[Callable[[], object]]) -> list[float]:
    """Shortest processor time of each of several works that take turns [s]."""
    times = [[] for _ in works]
    for _ in range(ROUNDS):
        for k, work in enumerate(works):
            begin = time.process_time()
            work()
            times[k].append(time.process_time() - begin)
    return [min(each) for each in times]


def response_against_pow() -> None:
    spring = Spring(SPRING)
    table = Table(title="Python calls against a C loop of pow(x, 0.5001) over as many samples, degrees (3,2)")
    for column in ("path", "quantity", "ns/sample", "pow ns/sample", "ratio", "target"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        library = compiled_powers(Path(folder))
        for name, path, target in (("smooth", smooth_path(), 1.2), ("all turning", turning_path(), 8.0)):
            x, result = np.random.default_rng(0).uniform(0.0, 1.0, path.size), np.empty(path.size)

            def powers(x: np.ndarray = x, result: np.ndarray = result) -> None:
                library.powers(
                    ctypes.c_size_t(x.size), ctypes.c_void_p(x.ctypes.data), ctypes.c_double(0.5001),
                    ctypes.c_void_p(result.ctypes.data),
                )  # fmt: skip

            for method in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
                ours, theirs = in_turns([lambda m=method, p=path: m(p), powers])
                table.add_row(
                    name, method.__name__, f"{1e9 * ours / path.size:.1f}", f"{1e9 * theirs / path.size:.1f}",
                    f"{ours / theirs:.2f}", f"<= {target}" if method == spring.response else "",
                )  # fmt: skip
    console.print(table)


def degrees() -> None:
    table = Table(title="Amplifiers of higher degree, all turning [ns/sample]")
    for column in ("degree", "response", "absorbed_energy"):
        table.add_column(column, justify="right")
    path = turning_path(20_000)
    for degree in DEGREES:
        weights = np.random.default_rng(degree).uniform(-1.0, 1.0, degree)
        weights *= 0.9 / np.sum(np.abs(weights))
        kA = (1.0, *(float(w) / 0.02 ** (i + 1) for i, w in enumerate(weights)))
        spring = Spring(SpringParameters(SPRING.kE, kA, 25.0, 400.0, 1.0, 0.5, 0.05, 0.03, 0.07))
        times = in_turns([lambda s=spring: s.response(path), lambda s=spring: s.absorbed_energy(path)])
        table.add_row(str(degree), *(f"{1e9 * each / path.size:.0f}" for each in times))
    console.print(table)


def memory() -> None:
    """Peak memory of a path of 1e7 samples beyond the arrays given and returned, in a process of its own."""
    done = subprocess.run([sys.executable, __file__, "--memory"], capture_output=True, text=True, check=True)
    console.print(done.stdout.strip())


def measure_memory() -> None:
    spring, path = Spring(SPRING), smooth_path(MANY, 200)
    spring.response(path[:1000])
    tracemalloc.start()
    force = spring.response(path)
    traced = tracemalloc.get_traced_memory()[1] - force.nbytes
    tracemalloc.stop()
    del force
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    spring.response(path)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(
        f"Memory of {MANY:g} samples beyond input and output (target: at most 32 bytes a sample): "
        f"{traced / MANY:.4f} bytes a sample traced by Python; peak resident size of a second call "
        f"{1024 * grown / MANY:.2f} bytes a sample above the first."
    )


if __name__ == "__main__":
    if sys.argv[1:] == ["--memory"]:
        measure_memory()
    else:
        console.print(f"Python {platform.python_version()}, NumPy {np.__version__}, {os.cpu_count()} cores")
        response_against_pow()
        degrees()
        memory()
