"""Random trials: python tests/fuzz/run.py [--hours H | --count N] [--only TARGET] [--seed S] [FILE...]

A target draws an input from a seed and gives it to the package; those that begin with "fmi" are random calls against
the C sources of FMUs under sanitizers (fmi/fuzz.c). Each target first judges its files of past findings (corpus/) and
then random trials. Trial k has the seed SEED + k, so that `--seed S --count 1` repeats it. By default the first seed is
from the commit's hash, and with --hours from the clock. A failure is printed with the command that repeats it, and the
exit status is 1; keep its file in the corpus.

The law of all: an input is accepted, or refused by one sentence that says what is wrong and what to do. A trial also
fails if it warns, prints, takes over 10 s of processor time or over 1 GB of memory, leaves temporary or open files
behind, or ends the process; it is done in a child process with limits of memory and time.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import gzip
import importlib
import multiprocessing
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path
from unittest import mock

HERE = Path(__file__).resolve().parent
sys.path[:0] = map(str, (HERE, HERE.parent / "helpers"))

# Of each target its function in targets/, which takes dice and an empty folder. `judge` in its module takes a file of
# the corpus. Both return an outcome, or raise what the package raises.
TARGETS = {
    "models": "models.trial", "fmus": "models.fmus", "systems": "systems.trial", "descriptions": "systems.campaigns",
    "options": "options.trial", "journals": "journals.trial", "identify": "identify.trial",
    "records_text": "records.text", "records_binary": "records.binary",
}  # fmt: skip
FORMS = ("spring", "table", "states", "branches", "branches-states", "system")
MAX_SECONDS = 10.0  # of processor time; by the clock 30 times as many, since other programs run too
MAX_BYTES = 1024**3
_SEQUENCES = 500  # of FMI calls between two looks at the clock: some seconds
_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", "ARROW_DEFAULT_MEMORY_POOL": "system"}


def seed_of_commit() -> int:
    """From the hash of the commit; without git, or with STRANDSPRING_FUZZ_SEED, that of the variable or 1."""
    if given := os.environ.get("STRANDSPRING_FUZZ_SEED"):
        return int(given)
    if shutil.which("git") is None:
        return 1
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=HERE, capture_output=True, text=True, check=False)
    return int(done.stdout[:7], 16) if done.returncode == 0 else 1


def corpus_of(target: str) -> list[Path]:
    """The files of past findings and the seeds of a target."""
    return sorted((HERE / "corpus" / target).glob("*"))


class Trials:
    """Trials in a child process, a new one after one that ended it; failures are printed."""

    def __init__(self) -> None:
        self.outcomes: Counter[tuple[str, str]] = Counter()
        self.failures: list[str] = []
        self._child: multiprocessing.process.BaseProcess | None = None

    def __enter__(self) -> Trials:
        self._folder = Path(tempfile.mkdtemp(prefix="strandspring-fuzz-"))
        (self._folder / "tmp").mkdir()
        return self

    def __exit__(self, *_: object) -> None:
        if self._child:
            self._pipe.close()
            self._child.join()
        if left := [path.name for path in (self._folder / "tmp").iterdir()]:
            self._fail("the end of the process", [f"left {left}"])
        shutil.rmtree(self._folder)

    def do(self, target: str, seed: int, file: Path | None = None) -> None:
        """One trial, or a file of the corpus that is judged."""
        if self._child is None or not self._child.is_alive():
            spawn = multiprocessing.get_context("spawn")
            self._pipe, end = spawn.Pipe()
            with mock.patch.dict(os.environ, _ENVIRONMENT, TMPDIR=str(self._folder / "tmp")):
                self._child = spawn.Process(target=_child, args=(self._folder, end))
                self._child.start()
            end.close()
        self._pipe.send((target, seed, file))
        try:
            if not self._pipe.poll(30.0 * MAX_SECONDS):
                self._child.kill()
            outcome, failures = self._pipe.recv()
        except EOFError:
            self._child.join()
            outcome, failures = "FAILED", [f"the process ended with status {self._child.exitcode}"]
        self.outcomes[target, outcome] += 1
        if failures:
            self._fail(f"--only {target} {file or f'--seed {seed} --count 1'}", failures)

    def _fail(self, where: str, failures: list[str]) -> None:
        self.failures.append(where)
        print(f"FAILURE: python {__file__} {where}", *failures, "", sep="\n", flush=True)


def _child(folder: Path, pipe: Connection) -> None:
    """Do trials as they are asked for, until the pipe is closed."""
    warnings.simplefilter("error")
    warnings.filterwarnings("ignore", message=r"(?s).*Sphinx")  # extensions of the site that use old names
    warnings.filterwarnings("ignore", message="`displacement` must be within the identified range")  # paths are wide
    with (folder / "printed").open("w+b") as printed:
        for descriptor in (1, 2):
            os.dup2(printed.fileno(), descriptor)
        with contextlib.suppress(EOFError):
            while True:
                target, seed, file = pipe.recv()
                work = Path(tempfile.mkdtemp(dir=folder))
                pipe.send(_judged(target, seed, file, work, printed.fileno()))
                os.chdir(folder)
                shutil.rmtree(work)


def _outcome(target: str, seed: int, file: Path | None, work: Path) -> str:
    name, _, function = TARGETS.get(target, target).partition(".")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of other packages, when they are imported
        module = importlib.import_module(f"targets.{name}")
        from strandspring.errors import StrandspringError
        from targets.mutator import kind_of
    try:
        if file is None:
            return str(getattr(module, function)(random.Random(seed), work))
        place = work / file.name.removesuffix(".gz")
        place.write_bytes(gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes())
        return str(module.judge(place))
    except StrandspringError as refusal:
        return f"refused: {kind_of(refusal, work)}"


def _judged(target: str, seed: int, file: Path | None, work: Path, printed: int) -> tuple[str, list[str]]:
    """The outcome of a trial, and what was wrong with it."""
    os.ftruncate(printed, 0)
    os.lseek(printed, 0, os.SEEK_SET)
    (files, _), begin = _left(), time.process_time()
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MAX_BYTES, resource.RLIM_INFINITY))
    failures, outcome = [], "FAILED"
    try:
        outcome = _outcome(target, seed, file, work)
    except BaseException:
        failures.append(traceback.format_exc())
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    if (seconds := time.process_time() - begin) > MAX_SECONDS:
        failures.append(f"took {seconds:.1f} s")
    gc.collect()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    if text := os.pread(printed, 4000, 0):
        failures.append(f"printed: {text.decode(errors='replace')}")
    opened, temporary = _left()
    failures += [f"left {path}" for path in (*work.rglob(".*"), *temporary, *(opened - files))]
    for path in temporary:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return "FAILED" if failures else outcome, failures


def _left() -> tuple[set[str], set[Path]]:
    """What is open besides pipes, fonts and libraries, and temporary files; but for processes that are kept."""
    from strandspring.records.formats import reader_process

    kept = {folder.path for folder in reader_process._running.values()}
    links = {str(each.readlink()) for each in [*Path("/proc/self/fd").iterdir()] if each.is_symlink()}
    opened = {link for link in links - set(map(str, kept)) if not link.startswith("pipe:")}
    left = {*Path(tempfile.gettempdir()).iterdir()} - kept
    return {link for link in opened if not link.endswith((".ttf", ".so"))}, left


def run(target: str, seed: int, count: int, seconds: float) -> tuple[int, int]:
    """Run a target; returns the number of trials and of failures, which are printed."""
    deadline, done = time.monotonic() + seconds, 0
    if target in TARGETS:
        with Trials() as trials:
            for file in corpus_of(target):
                trials.do(target, 0, file)
            while done < count and time.monotonic() < deadline:
                trials.do(target, seed + done)
                done += 1
        return done, len(trials.failures)
    import program

    with tempfile.TemporaryDirectory(prefix="strandspring-fuzz-") as folder:
        built = program.program_of(target.removeprefix("fmi-"), Path(folder))
        while done < count and time.monotonic() < deadline:
            found, _ = program.run(built, seed + done // program.RUN, sequences := min(_SEQUENCES, count - done))
            done += sequences
            if found:
                print(f"FAILURE in {target}:\n{found}", flush=True)
                return done, 1
    return done, 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [*TARGETS, *(f"fmi-{form}" for form in FORMS)]
    parser.add_argument("--hours", type=float, default=0.0, help="of all targets; else it is a minute for each")
    parser.add_argument("--count", type=int, default=10**9, help="trials of each target at most")
    parser.add_argument("--only", action="append", choices=names, metavar="TARGET", help=f"of {', '.join(names)}")
    parser.add_argument("--seed", type=int, help="of the first trial")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="files of one target to judge instead")
    given = parser.parse_args()
    targets = given.only or names
    if given.files:
        with Trials() as trials:
            for file in given.files:
                trials.do(targets[0], 0, file.resolve())
        print(*sorted(trials.outcomes.items()), sep="\n")
        return bool(trials.failures)
    seed = int(time.time()) if given.hours else seed_of_commit()
    seed, failed = seed if given.seed is None else given.seed, 0
    for target in targets:
        done, failures = run(target, seed, given.count, 3600.0 * given.hours / len(targets) or 60.0)
        failed += failures
        print(f"{target:22} from seed {seed:10} {done:9} trials {failures:5} failures", flush=True)
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
