"""Identification from records of hard numbers: coarse, constant, tiny, huge and degenerate ones.

One to three records of a path of the displacement, a law of the force, and what rigs and acquisition add, identified by
one of the methods, in Python or by the command. Results are finite, and can be saved and read again.
"""

from __future__ import annotations

import json
import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring import (
    NiOptions,
    PaperOptions,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    identify,
)  # fmt: skip
from targets.mutator import finite, numpy_of, refuse_constant
from targets.options import run

Numbers = NDArray[np.float64]
Dice = np.random.Generator


def _one(dice: Dice, items: Any) -> Any:
    return items[int(dice.integers(len(items)))]


def trial(drawn: random.Random, folder: Path) -> str:
    """Records and a method; most are of a spring on a rig with faults, so that what follows the fits is reached."""
    dice = numpy_of(drawn)
    make = _mild if dice.random() < 0.6 else _hard
    records = make(dice, int(_one(dice, (1, 1, 1, 1, 2, 3))))
    if dice.random() < 0.1:
        return _by_command(dice, folder, records)
    result = identify(records, options=_method(dice))
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
    if dice.random() < 0.1:
        result.report(folder / "report.html")
    return "accepted"


def _by_command(dice: Dice, folder: Path, records: list[Record]) -> str:
    files = [str(folder / f"record_{k}.csv") for k in range(len(records))]
    for file, record in zip(files, records, strict=True):
        record.save(file)
    extra = _one(dice, ([], ["--degrees", "3,2"], ["--robust"], ["--method", "two-stage"]))
    status, out, err = run(["identify", *files, "-o", str(folder / "model.json"), "--json", *extra])
    assert status in (0, 1), (status, err)
    content = json.loads(out, parse_constant=refuse_constant)
    assert ("error" in content) == (status == 1)
    assert (folder / "model.json").exists() == (status == 0)
    assert status == 0 or content["error"]["type"] not in ("MemoryError", "OSError"), content
    return f"accepted by the command with status {status}"


def _method(dice: Dice) -> Any:
    degrees = _one(dice, (None, None, (1, 0), (2, 1), (3, 2), (8, 6), (20, 8)))
    smoothing, branch = _one(dice, (None, 0, 3, 10_000)), _one(dice, ("loading", "unloading"))
    kind = int(dice.integers(10))
    if 5 <= kind < 7:
        return RefinedOptions(
            degrees=degrees, robust=bool(dice.random() < 0.5), moving_mass=float(_one(dice, (0.0, 0.0, 1.0, 1e12))),
            fixture_stiffness=float(_one(dice, (math.inf, math.inf, 1e3, 1e-9))),
            delay=_one(dice, (None, None, 0.0, 1e-3, -1e9)),
        )  # fmt: skip
    made = {7: TwoStageOptions(degrees=degrees), 8: PaperOptions(degrees, smoothing=smoothing, branch=branch)}
    return RefinedOptions() if kind < 5 else made.get(kind, NiOptions(degrees=degrees))


# ---- records of a spring on a rig ------------------------------------------------------------------------------------


def _ramps(size: int, corners: Any) -> Numbers:
    legs = len(corners) - 1
    return np.interp(np.linspace(0.0, legs, legs * size + 1), np.arange(legs + 1), corners)


def _mild(dice: Dice, count: int) -> list[Record]:
    """Records of one spring, each with its amplitude, and with what rigs and acquisition add."""
    length, force_unit = 10.0 ** dice.uniform(-4, 1), 10.0 ** dice.uniform(-2, 6)
    kE = (0.0, float(_one(dice, (0.0, 0.3, 1.0, 5.0))), float(dice.uniform(-0.3, 0.3)), float(dice.uniform(0, 0.5)))
    kappa, sigma = float(_one(dice, (0.02, 0.1, 0.5, 2.0))), float(_one(dice, (0.5, 0.8, 1.5, 5.0)))
    rho, n = 10.0 ** dice.uniform(0.0, 2.0), 10.0 ** dice.uniform(-1.0, 1.0)
    spring = Spring(SpringParameters(kE, (1.0, float(dice.uniform(-0.4, 0.4))), kappa, rho, sigma, n, 0.0, -1.0, 1.0))
    faults = dice.integers(9, size=int(_one(dice, (0, 1, 1, 2))))
    shape, offset = int(dice.integers(4)), float(_one(dice, (0.0, 0.0, 1.0, -10.0)))
    records = []
    for k in range(count):
        size, legs = int(_one(dice, (8, 13, 30, 60, 120))), int(_one(dice, (3, 4, 5, 8, 13)))
        phase = np.linspace(0.0, 2.0 * np.pi * float(_one(dice, (1.5, 2.0, 3.0, 5.3))), 4 * size)
        corners = np.resize([-1.0, 1.0], legs + 1)
        uneven = corners * np.where(np.arange(legs + 1) < 3, 1.0, dice.uniform(0.2, 1.0, legs + 1))
        x = (np.sin(phase), np.sin(phase) * phase / phase[-1], _ramps(size, corners), _ramps(size, uneven))[shape]
        x = x * float(_one(dice, (1.0, 1.0, 0.7, 0.3)))
        force = spring.response(x) + dice.normal(size=x.size) * float(_one(dice, (0.0, 1e-3, 3e-3, 0.01)))
        for fault in faults:
            x, force = _faulty(dice, int(fault), x, force)
        time = None if dice.random() < 0.3 else 0.01 * np.arange(x.size)
        records.append(Record(length * (x + offset), force_unit * force, time, path=f"record {k}"))
    return records


