"""A study of 10 000 runs one after the other and on a cluster that loses a worker: python tests/benchmarks/study.py

5000 springs drawn for each of two masses, at two frequencies below resonance so that a run takes some 20 ms. The
cluster is a local one of dask.distributed with two workers, one of which is killed when half of the runs are finished.
The files are compared byte for byte. It takes some six minutes; `--draws 500` a tenth of that.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

from distributed import LocalCluster
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from strandspring.campaigns.jobs.cluster import Cluster
from strandspring.campaigns.jobs.runners import Local, Runner
from strandspring.campaigns.studies.definition import Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.model.spread import Spread
from strandspring.vibration.one_mass.system import Excitation
from synthetic import spring_of

console = Console(width=118)


def planned(draws: int) -> Study:
    spring = spring_of(1.0, 1.0)
    errors = {name: 0.08 * getattr(spring, name) for name in ("kappa_omega", "rho", "sigma", "n")}
    spread = Spread.of(spring, {**errors, "correlation": {"kappa_omega,rho": -0.6, "sigma,n": 0.7}})
    return Study(
        spring, Excitation.BASE_DISPLACEMENT, (4.0, 5.0), (1e-4,), draws=draws, spread=spread, band=(2.0, 2.5), points=2
    )


def timed(study: Study, folder: Path, name: str, runner: Runner, cluster: LocalCluster | None = None) -> float:
    """Seconds that a study takes; a worker of the cluster is killed in the middle."""
    victim = cluster.workers[0].process.pid if cluster is not None else None
    begin = time.perf_counter()
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=len(study))

        def done(runs: int) -> None:
            nonlocal victim
            bar.update(task, completed=runs)
            if victim is not None and 2 * runs >= len(study):
                os.kill(victim, signal.SIGKILL)
                bar.console.print(f"worker {victim} killed after {runs} runs")
                victim = None

        run_study(study, folder / f"{name}.csv", runner, done)
    return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=5000, help="springs drawn for each of two masses")
    study = planned(parser.parse_args().draws)
    table = Table(title=f"{len(study)} runs, {os.cpu_count()} cores")
    for column in ("where", "time [s]", "per run [ms]", "bytes", "the same"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seconds = {"one after the other": timed(study, folder, "one after the other", Local(1))}
        with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
            runner = Cluster(cluster.scheduler_address)
            seconds["two workers, one killed"] = timed(study, folder, "two workers, one killed", runner, cluster)
        first = (folder / "one after the other.csv").read_bytes()
        for where, time_taken in seconds.items():
            found = (folder / f"{where}.csv").read_bytes()
            table.add_row(
                where,
                f"{time_taken:.0f}",
                f"{1e3 * time_taken / len(study):.1f}",
                str(len(found)),
                "yes" if found == first else "NO",
            )
    console.print(table)


if __name__ == "__main__":
    main()
