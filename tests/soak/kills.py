"""End commands by signals at random moments and see what remains: outputs, temporary files, processes, semaphores.

    python tests/soak/kills.py [--seed SEED] [--count COUNT] [--first TRIAL] [--only COMMAND] [--signal SIGNAL]

A trial runs one command in a session of its own and sends it a signal, either at a random moment of its measured
duration or a random while after its n-th sign of writing. SIGKILL, the default, goes to the main process alone; others
in half of the trials to its group, as from a terminal or `timeout`. Half of the trials find the outputs of another run
in place. Afterwards each output must be absent, the complete old one or the complete new one, and the next run of the
same command must give all bytes that an undisturbed run gives. Left-overs are counted after five seconds, and again
after the next run, which should have swept them. A run that answers its signal must do so within ten seconds, leave
nothing, and print no traceback or warning. A trial that is reported is repeated by the same --seed and its --signal
alone, with `--only COMMAND --first TRIAL --count 1`. A run that has kept finished work says that it resumes.

Only for Linux: processes are found through /proc.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "fmu_src"
# Found in the environment of every process that descends from a trial, whatever group or session it went to.
MARK = "STRANDSPRING_TRIAL"
PATIENCE = 5.0  # [s]
ATTEMPTS = 4  # to reach a run before it ends
ENDED_WITHIN = 10.0  # [s]
SIGNALS = {name: signal.Signals[f"SIG{name}"] for name in ("KILL", "TERM", "INT", "HUP")}
# A mass on four springs of in/model.json under shocks, as SYSTEM.toml.
SYSTEM = """
format = "strandspring-system"
format_version = 1
name = "mass"
[[body]]
name = "mass"
mass = {mass}
motion = {{ axis = [0, 0, 1] }}
[mount_type.spring]
axes = [{{ direction = "-z", model = "model.json" }}]
[[mount]]
name = "spring"
type = "spring"
places = [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
[[case]]
name = "shock"
pulse = "half-sine"
peak = "10 g"
duration = "5 ms"
directions = ["+z", "-z"]
"""
# What nobody should read who ends a command.
UNWANTED = ("Traceback", "leaked", "Exception ignored", "Warning")
# What everybody has to know whose command has kept what it had finished.
RESUMED = "the same command continues from there"
# What Python itself says that is ended while it loads.
LOADING = ("Could not import runpy module", "Fatal Python error: init_")


@dataclass(frozen=True)
class Command:
    """A command and the paths that it writes, relative to the folder that it runs in.

    Parameters
    ----------
    arguments : str         Of strandspring.
    outputs : tuple of str  Files, and folders that hold outputs only.
    kept : tuple of str     What keeps finished work for the next run; it may differ, and lie there or not.
    compiles : bool         Whether it finds nothing compiled; the next run finds what this one has left of it.
    """

    arguments: str
    outputs: tuple[str, ...]
    kept: tuple[str, ...] = ()
    compiles: bool = False


COMMANDS = {
    "show": Command("show in/a.csv -o out/page.html", ("out/page.html",)),
    "identify": Command(
        "identify in/a.csv -o out/spring.json --report out/spring.html", ("out/spring.json", "out/spring.html")
    ),
    "identify-json": Command("identify in/a.csv -o out/spring.json --method two-stage --json", ("out/spring.json",)),
    "identify-many": Command(
        "identify-many in/many -o out --workers 2",
        ("out/m0.json", "out/m1.json", "out/m2.json", "out/springs.csv", "out/springs.parquet"),
        ("out/springs.journal.sqlite",),
    ),
    "predict": Command("predict in/model.json in/a.csv -o out/predicted.csv", ("out/predicted.csv",)),
    "predict-sheet": Command("predict in/model.json in/a.parquet -o out/predicted.csv", ("out/predicted.csv",)),
    "info": Command("info in/model.json in/a.csv", ()),
    "compare": Command("compare in/model.json in/worn.json --plot out/difference.png", ("out/difference.png",)),
    "synthesize": Command("synthesize spring in/model.json --amplitude 5 -o out/record.csv", ("out/record.csv",)),
    "build": Command("build in/model.json -o out --backend both --platform linux64 --states", ("out",)),
    "build-record": Command(
        "build in/a.csv -o out/fmus --models out/models --name mount --platform linux64", ("out/fmus", "out/models")
    ),
    "build-compile": Command("build in/model.json -o out --platform linux64,win64", ("out",), compiles=True),
    "verify": Command("verify in/worn.fmu", ()),
    "export": Command("export in/model.json --ssv --modelica --ssp --mass 5 -o out", ("out",)),
    "isolate": Command(
        "isolate in/model.json --mass 0.5 --points 40 -o out/curves.csv --plot out/curves.svg",
        ("out/curves.csv", "out/curves.svg"),
    ),
    "isolate-verify": Command("isolate in/model.json --mass 0.5 --points 40 --verify", ()),
    "study": Command(
        "study in/model.json --mass 0.4:0.6:10 --draws 30 --workers 2 -o out/study.csv",
        ("out/study.csv",),
        ("out/study.csv.part.sqlite",),
    ),
    "simulate": Command(
        "simulate in/system.toml --draws 20 -o out/figures.csv --report out/page.html --histories out/histories",
        ("out/figures.csv", "out/page.html", "out/histories"),
    ),
    "build-system": Command("build in/system.toml -o out --platform linux64", ("out",)),
    "plan": Command("plan in/model.json -o out/program.csv", ("out/program.csv",)),
    "docs": Command("docs -o out/docs.html", ("out/docs.html",)),
}


@dataclass
class Undisturbed:
    """What a command writes in one second or so, for the inputs "new" and "old"."""

    status: int
    duration: float
    new: dict[str, str]
    old: dict[str, str]


@dataclass
class Remains:
    """What a trial left, by kind; `wrong` is what no kill may do."""

    wrong: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    unswept: list[str] = field(default_factory=list)


class Place:
    """The folder of a command's trials: in/ with its inputs, out/, tmp/ as its TMPDIR, and cache/."""

    def __init__(self, folder: Path, inputs: Path, mark: str) -> None:
        self.folder, self.inputs = folder, inputs
        self.environment = {
            **os.environ,
            "PYTHONPATH": str(PACKAGE),
            "TMPDIR": str(folder / "tmp"),
            "XDG_CACHE_HOME": str(folder / "cache"),
            "OPENBLAS_NUM_THREADS": "1",
            MARK: mark,
        }
        folder.mkdir()
        self.empty("out", "tmp", "cache")

    def empty(self, *names: str) -> None:
        """Make folders anew."""
        for name in names:
            shutil.rmtree(self.folder / name, ignore_errors=True)
            (self.folder / name).mkdir()

    def start(self, command: Command, version: str) -> subprocess.Popen[bytes]:
        inputs = self.folder / "in"
        shutil.rmtree(inputs, ignore_errors=True)
        shutil.copytree(self.inputs / version, inputs)
        return subprocess.Popen(
            [sys.executable, "-m", "strandspring", *command.arguments.split()],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=(self.folder / "stderr.txt").open("wb"),
            start_new_session=True,
        )

    def run(self, command: Command, version: str) -> int:
        return self.start(command, version).wait(timeout=300.0)

    def printed(self) -> str:
        """The end of what the last run printed on standard error."""
        return (self.folder / "stderr.txt").read_text(errors="replace")[-2000:]

    def said(self, words: str) -> bool:
        """Whether the last run printed them, on one line or several."""
        return words in " ".join(self.printed().split())

    def outputs(self, command: Command) -> dict[str, str]:
        """Hashes of the outputs that are there, by path; hidden files are not outputs."""
        files: list[Path] = []
        for name in command.outputs:
            path = self.folder / name
            files += [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
        paths = {str(file.relative_to(self.folder)): file for file in files}
        return {
            path: hashlib.sha256(file.read_bytes()).hexdigest() for path, file in paths.items() if not _hidden(path)
        }

    def strangers(self, command: Command) -> list[str]:
        """What lies in tmp/, and what in out/ is neither output nor kept for the next run."""
        known = {*self.outputs(command), *command.kept}
        found = (str(path.relative_to(self.folder)) for path in (self.folder / "out").rglob("*") if not path.is_dir())
        return sorted(
            {
                *(_hidden(name) or name for name in found if name not in known),
                *(f"tmp/{path.name}" for path in (self.folder / "tmp").iterdir()),
            }
        )

    def signs(self) -> int:
        """How many entries out/ and tmp/ have, a measure of how far a run has come."""
        return sum(
            len(names) + len(folders) for top in ("out", "tmp") for _, folders, names in os.walk(self.folder / top)
        )


def _hidden(path: str) -> str:
    """A path up to its first hidden file or folder; "" if none is."""
    parts = path.split("/")
    hidden = next((k for k, part in enumerate(parts) if part.startswith(".")), None)
    return "" if hidden is None else "/".join(parts[: hidden + 1])


def descendants(mark: str) -> Iterator[int]:
    """Processes that have the mark in their environment."""
    wanted = f"{MARK}={mark}".encode()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                variables = (entry / "environ").read_bytes().split(b"\0")
                alive = (entry / "stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
            except OSError:
                continue
            if alive and wanted in variables:
                yield int(entry.name)


def shared_memory(mark: str) -> set[Path]:
    """Named semaphores and shared memory that the processes of a trial have open."""
    names: set[Path] = set()
    for pid in descendants(mark):
        with suppress(OSError):
            names |= set(map(Path, re.findall(r"/dev/shm/\S+", Path(f"/proc/{pid}/maps").read_text())))
    return names


def end_at(
    place: Place, process: subprocess.Popen[bytes], number: signal.Signals, chance: random.Random, duration: float
) -> tuple[str, set[Path]]:
    """Send a signal at a random moment; says which, and what shared memory was open then."""
    opened: set[Path] = set()

    def end() -> None:
        opened.update(shared_memory(place.environment[MARK]))
        if number != signal.SIGKILL and chance.random() < 0.5:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)

    if chance.random() < 0.5:
        moment = chance.uniform(0.0, 1.1 * duration)
        try:
            process.wait(timeout=moment)
        except subprocess.TimeoutExpired:
            end()
        return f"after {moment:.3f} s", opened
    changes, pause = chance.randint(1, 6), chance.choice([0.0, chance.uniform(0.0, 0.02), chance.uniform(0.0, 0.3)])
    before, remaining = place.signs(), changes
    while process.poll() is None and remaining > 0:
        now = place.signs()
        remaining -= now != before
        before = now
    if process.poll() is None:
        time.sleep(pause)
        end()
    return f"{pause:.3f} s after change {changes} of its folders", opened


def trial(
    command: Command, place: Place, undisturbed: Undisturbed, number: signal.Signals, chance: random.Random
) -> tuple[str, Remains]:
    """End one run and judge how it ended, what it left and what the next run gives."""
    before = undisturbed.old if chance.random() < 0.5 else {}
    remains = Remains()
    for _ in range(ATTEMPTS):
        place.empty("out", "tmp", *(["cache"] if command.compiles else []))
        if before:
            shutil.copytree(place.folder / "old", place.folder / "out", dirs_exist_ok=True)
        process = place.start(command, "new")
        moment, opened = end_at(place, process, number, chance, undisturbed.duration)
        try:
            process.wait(ENDED_WITHIN)
        except subprocess.TimeoutExpired:
            remains.wrong.append(f"has not ended within {ENDED_WITHIN:.0f} s")
            process.kill()
            process.wait()
        if process.returncode != 0:
            break
    has_answered = process.returncode in (0, 128 + number)
    # While Python loads, it does not answer yet: the system ends it, as by SIGKILL, or Python itself says where it was.
    is_loading = any(words in place.printed() for words in LOADING)
    if not has_answered and process.returncode != -number and not is_loading:
        remains.wrong.append(f"ended with {process.returncode}: {place.printed()}")
    if has_answered:
        remains.wrong += [f"printed {word!r}: {place.printed()}" for word in UNWANTED if word in place.printed()]
    is_kept = any((place.folder / name).exists() for name in command.kept)
    if number != signal.SIGKILL and process.returncode != 0 and is_kept and not place.said(RESUMED):
        remains.wrong.append(f"ended with {process.returncode} and did not say that it resumes: {place.printed()}")
    moment += ", finished before" if process.returncode == 0 else ", ended"
    deadline = time.monotonic() + PATIENCE
    while (alive := list(descendants(place.environment[MARK]))) and time.monotonic() < deadline:
        time.sleep(0.1)
    remains.left += [f"process {_command_line(pid)}" for pid in alive]
    for pid in alive:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    remains.wrong += [f"{name} is neither old nor new" for name in mixed(place.outputs(command), undisturbed, before)]
    lost = before.keys() - place.outputs(command).keys()
    remains.wrong += [f"{name} was there and is lost" for name in lost]
    remains.left += place.strangers(command) + [str(name) for name in sorted(opened) if name.exists()]
    if has_answered:
        remains.wrong += [f"left {name}" for name in remains.left]
    # As if the next run came a day later: parts of files that are written just now are nobody's to remove.
    for path in (place.folder / "out").rglob("*.part"):
        os.utime(path, (time.time() - 86400.0,) * 2)
    status = place.run(command, "new")
    if status != undisturbed.status:
        remains.wrong.append(f"the next run ended with {status}: {place.printed()}")
    after = place.outputs(command)
    remains.wrong += [
        f"the next run gave another {name}"
        for name in sorted(after.keys() | undisturbed.new.keys())
        if after.get(name) != undisturbed.new.get(name)
    ]
    remains.unswept += place.strangers(command)
    return f"{number.name} {'over old outputs' if before else 'without outputs'}, {moment}", remains


def mixed(found: dict[str, str], undisturbed: Undisturbed, before: dict[str, str]) -> list[str]:
    """Outputs that are neither those of an undisturbed run nor those that lay there before."""
    return [name for name, content in found.items() if content not in (undisturbed.new.get(name), before.get(name))]


def _command_line(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")[:120]
    except OSError:
        return "that has just ended"


def reference(command: Command, place: Place) -> Undisturbed:
    """Undisturbed runs: of the old inputs, which also fills the caches, and twice of the new ones."""
    results, status, duration = [], 0, 0.0
    for version in ("old", "new", "new"):
        place.empty("out", "tmp", *(["cache"] if command.compiles else []))
        start = time.monotonic()
        status = place.run(command, version)
        duration = time.monotonic() - start
        if status not in (0, 1) or (place.strangers(command) and status == 0):
            left = place.strangers(command)
            raise SystemExit(f"{command.arguments}: status {status}, left {left}, printed: {place.printed()}")
        results.append(place.outputs(command))
        if version == "old":
            shutil.copytree(place.folder / "out", place.folder / "old")
            for kept in command.kept:
                (place.folder / "old" / Path(kept).relative_to("out")).unlink(missing_ok=True)
    if results[1] != results[2]:
        raise SystemExit(f"{command.arguments}: two undisturbed runs differ.")
    if status != 0:
        raise SystemExit(f"{command.arguments}: {place.printed()}")
    return Undisturbed(status, duration, results[1], results[0])


def write_inputs(folder: Path) -> None:
    """in/ of both versions: records and models of the same names and other content."""
    import numpy as np
    import pandas as pd

    from strandspring import Record, Spring, SpringParameters, identify

    for number, version in enumerate(("new", "old")):
        (folder / version / "many").mkdir(parents=True)
        for k, name in enumerate(("a", "worn", "many/m0", "many/m1", "many/m2")):
            parameters = SpringParameters(
                kE=(2.0, 3000.0 + 150.0 * k, 0.0, 1e5), kA=(1.0, 10.0), kappa_omega=8.0 - number, rho=600.0,
                sigma=0.9, n=0.8, displacement_offset=0.0, displacement_min=-0.015, displacement_max=0.015,
            )  # fmt: skip
            phase = np.linspace(0.0, 12.0 * np.pi, 900)
            displacement = 0.013 * np.sin(phase) * np.repeat([0.5, 0.8, 1.0], 300)
            noise = 0.05 * np.random.default_rng((k, number)).standard_normal(900)
            force = Spring(parameters).response(displacement) + noise
            table = np.column_stack([1e3 * displacement, force])
            path = folder / version / f"{name}.csv"
            np.savetxt(path, table, "%.5f", ",", header="displacement [mm],force [N]", comments="")
            if "/" not in name:
                pd.DataFrame(table, columns=["displacement [mm]", "force [N]"]).to_parquet(path.with_suffix(".parquet"))
                stem = "model" if name == "a" else name
                spring = identify(Record(displacement, force)).spring(stem)
                spring.save(folder / version / f"{stem}.json")
                if stem == "worn":
                    spring.build_fmu(folder / version)
        (folder / version / "system.toml").write_text(SYSTEM.format(mass=2.0 + number), encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="the number of the first trial")
    parser.add_argument("--only", choices=COMMANDS, action="append")
    parser.add_argument("--signal", choices=SIGNALS, action="append", help="several take turns; KILL by default")
    options = parser.parse_args()
    print(f"seed {options.seed}, trials {options.first} to {options.first + options.count - 1}", flush=True)
    sys.path.insert(0, str(PACKAGE))
    names = options.only or list(COMMANDS)
    # In the background and below nohup some are ignored, and what this starts would ignore them, too.
    for ignored in (number for number in SIGNALS.values() if signal.getsignal(number) == signal.SIG_IGN):
        signal.signal(ignored, signal.SIG_DFL)
    signals = [SIGNALS[name] for name in options.signal or ["KILL"]]
    counts: dict[str, Counter[str]] = {name: Counter() for name in names}
    # Ctrl-C ends the trials, and what was counted is reported.
    with suppress(KeyboardInterrupt), tempfile.TemporaryDirectory(prefix="kills-") as temporary:
        folder = Path(temporary)
        write_inputs(folder / "inputs")
        places: dict[str, tuple[Place, Undisturbed]] = {}
        for number in range(options.first, options.first + options.count):
            name = names[number % len(names)]
            if name not in places:
                place = Place(folder / name, folder / "inputs", f"{os.getpid()}-{name}")
                places[name] = place, reference(COMMANDS[name], place)
            end, chance = signals[number // len(names) % len(signals)], random.Random(f"{options.seed} {number}")
            moment, remains = trial(COMMANDS[name], *places[name], end, chance)
            count = counts[name]
            count["tried"] += 1
            count["ended"] += moment.endswith(", ended")
            for kind in ("wrong", "left", "unswept"):
                count[kind] += bool(getattr(remains, kind))
                for what in getattr(remains, kind):
                    print(f"trial {number}, {name} {moment}: {kind}: {what}", flush=True)
    for name, count in counts.items():
        print(
            f"{name:16}"
            + "".join(f"{kind} {count[kind]:4}  " for kind in ("tried", "ended", "wrong", "left", "unswept"))
        )
    sys.exit(any(count["wrong"] for count in counts.values()))


if __name__ == "__main__":
    main()
