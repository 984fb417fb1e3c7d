"""Do the same thing very often in one process, and see whether its memory stays flat.

    python tests/soak/soak.py [TASK ...] [--count COUNT]

Without a task all are done, each in a process of its own, with the counts below; --count does another number of each.
The resident set is read at forty moments. The first half of a task is its warm-up: caches fill. What the memory grows
by in the second half is reported in kB, and in kB per thousand repetitions; more than LIMIT in all is a leak.

Only for Linux: the resident set is read from /proc.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from ctypes import byref, c_double, c_uint
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests/helpers"))

READINGS = 40
LIMIT = 2048  # [kB] for the second half, whatever the count: less is what allocators keep or give back

# What is done again and again, with the number of the repetition.
Work = Callable[[int], object]


def resident() -> int:
    """Memory of this process [kB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


@dataclass(frozen=True)
class Growth:
    """Memory over the second half of a task."""

    seconds: float
    peak: int
    second_half: int
    per_thousand: float


def soak(work: Work, count: int) -> Growth:
    """Do the work `count` times, and see how much memory the second half takes."""
    begin = time.monotonic()
    readings: list[tuple[int, int]] = []
    for reading in range(READINGS):
        first, last = count * reading // READINGS, count * (reading + 1) // READINGS
        for number in range(first, last):
            work(number)
        readings.append((last, resident()))
    later = readings[READINGS // 2 - 1 :]
    growth = later[-1][1] - later[0][1]
    done = later[-1][0] - later[0][0]
    return Growth(time.monotonic() - begin, max(kB for _, kB in readings), growth, 1000.0 * growth / max(done, 1))


class Slave:
    """An unpacked FMU of either back end, called through ctypes without what FMPy does for each call."""

    def __init__(self, folder: Path, backend: str) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Slave, defaultCallbacks

        from fmu_tools import SPRING
        from strandspring.fmu.native.native_fmu import build_native_fmu
        from strandspring.fmu.native.platforms import chosen_platforms
        from strandspring.fmu.python_backed import build_python_fmu
        from strandspring.model.modelfile import ModelFile

        model = ModelFile("spring", SPRING)
        if backend == "native":
            fmu = build_native_fmu(model, folder, chosen_platforms("host"), zero=0.0)
        else:
            fmu = build_python_fmu(model, folder, zero=0.0)
        description = fmpy.read_model_description(str(fmu))
        fmpy.extract(str(fmu), unzipdir=str(folder / "unpacked"))
        self._slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=str(folder / "unpacked"),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="soak",
        )
        self.calls: Any = self._slave.dll
        self._callbacks = defaultCallbacks
        self._guid = description.guid.encode()
        self._place = (folder / "unpacked" / "resources").as_uri().encode()
        references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self._input, self._output = (c_uint * 1)(references["displacement"]), (c_uint * 1)(references["force"])
        self._middle, self._half = SPRING.displacement_offset, 0.01
        self._value, self._force = (c_double * 1)(self._middle), (c_double * 1)()

    def begin(self) -> Any:
        instance = self.calls.fmi2Instantiate(
            b"soak", 1, self._guid, self._place, byref(self._callbacks), 0, 0
        )  # fmt: skip
        if not instance:
            raise SystemExit("The FMU was not instantiated.")
        self._require(self.calls.fmi2SetupExperiment(instance, 0, 0.0, 0.0, 0, 0.0))
        self._require(self.calls.fmi2EnterInitializationMode(instance))
        self._value[0] = self._middle
        self._require(self.calls.fmi2SetReal(instance, self._input, 1, self._value))
        self._require(self.calls.fmi2ExitInitializationMode(instance))
        return instance

    def step(self, instance: Any, number: int) -> None:
        """A triangle of 50 steps a stroke, whose amplitude changes from cycle to cycle."""
        cycle, part = divmod(number, 100)
        rise = part / 25.0 - 1.0 if part < 50 else 3.0 - part / 25.0
        self._value[0] = self._middle + self._half * rise * (0.5 + 0.5 * (cycle % 7) / 6.0)
        calls = self.calls
        status = calls.fmi2SetReal(instance, self._input, 1, self._value)
        status |= calls.fmi2DoStep(instance, 1e-3 * number, 1e-3, 1)
        status |= calls.fmi2GetReal(instance, self._output, 1, self._force)
        self._require(status)

    def end(self, instance: Any) -> None:
        self._require(self.calls.fmi2Terminate(instance))
        self.calls.fmi2FreeInstance(instance)

    def _require(self, status: int) -> None:
        if status != 0:
            raise SystemExit(f"A call ended with status {status}.")


def steps(folder: Path, backend: str) -> Work:
    slave = Slave(folder, backend)
    instance = slave.begin()
    return lambda number: slave.step(instance, number)


def lives(folder: Path) -> Work:
    slave = Slave(folder, "native")

    def live(number: int) -> None:
        instance = slave.begin()
        slave.step(instance, number)
        slave.end(instance)

    return live


def identifications(folder: Path) -> Work:
    """Records are read from files of twenty springs again and again, refined, and saved."""
    from many_springs import write_batch
    from strandspring import identify

    paths = write_batch(folder / "records", 20, rows=600)
    return lambda number: identify(paths[number % 20]).spring("spring").save(folder / "spring.json")


def a_spring(folder: Path) -> Path:
    from many_springs import write_batch
    from strandspring import identify

    (record,) = write_batch(folder / "records", 1, rows=600)
    identify(record).spring("spring").save(folder / "spring.json")
    return folder / "spring.json"


def builds(folder: Path) -> Work:
    """The native FMU is built, validated and run."""
    from strandspring import build_fmu

    model = a_spring(folder)

    def build(_: int) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            build_fmu(model, folder / "dist")

    return build


def loads(folder: Path) -> Work:
    from strandspring import Spring

    model = a_spring(folder)
    return lambda _: Spring.load(model)


def reports(folder: Path) -> Work:
    from strandspring import identify

    a_spring(folder)
    found = identify(folder / "records/spring_0000.csv")
    return lambda _: found.report(folder / "report.html")


TASKS: dict[str, tuple[Callable[[Path], Work], int]] = {
    "native-steps": (lambda folder: steps(folder, "native"), 10_000_000),
    "python-steps": (lambda folder: steps(folder, "python"), 10_000_000),
    "native-lives": (lives, 100_000),
    "identifications": (identifications, 1000),
    "builds": (builds, 1000),
    "loads": (loads, 200),
    "reports": (reports, 50),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tasks", nargs="*", metavar="TASK", help=", ".join(TASKS))
    parser.add_argument("--count", type=int)
    options = parser.parse_args()
    if unknown := set(options.tasks) - TASKS.keys():
        parser.error(f"there is no task {', '.join(sorted(unknown))}")
    if len(options.tasks) != 1:
        count = [] if options.count is None else ["--count", str(options.count)]
        failures = 0
        for task in options.tasks or TASKS:
            failures += subprocess.run([sys.executable, __file__, task, *count], check=False).returncode != 0
        sys.exit(failures > 0)
    (task,) = options.tasks
    prepare, usual = TASKS[task]
    count = usual if options.count is None else options.count
    with tempfile.TemporaryDirectory(prefix="soak-") as temporary:
        growth = soak(prepare(Path(temporary)), count)
        print(
            f"{task:16} {count:9} times in {growth.seconds:7.1f} s ({1e6 * growth.seconds / count:9.2f} us each), "
            f"at most {growth.peak / 1024:6.1f} MB, second half {growth.second_half:+6d} kB "
            f"({growth.per_thousand:+.3f} kB per 1000)",
            flush=True,
        )
    sys.exit(growth.second_half > LIMIT)


if __name__ == "__main__":
    main()
