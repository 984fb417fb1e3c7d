"""The answers of the version before the refactoring, compared number by number (README.md beside this file).

`python tests/golden/test_golden.py --table` prints how far each case is off, in tolerances, without stopping.
"""

from __future__ import annotations

import gzip
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import CASES, HERE, Case, Outputs, Workshop
from tolerances import numbers, tolerance

pytestmark = pytest.mark.long

KEPT: dict[str, Outputs] = json.loads(gzip.decompress((HERE / "golden.json.gz").read_bytes()))["cases"]


@dataclass(frozen=True)
class Deviation:
    """How far a number is off, in tolerances; infinite if it is no number, or not there."""

    size: float
    place: str
    kept: object
    found: object

    def __str__(self) -> str:
        return f"{self.place}: {self.size:.3g} tolerances off; it was {self.kept!r} and is {self.found!r}"


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return Workshop(tmp_path_factory.mktemp("golden"))


def test_all_cases_are_kept() -> None:
    assert list(KEPT) == list(CASES)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if case.slow else []) for name, case in CASES.items()]
)
def test_same_answers(workshop: Workshop, name: str) -> None:
    worst = worst_of(CASES[name], KEPT[name], CASES[name].run(workshop))
    assert worst.size <= 1.0, f"{name}: {worst}"


def worst_of(case: Case, kept: Outputs, found: Outputs) -> Deviation:
    """The largest deviation of a case; what is new in `found` does not count."""
    each = [deviation(case, name, kept, found.get(name)) for name in kept]
    return max(each, key=lambda one: one.size)


def deviation(case: Case, name: str, kept: Outputs, found: Any) -> Deviation:
    """The largest deviation among the numbers `name` of a case."""
    before = kept[name]
    same = Deviation(0.0, name, before, found)
    if before == found:
        return same
    if not (_is_number(before) and _is_number(found)) or np.shape(before) != np.shape(found):
        return Deviation(np.inf, name, before, found)
    expected, now = np.atleast_1d(numbers(before)), np.atleast_1d(numbers(found))
    allowed = np.broadcast_to(tolerance(case, name, kept), expected.shape)
    distance = np.abs(now - expected)
    if "phase" in name:
        distance = np.minimum(distance, np.abs(360.0 - distance))
    # A number that was none and is one, or the other way round, is infinitely far off.
    distance[np.isnan(expected) & np.isnan(now)] = 0.0
    distance[np.isnan(expected) != np.isnan(now)] = np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = np.where(distance == 0.0, 0.0, distance / allowed)
    sizes[np.isinf(allowed)] = 0.0
    k = int(np.argmax(sizes))
    return Deviation(float(sizes[k]), f"{name}[{k}]" if np.shape(before) else name, float(expected[k]), float(now[k]))


def _is_number(values: Any) -> bool:
    """Whether these are numbers that may differ: neither words, truth values nor counts."""
    each = values if isinstance(values, list) else [values]
    return any(isinstance(v, float) for v in each) and all(v is None or type(v) in (float, int) for v in each)


def table() -> Iterator[tuple[str, Deviation]]:
    """The largest deviation of each case; one that cannot be computed is infinitely far off."""
    with tempfile.TemporaryDirectory(prefix="golden-") as folder:
        workshop = Workshop(Path(folder))
        for name, case in CASES.items():
            try:
                yield name, worst_of(case, KEPT[name], case.run(workshop))
            except (Exception, SystemExit) as problem:
                yield name, Deviation(np.inf, type(problem).__name__, "", str(problem))


if __name__ == "__main__":
    if sys.argv[1:] != ["--table"]:
        sys.exit("python test_golden.py --table")
    for name, worst in table():
        print(f"{worst.size:10.3g}  {name:45}  {'' if worst.size == 0.0 else worst}", flush=True)
