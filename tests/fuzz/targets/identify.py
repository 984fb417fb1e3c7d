"""Identification from records of hard numbers: coarse, constant, tiny, huge and degenerate ones.

    python tests/fuzz/targets/identify.py [--seed SEED] [--count COUNT]

A trial makes one to three records from a path of the displacement, a law of the force and a disturbance of both, and
identifies a spring by one of the methods, in Python or on the command line. Six in ten are mild: whole cycles of a
spring on a rig with faults, so that the fits are reached and most of what follows them. See `harness` for what counts
as a failure; here so do results that are not finite or cannot be saved and read again, and refusals that do not say
what to do.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring import (
    Identification,
    IdentificationError,
    NiOptions,
    PaperOptions,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    StrandspringError,
    TwoStageOptions,
    identify,
)
from strandspring.cli.main import main as command_line
from targets.made import finite, kind_of, numpy_of, refuse_constant

Numbers = NDArray[np.float64]
Dice = np.random.Generator

_BY_COMMAND = 0.1  # share of the trials on the command line
_MILD = 0.6  # share of mild trials
_REPORTED = 0.1  # share of the results of which a report is written
_SPRING = Spring(SpringParameters((0.0, 1.0, 0.3), (1.0, 0.2), 0.5, 8.0, 1.2, 0.7, 0.0, -1.0, 1.0))


def trial(drawn: random.Random, folder: Path) -> Iterator[str]:
    """Records and a method."""
    dice = numpy_of(drawn)
    is_mild = dice.random() < _MILD
    path_name, law_name = _one(dice, sorted(_WHOLE_CYCLES if is_mild else _PATHS)), _one(dice, sorted(_LAWS))
    yield f"mild {path_name}" if is_mild else path_name
    count = int(_one(dice, (1, 1, 1, 1, 2, 3)))
    try:
        if is_mild:
            records = _mild_records(dice, _WHOLE_CYCLES[path_name], count)
        else:
            records = [_record(dice, _PATHS[path_name], _LAWS[law_name], f"record {k}") for k in range(count)]
        if dice.random() < _BY_COMMAND:
            yield _by_command(dice, folder, records)
            return
        result = identify(records, options=_method(dice))
    except IdentificationError as refusal:
        kind_of(refusal, folder)
        yield f"refused: {refusal.outcome.name}"
    except StrandspringError as refusal:
        yield f"refused: {kind_of(refusal, folder)}"
    else:
        _judge(dice, folder, result)
        yield "accepted"


def _judge(dice: Dice, folder: Path, result: Identification) -> None:
    finite("figures", [result.rmse, result.rnl])
    for fit in result.fits:
        finite("prediction", fit.predicted)
    assert not re.search(r"\b(nan|inf)\b", result.summary()), result.summary()
    repr(result)
    frame = result.to_frame()
    finite("parameters", frame["value"])
    for name in frame.columns[2:]:
        assert not np.isinf(frame[name]).any(), frame
    spring = result.spring("spring")
    spring.save(folder / "model.json")
    assert Spring.load(folder / "model.json") == spring
    if dice.random() < _REPORTED:
        result.report(folder / "report.html")


def _by_command(dice: Dice, folder: Path, records: list[Record]) -> str:
    """The same by the command, whose output is JSON without NaN."""
    files = []
    for k, record in enumerate(records):
        files.append(str(folder / f"record_{k}.csv"))
        record.save(files[-1])
    extra = _one(dice, ([], ["--degrees", "3,2"], ["--robust"], ["--method", "two-stage"]))
    printed, said = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(said):
        try:
            command_line(["identify", *files, "-o", str(folder / "model.json"), "--json", *extra])
            status: Any = 0
        except SystemExit as leaving:
            status = leaving.code or 0
    assert status in (0, 1), (status, said.getvalue())
    content = json.loads(printed.getvalue(), parse_constant=refuse_constant)
    assert ("error" in content) == (status == 1)
    assert (folder / "model.json").exists() == (status == 0)
    if status == 1:
        assert content["error"]["type"] not in ("MemoryError", "OSError"), content
        return f"command refused: {content['error'].get('outcome', content['error']['type'])}"
    return "accepted by the command"


def _one(dice: Dice, items: Any) -> Any:
    return items[int(dice.integers(len(items)))]


def _method(dice: Dice) -> Any:
    degrees = _one(dice, (None, None, (1, 0), (2, 1), (3, 2), (8, 6), (20, 8)))
    kind = int(dice.integers(10))
    if kind < 5:
        return RefinedOptions()
    if kind < 7:
        return RefinedOptions(
            degrees=degrees,
            robust=bool(dice.random() < 0.5),
            moving_mass=float(_one(dice, (0.0, 0.0, 1.0, 1e12))),
            fixture_stiffness=float(_one(dice, (math.inf, math.inf, 1e3, 1e-9))),
            delay=_one(dice, (None, None, 0.0, 1e-3, -1e9)),
        )
    if kind == 7:
        return TwoStageOptions(degrees=degrees)
    if kind == 8:
        return PaperOptions(
            degrees, smoothing=_one(dice, (None, 0, 3, 10_000)), branch=_one(dice, ("loading", "unloading"))
        )
    return NiOptions(degrees=degrees)


def _mild_records(dice: Dice, path: Callable[..., Numbers], count: int) -> list[Record]:
    """Records of one spring, each with its amplitude, and with what rigs and acquisition add."""
    length, force_unit = 10.0 ** dice.uniform(-4, 1), 10.0 ** dice.uniform(-2, 6)
    spring = Spring(
        SpringParameters(
            (0.0, float(_one(dice, (0.0, 0.3, 1.0, 5.0))), float(dice.uniform(-0.3, 0.3)), float(dice.uniform(0, 0.5))),
            (1.0, float(dice.uniform(-0.4, 0.4))), float(_one(dice, (0.02, 0.1, 0.5, 2.0))),
            10.0 ** dice.uniform(0.0, 2.0), float(_one(dice, (0.5, 0.8, 1.5, 5.0))), 10.0 ** dice.uniform(-1.0, 1.0),
            0.0, -1.0, 1.0,
        )
    )  # fmt: skip
    records = []
    faults = [_one(dice, sorted(_FAULTS)) for _ in range(int(_one(dice, (0, 1, 1, 2))))]
    offset = float(_one(dice, (0.0, 0.0, 1.0, -10.0)))
    for k in range(count):
        x = path(dice, int(_one(dice, (8, 13, 30, 60, 120)))) * float(_one(dice, (1.0, 1.0, 0.7, 0.3)))
        force = spring.response(x) + dice.normal(size=x.size) * float(_one(dice, (0.0, 1e-3, 3e-3, 0.01)))
        time = 0.01 * np.arange(x.size)
        for fault in faults:
            x, force = _FAULTS[fault](dice, x, force)
        given_time = None if dice.random() < 0.3 else time
        records.append(Record(length * (x + offset), force_unit * force, given_time, path=f"record {k}"))
    return records


def _record(dice: Dice, path: Callable[..., Numbers], law: Callable[..., Numbers], name: str) -> Record:
    x = path(dice, int(_one(dice, (2, 3, 5, 8, 13, 30, 60, 120, 300))))
    force = law(dice, x)
    x, force = (_disturbed(dice, values) for values in (x, force))
    return Record(x, force, _time(dice, x.size), path=name)


def _time(dice: Dice, size: int) -> Numbers | None:
    k = np.arange(size, dtype=np.float64)
    return _one(
        dice,
        (None, None, 0.01 * k, 0.01 * k, k, 1e-300 * k, 1e300 * k, -k, 0.0 * k, np.floor(k / 3.0),
         np.cumsum(dice.exponential(1.0, size)), np.where(k > size / 2, k + 1e3, k), dice.permutation(k)),
    )  # fmt: skip


# Paths of the displacement with about so many samples, of the order of 1.


def _growing(_dice: Dice, size: int) -> Numbers:
    phase = np.linspace(0.0, 8.0 * np.pi, 4 * size)
    return np.sin(phase) * phase / phase[-1]


def _ramps(dice: Dice, size: int, legs: tuple[int, ...] = (1, 2, 3, 4, 8)) -> Numbers:
    count = int(_one(dice, legs))
    return np.interp(np.linspace(0.0, count, count * size + 1), np.arange(count + 1), np.resize([-1.0, 1.0], count + 1))


def _sine(dice: Dice, size: int) -> Numbers:
    phase = np.linspace(0.0, 2.0 * np.pi * float(_one(dice, (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 7.3))), size)
    return np.sin(phase + float(_one(dice, (0.0, 1.0))))


_PATHS: dict[str, Callable[[Dice, int], Numbers]] = {
    **dict.fromkeys(("sine", "sine again"), _sine),
    **dict.fromkeys(("triangle", "triangle again"), _ramps),
    **dict.fromkeys(("growing", "growing again"), _growing),
    "grid": lambda dice, size: dice.integers(-1, 2, size).astype(np.float64),
    "alternating": lambda _, size: np.resize([-1.0, 1.0], size),
    "few values": lambda dice, size: dice.choice(dice.normal(size=int(dice.integers(1, 5))), size),
    "walk": lambda dice, size: np.cumsum(dice.integers(-1, 2, size)).astype(np.float64),
    "monotone": lambda dice, size: np.sort(dice.normal(size=size))[:: int(_one(dice, (1, -1)))].copy(),
    "constant": lambda _, size: np.ones(size),
    "random": lambda dice, size: dice.normal(size=size),
    "two points": lambda dice, _: dice.normal(size=2),
    "with dwells": lambda dice, size: np.repeat(_ramps(dice, size), dice.integers(1, 6)),
    "corners": lambda _, size: np.resize([0.0, 3.0, -2.0, 2.0, -3.0], size),
}


# Laws of the force along a path.


def _of_spring(dice: Dice, x: Numbers) -> Numbers:
    scale = float(np.abs(x).max()) or 1.0
    return _SPRING.response(x / scale) + dice.normal(size=x.size) * float(_one(dice, (0.0, 0.0, 0.01, 0.3)))


def _flawed(dice: Dice, x: Numbers) -> Numbers:
    force = _of_spring(dice, x)
    force[int(dice.integers(x.size))] += 10.0 ** dice.uniform(0.0, 12.0)
    return force


_LAWS: dict[str, Callable[[Dice, Numbers], Numbers]] = {
    **dict.fromkeys((f"of spring {k}" for k in range(7)), _of_spring),
    "flawed": _flawed,
    "equal": lambda _, x: x.copy(),
    "reversed": lambda _, x: -x,
    "friction": lambda dice, x: np.sign(np.gradient(x) if x.size > 1 else x) + x * float(_one(dice, (0.0, 0.1, 1.0))),
    "lagging": lambda dice, x: np.roll(x, int(dice.integers(-3, 4))),
    "none": lambda _, x: np.zeros_like(x),
    "constant": lambda _, x: np.ones_like(x),
    "any": lambda dice, x: dice.normal(size=x.size),
    "few values": lambda dice, x: dice.integers(-1, 2, x.size).astype(np.float64),
    "cubic": lambda _, x: x**3,
}


# Of mild records.


def _uneven_ramps(dice: Dice, size: int) -> Numbers:
    """Strokes of any length about the middle, of which some are full ones."""
    legs = int(_one(dice, (5, 8, 13)))
    corners = np.resize([-1.0, 1.0], legs + 1) * dice.uniform(0.2, 1.0, legs + 1)
    corners[[1, 2]] = 1.0, -1.0
    return np.interp(np.linspace(0.0, legs, legs * size + 1), np.arange(legs + 1), corners)


_WHOLE_CYCLES: dict[str, Callable[[Dice, int], Numbers]] = {
    "cycles": lambda dice, size: np.sin(
        np.linspace(0.0, 2.0 * np.pi * float(_one(dice, (1.5, 2.0, 3.0, 5.3))), 4 * size)
    ),
    "ramps": lambda dice, size: _ramps(dice, size, (3, 4, 5, 8)),
    "uneven ramps": _uneven_ramps,
    "growing": _growing,
}

Points = tuple[Numbers, Numbers]


def _another_zero(dice: Dice, x: Numbers, force: Numbers) -> Points:
    shift = float(_one(dice, (0.01, 0.3, 3.0)))
    return x + dice.normal() * shift, force + dice.normal() * float(_one(dice, (0.0, 0.1, 10.0)))


def _quantised(dice: Dice, x: Numbers, force: Numbers) -> Points:
    steps = _one(dice, ((1e-3, 0.0), (0.02, 0.0), (0.0, 0.01), (0.0, 0.1), (0.02, 0.05)))
    x, force = (np.round(v / step) * step if step else v for v, step in zip((x, force), steps, strict=True))
    return x, force


def _resting(dice: Dice, x: Numbers, force: Numbers) -> Points:
    """A dwell at every fourth part of the record, in which the force relaxes a little; the number of samples stays."""
    samples = np.maximum.accumulate(np.where(np.arange(x.size) % 20 < 15, np.arange(x.size), 0))
    return x[samples], force[samples] * float(_one(dice, (1.0, 0.98)))


_FAULTS: dict[str, Callable[[Dice, Numbers, Numbers], Points]] = {
    "late": lambda dice, x, force: (x, np.roll(force, int(dice.integers(-2, 2)))),
    "drifting": lambda dice, x, force: (x, force + np.linspace(0.0, float(_one(dice, (0.1, 1.0, -30.0))), x.size)),
    "wearing": lambda dice, x, force: (x, force * np.linspace(1.0, float(_one(dice, (0.98, 0.9, 0.5, 0.01))), x.size)),
    "viscous": lambda dice, x, force: (x, force + float(_one(dice, (0.1, 1.0, 30.0))) * np.gradient(x)),
    "clipped": lambda dice, x, force: (
        x,
        np.clip(force, -np.inf, float(np.quantile(force, float(_one(dice, (0.7, 0.9)))))),
    ),
    # Another unit of one of the columns than the other records have.
    "weak": lambda dice, x, force: (x * float(_one(dice, (1.0, 1e-3))), force * float(_one(dice, (1.0, 1e-3, 1e3)))),
    "another zero": _another_zero,
    "quantised": _quantised,
    "resting": _resting,
}


def _disturbed(dice: Dice, values: Numbers) -> Numbers:
    """Values scaled, shifted, quantised or cut off."""
    largest = float(np.abs(values).max()) or 1.0
    exponent = _one(dice, (*[0.0] * 8, *dice.uniform(-6, 6, 4), *dice.uniform(-32, 32, 2), dice.uniform(-320, 305)))
    values = values * 10.0**exponent
    largest *= 10.0**exponent
    change = int(dice.integers(8))
    if change == 0:
        step = largest * float(_one(dice, (1e-3, 0.1, 0.5, 1.0)))
        values = np.round(values / step) * step if step > 0.0 else values
    elif change == 1:
        values = values + largest * float(_one(dice, (1.0, -5.0, 1e6, 1e14)))
    elif change == 2:
        values = np.clip(values, -0.5 * largest, 0.7 * largest)
    return np.asarray(np.nan_to_num(values, nan=0.0, posinf=1e308, neginf=-1e308), dtype=np.float64)
