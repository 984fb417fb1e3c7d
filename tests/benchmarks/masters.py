"""The masters of the explicit coupling compared: python tests/benchmarks/masters.py

Error against step, largest stable steps by linear theory and on the FMU, energy that the coupling makes, and time of a
step.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from monolithic import monolithic
from strandspring.cosimulation import (
    FmuSpring,
    GaussSeidel,
    InputPath,
    Iterative,
    Jacobi,
    Master,
    MeanForce,
    Motion,
    Plant,
    Subsystem,
    Verlet,
    energy_balance,
    largest_stable_step,
    one_mass,
    simulate,
)
from strandspring.examples.mounts import BACKENDS, EQUIPMENT_MOUNT, RECOIL_SPRING, build_example_fmu

MASTERS: dict[str, Master] = {
    "Jacobi, held": Jacobi(),
    "Jacobi, force by a line": Jacobi(1),
    "Jacobi, lines": Jacobi(1, 1),
    "Jacobi, parabolas": Jacobi(2, 2),
    "Gauss-Seidel, plant first, held": GaussSeidel(Subsystem.PLANT, 0),
    "Gauss-Seidel, plant first, lines": GaussSeidel(Subsystem.PLANT, 1),
    "Gauss-Seidel, plant first, parabolas": GaussSeidel(Subsystem.PLANT),
    "Gauss-Seidel, springs first, held": GaussSeidel(Subsystem.SPRINGS, 0, 0),
    "Gauss-Seidel, springs first, lines": GaussSeidel(Subsystem.SPRINGS, 1, 1),
    "Gauss-Seidel, springs first, parabolas": GaussSeidel(Subsystem.SPRINGS),
    "Verlet": Verlet(),
    "Iterative, mean of end forces": Iterative(MeanForce.ENDS),
    "Iterative, force by work": Iterative(),
}
CURVED: dict[str, Master] = {
    "Jacobi, lines, reset each step": Jacobi(1, 1, InputPath.RESET),
    "Jacobi, parabolas, reset each step": Jacobi(2, 2, InputPath.RESET),
    "Jacobi, parabolas, curved": Jacobi(2, 2, InputPath.CURVED),
    "Gauss-Seidel, plant first, curved": GaussSeidel(Subsystem.PLANT, 2, 2, InputPath.CURVED),
    "Gauss-Seidel, springs first, curved": GaussSeidel(Subsystem.SPRINGS, 2, 2, InputPath.CURVED),
}
STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
STOP = 0.6

MASS, LOAD, MIDDLE = 5.0, 50.0, 0.05
AMPLITUDE, CIRCULAR = 0.003, 2.0 * math.pi * 7.0

LINEAR = {"kE_1": 1e4, "kE_2": 0.0, "kE_3": 0.0, "kA_1": 0.0, "kappa_omega": 1e-9, "rho": 1.0}
RATIOS = (0.0, 0.02, 0.1)
GROWTH = 1e-7  # per step, above which the FMU counts as unstable
# Tangent of the recoil spring after a reversal, where it is steepest.
STEEPEST = RECOIL_SPRING.kE[1] + 2.0 * RECOIL_SPRING.sigma * RECOIL_SPRING.kappa_omega * RECOIL_SPRING.rho
RECOILING, SPEED = 25.0, 2.0

console = Console(width=118)


def base(t: float) -> float:
    return AMPLITUDE * (1.0 - math.cos(CIRCULAR * t))


def base_velocity(t: float) -> float:
    return AMPLITUDE * CIRCULAR * math.sin(CIRCULAR * t)


def run(fmu: Path, plant: Plant, stop: float, step: float, master: Master, speed: float = 0.0) -> Motion:
    with FmuSpring(fmu) as spring:
        return simulate(plant, [spring], stop, step, master, velocity=[speed])


def errors(fmu: Path) -> None:
    plant = one_mass(MASS, LOAD, base, offset=MIDDLE)
    times = np.linspace(0.0, STOP, round(STOP / STEPS[0]) + 1)
    expected = monolithic(plant, [EQUIPMENT_MOUNT], times, base_velocities=[base_velocity]).q
    frequency = math.sqrt((EQUIPMENT_MOUNT.kE[1] + EQUIPMENT_MOUNT.kappa_omega * EQUIPMENT_MOUNT.rho) / MASS)
    table = Table(title=f"Largest error of the position over its range, base at 7 Hz, omega_0 = {frequency:.0f}/s")
    table.add_column("master")
    for step in STEPS:
        table.add_column(f"{1e3 * step:g} ms", justify="right")
    table.add_column("order", justify="right")
    for name, master in {**MASTERS, **CURVED}.items():
        found = [
            float(np.max(np.abs(run(fmu, plant, STOP, step, master).q[:: 2**k] - expected)) / np.ptp(expected))
            for k, step in enumerate(STEPS)
        ]
        table.add_row(name, *(f"{e:.1e}" for e in found), f"{math.log2(found[-3] / found[-1]) / 2.0:.2f}")
    console.print(table)


def growth_of_fmu(fmu: Path, plant: Plant, step: float, master: Master) -> float:
    """Growth of free motion per step, from the recurrence that its late samples follow."""
    with FmuSpring(fmu, parameters=LINEAR) as spring:
        q = simulate(plant, [spring], 400 * step, step, master, velocity=[1e-4]).q[250:, 0]
    if np.max(np.abs(q)) < 1e-11:
        return 0.0  # died out, and what is left is rounding
    q = q / np.max(np.abs(q))
    recurrence, *_ = np.linalg.lstsq(np.column_stack([q[1:-1], q[:-2]]), q[2:])
    return float(np.max(np.abs(np.roots([1.0, *-recurrence]))))


def measured_limit(fmu: Path, plant: Plant, master: Master, omega: float) -> float:
    """h*omega_0 beyond which free motion on the FMU grows, to 1 %; infinity beyond 10."""
    grid = np.geomspace(0.005, 10.0, 40)
    low, high = 0.0, math.inf
    for w in grid.tolist():
        if growth_of_fmu(fmu, plant, w / omega, master) > 1.0 + GROWTH:
            high = w
            break
        low = w
    if not math.isfinite(high) or low == 0.0:
        return high if low else 0.0
    while high - low > 0.005 * high:
        middle = 0.5 * (low + high)
        if growth_of_fmu(fmu, plant, middle / omega, master) > 1.0 + GROWTH:
            high = middle
        else:
            low = middle
    return low


def dies_out(fmu: Path, w: float, master: Master) -> bool:
    """Whether the motion after a recoil dies out, at h*omega_0 = w by the steepest tangent."""
    step = w / math.sqrt(STEEPEST / RECOILING)
    with np.errstate(all="ignore"):
        try:
            q = np.abs(run(fmu, one_mass(RECOILING), max(2.0, 60.0 * step), step, master, SPEED).q)
        except ValueError:
            return False
    return bool(np.max(q[-len(q) // 4 :]) < 0.25 * 0.07)


def stability(fmu: Path) -> None:
    table = Table(
        title=f"Largest stable h*omega_0: linear theory | measured on the FMU (growth above {GROWTH:g} a step)"
    )
    table.add_column("master")
    for ratio in RATIOS:
        table.add_column(f"damping {ratio:g}", justify="right")
    table.add_column("recoil dies out up to", justify="right")
    for name, master in MASTERS.items():
        cells = []
        for ratio in RATIOS:
            plant = one_mass(1.0, damping=2.0 * ratio * 100.0)
            theory = 100.0 * largest_stable_step(master, plant, [1e4])
            cells.append(f"{theory:.3f} | {measured_limit(fmu, plant, master, 100.0):.3f}")
        limit = 0.0
        for w in np.geomspace(0.05, 5.0, 48).tolist():
            if not dies_out(fmu, w, master):
                break
            limit = w
        table.add_row(name, *cells, f"{limit:.2f}" if limit < 4.9 else "5.00 and more")
    console.print(table)


def energies(fmu: Path) -> None:
    plant = one_mass(RECOILING)
    table = Table(title="Energy that the coupling makes (kinetic + absorbed_energy), in shares of the 50 J of a recoil")
    table.add_column("master")
    for step in STEPS:
        table.add_column(f"{1e3 * step:g} ms", justify="right")
    for name, master in MASTERS.items():
        cells = []
        for step in STEPS:
            balance = energy_balance(plant, run(fmu, plant, 0.4, step, master, SPEED))
            worst = int(np.argmax(np.abs(balance.residual)))
            cells.append(f"{balance.residual[worst] / balance.kinetic[0]:+.1e}")
        table.add_row(name, *cells)
    console.print(table)


def costs(folder: Path) -> None:
    plant = one_mass(MASS, LOAD, base, offset=MIDDLE)
    table = Table(title="Time of a step in microseconds, one mass on one spring")
    table.add_column("master")
    fmus = {backend: build_example_fmu(EQUIPMENT_MOUNT, f"on_{backend}", folder, backend) for backend in BACKENDS}
    for backend in fmus:
        table.add_column(backend, justify="right")
    for name in ("Gauss-Seidel, plant first, parabolas", "Verlet", "Iterative, force by work"):
        cells = []
        for fmu in fmus.values():
            with FmuSpring(fmu) as spring:
                began = time.perf_counter()
                steps = simulate(plant, [spring], 1.0, 1e-3, MASTERS[name]).times.size - 1
                cells.append(f"{1e6 * (time.perf_counter() - began) / steps:.0f}")
        table.add_row(name, *cells)
    console.print(table)


def main() -> None:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        mount, recoil = (
            build_example_fmu(s, n, folder) for s, n in ((EQUIPMENT_MOUNT, "mount"), (RECOIL_SPRING, "recoil"))
        )
        errors(mount)
        stability(recoil)
        energies(recoil)
        costs(folder)


if __name__ == "__main__":
    main()
