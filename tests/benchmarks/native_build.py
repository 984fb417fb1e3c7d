"""Size and build time of the native FMU for each platform: python tests/benchmarks/native_build.py

Cold: the compiler's caches are empty, as at the first build on a computer. Cached: the same build once more.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from strandspring import Spring
from strandspring.fmu.archive import binary_sizes, installed_version
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import PLATFORMS, chosen_platforms

MODEL = Path(__file__).resolve().parents[2] / "models" / "rubber_hinge.json"
console = Console(width=118)


def main() -> None:
    model = Spring.load(MODEL).model
    console.print(f"ziglang {installed_version('ziglang')}, {os.cpu_count()} cores, {MODEL.name}")
    table = Table(title="Native FMU")
    for column in ("platform", "binary [KiB]", "FMU [KiB]", "cold [s]", "cached [s]"):
        table.add_column(column, justify="left" if column == "platform" else "right")
    for name in (*PLATFORMS, "all"):
        with tempfile.TemporaryDirectory() as folder:
            for kind in ("GLOBAL", "LOCAL"):
                os.environ[f"ZIG_{kind}_CACHE_DIR"] = str(Path(folder) / kind)
            seconds = []
            for _ in range(2):
                begin = time.perf_counter()
                fmu = build_native_fmu(model, Path(folder), chosen_platforms(name))
                seconds.append(time.perf_counter() - begin)
            binaries = sum(binary_sizes(fmu).values())
            table.add_row(
                name, f"{binaries / 1024:.0f}", f"{fmu.stat().st_size / 1024:.0f}", *(f"{s:.2f}" for s in seconds)
            )
    console.print(table)


if __name__ == "__main__":
    main()
