"""1000 springs, ten of the files damaged, identified on all cores: python tests/benchmarks/many.py

Each spring differs from a nominal one by 5 % in stiffness, kappa_omega, rho, sigma and n; a file has 3000 rows of two
cycles at each of three amplitudes with 0.5 % noise. The rate, the processor time and the peak memory of all processes
together are printed, and what is said of the damaged files. The parameters are compared with the true ones. It takes
some two minutes on two cores; `--springs 100` a tenth of that.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import psutil

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from many_springs import DAMAGES, one_of, write_batch, write_damaged

_GLANCE = 0.2  # seconds between two looks at the memory


def watched(command: list[str], folder: Path) -> tuple[float, float, float, str]:
    """Run a command: wall and processor seconds, peak memory of all its processes [MB], and what it printed."""
    begin = time.perf_counter()
    before = os.times()
    program = psutil.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    peak = 0
    while program.poll() is None:
        peak = max(peak, memory(program))
        time.sleep(_GLANCE)
    wall = time.perf_counter() - begin
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, used, peak / 1e6, program.stdout.read()


def memory(program: psutil.Process) -> int:
    """Bytes that a program and its workers hold, what they share counted once for each."""
    total = 0
    for process in (program, *program.children(recursive=True)):
        try:
            total += process.memory_info().rss
        except psutil.NoSuchProcess:  # it has just ended
            continue
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--springs", type=int, default=1000, help="files, ten damaged ones among them")
    count = parser.parse_args().springs - len(DAMAGES)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_batch(folder / "springs", count)
        write_damaged(folder / "springs")
        command = [sys.executable, "-m", "strandspring", "identify-many", "springs", "-o", "models"]
        for title in ("first run", "again, nothing changed"):
            wall, used, peak, said = watched(command, folder)
            print(
                f"{title}: {wall:.1f} s, {(count + 10) / wall:.1f} springs/s; processors {used:.1f} s, "
                f"{1e3 * used / (count + 10):.0f} ms for each spring; peak memory of all processes {peak:.0f} MB"
            )
        print(said)
        frame = pd.read_csv(folder / "models" / "springs.csv").set_index("model")
        for parameter, unit in (("kappa_omega", "N"), ("rho", "1/m"), ("sigma", "1"), ("n", "1")):
            found, error = (
                np.array([frame.loc[f"spring_{k:04d}.json", f"{parameter}{what} [{unit}]"] for k in range(count)])
                for what in ("", " standard error")
            )
            true = np.array([getattr(one_of(k), parameter) for k in range(count)])
            share, errors = (np.sqrt(np.mean((found - true) ** 2 / scale**2)) for scale in (true, error))
            print(f"{parameter}: rms deviation from the true values {100 * share:.2g} %, {errors:.2f} standard errors")


if __name__ == "__main__":
    main()
