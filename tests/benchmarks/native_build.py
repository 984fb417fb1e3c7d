"""Size and build time of the native FMU for each platform: python tests/benchmarks/native_build.py

Compiled: the images alone, with the compiler's caches empty, as when a wheel is built. FMU: one is made of them.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from strandspring import Spring
from strandspring.compiled import images
from strandspring.fmu.archive import binary_sizes, installed_version
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import PLATFORMS, chosen_platforms

MODEL = Path(__file__).resolve().parents[2] / "models" / "rubber_hinge.json"
console = Console(width=118)


def main() -> None:
    model = Spring.load(MODEL).model
    console.print(f"ziglang {installed_version('ziglang')}, {os.cpu_count()} cores, {MODEL.name}")
    table = Table(title="Native FMU")
    for column in ("platform", "binary [KiB]", "FMU [KiB]", "compiled [s]", "FMU [s]"):
        table.add_column(column, justify="left" if column == "platform" else "right")
    for name in (*PLATFORMS, "all"):
        with tempfile.TemporaryDirectory() as folder:
            for kind in ("GLOBAL", "LOCAL"):
                os.environ[f"ZIG_{kind}_CACHE_DIR"] = str(Path(folder) / kind)
            platforms = chosen_platforms(name)
            begin = time.perf_counter()
            for target in {target for platform in platforms for target in platform.targets}:
                images.compiled(images.FMU, target)
            compiled = time.perf_counter() - begin
            build_native_fmu(model, Path(folder), platforms)  # its images may have to be compiled, too
            begin = time.perf_counter()
            fmu = build_native_fmu(model, Path(folder), platforms)
            seconds = compiled, time.perf_counter() - begin
            binaries = sum(binary_sizes(fmu).values())
            table.add_row(
                name, f"{binaries / 1024:.0f}", f"{fmu.stat().st_size / 1024:.0f}", *(f"{s:.2f}" for s in seconds)
            )
    console.print(table)


if __name__ == "__main__":
    main()
