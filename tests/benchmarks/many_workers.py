"""How busy a study keeps the workers of a cluster: python tests/benchmarks/many_workers.py [--workers N] [--run S]

What this process needs for a batch and for a run, all journalled, is measured with two workers of dask.distributed on
runs without computation. Then a study of 1e8 runs on so many workers is simulated, in batches as the package makes
them, beside batches of 32 runs.
"""

from __future__ import annotations

import argparse
import heapq
import os
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from large_study import InstantStudy

from strandspring.campaigns.jobs import cluster, runners
from strandspring.campaigns.studies.definition import Study
from strandspring.campaigns.studies.journal import EncodedRuns, Journal
from studies import CHEAP

# Where workers find the study.
IMPORTED = [str(Path(__file__).resolve().parents[k] / name) for k, name in ((0, ""), (1, "helpers"))]
RUNS = 40_000
SIZES = (32, 400)  # of the batches that are measured
SIMULATED = 10**8
SCHEDULER = """
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""


class Fixed(runners._Batches[int]):
    """Batches of one size."""

    size = 32

    def next(self, seconds: float) -> Sequence[int]:  # noqa: ARG002
        begin, self._taken = self._taken, min(self._taken + self.size, len(self._tasks))
        return self._tasks[begin : self._taken]


def parent_seconds(size: int, address: str, results: Path) -> float:
    """Processor time of this process for a study in batches of a size [s]."""
    named = {field.name: getattr(CHEAP, field.name) for field in fields(Study)}
    study = InstantStudy(**named | {"masses": (4.0,), "draws": RUNS})
    Fixed.size, real = size, runners._Batches
    runners._Batches = Fixed  # type: ignore[misc]
    begin = time.process_time()
    try:
        journal = Journal(results, study)
        for rows in runners.finished_rows(EncodedRuns(study), journal.missing(), cluster.Cluster(address), print):
            journal.add_encoded(rows)
        journal.close(remove=True)
    finally:
        runners._Batches = real  # type: ignore[misc]
    return time.process_time() - begin


def simulated(batches: runners._Batches[int], workers: int, run: float, of_batch: float, of_run: float) -> list[float]:
    """Shares of the time that workers and this process are busy with runs of a mean duration [s]."""
    draw = np.random.default_rng(0)
    free, now = [0.0] * workers, 0.0
    ends: list[tuple[float, int, float]] = []  # when each batch ends, its runs and seconds
    worked = parent = 0.0
    queue: deque[int] = deque()
    while True:
        while len(ends) + len(queue) < cluster._WINDOW and (batch := batches.next(cluster._BATCH)):
            queue.append(len(batch))
        while queue and free:
            size = queue.popleft()
            seconds = run * max(size + 0.5 * np.sqrt(size) * draw.standard_normal(), 0.1)
            # The scheduler has it already.
            heapq.heappush(ends, (free.pop() + seconds, size, seconds))
        if not ends:
            return [worked / (workers * now), parent / now]
        end, size, seconds = heapq.heappop(ends)
        free.append(end)
        now = max(now, end) + of_batch + of_run * size
        parent += of_batch + of_run * size
        worked += seconds
        batches.learn(size, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=1000)
    parser.add_argument("--run", type=float, default=0.012, help="seconds of a run")
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [sys.executable, "-c", SCHEDULER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(IMPORTED)},
        ) as scheduler,
    ):
        assert scheduler.stdin is not None
        assert scheduler.stdout is not None
        address = scheduler.stdout.readline().decode().strip()
        parent_seconds(SIZES[1], address, Path(folder) / "first.csv")
        few, many = (parent_seconds(size, address, Path(folder) / f"{size}.csv") for size in SIZES)
        scheduler.stdin.close()
    of_batch = (few - many) / (RUNS / SIZES[0] - RUNS / SIZES[1])
    of_run = many / RUNS - of_batch / SIZES[1]
    print(f"This process: {1e6 * of_batch:.0f} us for a batch and {1e6 * of_run:.1f} us for a run")
    for name, kind in (("32 runs", Fixed), (f"{cluster._BATCH:g} s", runners._Batches)):
        Fixed.size = 32
        for workers in (given.workers // 10, given.workers):
            batches = kind(range(SIMULATED // 100 if kind is Fixed else SIMULATED))
            busy, parent = simulated(batches, workers, given.run, of_batch, of_run)
            what = f"{workers} workers, runs of {1e3 * given.run:g} ms, batches of {name}"
            print(f"{what}: workers busy {100 * busy:.1f} %, this process {100 * parent:.0f} %")


if __name__ == "__main__":
    main()
