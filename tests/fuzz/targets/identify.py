"""Identification from records of hard numbers: coarse, constant, tiny, huge and degenerate ones.

One to three records of a path of the displacement, a law of the force, and what rigs and acquisition add, identified by
one of the methods. Results are finite, and can be saved and read again.
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
from targets.mutator import finite

Numbers = NDArray[np.float64]


def _normal(dice: random.Random, size: int) -> Numbers:
    return np.random.default_rng(dice.getrandbits(62)).normal(size=size)


def trial(dice: random.Random, folder: Path) -> str:
    """Records and a method."""
    records = _records(dice, dice.choice((1, 1, 1, 1, 2, 3)), is_mild=dice.random() < 0.6)
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


def _method(dice: random.Random) -> Any:
    degrees = dice.choice((None, None, (1, 0), (2, 1), (3, 2), (8, 6), (20, 8)))
    refined = RefinedOptions(
        degrees=degrees, robust=dice.random() < 0.5, moving_mass=dice.choice((0.0, 0.0, 1.0, 1e12)),
        fixture_stiffness=dice.choice((math.inf, math.inf, 1e3, 1e-9)), delay=dice.choice((None, None, 0.0, 1e-3)),
    )  # fmt: skip
    paper = PaperOptions(
        degrees, smoothing=dice.choice((None, 0, 3, 10_000)), branch=dice.choice(("loading", "unloading"))
    )
    usual = [RefinedOptions()] * 5
    return dice.choice((*usual, refined, refined, TwoStageOptions(degrees=degrees), paper, NiOptions(degrees=degrees)))


def _records(dice: random.Random, count: int, is_mild: bool) -> list[Record]:
    """Records of one spring on a rig, each with its amplitude and what rigs and acquisition add; or of anything."""
    spring = Spring(SpringParameters(
        (0.0, dice.choice((0.0, 0.3, 1.0, 5.0)), dice.uniform(-0.3, 0.3), dice.uniform(0.0, 0.5)),
        (1.0, dice.uniform(-0.4, 0.4)), dice.choice((0.02, 0.1, 0.5, 2.0)), 10.0 ** dice.uniform(0.0, 2.0),
        dice.choice((0.5, 0.8, 1.5, 5.0)), 10.0 ** dice.uniform(-1.0, 1.0), 0.0, -1.0, 1.0,
    ))  # fmt: skip
    faults = dice.sample(range(9), dice.choice((0, 1, 1, 2)))
    shape, units = dice.randrange(4 if is_mild else 11), (10.0 ** dice.uniform(-4, 1), 10.0 ** dice.uniform(-2, 6))
    made = []
    for k in range(count):
        x = _path(dice, shape, dice.choice((30, 60, 120, 300) if is_mild else (2, 3, 5, 8, 13, 60, 300)))
        x = x * dice.choice((1.0, 1.0, 0.7, 0.3))
        noise, steady = _normal(dice, x.size), 0.01 * np.arange(x.size)
        force, time = (
            spring.response(x) + noise * dice.choice((0.0, 1e-3, 3e-3, 0.01)),
            dice.choice((None, steady, steady)),
        )
        if not is_mild:
            friction = np.sign(np.gradient(x)) + x * dice.choice((0.0, 0.1, 1.0))
            flawed = force + (np.arange(x.size) == dice.randrange(x.size)) * 10.0 ** dice.uniform(0.0, 12.0)
            force = dice.choice((*[force] * 4, flawed, x, -x, friction, 0.0 * x, 0.0 * x + 1.0, noise, x**3))
        for fault in faults:
            x, force = _faulty(dice, fault, x, force)
        if not is_mild and dice.random() < 0.5:
            time = dice.choice((1e-300 * steady, 1e300 * steady, -steady, 0.0 * steady, np.floor(30.0 * steady), noise))
        x, force = (
            values * unit if is_mild else _disturbed(dice, values)
            for values, unit in zip((x, force), units, strict=True)
        )
        made.append(Record(x, force, time, path=f"record {k}"))
    return made


def _path(dice: random.Random, shape: int, size: int) -> Numbers:
    """Cycles at first, then displacements of any kind, of the order of 1."""
    legs = dice.choice((3, 4, 5, 8, 13))
    phase, place = np.linspace(0.0, 2.0 * np.pi * dice.choice((1.5, 2.0, 3.0, 5.3)), size), np.linspace(0.0, legs, size)
    corners = np.resize([-1.0, 1.0], legs + 1)
    uneven = corners * np.where(np.arange(legs + 1) < 3, 1.0, 0.2 + 0.8 * abs(np.tanh(_normal(dice, legs + 1))))
    noise = _normal(dice, size)
    steps = np.round(np.tanh(noise))
    return (
        np.sin(phase), np.sin(phase) * phase / phase[-1], np.interp(place, np.arange(legs + 1), corners),
        np.interp(place, np.arange(legs + 1), uneven), np.repeat(np.resize([0.0, 3.0, -2.0, 2.0], size), 2), steps,
        np.cumsum(steps), noise[np.argsort(noise) % min(3, size)], np.sort(noise), noise, np.sin(0.2 * phase),
    )[shape]  # fmt: skip


def _faulty(dice: random.Random, fault: int, x: Numbers, force: Numbers) -> tuple[Numbers, Numbers]:
    """Late, drifting, wearing, viscous, clipped, of another unit or zero, quantised, or resting at times."""
    small, large = dice.choice((0.01, 0.1, 0.3)), dice.choice((1.0, 3.0, -30.0))
    place = np.linspace(0.0, 1.0, x.size)
    resting = np.maximum.accumulate(np.where(np.arange(x.size) % 20 < 15, np.arange(x.size), 0))
    return (
        (x, np.roll(force, dice.randrange(-2, 2))), (x, force + large * place), (x, force * (1.0 - 0.9 * place)),
        (x, force + abs(large) * np.gradient(x)), (x, np.minimum(force, float(np.quantile(force, 0.8)))),
        (x * dice.choice((1.0, 1e-3)), force * dice.choice((1.0, 1e-3, 1e3))),
        (x + dice.gauss(0.0, small), force + dice.gauss(0.0, large)),
        (np.round(x / (0.2 * small)) * 0.2 * small, np.round(force / small) * small),
        (x[resting], force[resting] * dice.choice((1.0, 0.98))),
    )[fault]  # fmt: skip


def _disturbed(dice: random.Random, values: Numbers) -> Numbers:
    """Scaled, and perhaps quantised, shifted or cut off."""
    reach = dice.choice((*[0] * 8, *[6] * 4, 32, 32, 305))
    with np.errstate(all="ignore"):
        values = values * 10.0 ** dice.uniform(-reach, reach)
        largest = float(np.abs(values).max()) or 1.0
        step = largest * dice.choice((1e-3, 0.1, 0.5, 1.0))
        shifted = values + largest * dice.choice((1.0, -5.0, 1e6, 1e14))
        coarse, cut = np.round(values / step) * step, np.clip(values, -0.5 * largest, step)
        values = dice.choice((*[values] * 5, coarse, shifted, cut))
    return np.asarray(np.nan_to_num(values, nan=0.0, posinf=1e308, neginf=-1e308), dtype=np.float64)
