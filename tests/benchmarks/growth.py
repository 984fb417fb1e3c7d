"""What an identification waits for, and with what it grows: python tests/benchmarks/growth.py [WHAT ...]

WHAT is one or more of records, cycles, samples, same (all of them without any). Processor times, and exponents between
neighbouring sizes, within one run: of 16 to 256 records of one spring, of records with 100 to 100 000 cycles of 60
samples, and of 9 cycles with up to a million samples each. `same` compares identifications with those that a file holds
(growth_before.json, which `python tests/benchmarks/growth.py write FILE` wrote at commit f2235e43): the largest
difference of a parameter in its standard errors as they were, the number of fits, and the times then and now as shares
of a reference that is timed beside each of them.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

# Before NumPy is imported: processor time of threads that wait for each other says nothing.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from many_springs import measured
from rig_causes import drawn_case
from rig_faults import FAULTS
from strandspring import Record, Spring, StrandspringError, read_record
from strandspring.identification.fit import Problem
from strandspring.identification.identify import identify_records
from synthetic import AMPLITUDE, MEAN, spring_of
from zoo_mounts import DRAWS
from zoo_rig import draw_case

ROOT = Path(__file__).resolve().parents[2]
BEFORE = Path(__file__).with_name("growth_before.json")
SPRING = spring_of(1.0, 1.2)
NOISE = 0.3  # of the force [N]
RECORDS = (16, 32, 64, 128, 256)
CYCLES = (100, 1000, 10_000, 100_000)
SAMPLES = (1000, 10_000, 100_000, 1_000_000)  # in a cycle
CLOSE = 0.01  # standard errors within which parameters are the same


def sine(cycles: float, samples: int, share: float = 1.0, seed: int = 0) -> Record:
    """The spring on a sine, its amplitude a share of the largest, with noise."""
    moment = np.arange(round(cycles * samples) + 1) / samples
    path = MEAN + share * AMPLITUDE * np.sin(2.0 * np.pi * moment)
    noise = NOISE * np.random.default_rng(seed).standard_normal(moment.size)
    return Record(path, Spring(SPRING).response(path) + noise, moment, path=f"sine {seed}")


def amplitudes(count: int) -> list[Record]:
    """So many records of the spring, each of 3 cycles at another amplitude."""
    return [sine(3, 300, share, seed) for seed, share in enumerate(np.linspace(0.4, 1.0, count).tolist())]


GROWTH: dict[str, tuple[tuple[int, ...], Callable[[int], list[Record]]]] = {
    "records": (RECORDS, amplitudes),
    "cycles": (CYCLES, lambda count: [sine(count, 60)]),
    "samples": (SAMPLES, lambda count: [sine(9, count)]),
}


def growth(what: str) -> None:
    """Times and exponents over sizes."""
    sizes, records_of = GROWTH[what]
    before: tuple[int, float] | None = None
    for size in sizes:
        records = records_of(size)
        begin = time.process_time()
        rho = identify_records(records).parameters.rho
        taken = time.process_time() - begin
        line = f"{what} {size:>8}: {taken:8.2f} s, rho/true {rho / SPRING.rho:.4f}"
        if before is not None:
            line += f", exponent {math.log(taken / before[1]) / math.log(size / before[0]):.2f}"
        print(line, flush=True)
        before = size, taken


def measured_cases() -> Iterator[tuple[str, list[Record]]]:
    """Measured records."""
    data = ROOT / "tests/data"
    yield "hinge", [read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")]
    actuator = read_record(data / "actuator/circle_3bar.csv", time=1, displacement=5, force=7)
    yield "actuator", [replace(actuator, time=1e-3 * actuator.time)]
    yield "column", [read_record(data / "degrading/SPC1.csv")]
    damper = read_record(data / "mr_damper/ensaio1.mat", time="Tout", displacement="dist", force="forc")
    yield "damper", [damper]


def cases() -> Iterator[tuple[str, list[Record]]]:
    """Records of all kinds: measured, of the model itself, of rigs with faults, of mounts of other classes."""
    yield from measured_cases()
    for seed in range(8):
        table = measured(seed)
        yield f"spring {seed}", [Record(1e-3 * table[:, 1], table[:, 2], table[:, 0], path=f"spring {seed}")]
    for count in (2, 3, 8, 24):
        yield f"{count} records", amplitudes(count)
    for count in (1, 10, 40, 150):
        yield f"{count} cycles", [sine(count, 60)]
    for name, fault in FAULTS.items():
        yield f"fault: {name}", list(drawn_case(fault, 7, 0).records)
    for name in DRAWS:
        for index in range(2):
            yield f"mount: {name} {index}", list(draw_case(name, 7, index).records)


def reference() -> float:
    """Processor time of something that does not change [s]."""
    matrix = np.random.default_rng(0).standard_normal((2000, 12))
    begin = time.process_time()
    for _ in range(100):
        np.linalg.qr(matrix, mode="r")
    return time.process_time() - begin


def identified(records: list[Record]) -> dict[str, Any]:
    """Parameters with their standard errors, cautions, number of fits, and time as a share of the reference."""
    fits = 0
    local = Problem.local

    def counted(problem: Problem, *arguments: Any) -> Any:
        nonlocal fits
        fits += 1
        return local(problem, *arguments)

    Problem.local = counted  # type: ignore[method-assign]
    scale = reference()
    begin = time.process_time()
    try:
        found = identify_records(records)
    except StrandspringError as error:
        return {"refused": str(error)}
    finally:
        taken = time.process_time() - begin
        Problem.local = local  # type: ignore[method-assign]
    names = ("kE", "FE_forces", "kA", "kappa_omega", "rho", "sigma", "n")
    values = {name: np.ravel(getattr(found.parameters, name)).tolist() for name in names}
    errors = {name: np.ravel(found.uncertainty.get(name, [])).tolist() for name in names}
    return {
        "values": values,
        "errors": errors,
        "outcomes": sorted(outcome.name for outcome in found.outcomes),
        "effects": sorted(found.effects),
        "fits": fits,
        "time": taken / scale,
    }


def difference(before: dict[str, Any], now: dict[str, Any]) -> float:
    """The largest difference of a parameter in its standard errors; infinite where their number differs."""
    largest = 0.0
    for name, values in before["values"].items():
        if len(values) != len(now["values"][name]):
            return math.inf
        for a, b, error in zip(values, now["values"][name], before["errors"][name], strict=False):
            if error:
                largest = max(largest, abs(a - b) / error)
    return largest


def compare(file: Path) -> None:
    """Identifications now against those of the file."""
    before = json.loads(file.read_text())
    far, ratios = 0, []
    for name, records in cases():
        then, now = before[name], identified(records)
        if "refused" in then or "refused" in now:
            same = then.get("refused") == now.get("refused")
            far += not same
            print(f"{name:32} {'refused as before' if same else f'REFUSED: {then} {now}'}", flush=True)
            continue
        off = difference(then, now)
        changed = [key for key in ("outcomes", "effects") if then[key] != now[key]]
        far += off > CLOSE or bool(changed)
        ratios.append(now["time"] / then["time"])
        notes = "".join(f"; {key} {sorted(set(then[key]) ^ set(now[key]))}" for key in changed)
        print(
            f"{name:32} {off:8.2g} standard errors, fits {then['fits']:4} -> {now['fits']:4}, "
            f"time {ratios[-1]:5.2f} of that before{notes}",
            flush=True,
        )
    print(f"{far} differ; time {np.median(ratios):.2f} of that before in the median, up to {max(ratios):.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", help=f"{', '.join(GROWTH)}, same, or write FILE")
    what = parser.parse_args().what or [*GROWTH, "same"]
    identify_records([sine(3, 300)])  # what is done once
    if what[0] == "write":
        Path(what[1]).write_text(json.dumps({name: identified(records) for name, records in cases()}, indent=1))
        return
    for name in what:
        if name == "same":
            compare(BEFORE)
        else:
            growth(name)


if __name__ == "__main__":
    main()
