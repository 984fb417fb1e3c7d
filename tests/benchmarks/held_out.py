"""Errors on strokes that a fit has not seen, on measured records: python tests/benchmarks/held_out.py [RECORD ...]

A model is fitted to a part of a record, and driven along the whole displacement as recorded, from its first sample and
by its default state. The error is the rms of predicted less measured force over the samples held out, in % of the
standard deviation of the measured force there: a constant has 100. RECORD is the beginning of a name; without any all
are taken. Files without a folder are in `../shared/data` beside the checkout; records that are absent are named.

    record           file                               displacement; force; time
    hinge            models/records/rubber_stretch.csv  by name, negated [mm]; [N]; [s]
    wire_rope        models/records/wire_rope_mount.csv by name [mm]; [N]; [s]; synthetic
    actuator         tests/data/actuator/               column 5 [mm]; 7 [N]; 1 [ms]
    snap_through     tests/data/hinge/                  by name, negated [mm]; [N]; [s]; no such spring, to be refused
    SPC1             tests/data/degrading/              by name [mm]; [kN]; none; degrades
    mr_damper        tests/data/mr_damper/              dist [mm]; forc [N]; Tout [s], every 0.01 s; its only record
    mts_25mm, _5mm   25mm_0.25Hz.txt, 5mm_3Hz.txt       column 2 [mm]; 4 [N]; 1 [s]; mts_both: two records in one fit;
                     mts_25mm_to_5mm and back: the whole of one record is seen, the whole of the other held out
    mts_raw_1 to 5   raw_25mm_0.25Hz.txt                column 4, 9.83 mm/V; 3, 930 N/V; every 0.005 s; a current each,
                     between the pauses, the first the lowest; the factors are those of mts_25mm if that is the third
                     current, a guess; no error depends on them
    coupon_1         coupon_1.csv                       e_true, a strain as if in mm; Sigma_true, MPa as if N; none
    HEM320C_stroke   HEM320C_LP8.csv                    column 6 [mm]; 4 [kN]; 3 [s]
    HEM320C_gauge    the same, by its extensometer      column 5 [mm]; 4 [kN]; 3 [s]
    rc_column        column.csv                         by name [m]; [kN]; none
    explode          between_samples/                   by name [mm]; [N]; [s]; synthetic

Strokes lie between turning points, where the displacement turns by more than a tenth of its range, and its ends. Held
out are, of which the fit sees what precedes and what follows as two records if they have two strokes at least,

    paper   of mts, coupon, HEM320C and rc_column all strokes from number int(0.67 * strokes) on; of others the last
            four, or the last two of fewer than eight
    A       the middle third of the strokes
    B       a sixth of the strokes, and at least two, that travel farthest in a row; the last such if equal within 1 %

A row has the product's error, that of the baseline (the product at the commit that the file names), the ratio of both,
and errors of models that were fitted to the same part: the classic Bouc-Wen model with linear spring, offset and, where
there is time, dashpot, by SciPy's least squares from the best of a grid; Prandtl-Ishlinskii with 12 stops and a cubic;
ridge regression on kernels of displacement, last two turning points and direction. Then processor time of the product's
fit, also as times that of `python -c "import numpy"`. Averages are of ratios limited to [0.5, 2], so that one mended
explosion does not carry all; what is refused counts as infinite, and what is refused on both sides is left out.
`--write FILE` keeps the product's errors with the commit of the package that is imported; held_out_before.json was
written in an environment of 828412b2.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, Literal

# Before NumPy is imported: processor time of threads that wait for each other says nothing.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from startup import processor_time

import strandspring
from other_models import Array, Model, bouc_wen, kernels, stops, turning_points
from strandspring import IdentificationError, Record, StrandspringError, identify, read_record
from tools import shared_data

ROOT = Path(__file__).resolve().parents[2]
Split = Literal["paper", "A", "B"]
SPLITS: tuple[Split, ...] = ("paper", "A", "B")
BEFORE = Path(__file__).with_name("held_out_before.json")
SYNTHETIC = ("wire_rope", "explode")
LIMITS = 0.5, 2.0  # of a ratio before it is averaged: one mended explosion would carry all
IMPORT = [sys.executable, "-c", "import numpy"]
WORSE = 1.1  # ratio above which a record is named
RAW_CUTS = np.cumsum([0, 5998, 6138, 6178, 6478, 6398])  # between pauses, whose lines are left out


def current(number: int) -> Record:
    """The record of one current in the file of the acquisition."""
    whole = shared("mts_damper/raw_25mm_0.25Hz.txt", skip_bad_lines=True, **VOLTS)
    part = slice(*RAW_CUTS[number - 1 : number + 1])
    return Record(whole.displacement[part], whole.force[part], 0.005 * np.arange(part.stop - part.start))


def shared(name: str, **options: Any) -> Record:
    return read_record(shared_data(name), **options)


ACTUATOR: dict[str, Any] = {"time": 1, "displacement": 5, "force": 7}
MTS: dict[str, Any] = {"time": 1, "displacement": 2, "force": 4}
HEM: dict[str, Any] = {"time": 3, "force": 4}
VOLTS: dict[str, Any] = {"displacement": 4, "force": 3, "displacement_scale": 9.83, "force_scale": 930.0}
RECORDS: dict[str, Callable[[], list[Record]]] = {
    "hinge": lambda: [read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")],
    "wire_rope": lambda: [read_record(ROOT / "models/records/wire_rope_mount.csv")],
    "actuator": lambda: [read_record(ROOT / "tests/data/actuator/circle_3bar.csv", time_unit="ms", **ACTUATOR)],
    "snap_through": lambda: [read_record(ROOT / "tests/data/hinge/plastic_compress.csv", reverse="displacement")],
    "SPC1": lambda: [read_record(ROOT / "tests/data/degrading/SPC1.csv")],
    "mr_damper": lambda: [read_record(ROOT / "tests/data/mr_damper/ensaio1.mat")],
    "mts_25mm": lambda: [shared("mts_damper/25mm_0.25Hz.txt", **MTS)],
    "mts_5mm": lambda: [shared("mts_damper/5mm_3Hz.txt", **MTS)],
    "mts_both": lambda: [*RECORDS["mts_25mm"](), *RECORDS["mts_5mm"]()],
    "mts_25mm_to_5mm": lambda: [*RECORDS["mts_both"]()],
    "mts_5mm_to_25mm": lambda: RECORDS["mts_both"]()[::-1],
    **{f"mts_raw_{number}": partial(lambda number: [current(number)], number) for number in range(1, 6)},
    "coupon_1": lambda: [shared("steel_coupon/coupon_1.csv", displacement="e_true", force="Sigma_true")],
    "HEM320C_stroke": lambda: [shared("steel_coupon/HEM320C_LP8.csv", displacement=6, **HEM)],
    "HEM320C_gauge": lambda: [shared("steel_coupon/HEM320C_LP8.csv", displacement=5, **HEM)],
    "rc_column": lambda: [shared("rc_column/column.csv")],
    "explode": lambda: [shared("between_samples/explode.csv")],
}
THIRDS = ("mts", "coupon", "HEM320C", "rc_column")  # beginnings of names of which a third is held out


@dataclass(frozen=True)
class Case:
    """What a fit sees, and the records that its model is driven along with the samples that it has not seen."""

    training: list[Record]
    driven: list[tuple[Record, slice]]

    def error(self, model: Model) -> float:
        """Of the force held out, in % of its standard deviation."""
        with np.errstate(all="ignore"):
            misses = np.concatenate([model(record)[held] - record.force[held] for record, held in self.driven])
            scale = np.std(np.concatenate([record.force[held] for record, held in self.driven]))
            error = 100.0 * math.sqrt(np.mean(misses**2)) / scale
        return error if math.isfinite(error) else math.inf


def part_of(record: Record, samples: slice) -> Record:
    """A part of a record as a record of its own."""
    moments = None if record.time is None else record.time[samples]
    return Record(record.displacement[samples], record.force[samples], moments, path=record.path)


def held_strokes(name: str, split: Split, travel: Array) -> tuple[int, int]:
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


OTHERS = {"Bouc-Wen": bouc_wen, "stops": stops, "kernels": kernels}


# What is printed


def commit() -> str:
    """Of the package that is imported."""
    command = ["git", "-C", str(Path(strandspring.__file__).parent), "describe", "--always", "--dirty", "--abbrev=8"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def fitted(case: Case) -> dict[str, Any]:
    """The product's error [%] and times, or the outcome by which it refuses."""
    unit = processor_time(IMPORT, ROOT, 3)  # beside each fit: machines slow down
    begin = time.process_time()
    try:
        spring = identify(case.training).spring()
    except StrandspringError as refusal:
        return {"refused": refusal.outcome.name if isinstance(refusal, IdentificationError) else str(refusal)}
    taken = time.process_time() - begin
    error = case.error(lambda record: spring.response(record.displacement, time=record.time))
    return {"error": round(error, 3), "seconds": round(taken, 2), "imports": round(taken / unit, 1)}


