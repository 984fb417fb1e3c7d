"""Random trials: python tests/fuzz/run.py [--hours H | --minutes M | --count N] [--only TARGET] [--seed S] [FILE...]

A target (see `TARGETS`) draws inputs from a seed, gives them to the package, and says what is allowed; those that
begin with "fmi" are random calls against the C sources of FMUs under sanitizers (fmi/fuzz.h). Each target first judges
its files of past findings (corpus/) and then random trials. Trial k has the seed SEED + k, so that `--seed S --count 1`
repeats it. By default the first seed is from the commit's hash, and with --hours it is where the last such run ended,
which is kept in tests/fuzz/.next.json. A failure is printed with the command that repeats it, and the exit status is 1;
keep its file in the corpus.

Trials run one after the other in a child process with limits of memory and time. One also fails if it warns, prints,
takes over 10 s of processor time or over 1 GB of memory, leaves temporary or open files behind, or ends the process.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import json
import math
import os
import random
import resource
import select
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = map(str, (HERE, HERE.parent / "helpers"))

from seeds import SEED  # noqa: E402

# Of each target in Python its module in targets/, whose `trial` (or a function of the name given) takes dice and an
# empty folder, and whose `judge` takes a file; both yield a group (such as the format) and then an outcome (such as
# "accepted" or "refused: ..."), and raise for a failure.
TARGETS = {
    "models": "models", "corners": "models:corners", "fmus": "fmus", "systems": "systems", "options": "options",
    "journals": "journals", "identify": "identify", "records_text": "records:text", "records_binary": "records:binary",
    "descriptions": "descriptions",
}  # fmt: skip
FORMS = ("spring", "table", "states", "real-time", "no-energy", "branches", "branches-states", "system")
NEXT = HERE / ".next.json"
MAX_SECONDS = 10.0  # of processor time
PATIENCE = 30.0 * MAX_SECONDS  # by the clock, since other programs run too
MAX_BYTES = 1024**3
_ENDLESS = 10**9
_SEQUENCES = 500  # of FMI calls between two looks at the clock: some seconds
_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", "ARROW_DEFAULT_MEMORY_POOL": "system"}
Result = dict[str, str]


@dataclass
class Report:
    """Number of trials by group and outcome, and failures with seed, group and reason."""

    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    failures: list[Result] = field(default_factory=list)

    def share(self, word: str) -> float:
        """Of the trials whose outcome has this word."""
        return sum(n for (_, outcome), n in self.outcomes.items() if word in outcome) / self.outcomes.total()


def corpus_of(target: str) -> list[Path]:
    """The files of past findings of a target."""
    return sorted((HERE / "corpus" / target).glob("*"))


def trials(
    target: str, seed: int, count: int, files: Sequence[Path] = (), keep: Path | None = None, seconds: float = math.inf
) -> Report:
    """Do trials in a child process, a new one after a trial that ended it, or judge files; failures are printed."""
    seed, count = (1, len(files)) if files else (seed, count)
    deadline, end, report = time.monotonic() + seconds, seed + count, Report()
    while seed < end and time.monotonic() < deadline:
        with tempfile.TemporaryDirectory() as folder:
            for result in _results(target, seed, end - seed, Path(folder), files, keep):
                group, outcome = result["group"], result["outcome"]
                if failure := result.get("failure"):
                    report.failures.append({"seed": str(seed), "group": group, "failure": failure})
                    how = files[seed - 1] if files else f"--seed {seed} --count 1"
                    print(f"FAILURE in {group}: python {__file__} --only {target} {how}\n{failure}\n", flush=True)
                report.outcomes[group, outcome] += 1
                seed += 1
                if time.monotonic() > deadline:
                    return report
            if left := [path.name for path in (Path(folder) / "tmp").iterdir()]:
                report.failures.append({"seed": str(seed), "group": "end", "failure": f"left {left}"})
                print(f"FAILURE at the end of the process, before the seed {seed}: left {left}\n", flush=True)
    return report


def _results(
    target: str, seed: int, count: int, folder: Path, files: Sequence[Path], keep: Path | None
) -> Iterator[Result]:
    """Results of the trials of one child, of which the last may be its end."""
    (folder / "tmp").mkdir()
    command = [sys.executable, __file__, "--only", target, "--seed", str(seed), "--count", str(count)]
    command += ["--child", str(folder), *([] if keep is None else ["--keep", str(keep)]), *map(str, files)]
    environment = os.environ | _ENVIRONMENT | {"TMPDIR": str(folder / "tmp"), "STRANDSPRING_FUZZ_SEED": str(SEED)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment) as child:
        assert child.stdout is not None
        try:
            rest = b""
            group, reason = "unknown", "did not end"
            while select.select([child.stdout], [], [], PATIENCE)[0]:
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


# ---- in the child ----------------------------------------------------------------------------------------------------


def _do_trials(target: str, seeds: range, files: Sequence[Path], folder: Path, keep: Path | None) -> None:
    """Do trials in this process; results go to standard output, one JSON object per line."""
    name, _, function = TARGETS.get(target, target).partition(":")
    module = importlib.import_module(f"targets.{name}")
    trial = getattr(module, function or "trial")
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
            if files:
                tried = module.judge(Path(shutil.copy(files[seed - 1], work)))
            else:
                tried = trial(random.Random(seed), work)
            for result in _judged(tried, printed.fileno()):
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
    if seconds > MAX_SECONDS or peak > MAX_BYTES:
        failures.append(f"took {seconds:.1f} s and {peak / 1e6:.0f} MB")
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
    from strandspring.records.formats import reader_process

    return {folder.path for folder in reader_process._running.values()}


# ---- runs of all targets ---------------------------------------------------------------------------------------------


def run(target: str, seed: int, count: int, seconds: float) -> tuple[int, int]:
    """Run a target; returns the number of trials and of failures, which are printed."""
    if target in TARGETS:
        reports = [trials(target, 1, 1, files=corpus_of(target))] if corpus_of(target) else []
        reports.append(trials(target, seed, count, seconds=seconds))
        return reports[-1].outcomes.total(), sum(len(report.failures) for report in reports)
    import fuzzing

    deadline, done = time.monotonic() + seconds, 0
    with tempfile.TemporaryDirectory(prefix="strandspring-fuzz-") as folder:
        program = fuzzing.program_of(target.removeprefix("fmi-"), Path(folder))
        while done < count and time.monotonic() < deadline:
            sequences = min(_SEQUENCES, count - done)
            outcome = fuzzing.run(program, seed + done // fuzzing.RUN, sequences)
            done += sequences
            if outcome.found:
                print(f"FAILURE in {target}:\n{outcome.found}", flush=True)
                return done, 1
    return done, 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [*TARGETS, *(f"fmi-{form}" for form in FORMS)]
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--hours", type=float, default=0.0)
    length.add_argument("--minutes", type=float, default=2.0)
    length.add_argument("--count", type=int, help="trials of each target, instead of a time")
    parser.add_argument("--only", action="append", metavar="TARGET", help=f"of {', '.join(names)}")
    parser.add_argument("--scripts", action="store_true", help="the targets in Python alone")
    parser.add_argument("--seed", type=int, help="of the first trial")
    parser.add_argument("--keep", type=Path, help="folder for the files of the trials, which are not deleted")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="files of one target to judge instead")
    given = parser.parse_args()
    targets = given.only or (list(TARGETS) if given.scripts else names)
    if given.child:
        seeds = range(given.seed, given.seed + given.count)
        _do_trials(targets[0], seeds, given.files, given.child, given.keep)
        return 0
    if wrong := set(targets) - set(names):
        parser.error(f"there is no target {', '.join(sorted(wrong))}")
    print(f"The seed of this commit is {SEED}.", flush=True)
    if given.files or given.keep:
        report = trials(
            targets[0], SEED if given.seed is None else given.seed, given.count or 1, given.files, given.keep
        )
        print(*sorted(report.outcomes.items()), sep="\n")
        return bool(report.failures)
    going_on = json.loads(NEXT.read_text()) if given.hours and NEXT.exists() else {}
    share = math.inf if given.count else (3600.0 * given.hours or 60.0 * given.minutes) / len(targets)
    failed = 0
    for target in targets:
        seed = going_on.get(target, SEED) if given.seed is None else given.seed
        done, failures = run(target, seed, given.count or _ENDLESS, share)
        failed += failures
        print(f"{target:22} from seed {seed:10} {done:9} trials {failures:5} failures", flush=True)
        going_on[target] = seed + done
        if given.hours:
            NEXT.write_text(json.dumps(going_on))
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
