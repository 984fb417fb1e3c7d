"""What one exchange with the native FMU costs: python tests/benchmarks/native.py [MODEL.json]

Set the displacement, do a step, get outputs: through fmpy, beside the Python-backed FMU of the same model; in a C host
without Python, beside the least that an FMU can do, to copy its input (feedthrough.c); and beside our own FMI layer
without the mathematics (empty_kernel.c). All FMUs of a table take turns in one process; figures are medians, and ratios
are between figures of one run. Then springs of higher degrees, and ten thousand instances in one process.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
import zipfile
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import fmpy
import numpy as np
from rich.console import Console
from rich.table import Table

from strandspring import Spring
from strandspring.compiled import zig
from strandspring.compiled.targets import host_target
from strandspring.fmu.archive import installed_version
from strandspring.fmu.checks.check import running
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import host_folder
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.modelfile import ModelFile

HERE = Path(__file__).resolve().parent
MODEL = HERE.parents[1] / "models" / "rubber_hinge.json"
HEADERS = files("fmpy") / "c-code"
ROUNDS = 31
STEPS = 20_000
# Fractions of the identified range: excursions would print warnings.
REACH = 0.95
DEGREES = (0, 2, 6, 8)
INSTANCES = (1, 100, 10_000)
CASES = {
    "stroke,force": "one long stroke: force",
    "stroke,all": "  stiffness, energy as well",
    "sine,force": "sine of 200 steps: force",
    "sine,all": "  stiffness, energy as well",
    "reversals,force": "turns at each step: force",
    "reversals,all": "  stiffness, energy as well",
    "exchange,force": "model exchange on the sine",
}
console = Console(width=118)


@dataclass(frozen=True)
class Loadable:
    """An FMU for the C host."""

    name: str
    guid: str
    library: Path
    resources: str = ""
    steps: int = STEPS
    every: int = 1
    kinds: int = 2

    def arguments(self) -> list[str]:
        return [self.guid, str(self.library), self.resources, str(self.steps), str(self.every), str(self.kinds)]


def unpacked(fmu: Path, folder: Path) -> tuple[str, Path, str]:
    """GUID, library and resources of an FMU, unpacked."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    description = fmpy.read_model_description(str(folder), validate=False)
    (library,) = (folder / "binaries" / str(host_folder())).iterdir()
    return str(description.guid), library, (folder / "resources").as_uri()


def compiled(sources: dict[str, bytes], unit: str, library: Path) -> Path:
    """A C source compiled as the native FMU is."""
    flags = ("-O2", "-fvisibility=hidden", "-Wno-unused-function", "-Wno-undefined-inline")
    library.write_bytes(zig.shared_library(host_target(), sources, (unit,), library.stem, flags))
    return library


def copying(folder: Path) -> Loadable:
    """An FMU that copies its input to its outputs."""
    names = ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h")
    sources = {name: (HEADERS / name).read_bytes() for name in names}
    sources["feedthrough.c"] = (HERE / "feedthrough.c").read_bytes()
    return Loadable("copies", "any", compiled(sources, "feedthrough.c", folder / "feedthrough.so"))


def without_kernel(native: Loadable, folder: Path) -> Loadable:
    """The native FMU with an empty kernel."""
    folder_of_sources = native.library.parents[2] / "sources"
    files = (path for path in folder_of_sources.rglob("*.*"))
    sources = {path.relative_to(folder_of_sources).as_posix(): path.read_bytes() for path in files}
    empty = {"spring.c": (HERE / "empty_kernel.c").read_bytes(), "saturation.c": b"", "saturation_table.c": b""}
    sources |= {f"spring/{name}": content for name, content in empty.items()}
    return Loadable("empty kernel", native.guid, compiled(sources, "fmi2_all.c", folder / "empty.so"))


def program(source: str, folder: Path) -> Path:
    """A host in C."""
    flags = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-Wshadow", "-Wconversion"]
    binary = (folder / source).with_suffix("")
    subprocess.run(["cc", *flags, f"-I{HEADERS}", str(HERE / source), "-o", str(binary), "-lm", "-ldl"], check=True)
    return binary


