"""Random trials, one after the other, in a child process with limits of memory and time.

A script calls `main` with a function that does one trial, determined by a generator of random numbers, in an empty
folder. The function yields a group (such as the format) and then an outcome (such as "accepted" or "refused: ..."), and
raises for a failure.

    python SCRIPT [--seed SEED] [--count COUNT] [--keep FOLDER] [FILE...]

A trial also fails if it warns, prints, takes over 10 s of processor time or over 1 GB of memory, leaves temporary or
open files behind, or ends the process. Trial k has the seed SEED + k, so that `--seed S --count 1` repeats it. Files,
such as those of tests/fuzz/corpus, are judged instead of random ones, each like a trial.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from strandspring.records.formats import reader_process

Trial = Callable[[np.random.Generator, Path], Iterator[str]]
Judge = Callable[[Path], Iterator[str]]
Result = dict[str, str]

MAX_SECONDS = 10.0  # of processor time
_PATIENCE = 30.0 * MAX_SECONDS  # by the clock, since other programs run too
MAX_BYTES = 1024**3
_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", "ARROW_DEFAULT_MEMORY_POOL": "system"}


@dataclass
class Report:
    """Outcomes of trials.

    Attributes
    ----------
    outcomes : Counter        Number of trials by group and outcome.
    failures : list of dict   Seed, group and reason of each failure.
    """

    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    failures: list[Result] = field(default_factory=list)

    def __str__(self) -> str:
        lines = []
        for group in sorted({group for group, _ in self.outcomes}):
            own = {outcome: count for (of, outcome), count in self.outcomes.items() if of == group}
            total = sum(own.values())
            accepted = sum(count for outcome, count in own.items() if outcome.startswith("accepted"))
            lines.append(f"{group}: {total} trials, {100 * accepted / total:.0f} % accepted")
            lines += [f"{count:8d}  {outcome}" for outcome, count in sorted(own.items(), key=lambda one: -one[1])]
        return "\n".join([*lines, f"{sum(self.outcomes.values())} trials, {len(self.failures)} failures"])


def main(script: str, trial: Trial, count: int, judge: Judge | None = None) -> None:
    """The command line of a script; the exit status is 1 after a failure.

    Parameters
    ----------
    script : str       Its `__file__`.
    trial : callable
    count : int        Number of trials unless another is given.
    judge : callable   The same as `trial` with a file that is given; None if the script takes none.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--keep", type=Path, help="folder for the files of the trials, which are not deleted")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    if judge is not None:
        parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="files to judge instead")
    given = parser.parse_args()
    files = getattr(given, "files", [])
    if given.child:
        seeds = range(given.seed, given.seed + given.count)
        if judge is not None and files:
            trial = _of_files(judge, iter(files[given.seed - 1 :]))
        _do_trials(trial, seeds, given.child, given.keep)
        return
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    report = run(Path(script), given.seed, given.count, given.keep, files)
    print(report)
    sys.exit(bool(report.failures))


def _of_files(judge: Judge, files: Iterator[Path]) -> Trial:
    """A trial of each file, of a copy in the folder of the trial."""

    def trial(_generator: np.random.Generator, folder: Path) -> Iterator[str]:
        file = next(files)
        yield f"corpus, {file.name}"
        copy = folder / file.name
        shutil.copyfile(file, copy)
        yield from judge(copy)

    return trial


def run(
    script: Path, seed: int, count: int, keep: Path | None = None, files: Sequence[Path] = (), seconds: float = math.inf
) -> Report:
    """Do the trials of a script in a child process, a new one after a trial that ended it; failures are printed.

    Files are judged instead if there are any. An interrupt, or the end of the seconds, ends it with the report of the
    trials until then.
    """
    if files:
        seed, count = 1, len(files)
    print(f"seed {seed}, {count} trials", flush=True)
    report = Report()
    try:
        _run(report, script, range(seed, seed + count), keep, files, time.monotonic() + seconds)
    except KeyboardInterrupt:
        print("interrupted")
    return report


def _run(report: Report, script: Path, seeds: range, keep: Path | None, files: Sequence[Path], deadline: float) -> None:
    seed, end = seeds.start, seeds.stop
    while seed < end:
        with tempfile.TemporaryDirectory() as folder:
            for result in _results(script, seed, end - seed, Path(folder), keep, files):
                group, outcome = result["group"], result["outcome"]
                if failure := result.get("failure"):
                    report.failures.append({"seed": str(seed), "group": group, "failure": failure})
                    how = files[seed - 1] if files else f"--seed {seed} --count 1"
                    print(f"FAILURE in {group}: python {script} {how}\n{failure}\n", flush=True)
                report.outcomes[group, outcome] += 1
                seed += 1
                if time.monotonic() > deadline:
                    return
            if left := [path.name for path in (Path(folder) / "tmp").iterdir()]:
                report.failures.append({"seed": str(seed), "group": "end", "failure": f"left {left}"})
                print(f"FAILURE at the end of the process, before the seed {seed}: left {left}\n", flush=True)


