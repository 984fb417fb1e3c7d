"""Identification from records of hard numbers: coarse, constant, tiny, huge and degenerate ones.

Records of a drawn spring on a rig with one of the faults of `rig_faults`, of few samples, and in two of five trials of
other motion, force, times and sizes; identified by one of the methods. Results are finite, and can be saved and read.
"""

from __future__ import annotations

import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig import NO_FAULT, draw_experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import NiOptions, PaperOptions, Record, RefinedOptions, Spring, TwoStageOptions
from strandspring.api.identification import identify
from targets.mutator import finite

Numbers = NDArray[np.float64]


def trial(dice: random.Random, folder: Path) -> str:
    """Records and a method."""
    result = identify(_records(dice), options=_method(dice))
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


def _records(dice: random.Random) -> list[Record]:
    generator = np.random.default_rng(dice.getrandbits(62))
    samples, noise = dice.choice((30, 60, 120, 300, 1000)), dice.choice((0.0, 1e-3, 3e-3, 0.01))
    experiment = draw_experiment(generator, samples=samples, noise=noise)
    fault = dice.choice((NO_FAULT, *FAULTS.values()))
    case = simulate(draw_spring(generator), experiment, generator, fault, dice.choice(("small", "large")))
    disturb = dice.choice((_in_other_units, _in_other_units, _in_other_units, _disturbed, _disturbed))
    return [disturb(dice, record) for record in case.records]


def _in_other_units(dice: random.Random, record: Record) -> Record:
    x, force = record.displacement * dice.choice((1.0, 1e-3, 10.0)), record.force * dice.choice((1.0, 1e-3, 1e3))
    return Record(x, force, dice.choice((None, record.time, record.time)), path=record.path)


def _disturbed(dice: random.Random, record: Record) -> Record:
    """Cut short, and perhaps of other motion, force or times."""
    assert record.time is not None
    size = min(len(record), dice.choice((2, 3, 5, 8, 13, 60, 300)))
    noise = np.random.default_rng(dice.getrandbits(62)).normal(size=size)
    x, force, time = record.displacement[:size], record.force[:size], record.time[:size]
    steps = np.round(np.tanh(noise))
    x = dice.choice((*[x] * 4, steps, np.cumsum(steps), np.sort(noise), noise, noise[np.argsort(noise) % min(3, size)]))
    flawed = force + (np.arange(size) == dice.randrange(size)) * 10.0 ** dice.uniform(0.0, 12.0)
    friction = np.sign(np.gradient(x)) + x * dice.choice((0.0, 0.1, 1.0))
    force = dice.choice((*[force] * 4, flawed, x, -x, friction, 0.0 * x, 0.0 * x + 1.0, noise, x**3))
    times = (None, time, 1e-300 * time, 1e300 * time, -time, 0.0 * time, np.floor(30.0 * time), noise)
    return Record(_scaled(dice, x), _scaled(dice, force), dice.choice(times), path=record.path)


def _scaled(dice: random.Random, values: Numbers) -> Numbers:
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