def measured(fmus: list[Loadable], middle: float, half: float) -> dict[str, list[float]]:
    """Median nanoseconds by case, one for each FMU that has it."""
    host = program("native_host.c", fmus[0].library.parent)
    said = subprocess.run(
        [str(host), str(ROUNDS), str(middle), str(half), *(a for fmu in fmus for a in fmu.arguments())],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    medians: dict[str, list[float]] = {}
    for line in said.splitlines():
        path, what, _, median, *_ = line.split(",")
        medians.setdefault(f"{path},{what}", []).append(float(median))
    return medians


def in_a_c_host(fmus: list[Loadable], middle: float, half: float) -> None:
    table = Table(title="In a C host: ns an exchange")
    ratios = ("/ copies", "/ empty")
    for column in ("exchange", *(fmu.name for fmu in fmus), *ratios):
        table.add_column(column, justify="left" if column == "exchange" else "right")
    medians = measured(fmus, middle, half)
    for case, title in CASES.items():
        copies, empty, native = medians[case]
        table.add_row(
            title, *(f"{value:.1f}" if value < 1000 else f"{value:.0f}" for value in medians[case]),
            f"{native / copies:.2f}", f"{native / empty:.2f}",
        )  # fmt: skip
    console.print(table)


def of_higher_degrees(model: ModelFile, folder: Path, middle: float, half: float) -> None:
    """What the energy costs where FA is of a higher degree."""
    table = Table(title="In a C host: ns an exchange of force, stiffness and energy")
    p = model.parameters
    fmus = {}
    for degree in DEGREES:
        # Alternating, so that FA stays positive and changes as fast as it may.
        weights = [0.9 / degree * (-1.0) ** k / p.x_max**k for k in range(1, degree + 1)]
        spring = ModelFile(f"degree{degree}", replace(p, kA=(1.0, *weights)))
        fmus[degree] = Loadable("", *unpacked(build_native_fmu(spring, folder), folder / f"degree{degree}"))
    medians = measured(list(fmus.values()), middle, half)
    for column in ("exchange", *(f"degree {degree}" for degree in fmus)):
        table.add_column(column, justify="left" if column == "exchange" else "right")
    for case in ("stroke,all", "sine,all", "reversals,all"):
        table.add_row(CASES[case.replace("all", "force")].split(":")[0], *(f"{value:.1f}" for value in medians[case]))
    console.print(table)


def many_instances(native: Loadable, folder: Path, middle: float, half: float) -> None:
    """Instances of one spring that move in turn."""
    table = Table(title="Instances of one spring in a C host: set, step, get force")
    for column in ("instances", "ns a step", "of one alone", "bytes each"):
        table.add_column(column, justify="right")
    host = program("native_many.c", folder)
    rows = []
    for count in INSTANCES:
        command = [str(host), native.guid, str(native.library), str(count), str(middle), str(half)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        step, size, _ = map(float, said.split())
        rows.append((count, step, size))
    for count, step, size in rows:
        table.add_row(str(count), f"{step:.1f}", f"{step / rows[0][1]:.2f}", f"{size:.0f}")
    console.print(table)


def through_fmpy(fmus: dict[str, Path], middle: float, half: float) -> None:
    """Microseconds per exchange through fmpy, where its own work weighs most."""
    table = Table(title="Through fmpy, sine: us an exchange")
    for column in ("FMU", "set, step, get force"):
        table.add_column(column, justify="left" if column == "FMU" else "right")
    path = (middle + half * np.sin(np.linspace(0.0, 20.0 * np.pi, 2000))).tolist()
    for name, fmu in fmus.items():
        seconds = []
        with running(fmu) as slave:
            slave.setupExperiment()
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            for _ in range(7):
                begin = time.perf_counter()
                for k, displacement in enumerate(path):
                    slave.setReal([0], [displacement])
                    slave.doStep(1e-3 * k, 1e-3)
                    slave.getReal([1])
                seconds.append((time.perf_counter() - begin) / len(path))
            slave.terminate()
        table.add_row(name, f"{1e6 * float(np.median(seconds)):.2f}")
    console.print(table)


def main() -> None:
    model = Spring.load(Path(sys.argv[1]) if len(sys.argv) > 1 else MODEL).model
    p = model.parameters
    middle = 0.5 * (p.displacement_min + p.displacement_max)
    half = 0.5 * REACH * (p.displacement_max - p.displacement_min)
    console.print(
        f"{model.name} (degrees {len(p.kE) - 1} and {len(p.kA) - 1}, n = {p.n:.3g}), "
        f"ziglang {installed_version('ziglang')}, Python {platform.python_version()}, {os.cpu_count()} cores"
    )
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        native = build_native_fmu(model, folder / "native")
        python = build_python_fmu(model, folder / "python")
        ours = Loadable("native", *unpacked(native, folder / "n"))
        fmus = [copying(folder), without_kernel(ours, folder), ours]
        in_a_c_host(fmus, middle, half)
        of_higher_degrees(model, folder, middle, half)
        many_instances(ours, folder, middle, half)
        through_fmpy({"native": native, "Python-backed": python}, middle, half)


if __name__ == "__main__":
    main()
