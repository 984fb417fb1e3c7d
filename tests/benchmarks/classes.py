"""Classes of springs on measured mounts, by cycles left out: python tests/benchmarks/classes.py [FILE]

Each record is identified from the first three quarters of its strokes, and the saved spring is driven along the path of
all, free of jitter; errors are those of the last quarter, as shares of the force's standard deviation there. Beside it
stand models that `peers` fits to the same points, and a kernel regression of the force on displacement, direction and
three stop operators, its width chosen on the last third of what it is fitted to.

FILE is a table of further records, TOML: [name] file = ..., and options of `read_record`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import tomllib
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "identification"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from test_measured_mounts import NAMES, measured

from strandspring import Record, RefinedOptions, StrandspringError, identify, read_record
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.other_mounts import stop_operators
from strandspring.kernel.arrays import FloatArray
from strandspring.kernel.path import PathSolver
from strandspring.loops.strokes import find_strokes
from strandspring.peers.rivals.classes import PrandtlIshlinskii, Rival, VaianaRosati
from strandspring.peers.rivals.fitting import fit_class
from strandspring.peers.rivals.ranking import folds
from strandspring.peers.rivals.track import Track

FITTED = 0.75  # share of the strokes
STOPS = np.array([0.05, 0.15, 0.4])  # thresholds, shares of half the range
WIDTHS = (0.01, 0.02, 0.04, 0.08, 0.16)  # of the kernel
CLASSES: dict[str, dict[str, int]] = {
    "paper's": {"mechanisms": 1, "branches": 0},
    "one branch": {"mechanisms": 1, "branches": 1},
    "two mechanisms": {"mechanisms": 2, "branches": 0},
    "both": {"mechanisms": 2, "branches": 1},
    "chosen": {},
}


def end_of_fitted(record: Record) -> int:
    """The sample after those that are fitted."""
    turning = find_strokes(record.displacement).turning
    return int(turning[round(FITTED * (turning.size - 1))]) + 1


def cut(record: Record, end: int) -> Record:
    times = None if record.time is None else record.time[:end]
    return replace(record, displacement=record.displacement[:end], force=record.force[:end], time=times)


def by_identification(record: Record, end: int, options: dict[str, int]) -> tuple[float, int, str]:
    """Error of the saved spring on what is left out [N], its number of parameters, and its class."""
    found = identify(cut(record, end), RefinedOptions(**options))  # type: ignore[arg-type]
    p = found.parameters
    path = find_strokes(record.displacement).displacement
    force = PathSolver(p).force(path, found.fits[0].omega_start, record.rising_time)
    size = len(p.kE) + len(p.FE_forces) + len(p.kA) + 3 + 2 * len(p.branches)
    size += 3 + len(p.second.kA) if p.second else 0
    return rms((force - record.force)[end:]), size, f"{1 + bool(p.second)}+{len(p.branches)}"


def by_rival(record: Record, end: int, rival: Rival) -> tuple[float, int, str]:
    track = Track.from_steady([find_steady_part(cut(record, end))])
    fit = fit_class(rival, track, folds(track)[0])[0]
    whole = Track.from_steady([find_steady_part(record)])
    left_out = whole.loops.sample >= end
    return rms((fit.at_points(whole) - whole.loops.force)[left_out]), fit.parameters, ""


def by_kernel(record: Record, end: int) -> tuple[float, int, str]:
    loops = Track.from_steady([find_steady_part(record)]).loops
    half = 0.5 * (loops.reach[1] - loops.reach[0])
    stops = stop_operators(loops, STOPS * half) / (STOPS * half)
    features = np.column_stack([loops.displacement / half, 0.5 * loops.side, 0.3 * stops])
    fitted = loops.sample < end
    tuned = fitted & (loops.sample < 2 / 3 * end)

    def predicted(known: NDArray[np.bool_], wanted: NDArray[np.bool_], width: float) -> FloatArray:
        squares = ((features[wanted][:, None] - features[known][None]) ** 2).sum(axis=2)
        weights = np.exp(-0.5 * (squares - squares.min(axis=1, keepdims=True)) / width**2)
        return np.asarray(weights @ loops.force[known] / weights.sum(axis=1))

    def error(known: NDArray[np.bool_], wanted: NDArray[np.bool_], width: float) -> float:
        return rms(predicted(known, wanted, width) - loops.force[wanted])

    width = min(WIDTHS, key=lambda w: error(tuned, fitted & ~tuned, w))
    return error(fitted, ~fitted, width), int(fitted.sum()), f"width {width:g}"


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def records_of(arguments: list[str]) -> dict[str, Record]:
    records = {name: measured(name) for name in NAMES}
    for file in arguments:
        for name, options in tomllib.loads(Path(file).read_text(encoding="utf-8")).items():
            records[name] = read_record(options.pop("file"), **options)
    return records


def main() -> None:
    table = Table(title="Error on the last quarter of the strokes, share of the force's standard deviation")
    for column in ("record", "model", "error", "parameters", "class", "processor time"):
        table.add_column(column, justify="left" if column in ("record", "model", "class") else "right")
    for name, record in records_of(sys.argv[1:]).items():
        end = end_of_fitted(record)
        spread = float(np.std(record.force[end:]))
        models: dict[str, Callable[[Record, int], tuple[float, int, str]]] = {
            **{label: partial(by_identification, options=options) for label, options in CLASSES.items()},
            **{rival.name: partial(by_rival, rival=rival) for rival in (PrandtlIshlinskii(), VaianaRosati())},
            "kernel regression": by_kernel,
        }
        for label, model in models.items():
            begin = time.process_time()
            try:
                error, size, kind = model(record, end)
            except StrandspringError as refusal:
                table.add_row(name, label, "-", "", str(refusal)[:40], "")
                continue
            seconds = time.process_time() - begin
            table.add_row(name, label, f"{100.0 * error / spread:.1f} %", str(size), kind, f"{seconds:.1f} s")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