def ratio(now: float, then: float) -> float:
    """Limited; NaN where both are infinite, or one unknown."""
    share = now / then if math.isfinite(now) or math.isfinite(then) else math.nan
    return min(max(share, LIMITS[0]), LIMITS[1])


def summary(rows: dict[tuple[str, str], dict[str, float]]) -> None:
    """Ratios over all, and who is worse than what."""
    groups = {f"split {split}": [key for key in rows if key[1] == split] for split in SPLITS}
    groups |= {"all": list(rows), "all measured": [key for key in rows if key[0] not in SYNTHETIC]}
    for name, keys in groups.items():
        ratios = [value for key in keys if not math.isnan(value := ratio(rows[key]["now"], rows[key]["before"]))]
        if ratios:
            mean = math.exp(np.mean(np.log(ratios)))
            print(f"{name}: {len(ratios)} ratios, geometric mean {mean:.2f}, median {np.median(ratios):.2f}")
    for what, factor in (("before", WORSE), ("Bouc-Wen", WORSE), ("stops", 1.0), ("kernels", 1.0)):
        shares = {" ".join(key): row["now"] / row[what] for key, row in rows.items() if row["now"] > factor * row[what]}
        print(
            f"above {factor} of {what}: {', '.join(f'{key} ({share:.2f})' for key, share in shares.items()) or 'none'}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("records", nargs="*", metavar="RECORD", help=f"beginnings of {', '.join(RECORDS)}")
    parser.add_argument("--split", choices=SPLITS, action="append")
    parser.add_argument("--baseline", type=Path, default=BEFORE, metavar="FILE")
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the product's errors instead of comparing")
    arguments = parser.parse_args()
    # The bytecode of NumPy, which some installations do not have: without it the import takes twice as long.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    processor_time(IMPORT, ROOT, 1)
    before = {"product": {}} if arguments.write else json.loads(arguments.baseline.read_text())
    written: dict[str, Any] = {"commit": commit(), "product": {}}
    warnings.simplefilter("ignore")  # paths that leave the range that was fitted
    identify(Record(np.sin(np.arange(400) / 16.0), np.sin(np.arange(400) / 16.0 + 0.2)))  # what is done once
    print(f"{written['commit']} against {before.get('commit')}")
    print(f"{'record':16} split {'now':>8} {'before':>8} ratio {'Bouc-Wen':>8} {'stops':>8} {'kernels':>8}  time")
    rows: dict[tuple[str, str], dict[str, float]] = {}
    for name, split in product(RECORDS, arguments.split or SPLITS):
        if arguments.records and not name.startswith(tuple(arguments.records)):
            continue
        try:
            case = case_of(name, split, RECORDS[name]())
        except pytest.skip.Exception as reason:
            print(f"{name:16} {split:5} {reason}")
            continue
        if case is None:
            continue
        now, then = fitted(case), before["product"].get(name, {}).get(split, {})
        written["product"].setdefault(name, {})[split] = now
        unknown = math.inf if "refused" in then else math.nan
        row = {"now": now.get("error", math.inf), "before": then.get("error", unknown)}
        if not arguments.write:
            row |= {other: case.error(fit(case.training)) for other, fit in OTHERS.items()}
        rows[name, split] = row
        values = [f"{row[other]:8.2f}" for other in OTHERS if other in row]
        notes = [f"{now['seconds']:.2f} s, {now['imports']:.1f} imports"] if "error" in now else []
        notes += [
            f"{when} refused: {was['refused']}" for when, was in (("now", now), ("before", then)) if "refused" in was
        ]
        figures = f"{row['now']:8.2f} {row['before']:8.2f} {ratio(row['now'], row['before']):5.2f}"
        print(f"{name:16} {split:5} {figures}", *values, "; ".join(notes), flush=True)
    if arguments.write:
        arguments.write.write_text(json.dumps(written, indent=1) + "\n")
    else:
        summary(rows)


if __name__ == "__main__":
    main()
