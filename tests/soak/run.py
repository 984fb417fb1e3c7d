"""Soak: end commands by signals at random moments, and do the same thing very often in one process.

    python tests/soak/run.py --hours 2 [--seed SEED] [--only NAME ...]
    python tests/soak/run.py --count COUNT --only NAME

Names of COMMANDS and LEAKS take turns until the hours are over or each had COUNT trials (of a leak: repetitions).

A trial runs one command in a session of its own and sends it KILL, TERM, INT or HUP in turn, at a random moment of its
measured duration or a random while after a sign of writing: KILL to the main process alone, others in half of the
trials to its group, as from a terminal. Half of the trials find the outputs of another run in place. Afterwards each
output must be absent, the complete old one or the complete new one, and the next run of the same command must give all
bytes that an undisturbed run gives, and leave nothing else. A run that answers its signal must do so within ten
seconds, leave nothing, and print no traceback or warning; one that has kept finished work says that it resumes.

A leak is what memory grows by in the second half of the repetitions; the first is the warm-up, in which caches fill.

Only for Linux: processes and memory are read from /proc.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, redirect_stdout, suppress
from pathlib import Path

import tomllib

ROOT = Path(__file__).resolve().parents[2]
# Found in the environment of every process that descends from a trial, whatever group or session it went to.
MARK = "STRANDSPRING_TRIAL"
PATIENCE, ENDED_WITHIN, ATTEMPTS = 5.0, 10.0, 4  # [s], [s], times to reach a run before it ends
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
LIMIT = 2048  # [kB] for the second half, whatever the count: less is what allocators keep or give back
READINGS = 40
# What nobody should read who ends a command, what everybody has to whose command has kept finished work, and what
# Python itself says that is ended while it loads.
UNWANTED = ("Traceback", "leaked", "Exception ignored", "Warning")
RESUMED = "the same command continues from there"
LOADING = ("Could not import runpy module", "Fatal Python error: init_")


NAMES = tomllib.loads(Path(__file__).with_name("names.toml").read_text("utf-8"))
COMMANDS, LEAKS = NAMES["commands"], NAMES["leaks"]
KEPT = ".sqlite"


def write_inputs(folder: Path) -> None:
    """in/ of both versions, "new" and "old": records and models of the same names and other content."""
    sys.path[:0] = [str(ROOT / "fmu_src"), str(ROOT / "tests"), str(ROOT / "tests/helpers")]
    import pandas as pd

    from many_springs import measured, write
    from strandspring import identify

    for number, version in enumerate(("new", "old")):
        (folder / version / "many").mkdir(parents=True)
        for k, name in enumerate(("a", "worn", "many/m0", "many/m1", "many/m2")):
            path, table = folder / version / f"{name}.csv", measured(2 * k + number, 900)
            write(path, table)
            if "/" not in name:
                header = ("time [s]", "displacement [mm]", "force [N]")
                pd.DataFrame(table, columns=header).to_parquet(path.with_suffix(".parquet"))
                spring = identify(path).spring("model" if name == "a" else name)
                spring.save(path.with_name(f"{spring.model.name}.json"))
        spring.build_fmu(folder / version)
        system = Path(__file__).with_name("system.toml").read_text("utf-8").replace("2.0 kg", f"{2 + number} kg")
        (folder / version / "system.toml").write_text(system, encoding="utf-8")


class Trials:
    """A command with the folder of its trials: in/ with its inputs, out/, tmp/ as its TMPDIR, and cache/."""

    def __init__(self, name: str, folder: Path, inputs: Path) -> None:
        self.command, self.folder, self.inputs, self.mark = COMMANDS[name], folder, inputs, f"{os.getpid()}-{name}"
        self.written = tuple(f"{word}/" for word in self.command.split() if word.startswith("out"))
        self.emptied = ["out", "tmp", *["cache"] * (name == "build-compile")]
        self.environment = {
            **os.environ, "PYTHONPATH": str(ROOT / "fmu_src"), "TMPDIR": str(folder / "tmp"),
            "XDG_CACHE_HOME": str(folder / "cache"), "OPENBLAS_NUM_THREADS": "1", MARK: self.mark,
        }  # fmt: skip
        self.empty("out", "tmp", "cache")
        # Undisturbed runs: of the old inputs, which also fills the caches, and twice of the new ones.
        results = []
        for version in ("old", "new", "new"):
            self.empty(*self.emptied)
            begin = time.monotonic()
            status = self.start(version).wait(timeout=300.0)
            self.duration = time.monotonic() - begin
            if status or self.strangers():
                raise SystemExit(f"{self.command}: status {status}, left {self.strangers()}: {self.printed()}")
            results.append(self.outputs())
            if version == "old":
                shutil.copytree(folder / "out", folder / "before")
                for kept in (folder / "before").glob(f"*{KEPT}"):
                    kept.unlink()
        self.old, self.new, again = results
        if self.new != again:
            raise SystemExit(f"{self.command}: two undisturbed runs differ.")

    def empty(self, *names: str) -> None:
        """Make folders anew."""
        for name in names:
            shutil.rmtree(self.folder / name, ignore_errors=True)
            (self.folder / name).mkdir(parents=True)

    def start(self, version: str) -> subprocess.Popen[bytes]:
        shutil.rmtree(self.folder / "in", ignore_errors=True)
        shutil.copytree(self.inputs / version, self.folder / "in")
        with (self.folder / "stderr.txt").open("wb") as errors:
            return subprocess.Popen(
                [sys.executable, "-m", "strandspring", *self.command.split()], cwd=self.folder,
                env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors,
                start_new_session=True,
            )  # fmt: skip

    def printed(self) -> str:
        """The end of what the last run printed on standard error, on one line."""
        return " ".join((self.folder / "stderr.txt").read_text(errors="replace")[-2000:].split())

    def files(self) -> list[str]:
        """In out/."""
        return [str(path.relative_to(self.folder)) for path in (self.folder / "out").rglob("*") if path.is_file()]

    def outputs(self) -> dict[str, str]:
        """Hashes of the outputs that are there, by path; hidden files are not outputs."""
        return {
            name: hashlib.sha256((self.folder / name).read_bytes()).hexdigest()
            for name in self.files()
            if f"{name}/".startswith(self.written) and "/." not in name and KEPT not in name
        }

    def strangers(self) -> list[str]:
        """What lies in tmp/, and what in out/ is neither output nor kept for the next run."""
        known = self.outputs()
        in_tmp = [str(path.relative_to(self.folder)) for path in (self.folder / "tmp").iterdir()]
        return [name for name in self.files() if name not in known and not name.endswith(KEPT)] + in_tmp

    def descendants(self) -> Iterator[int]:
        """Living processes that have the mark in their environment."""
        wanted = f"{MARK}={self.mark}".encode()
        for entry in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                alive = (entry / "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
                if alive and wanted in (entry / "environ").read_bytes().split(b"\0"):
                    yield int(entry.name)

    def end(self, process: subprocess.Popen[bytes], number: signal.Signals, chance: random.Random) -> set[Path]:
        """Send a signal at a random moment; what shared memory and semaphores were open then."""
        if chance.random() < 0.5:
            with suppress(subprocess.TimeoutExpired):
                process.wait(timeout=chance.uniform(0.0, 1.1 * self.duration))
        else:
            changes, before = chance.randint(1, 6), None
            pause = chance.choice([0.0, chance.uniform(0.0, 0.02), chance.uniform(0.0, 0.3)])
            while process.poll() is None and changes >= 0:
                now = [len(names) for top in ("out", "tmp") for _, _, names in os.walk(self.folder / top)]
                changes, before = changes - (now != before), now
            time.sleep(pause)
        opened: set[Path] = set()
        for pid in self.descendants():
            with suppress(OSError):
                opened |= set(map(Path, re.findall(r"/dev/shm/\S+", Path(f"/proc/{pid}/maps").read_text())))
        if process.poll() is None and number != signal.SIGKILL and chance.random() < 0.5:
            os.killpg(process.pid, number)
        elif process.poll() is None:
            process.send_signal(number)
        return opened

    def trial(self, number: signal.Signals, chance: random.Random) -> tuple[str, list[str]]:
        """End one run, and judge how it ended, what it left and what the next run gives."""
        before, wrong = (self.old if chance.random() < 0.5 else {}), []
        for _ in range(ATTEMPTS):
            self.empty(*self.emptied)
            if before:
                shutil.copytree(self.folder / "before", self.folder / "out", dirs_exist_ok=True)
            process = self.start("new")
            opened = self.end(process, number, chance)
            try:
                process.wait(ENDED_WITHIN)
            except subprocess.TimeoutExpired:
                wrong.append(f"has not ended within {ENDED_WITHIN:.0f} s")
                process.kill()
                process.wait()
            if process.returncode != 0:
                break
        status, said = process.returncode, self.printed()
        answered = status in (0, 128 + number)
        # While Python loads, it does not answer yet: the system ends it, as by SIGKILL, or Python says where it was.
        if not answered and status != -number and not any(words in said for words in LOADING):
            wrong.append(f"ended with {status}: {said}")
        wrong += [f"printed {word!r}: {said}" for word in UNWANTED if answered and word in said]
        kept = any(name.endswith(KEPT) for name in self.files())
        if number != signal.SIGKILL and status != 0 and kept and RESUMED not in said:
            wrong.append(f"ended with {status} and did not say that it resumes: {said}")
        deadline = time.monotonic() + PATIENCE
        while (alive := list(self.descendants())) and time.monotonic() < deadline:
            time.sleep(0.1)
        left = [f"process {pid}" for pid in alive] + [str(name) for name in opened if name.exists()] + self.strangers()
        for pid in alive:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        wrong += spoilt(self.outputs(), self.new, before) + [f"left {name}" for name in left if answered]
        # As if the next run came a day later: parts of files that are written just now are nobody's to remove.
        for path in (self.folder / "out").rglob("*.part"):
            os.utime(path, (time.time() - 86400.0,) * 2)
        status = self.start("new").wait(timeout=300.0)
        if status or self.outputs() != self.new:
            wrong.append(f"the next run ended with {status}, and gave other outputs or none: {self.printed()}")
        wrong += [f"the next run left {name}" for name in self.strangers()]
        return "finished before" if process.returncode == 0 else "ended", wrong


def spoilt(found: Mapping[str, str], new: Mapping[str, str], before: Mapping[str, str]) -> list[str]:
    """Outputs that are neither those of an undisturbed run nor those that lay there before, or that are lost."""
    mixed = [name for name, content in found.items() if content not in (new.get(name), before.get(name))]
    return [f"{name} is neither old nor new" for name in mixed] + [
        f"{name} was there and is lost" for name in before if name not in found
    ]


# What is done again and again, with the number of the repetition.
Work = Callable[[int], object]


def grown(work: Work, count: int) -> int:
    """What the resident set grows by in the second half of `count` repetitions [kB]."""
    readings = []
    for reading in range(READINGS):
        for number in range(count * reading // READINGS, count * (reading + 1) // READINGS):
            work(number)
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        readings.append(pages * os.sysconf("SC_PAGE_SIZE") // 1024)
    return readings[-1] - readings[READINGS // 2 - 1]


def leak(name: str, count: int) -> int:
    """The repetitions of a name of LEAKS, in a process of its own; 1 if its memory grows."""
    sys.path.insert(0, str(ROOT / "fmu_src"))
    from strandspring import Spring, build_fmu, identify
    from strandspring.fmu.checks.check import running

    with tempfile.TemporaryDirectory(prefix="soak-") as temporary, ExitStack() as stack:
        folder, new = Path(temporary), Path(temporary) / "inputs" / "new"
        write_inputs(folder / "inputs")
        stack.enter_context(redirect_stdout(io.StringIO()))
        backend = "python" if name.startswith("python") else "native"
        fmu = build_fmu(new / "model.json", folder / "fmu", backend=backend, zero=0.0)
        slave, found = stack.enter_context(running(fmu)), identify(new / "a.csv")

        def live(number: int) -> None:
            slave.reset()
            slave.setupExperiment()
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            step(number)

        def step(number: int) -> None:
            """A triangle of 50 steps a stroke, whose amplitude changes from cycle to cycle."""
            cycle, part = divmod(number, 100)
            rise = part / 25.0 - 1.0 if part < 50 else 3.0 - part / 25.0
            slave.setReal([0], [0.01 * rise * (0.5 + 0.5 * (cycle % 7) / 6.0)])
            slave.doStep(1e-3 * number, 1e-3)
            slave.getReal([1])

        works: dict[str, Work] = {
            "steps": lambda number: step(number + 1),
            "lives": live,
            "identifications": lambda k: identify(new / f"many/m{k % 3}.csv").spring("s").save(folder / "s.json"),
            "builds": lambda _: build_fmu(new / "model.json", folder / "dist"),
            "loads": lambda _: Spring.load(new / "model.json"),
            "reports": lambda _: found.report(folder / "report.html"),
        }
        live(0)
        growth = grown(works[name.rpartition("-")[2]], count)
    print(f"{name}, {count} times: the second half takes {growth:+d} kB", flush=True)
    return int(growth > LIMIT)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--count", type=int, default=0, help="trials of each name, in place of hours")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--only", choices=[*COMMANDS, *LEAKS], action="append", metavar="NAME", help="several take turns"
    )
    parser.add_argument("--leak", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.leak:
        return leak(options.leak[0], int(options.leak[1]))
    names, end, failures = options.only or [*COMMANDS, *LEAKS], time.monotonic() + 3600.0 * options.hours, 0
    # In the background and below nohup some are ignored, and what this starts would ignore them, too.
    for ignored in (number for number in SIGNALS[1:] if signal.getsignal(number) == signal.SIG_IGN):
        signal.signal(ignored, signal.SIG_DFL)
    print(f"seed {options.seed}", flush=True)
    with suppress(KeyboardInterrupt), tempfile.TemporaryDirectory(prefix="soak-") as temporary:
        folder, places, number = Path(temporary), {}, -1
        write_inputs(folder / "inputs")
        while (number := number + 1) < options.count * len(names) if options.count else time.monotonic() < end:
            turn, place = divmod(number, len(names))
            name = names[place]
            if name in LEAKS:
                if options.count == 0 or turn == 0:
                    repetitions = str(options.count or LEAKS[name])
                    command = [sys.executable, __file__, "--leak", name, repetitions]
                    failures += subprocess.run(command, check=False).returncode != 0
                continue
            if name not in places:
                places[name] = Trials(name, folder / name, folder / "inputs")
            kind = SIGNALS[turn % len(SIGNALS)]
            how, wrong = places[name].trial(kind, random.Random(f"{options.seed} {name} {turn}"))
            failures += bool(wrong)
            print(f"{name} {turn}, {kind.name}, {how}", *(f"WRONG: {what}" for what in wrong), sep="\n  ", flush=True)
    print(f"{failures} failures", flush=True)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
