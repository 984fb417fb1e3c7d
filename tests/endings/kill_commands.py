"""Commands that are ended by signals at random moments: nothing is left behind, and the next run is right.

usage: kill_commands.py [--seed N] [--count N] [--only CASE]    (a case is repeated exactly with its seed and --only)
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from many_springs import write_batch
from strandspring.modelfile import ModelFile, save_model
from studies import COMMAND, SPRING, UNCERTAINTY

_MARK = "STRANDSPRING_TEST_CASE"
_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL)
_LIMIT = 120.0  # [s]
# What may be told about the children of a process that had no chance to end them.
_FORBIDDEN = ("Traceback", "leaked", "Exception ignored", "Warning")
_OF_KILLED = "resource_tracker: There appear to be"


@dataclass(frozen=True)
class Command:
    """A command, the results that count, and how long it takes [s] on a slow machine."""

    arguments: tuple[str, ...]
    results: tuple[str, ...]
    duration: float
    compiles: bool = False


_RECORD = "records/spring_0000.csv"
COMMANDS = {
    "study": Command((*COMMAND, "--workers", "2", "-o", "study.csv"), ("study.csv",), 3.0),
    "identify-many": Command(
        ("identify-many", "records", "--workers", "2", "-o", "many"),
        ("many/springs.csv", "many/spring_0000.json", "many/spring_0003.json"),
        8.0,
    ),
    "identify": Command(("identify", _RECORD, "-o", "spring.json", "--report", "spring.pdf"), ("spring.json",), 6.0),
    "isolate": Command(("isolate", "mount.json", "--mass", "5", "--verify", "-o", "curves.csv"), ("curves.csv",), 5.0),
    "build": Command(("build", "mount.json", "-o", "dist"), ("dist/mount.fmu",), 15.0, compiles=True),
    "build all": Command(
        ("build", "mount.json", "-o", "dist", "--platform", "all"), ("dist/mount.fmu",), 40.0, compiles=True
    ),
}


class Place:
    """An empty place with inputs, and caches and temporary files of its own."""

    def __init__(self, folder: Path, compiled: Path | None) -> None:
        self.folder, self.temporary = folder / "work", folder / "temporary"
        self.temporary.mkdir(parents=True)
        write_batch(self.folder / "records", 4, rows=600)
        save_model(self.folder / "mount.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
        self.environment = {
            **os.environ,
            "TMPDIR": str(self.temporary),
            "MPLCONFIGDIR": str(folder.parent / "matplotlib"),
            _MARK: folder.name,
        }
        self.use_compiled(folder / "cache" if compiled is None else compiled)

    def use_compiled(self, folder: Path) -> None:
        """Use what is compiled in a folder, and keep there what is not."""
        self.environment |= {"XDG_CACHE_HOME": str(folder), "ZIG_GLOBAL_CACHE_DIR": str(folder / "zig")}

    def start(self, command: Command) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "strandspring", *command.arguments],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def processes(self) -> list[psutil.Process]:
        """Those that were started from here and run."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.environ().get(_MARK) == self.environment[_MARK] and process.status() != "zombie":
                    found.append(process)
            except psutil.Error:
                continue
        return found

    def digest(self, command: Command) -> dict[str, str]:
        return {name: hashlib.sha256((self.folder / name).read_bytes()).hexdigest() for name in command.results}


class Kills:
    """Kills of commands, each in a place of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._expected: dict[str, dict[str, str]] = {}
        # What need not be compiled again in every case: the kernel, and what the second run of a build needs.
        self._compiled = folder / "compiled"

    def expected(self, name: str) -> dict[str, str]:
        """Digests of what a command writes that nobody ends."""
        if name not in self._expected:
            place = Place(self._folder / f"expected {name}", self._compiled)
            process = place.start(COMMANDS[name])
            _, complaints = process.communicate(timeout=5.0 * _LIMIT)
            assert process.returncode == 0, complaints
            self._expected[name] = place.digest(COMMANDS[name])
        return self._expected[name]

    def case(self, name: str, number: signal.Signals, to_all: bool, moment: float, case: str) -> tuple[str, list[str]]:
        """How a command ended that got a signal at a moment [s], and what was wrong then or with the next run.

        The signal goes to the process alone, or to all of its group, as from a terminal or `timeout`.
        """
        command, expected = COMMANDS[name], self.expected(name)
        place = Place(self._folder / case, None if COMMANDS[name].compiles else self._compiled)
        wrong = []
        process = place.start(command)
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, number) if to_all else process.send_signal(number)
        began = time.monotonic()
        try:
            _, complaints = process.communicate(timeout=_LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            return "hangs", ["hangs"]
        if time.monotonic() - began > 10.0:
            wrong.append(f"ended after {time.monotonic() - began:.1f} s")
        allowed = (0, -number) if number == signal.SIGKILL else (0, -number, 128 + number)
        if process.returncode not in allowed:
            wrong.append(f"status {process.returncode}")
        told = "\n".join(line for line in complaints.splitlines() if number != signal.SIGKILL or _OF_KILLED not in line)
        if process.returncode == -signal.SIGINT:
            told = ""  # Python itself, whose packages were not loaded yet, shows where
        wrong += [f"standard error has {word!r}: {told}" for word in _FORBIDDEN if word in told]
        deadline = time.monotonic() + 5.0
        while place.processes() and time.monotonic() < deadline:
            time.sleep(0.1)
        wrong += [f"{process.cmdline()} is left" for process in place.processes()]
        # A process that has not begun its work is ended by the system, as it is by SIGKILL.
        if process.returncode in (0, 128 + number):
            wrong += [f"{path.name} is left" for path in place.temporary.iterdir()]
        place.use_compiled(self._compiled)
        again = place.start(command)
        _, complaints = again.communicate(timeout=5.0 * _LIMIT)
        if again.returncode != 0:
            wrong.append(f"the next run has status {again.returncode}: {complaints}")
        elif place.digest(command) != expected:
            wrong.append("the next run has another result")
        wrong += [f"{path.name} is left after the next run" for path in place.temporary.iterdir()]
        wrong += [f"{path.name} is left beside results" for path in place.folder.rglob(".*")]
        return f"{name}, {number.name}: status {process.returncode}", wrong


def moment_of(chance: random.Random, command: Command) -> float:
    """When a signal comes: at any time, and often early, where programs load."""
    return chance.uniform(0.05, command.duration if chance.random() < 0.8 else 1.0)


def main() -> None:
    """Run the cases that the command line asks for; status 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--only", type=int, help="this case alone")
    parser.add_argument("--command", choices=list(COMMANDS), action="append")
    given = parser.parse_args()
    names = given.command or list(COMMANDS)
    print(f"seed {given.seed}, {given.count} cases")
    outcomes: Counter[str] = Counter()
    failures = 0
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        kills = Kills(Path(folder))
        for case in range(given.count) if given.only is None else [given.only]:
            chance = random.Random(f"{given.seed} {case}")
            name, number = names[case % len(names)], _SIGNALS[case // len(names) % len(_SIGNALS)]
            moment = moment_of(chance, COMMANDS[name])
            to_all = chance.random() < 0.5
            outcome, wrong = kills.case(name, number, to_all, moment, f"case {case}")
            outcomes[outcome] += 1
            failures += bool(wrong)
            for sentence in wrong:
                print(
                    f"case {case}, {name}, {number.name}{' to all' * to_all} after {moment:.2f} s: {sentence}",
                    flush=True,
                )
    for outcome, count in sorted(outcomes.items()):
        print(f"{count:5d}  {outcome}")
    print(f"{failures} failures in {sum(outcomes.values())} cases")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
