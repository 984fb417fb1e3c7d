"""Processor time of short commands against that of ``python -c "import numpy"``: python tests/benchmarks/startup.py

Each is run several times as a process of its own; the median counts. The targets are those of the project: 2.5 times
for the help, 8 times for the identification of the bundled record.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]
RECORD = str(ROOT / "models/records/rubber_stretch.csv")
MODEL = str(ROOT / "models/rubber_hinge.json")
PROGRAM = [sys.executable, "-m", "strandspring"]
# Name, command, largest ratio.
COMMANDS = (
    ("import strandspring", [sys.executable, "-c", "import strandspring"], None),
    ("--help", [*PROGRAM, "--help"], 2.5),
    ("identify --help", [*PROGRAM, "identify", "--help"], None),
    ("identify", [*PROGRAM, "identify", RECORD, "--reverse", "displacement", "-o", "m.json"], 8.0),
    ("predict", [*PROGRAM, "predict", MODEL, RECORD, "--reverse", "displacement"], None),
    ("info", [*PROGRAM, "info", MODEL], None),
    ("build", [*PROGRAM, "build", MODEL, "--platform", "host"], 2.2),
    ("isolate", [*PROGRAM, "isolate", MODEL, "--mass", "0.05"], 1.6),
)


def processor_time(command: list[str], folder: Path, repetitions: int) -> float:
    """Median processor time of a command [s]."""
    times = []
    for _ in range(repetitions):
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f"{' '.join(command)} ended with status {process.returncode}.")
        times.append(usage.ru_utime + usage.ru_stime)
    return statistics.median(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=7, help="runs of each command")
    repetitions = parser.parse_args().repetitions
    table = Table(title="Processor time, median")
    for column in ("command", "time [s]", "times import numpy", "target"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        reference = processor_time([sys.executable, "-c", "import numpy"], folder, repetitions)
        table.add_row("import numpy", f"{reference:.3f}", "1.00", "")
        for title, command, target in COMMANDS:
            seconds = processor_time(command, folder, repetitions)
            ratio = seconds / reference
            limit = "" if target is None else f"<= {target:g}{'' if ratio <= target else ' MISSED'}"
            table.add_row(title, f"{seconds:.3f}", f"{ratio:.2f}", limit)
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