def _results(
    script: Path, seed: int, count: int, folder: Path, keep: Path | None, files: Sequence[Path]
) -> Iterator[Result]:
    """Results of the trials of one child, of which the last may be its end."""
    (folder / "tmp").mkdir()
    command = [sys.executable, str(script), "--seed", str(seed), "--count", str(count), "--child", str(folder)]
    command += [] if keep is None else ["--keep", str(keep)]
    command += map(str, files)
    environment = os.environ | _ENVIRONMENT | {"TMPDIR": str(folder / "tmp")}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as child:
        assert child.stdout is not None
        try:
            rest = b""
            group, reason = "unknown", "did not end"
            while select.select([child.stdout], [], [], _PATIENCE)[0]:
                block = os.read(child.stdout.fileno(), 65536)
                if not block:
                    reason = f"ended with status {child.wait()}"
                    break
                *lines, rest = (rest + block).split(b"\n")
                for line in lines:
                    result = {"group": group} | json.loads(line)
                    group = result["group"]
                    if "outcome" in result:
                        count -= 1
                        yield result
        finally:
            child.kill()
    if count:
        yield {"group": group, "outcome": "FAILED", "failure": f"the process {reason}"}


def _do_trials(trial: Trial, seeds: range, folder: Path, keep: Path | None) -> None:
    """Do trials in this process; results go to standard output, one JSON object per line."""
    warnings.simplefilter("error")
    warnings.filterwarnings("ignore", message=r"(?s).*Sphinx")  # extensions of the site that use old names
    warnings.filterwarnings("ignore", message="`displacement` must be within the identified range")  # paths are wide
    gc.collect()
    gc.freeze()  # what has been imported is not searched for garbage after every trial
    results = os.fdopen(os.dup(1), "w")
    with (folder / "printed").open("w+b") as printed:
        for descriptor in (1, 2):
            os.dup2(printed.fileno(), descriptor)
        for seed in seeds:
            work = (keep or folder / "work") / str(seed)
            work.mkdir(parents=True)
            for result in _judged(trial(np.random.default_rng(seed), work), printed.fileno()):
                results.write(json.dumps(result) + "\n")
                results.flush()
            if keep is None:
                shutil.rmtree(work)


def _judged(trial: Iterator[str], printed: int) -> Iterator[Result]:
    """The group of a trial, and its outcome."""
    os.ftruncate(printed, 0)
    os.lseek(printed, 0, os.SEEK_SET)
    files, begin, memory = _open_files(), time.process_time(), _memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory begins anew
    resource.setrlimit(resource.RLIMIT_AS, (_memory("VmSize") + MAX_BYTES, resource.RLIM_INFINITY))
    failures = []
    outcome = ""
    try:
        yield {"group": next(trial)}
        outcome = next(trial)
    except BaseException:
        failures.append(traceback.format_exc())
    seconds, peak = time.process_time() - begin, _memory("VmHWM") - memory
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    gc.collect()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    if text := os.pread(printed, 4000, 0):
        failures.append(f"printed: {text.decode(errors='replace')}")
    if seconds > MAX_SECONDS:
        failures.append(f"took {seconds:.1f} s")
    if peak > MAX_BYTES:
        failures.append(f"took {peak / 1e6:.0f} MB")
    for path in set(Path(tempfile.gettempdir()).iterdir()) - _folders_of_readers():
        failures.append(f"left {path.name}")
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    if left_open := _open_files() - files:
        failures.append(f"left open {sorted(left_open)}")
    yield {"outcome": "FAILED", "failure": "\n".join(failures)} if failures else {"outcome": outcome}


def _memory(name: str) -> int:
    """A figure of /proc/self/status [B]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{name}:"))


def _open_files() -> set[str]:
    """What is open besides pipes, fonts, which Matplotlib keeps, and folders of processes kept for the next trial."""
    links = {str(each.readlink()) for each in [*Path("/proc/self/fd").iterdir()] if each.is_symlink()}
    kept = set(map(str, _folders_of_readers()))
    return {link for link in links - kept if not (link.startswith("pipe:") or link.endswith(".ttf"))}


def _folders_of_readers() -> set[Path]:
    """Temporary folders of the processes that are kept for the next trial."""
    return {folder.path for folder in reader_process._running.values()}
