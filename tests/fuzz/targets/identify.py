"""Identification from records of hard numbers: coarse, constant, tiny, huge and degenerate ones.

One to three records of a path of the displacement, a law of the force, and what rigs and acquisition add, identified by
one of the methods, in Python or by the command. Results are finite, and can be saved and read again.
"""

from __future__ import annotations

import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring import NiOptions, PaperOptions, Record, RefinedOptions, Spring, SpringParameters, TwoStageOptions
from strandspring.api.identification import identify
from targets.mutator import finite, numpy_of
from targets.options import judged

Numbers = NDArray[np.float64]
Dice = np.random.Generator


def _one(dice: Dice, items: Any) -> Any:
    return items[int(dice.integers(len(items)))]


def trial(drawn: random.Random, folder: Path) -> str:
    """Records and a method."""
    dice = numpy_of(drawn)
    records = _records(dice, int(_one(dice, (1, 1, 1, 1, 2, 3))), is_mild=bool(dice.random() < 0.6))
    if dice.random() < 0.1:
        return _by_command(dice, folder, records)
    result = identify(records, options=_method(dice))
    finite("figures", [result.rmse, result.rnl, *(force for fit in result.fits for force in fit.predicted)])
    assert not re.search(r"\b(nan|inf)\b", result.summary() + repr(result)), result.summary()
    frame = result.to_frame()
    finite("parameters", frame["value"])
    assert not np.isinf(frame.iloc[:, 2:].to_numpy(dtype=float, na_value=0.0)).any(), frame
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
    status = judged(["identify", *files, "-o", str(folder / "model.json"), "--json", *extra], folder)
    assert (folder / "model.json").exists() == (status == 0)
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


def _records(dice: Dice, count: int, is_mild: bool) -> list[Record]:
    """Records of one spring on a rig, each with its amplitude and what rigs and acquisition add; or of anything."""
    kE = (0.0, float(_one(dice, (0.0, 0.3, 1.0, 5.0))), float(dice.uniform(-0.3, 0.3)), float(dice.uniform(0, 0.5)))
    kappa, sigma = float(_one(dice, (0.02, 0.1, 0.5, 2.0))), float(_one(dice, (0.5, 0.8, 1.5, 5.0)))
    rho, n = 10.0 ** dice.uniform(0.0, 2.0), 10.0 ** dice.uniform(-1.0, 1.0)
    spring = Spring(SpringParameters(kE, (1.0, float(dice.uniform(-0.4, 0.4))), kappa, rho, sigma, n, 0.0, -1.0, 1.0))
    faults = dice.integers(9, size=int(_one(dice, (0, 1, 1, 2))))
    shape, law, units = (
        int(dice.integers(4 if is_mild else 11)),
        int(dice.integers(12)),
        (dice.uniform(-4, 1), dice.uniform(-2, 6)),
    )
    made = []
    for k in range(count):
        x = _path(dice, shape, int(_one(dice, (30, 60, 120, 300) if is_mild else (2, 3, 5, 8, 13, 60, 300))))
        x = x * float(_one(dice, (1.0, 1.0, 0.7, 0.3)))
        force = spring.response(x) + dice.normal(size=x.size) * float(_one(dice, (0.0, 1e-3, 3e-3, 0.01)))
        force = force if is_mild else _law(dice, law, x, force)
        for fault in faults:
            x, force = _faulty(dice, int(fault), x, force)
        if is_mild:
            x, force = (10.0**exponent * values for values, exponent in zip((x, force), units, strict=True))
        else:
            x, force = _disturbed(dice, x), _disturbed(dice, force)
        steady = 0.01 * np.arange(x.size)
        strange = (
            1e-300 * steady,
            1e300 * steady,
            -steady,
            0.0 * steady,
            np.floor(30.0 * steady),
            dice.normal(size=x.size),
        )
        time = _one(dice, strange) if not is_mild and dice.random() < 0.5 else _one(dice, (None, steady, steady))
        made.append(Record(x, force, time, path=f"record {k}"))
    return made


