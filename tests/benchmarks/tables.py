"""What benchmarks share: a printed table, and processor times of works that take turns within one run."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]
IMPORT = [sys.executable, "-c", "import numpy"]
console = Console(width=150)


def show(title: str, rows: Sequence[Mapping[str, object]]) -> None:
    """A table whose columns are the keys of its first row; numbers have three digits."""
    table = Table(title=title)
    for name in rows[0]:
        table.add_column(name, justify="left" if isinstance(rows[0][name], str) else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(f"{cell:.3g}" if isinstance(cell, float) else str(cell) for cell in row.values()))
    console.print(table)


def in_turns(works: Mapping[str, Callable[[], object]], rounds: int = 5) -> dict[str, float]:
    """Shortest processor time of each of several works that take turns [s]."""
    times = dict.fromkeys(works, np.inf)
    for _ in range(rounds):
        for name, work in works.items():
            begin = time.process_time()
            work()
            times[name] = min(times[name], time.process_time() - begin)
    return times


def processor_time(command: Sequence[str], folder: Path, rounds: int = 3) -> float:
    """Median processor time of a command [s]."""
    times = []
    for _ in range(rounds):
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f"{' '.join(command)} ended with status {process.returncode}.")
        times.append(usage.ru_utime + usage.ru_stime)
    return float(np.median(times))


def percent(value: Any) -> str:
    return f"{100.0 * float(value):.1f}"
