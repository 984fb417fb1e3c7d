"""Errors on strokes that a fit has not seen, on measured records.

A model is fitted to a part of a record, and driven along the whole displacement as recorded, from its first sample and
by its default state. The error is the rms of predicted less measured force over the samples held out, in % of the
standard deviation of the measured force there: a constant has 100. held_out.toml has the records; those that are absent
are named.

Strokes lie between turning points, where the displacement turns by more than a tenth of its range, and its ends. Held
out are, of which the fit sees what precedes and what follows as two records if they have two strokes at least,

    paper   of mts, coupon, HEM320C and rc_column all strokes from number int(0.67 * strokes) on; of others the last
            four, or the last two of fewer than eight
    A       the middle third of the strokes
    B       a sixth of the strokes, and at least two, that travel farthest in a row; the last such if equal within 1 %
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import tomllib
from tables import IMPORT, ROOT, console, processor_time, show

from strandspring import IdentificationError, Record, Spring, StrandspringError, identify, read_record
from tools import shared_data

Split = Literal["paper", "A", "B"]
SPLITS: tuple[Split, ...] = ("paper", "A", "B")
RECORDS = tomllib.loads(Path(__file__).with_name("held_out.toml").read_text("utf-8"))
RAW = RECORDS.pop("raw")
THIRDS = ("mts", "coupon", "HEM320C", "rc_column")  # beginnings of names of which a third is held out
RAW_CUTS = np.cumsum([0, 5998, 6138, 6178, 6478, 6398])  # between pauses, whose lines are left out


def records_of(given: dict[str, Any]) -> list[Record]:
    """The records of a table of held_out.toml."""
    if "of" in given:
        return [record for name in given["of"] for record in records_of(RECORDS[name])]
    if "current" in given:
        (whole,) = records_of(RAW)
        part = slice(*RAW_CUTS[given["current"] - 1 : given["current"] + 1])
        return [Record(whole.displacement[part], whole.force[part], 0.005 * np.arange(part.stop - part.start))]
    file, options = given["file"], {name: value for name, value in given.items() if name != "file"}
    path = ROOT / file if file.startswith(("models/", "tests/")) else shared_data(file)
    return [read_record(path, **options)]


@dataclass(frozen=True)
class Case:
    """What a fit sees, and the records that its model is driven along with the samples that it has not seen."""

    training: list[Record]
    driven: list[tuple[Record, slice]]

    def error(self, spring: Spring) -> float:
        """Of the force held out, in % of its standard deviation."""
        held = np.concatenate([record.force[part] for record, part in self.driven])
        forces = [spring.response(record.displacement, time=record.time)[part] for record, part in self.driven]
        return 100.0 * math.sqrt(np.mean((np.concatenate(forces) - held) ** 2)) / float(np.std(held))


def turning_points(path: np.ndarray, share: float = 0.1) -> np.ndarray:
    """Samples where a path turns by more than a share of its range, and both its ends."""
    turns, direction, extreme, least = [0], 0, 0, share * np.ptp(path)
    for k, x in enumerate(path.tolist()):
        ahead = (x - path[extreme]) * direction
        if direction == 0:
            if abs(x - path[0]) > least:
                direction, extreme = (1 if x > path[0] else -1), k
        elif ahead >= 0.0:
            extreme = k
        elif ahead < -least:
            turns.append(extreme)
            direction, extreme = -direction, k
    return np.array([*turns, path.size - 1])


def part_of(record: Record, samples: slice) -> Record:
    """A part of a record as a record of its own."""
    moments = None if record.time is None else record.time[samples]
    return Record(record.displacement[samples], record.force[samples], moments, path=record.path)


def held_strokes(name: str, split: Split, travel: np.ndarray) -> tuple[int, int]:
    """The first stroke that is held out, and the one after the last."""
    count = travel.size
    if split == "A":
        return count // 3, 2 * count // 3
    if split == "B":
        sixth = max(2, round(count / 6))
        sums = np.convolve(travel, np.ones(sixth), "valid")
        first = int(np.flatnonzero(sums >= 0.99 * sums.max())[-1])
        return first, first + sixth
    if name.startswith(THIRDS):
        return int(0.67 * count), count
    return count - (2 if count < 8 else 4), count


def case_of(name: str, split: Split, records: list[Record]) -> Case | None:
    """The records of a name, split; None where a split has no meaning."""
    if "_to_" in name:
        return Case(records[:1], [(records[1], slice(None))]) if split == "paper" else None
    case = Case([], [])
    for record in records:
        turns = turning_points(record.displacement)
        first, after = held_strokes(name, split, np.abs(np.diff(record.displacement[turns])))
        begin, end = int(turns[first]), int(turns[after])
        seen = [slice(0, begin + 1)] * (first > 1) + [slice(end, None)] * (after < turns.size - 2)
        case.training.extend(part_of(record, samples) for samples in seen)
        case.driven.append((record, slice(begin + 1, end + 1)))
    return case


def fitted(case: Case) -> tuple[float, str]:
    """The product's error [%], infinite where it refuses, and its processor time or the outcome."""
    unit = processor_time(IMPORT, ROOT)  # beside each fit: machines slow down
    begin = time.process_time()
    try:
        spring = identify(case.training).spring()
    except StrandspringError as refusal:
        return math.inf, refusal.outcome.name if isinstance(refusal, IdentificationError) else str(refusal)
    taken = time.process_time() - begin
    return case.error(spring), f"{taken:.2f} s, {taken / unit:.1f} times import numpy"


def held_out(only: str = "", split: str = "") -> None:
    """Errors on strokes that are held out; `only` is the beginning of a record's name, `split` one of the three."""
    identify(Record(np.sin(np.arange(400) / 16.0), np.sin(np.arange(400) / 16.0 + 0.2)))  # what is done once
    rows: list[dict[str, Any]] = []
    for name, part in product(RECORDS, [each for each in SPLITS if split in ("", each)]):
        if not name.startswith(only):
            continue
        try:
            case = case_of(name, part, records_of(RECORDS[name]))
        except pytest.skip.Exception as reason:
            console.print(f"{name} {part}: {reason}")
            continue
        if case is not None:
            error, note = fitted(case)
            rows.append({"record": name, "split": part, "error": error, "of it": note})
    show("Errors held out [%]", rows)
