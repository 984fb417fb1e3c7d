"""Speed and memory of the spine, printed as ratios within one run: python tests/benchmarks/spine.py

Machines are noisy, so nothing here is asserted; each figure is the best of several repetitions.
"""

from __future__ import annotations

import os
import platform
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from strandspring import Record, Spring, SpringParameters, TwoStageOptions, identify, read_record
from strandspring.fmu.checks.check import running
from strandspring.fmu.python_backed import build_python_fmu

SPRING = SpringParameters(
    (5.0, 3000.0, 2e4, 1e6), (1.0, 10.0, 100.0), 25.0, 400.0, 1.0, 0.5, 0.05, 0.03, 0.07
)  # fmt: skip
console = Console(width=110)


def best(work: Callable[[], object], repetitions: int = 5) -> float:
    """Shortest of several runs [s]."""
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def path(samples: int, cycles: int = 20) -> np.ndarray:
    return 0.05 + 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi * cycles, samples))


def response_against_an_ode_solver() -> None:
    """1e6 samples of the closed form against solve_ivp at the accuracy it reaches on a shorter path."""
    spring = Spring(SPRING)
    long = path(1_000_000)
    closed = long.size / best(lambda: spring.response(long))

    p, cycles, samples = SPRING, 2, 20_000
    short = path(samples, cycles)
    times = np.linspace(0.0, 2.0 * np.pi * cycles, samples)

    def rate(t: float, omega: np.ndarray) -> np.ndarray:
        speed = 0.02 * np.cos(t)
        sign = np.sign(speed) * np.sign(omega)
        return p.rho * speed * (1.0 - (p.sigma * sign - p.sigma + 1.0) * np.abs(omega) ** p.n)

    truth = spring.omega(short)
    table = Table(title="Response: closed form against scipy's solve_ivp (samples per second)")
    for column in ("method", "rtol", "largest omega error", "samples/s", "closed form is faster by"):
        table.add_column(column, justify="right")
    table.add_row("closed form", "-", "< 1e-12 (test_saturation.py)", f"{closed:.3g}", "1")
    for tolerance in (1e-6, 1e-9, 1e-12):

        def integrate(rtol: float = tolerance) -> np.ndarray:
            found = solve_ivp(rate, (0.0, times[-1]), [0.0], "DOP853", times, rtol=rtol, atol=rtol, max_step=0.1)
            return np.asarray(found.y[0])

        error = float(np.max(np.abs(integrate() - truth)))
        speed = samples / best(integrate, 1)
        table.add_row("solve_ivp DOP853", f"{tolerance:g}", f"{error:.1e}", f"{speed:.3g}", f"{closed / speed:.0f}")
    console.print(table)


def identification_time() -> None:
    """Two-stage identification of 1e3, 1e5 and 1e6 samples, in memory and with reading."""
    table = Table(title="Two-stage identification")
    for column in (
        "samples",
        "degrees 3,2 [ms]",
        "automatic [ms]",
        "us/sample (3,2)",
        "reading [ms]",
        "peak memory [MB]",
    ):
        table.add_column(column, justify="right")
    for samples in (1_000, 100_000, 1_000_000):
        x = path(samples, 3 if samples == 1_000 else 20)
        record = Record(x, Spring(SPRING).response(x))
        given = best(lambda r=record: identify(r, TwoStageOptions(degrees=(3, 2))))
        automatic = best(lambda r=record: identify(r, TwoStageOptions()), 3)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "record.csv"
            rows = np.column_stack([np.arange(samples) * 1e-3, x * 1e3, record.force])
            np.savetxt(file, rows, delimiter=",", header="time [s],displacement [mm],force [N]", comments="")
            reading = best(lambda f=file: read_record(f), 3)
        tracemalloc.start()
        identify(record, TwoStageOptions(degrees=(3, 2)))
        peak = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        table.add_row(
            f"{samples}", f"{1e3 * given:.1f}", f"{1e3 * automatic:.1f}", f"{1e6 * given / samples:.3f}",
            f"{1e3 * reading:.0f}", f"{peak:.0f}",
        )  # fmt: skip
    console.print(table)


def fmu_step_time() -> None:
    """Microseconds per exchanged step through fmpy, with and without reading the energy."""
    import fmpy

    table = Table(title="Python-backed FMU through fmpy (set displacement, doStep, get force)")
    for column in ("what", "us/step", "against the closed form on a path"):
        table.add_column(column, justify="right")
    steps = 5_000
    displacement = path(steps, 5).tolist()
    closed = best(lambda: Spring(SPRING).response(displacement)) / steps
    with tempfile.TemporaryDirectory() as folder:
        fmu = build_python_fmu(Spring(SPRING, "benchmark").model, Path(folder))
        description = fmpy.read_model_description(fmu)
        references = {v.name: v.valueReference for v in description.modelVariables}
        for what, outputs in (("force", ["force"]), ("force and absorbed_energy", ["force", "absorbed_energy"])):
            inputs, wanted = [references["displacement"]], [references[name] for name in outputs]
            with running(fmu) as slave:
                slave.setupExperiment()
                slave.enterInitializationMode()
                slave.exitInitializationMode()
                begin = time.perf_counter()
                for k, value in enumerate(displacement):
                    slave.setReal(inputs, [value])
                    slave.doStep(k * 1e-3, 1e-3)
                    slave.getReal(wanted)
                each = (time.perf_counter() - begin) / steps
                slave.terminate()
            table.add_row(what, f"{1e6 * each:.1f}", f"{each / closed:.0f} times slower")
    console.print(table)


if __name__ == "__main__":
    console.print(f"Python {platform.python_version()}, NumPy {np.__version__}, {os.cpu_count()} cores")
    response_against_an_ode_solver()
    identification_time()
    fmu_step_time()
