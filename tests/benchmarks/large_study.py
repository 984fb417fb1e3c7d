"""Memory and time of a study with a million runs: python tests/benchmarks/large_study.py [--runs N] [--masses N]

The runs themselves give numbers at once; journal, quantiles and results are the real ones. The study is interrupted
when 99 % of the runs are finished, and continued by another process. Of both, the peak memory and the time are printed:
of all, and until the first run. It takes some three minutes.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from strandspring import StrandspringError
from strandspring.campaigns.jobs.runners import Local
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.summaries import summaries
from studies import CHEAP


class InstantStudy(Study):
    """Runs without any computation."""

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        return [self._instant(run) for run in runs]

    def _instant(self, run: int) -> RunRow:
        number, index = divmod(run, self.grid_size)
        point = self.grid_point(index)
        x = (run * 2654435761 % 2**32) / 2**32
        drawn = (10.0 + x, 500.0 + x, 1.0 + x, 0.5 + x)
        row = (run, number, point.mass, point.level, point.stiffness_factor, *drawn)
        if x < 0.05:
            return RunRow(*row, outcome=f"The static load of {x} N on each spring must lie within 0.1 and 10 N.")
        return RunRow(*row, x, 0.1 * x, 5.0 + x, 8.0 + x, 1e-3 * x, 1e3 + x, 0.1 * x, 7.0 + x, True, False)


def child(runs: int, masses: int, stop: int, results: Path) -> None:
    """Run the study in this process, and print its figures."""
    named = {field.name: getattr(CHEAP, field.name) for field in fields(Study)}
    named |= {"masses": tuple(np.linspace(4.0, 5.0, masses).tolist()), "draws": runs // masses}
    times: list[float] = []
    begin = time.perf_counter()

    def progress(finished: int) -> None:
        times.append(time.perf_counter() - begin)
        del times[1:]
        if finished >= stop:
            raise StrandspringError("Enough.")

    what = "whole"
    try:
        study = InstantStudy(**named)
        run_study(study, results, Local(1), progress)
        summaries(study, results)
    except StrandspringError as end:
        what = str(end)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"peak {peak:.0f} MB, first run after {times[0]:.2f} s, {time.perf_counter() - begin:.0f} s in all; {what}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1_000_000)
    parser.add_argument("--masses", type=int, default=1, help="grid points, a divisor of the runs")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        child(given.runs, given.masses, int(given.child[0]), Path(given.child[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, "--runs", str(given.runs), "--masses", str(given.masses), "--child"]
        for stop in (given.runs * 99 // 100, given.runs + 1):
            subprocess.run([*command, str(stop), str(Path(folder) / "results.csv")], check=True)


if __name__ == "__main__":
    main()