def _path(dice: Dice, shape: int, size: int) -> Numbers:
    """Cycles at first, then displacements of any kind, of the order of 1."""
    legs = int(_one(dice, (3, 4, 5, 8, 13)))
    phase = np.linspace(0.0, 2.0 * np.pi * float(_one(dice, (1.5, 2.0, 3.0, 5.3))), size)
    corners = np.resize([-1.0, 1.0], legs + 1)
    uneven = corners * np.where(np.arange(legs + 1) < 3, 1.0, dice.uniform(0.2, 1.0, legs + 1))
    place = np.linspace(0.0, legs, size)
    steps = dice.integers(-1, 2, size).astype(np.float64)
    return (
        np.sin(phase), np.sin(phase) * phase / phase[-1], np.interp(place, np.arange(legs + 1), corners),
        np.interp(place, np.arange(legs + 1), uneven), np.repeat(np.resize([0.0, 3.0, -2.0, 2.0], size), 2), steps,
        np.cumsum(steps), dice.choice(dice.normal(size=3), size), np.sort(dice.normal(size=size)),
        dice.normal(size=size), np.sin(0.2 * phase),
    )[shape]  # fmt: skip


def _law(dice: Dice, law: int, x: Numbers, force: Numbers) -> Numbers:
    flawed = force.copy()
    flawed[int(dice.integers(x.size))] += 10.0 ** dice.uniform(0.0, 12.0)
    friction = np.sign(np.gradient(x)) + x * float(_one(dice, (0.0, 0.1, 1.0)))
    others = (flawed, x.copy(), -x, friction, np.zeros_like(x), np.ones_like(x), dice.normal(size=x.size), x**3)
    return others[law] if law < len(others) else force


def _faulty(dice: Dice, fault: int, x: Numbers, force: Numbers) -> tuple[Numbers, Numbers]:
    """Late, drifting, wearing, viscous, clipped, of another unit or zero, quantised, or resting at times."""
    small, large = float(_one(dice, (0.01, 0.1, 0.3))), float(_one(dice, (1.0, 3.0, -30.0)))
    place = np.linspace(0.0, 1.0, x.size)
    resting = np.maximum.accumulate(np.where(np.arange(x.size) % 20 < 15, np.arange(x.size), 0))
    return (
        (x, np.roll(force, int(dice.integers(-2, 2)))), (x, force + large * place), (x, force * (1.0 - 0.9 * place)),
        (x, force + abs(large) * np.gradient(x)), (x, np.minimum(force, float(np.quantile(force, 0.8)))),
        (x * float(_one(dice, (1.0, 1e-3))), force * float(_one(dice, (1.0, 1e-3, 1e3)))),
        (x + dice.normal() * small, force + dice.normal() * large),
        (np.round(x / (0.2 * small)) * 0.2 * small, np.round(force / small) * small),
        (x[resting], force[resting] * float(_one(dice, (1.0, 0.98)))),
    )[fault]  # fmt: skip


def _disturbed(dice: Dice, values: Numbers) -> Numbers:
    """Scaled, and perhaps quantised, shifted or cut off."""
    exponent = _one(dice, (*[0.0] * 8, *dice.uniform(-6, 6, 4), *dice.uniform(-32, 32, 2), dice.uniform(-320, 305)))
    with np.errstate(all="ignore"):
        values = values * 10.0**exponent
        largest = float(np.abs(values).max()) or 1.0
        step = largest * float(_one(dice, (1e-3, 0.1, 0.5, 1.0)))
        shifted = values + largest * float(_one(dice, (1.0, -5.0, 1e6, 1e14)))
        values = _one(
            dice, (*[values] * 5, np.round(values / step) * step, shifted, np.clip(values, -0.5 * largest, step))
        )
    return np.asarray(np.nan_to_num(values, nan=0.0, posinf=1e308, neginf=-1e308), dtype=np.float64)
