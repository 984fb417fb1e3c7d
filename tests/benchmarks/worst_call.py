"""What the worst step of an FMU for real time costs: python tests/benchmarks/worst_call.py [--steps 1e7]

As worst_step.py, by the calls of FMI 3.0: displacement set, step done, all outputs read. Each path is followed several
times by the same instance, reset in between, and the least time of each step counts, so that the machine's noise is
out; nothing is asserted.
"""

from __future__ import annotations

import argparse
import ctypes
import itertools
import platform
import tempfile
from _ctypes import dlclose
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from worst_step import DEGREES, ROUNDS, SATURATIONS, SEED, SIGMA, N, adversarial_path, spring

from strandspring import SpringParameters
from strandspring.compiled import zig
from strandspring.compiled.images import FMU, image
from strandspring.compiled.sources import FMI_HEADERS, fmi_header
from strandspring.compiled.targets import host_target
from strandspring.fmu.native.block import NativeForm, filled
from strandspring.model.modelfile import ModelFile

GUID = "{00000000-0000-0000-0000-000000000000}"
console = Console(width=100)


class Calls(ctypes.Structure):
    """As in worst_call.c."""

    _fields_ = [*((name, ctypes.c_void_p) for name in ("set", "step", "get", "instance", "input", "outputs")),
                ("output_count", ctypes.c_size_t)]  # fmt: skip


def driver(folder: Path) -> ctypes.CDLL:
    """The loops that time the calls."""
    sources = {name: fmi_header(name) for name in FMI_HEADERS[3]}
    here = Path(__file__).parent
    sources |= {name: (here / name).read_bytes() for name in ("worst_call.c", "ticks.h")}
    library = folder / "worst.so"
    flags = ("-O2", "-D_GNU_SOURCE", "-Wno-strict-prototypes")
    library.write_bytes(zig.shared_library(host_target(), sources, ("worst_call.c",), "worst", flags))
    loaded = ctypes.CDLL(str(library))
    loaded.worst_ticks_per_ns.restype = ctypes.c_double
    loaded.worst_calls.argtypes = [
        ctypes.c_void_p, ctypes.c_double, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p,
    ]  # fmt: skip
    return loaded


def timed(
    kernel: ctypes.CDLL, folder: Path, parameters: SpringParameters, path: np.ndarray, energies: bool, rounds: int
) -> np.ndarray:
    """Ticks of each step of one FMU, which is made and thrown away."""
    binary = folder / "spring.so"
    form = NativeForm(real_time=True, no_energy=not energies)
    binary.write_bytes(filled(image(FMU, host_target()).read_bytes(), ModelFile("spring", parameters), GUID, form))
    fmu = ctypes.CDLL(str(binary))
    fmu.fmi3InstantiateCoSimulation.restype = ctypes.c_void_p
    begin = [ctypes.c_char_p(b"spring"), ctypes.c_char_p(GUID.encode()), None, False, False, False, False, None]
    instance = ctypes.c_void_p(fmu.fmi3InstantiateCoSimulation(*begin, ctypes.c_size_t(0), None, None, None))
    inputs, outputs = (ctypes.c_uint32 * 1)(1), (ctypes.c_uint32 * 4)(2, 3, 6, 4)
    calls = Calls(
        *(ctypes.cast(getattr(fmu, f"fmi3{name}"), ctypes.c_void_p) for name in ("SetFloat64", "DoStep", "GetFloat64")),
        instance, ctypes.addressof(inputs), ctypes.addressof(outputs), 4 if energies else 3,
    )  # fmt: skip
    ticks = np.full(path.size, np.iinfo(np.uint32).max, np.uint32)
    for _ in range(rounds):
        status = fmu.fmi3EnterInitializationMode(
            instance, False, ctypes.c_double(), ctypes.c_double(), False, ctypes.c_double()
        )
        status |= fmu.fmi3SetFloat64(instance, inputs, ctypes.c_size_t(1), path[:1].ctypes, ctypes.c_size_t(1))
        status |= fmu.fmi3ExitInitializationMode(instance)
        status |= kernel.worst_calls(ctypes.byref(calls), 0.0, path.size, path.ctypes.data, ticks.ctypes.data)
        status |= fmu.fmi3Reset(instance)
        if status:
            raise RuntimeError(f"a call returned {status}")
    fmu.fmi3FreeInstance(instance)
    dlclose(fmu._handle)
    return ticks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--steps", type=float, default=1e7, help="of all degrees together, with and without energy each"
    )
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--degrees", type=int, nargs="*", default=list(DEGREES))
    chosen = parser.parse_args()
    cases = list(itertools.product(N, SIGMA, SATURATIONS))
    count = max(int(chosen.steps / len(chosen.degrees) / len(cases)), 50)
    table = Table(title="One step by FMI 3.0, all outputs read [ns]")
    for column in ("degree", "energy", "worst", "99.99 %", "median", "worst/median", "worst at n, sigma, rho range"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        kernel = driver(Path(folder))
        per_ns = kernel.worst_ticks_per_ns()
        for energies, degree in itertools.product((False, True), chosen.degrees):
            random = np.random.default_rng(SEED + degree)
            found, worst = [], (0, cases[0])
            for case in cases:
                path = adversarial_path(random, count)
                ticks = timed(kernel, Path(folder), spring(*case, degree), path, energies, chosen.rounds)
                found.append(ticks)
                worst = max(worst, (int(ticks.max()), case))
            each = np.concatenate(found) / per_ns
            median = float(np.median(each))
            table.add_row(
                str(degree), "yes" if energies else "no", f"{each.max():.0f}", f"{np.quantile(each, 0.9999):.0f}",
                f"{median:.0f}", f"{each.max() / median:.1f}", ", ".join(f"{value:g}" for value in worst[1]),
            )  # fmt: skip
    console.print(
        f"{platform.machine()}, seed {SEED}, {count} steps of each of {len(cases)} springs of a degree, "
        f"{2 * len(chosen.degrees) * len(cases) * count:.3g} in all"
    )
    console.print(table)


if __name__ == "__main__":
    main()