def _faulty(dice: Dice, fault: int, x: Numbers, force: Numbers) -> tuple[Numbers, Numbers]:
    """Late, drifting, wearing, viscous, clipped, of another unit or zero, quantised, or resting at times."""
    small, large = float(_one(dice, (0.01, 0.1, 0.3))), float(_one(dice, (1.0, 3.0, -30.0)))
    place = np.linspace(0.0, 1.0, x.size)
    resting = np.maximum.accumulate(np.where(np.arange(x.size) % 20 < 15, np.arange(x.size), 0))
    return (
        (x, np.roll(force, int(dice.integers(-2, 2)))),
        (x, force + large * place),
        (x, force * (1.0 - place * float(_one(dice, (0.02, 0.1, 0.5, 0.99))))),
        (x, force + abs(large) * np.gradient(x)),
        (x, np.minimum(force, float(np.quantile(force, 0.8)))),
        (x * float(_one(dice, (1.0, 1e-3))), force * float(_one(dice, (1.0, 1e-3, 1e3)))),
        (x + dice.normal() * small, force + dice.normal() * large),
        (np.round(x / (0.2 * small)) * 0.2 * small, np.round(force / small) * small),
        (x[resting], force[resting] * float(_one(dice, (1.0, 0.98)))),
    )[fault]


# ---- records of anything ---------------------------------------------------------------------------------------------


def _hard(dice: Dice, count: int) -> list[Record]:
    """Paths and laws of any kind, scaled, shifted, quantised or cut off."""
    shape, law = int(dice.integers(9)), int(dice.integers(12))
    made = []
    for k in range(count):
        x = _path(dice, shape, int(_one(dice, (2, 3, 5, 8, 13, 30, 60, 120, 300))))
        force = _law(dice, law, x)
        time = np.arange(x.size, dtype=np.float64)
        times = (None, None, 0.01 * time, time, 1e-300 * time, 1e300 * time, -time, 0.0 * time, np.floor(time / 3.0),
                 np.cumsum(dice.exponential(1.0, x.size)), np.where(time > x.size / 2, time + 1e3, time))  # fmt: skip
        made.append(Record(_disturbed(dice, x), _disturbed(dice, force), _one(dice, times), path=f"record {k}"))
    return made


def _path(dice: Dice, shape: int, size: int) -> Numbers:
    phase = np.linspace(0.0, 2.0 * np.pi * float(_one(dice, (0.25, 0.5, 1.0, 2.0, 7.3))), size)
    ramps = _ramps(size, np.resize([-1.0, 1.0], int(_one(dice, (2, 3, 4, 5, 9)))))
    return (
        np.sin(phase + float(_one(dice, (0.0, 1.0)))),
        ramps,
        np.repeat(ramps, dice.integers(1, 6)),
        dice.integers(-1, 2, size).astype(np.float64),
        dice.choice(dice.normal(size=int(dice.integers(1, 5))), size),
        np.cumsum(dice.integers(-1, 2, size)).astype(np.float64),
        np.sort(dice.normal(size=size)),
        dice.normal(size=size),
        np.resize([0.0, 3.0, -2.0, 2.0, -3.0], size),
    )[shape]


def _law(dice: Dice, law: int, x: Numbers) -> Numbers:
    spring = Spring(SpringParameters((0.0, 1.0, 0.3), (1.0, 0.2), 0.5, 8.0, 1.2, 0.7, 0.0, -1.0, 1.0))
    force = spring.response(x / (float(np.abs(x).max()) or 1.0))
    flawed = force.copy()
    flawed[int(dice.integers(x.size))] += 10.0 ** dice.uniform(0.0, 12.0)
    friction = np.sign(np.gradient(x) if x.size > 1 else x) + x * float(_one(dice, (0.0, 0.1, 1.0)))
    others = (flawed, x.copy(), -x, friction, np.zeros_like(x), np.ones_like(x), dice.normal(size=x.size), x**3)
    return others[law] if law < len(others) else force + dice.normal(size=x.size) * float(_one(dice, (0.0, 0.01, 0.3)))


def _disturbed(dice: Dice, values: Numbers) -> Numbers:
    exponent = _one(dice, (*[0.0] * 8, *dice.uniform(-6, 6, 4), *dice.uniform(-32, 32, 2), dice.uniform(-320, 305)))
    with np.errstate(all="ignore"):
        values = values * 10.0**exponent
        largest = float(np.abs(values).max()) or 1.0
        step = largest * float(_one(dice, (1e-3, 0.1, 0.5, 1.0)))
        changes = (np.round(values / step) * step, values + largest * float(_one(dice, (1.0, -5.0, 1e6, 1e14))),
                   np.clip(values, -0.5 * largest, 0.7 * largest))  # fmt: skip
        change = int(dice.integers(8))
        values = changes[change] if change < len(changes) else values
    return np.asarray(np.nan_to_num(values, nan=0.0, posinf=1e308, neginf=-1e308), dtype=np.float64)
