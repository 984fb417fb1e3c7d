"""Measure the figures of docs/pages/figures.md again: python tests/benchmarks/figures.py [NAME ...]

What each benchmark prints is kept in tests/benchmarks/results/COMMIT/NAME.txt, with the computer and the versions
that it ran on, so that any diff compares two commits. Without names all are run, which takes hours on two cores.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).resolve().parent

# What is run for each name; the page cites the scripts with these arguments.
COMMANDS = {
    "honesty-clean": "honesty.py clean",
    "honesty-clean-1": "honesty.py clean --seed 1",
    "honesty-clean-2": "honesty.py clean --seed 2",
    "honesty-clean-single": "honesty.py clean --single",
    "honesty-clean-exact": "honesty.py clean --noise 0",
    "honesty-clean-coarse": "honesty.py clean --coarse",
    "honesty-faults": "honesty.py faults",
    "honesty-faults-drawn": "honesty.py faults --drawn --repetitions 3 --seed 11",
    "honesty-pairs": "honesty.py pairs",
    "honesty-pairs-coarse": "honesty.py pairs --coarse",
    "honesty-alarms": "honesty.py alarms",
    "honesty-sizes": "honesty.py sizes",
    "honesty-noise": "honesty.py noise",
    "honesty-intervals": "honesty.py intervals",
    "honesty-spans": "honesty.py spans",
    "held-out": "held_out.py",
    "zoo": "zoo.py run --seed 7 --count 8",
    "zoo-heldout": "zoo.py heldout --seed 7 --count 2",
    "zoo-measured": "zoo.py measured",
    "zoo-own": "zoo.py own --seed 7",
    "zoo-lab": "zoo.py lab --seed 7",
    "added": "added.py",
    "added-2": "added.py --seed 2",
    "planning": "planning.py",
    "methods": "methods.py",
    "limits": "limits.py",
    "kernel": "kernel.py",
    "bulk": "bulk.py",
    "growth": "growth.py records cycles",
    "isolation": "isolation.py",
    "study": "study.py --draws 500",
    "many-workers": "many_workers.py",
    "native": "native.py",
    "native-build": "native_build.py",
    "systems": "systems.py",
    "startup": "startup.py",
    "verdicts": "verdicts.py",
}


def commit() -> str:
    """The commit that is measured, with a mark if files differ from it."""
    described = ["git", "-C", str(HERE), "describe", "--always", "--dirty", "--abbrev=12"]
    return subprocess.run(described, check=True, capture_output=True, text=True).stdout.strip()


def measure(name: str, folder: Path) -> None:
    """Run one benchmark and keep what it prints."""
    command = [sys.executable, *COMMANDS[name].split()]
    start = time.perf_counter()
    run = subprocess.run(command, check=False, cwd=HERE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    heading = (
        f"{COMMANDS[name]}: {time.perf_counter() - start:.0f} s, exit status {run.returncode}; "
        f"Python {platform.python_version()}, NumPy {version('numpy')}, SciPy {version('scipy')}, {platform.platform()}"
    )
    (folder / f"{name}.txt").write_text(f"{heading}\n\n{run.stdout}", encoding="utf-8")
    print(heading, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(COMMANDS))
    names = parser.parse_args().names or list(COMMANDS)
    if unknown := sorted(set(names) - set(COMMANDS)):
        parser.error(f"There is no benchmark {', '.join(unknown)}; there are {', '.join(COMMANDS)}.")
    folder = HERE / "results" / commit()
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        measure(name, folder)


if __name__ == "__main__":
    main()
