"""Model files, sound, at the ends of their limits and damaged, given to everything that takes a model.

A model that is accepted is the same again after it was saved, and finite in every output of every use.
"""

from __future__ import annotations

import json
import math
import random
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from strandspring import Record, Spring
from strandspring.core import parameters as limits
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from targets.mutator import ABSURD, CORPUS, FLOATS, finite, mutated
from targets.options import judged

_INSIDE = 1.0 - 1e-12  # what is rounded stays within


@cache
def _seeds() -> list[bytes]:
    """Sound model files, of coefficients and tables, with uncertainty and without."""
    return [path.read_bytes() for path in sorted((CORPUS / "models").glob("sound_*"))]


def model_file(dice: random.Random) -> bytes:
    """A model file, sound or not."""
    data = dice.choice(_seeds())
    if dice.random() < 0.4:
        content = json.loads(data)
        for name in ("kE", "FE_knots", "FE_forces"):
            content["parameters"].pop(name, None)
        content["parameters"] |= _corner(dice)
        if dice.random() < 0.8:
            content |= {"uncertainty": {}, "fit": {}, "provenance": {}}
        data = json.dumps(content).encode()
    return mutated(dice, data) if dice.random() < 0.5 else data


def _corner(dice: random.Random) -> dict[str, Any]:
    """Parameters at the ends of what is allowed, or between them at any size."""

    def end(low: float, high: float) -> float:
        return min(max(dice.choice((low, high, low * (high / low) ** dice.random())), low / _INSIDE), high * _INSIDE)

    def size() -> float:
        return dice.choice((-1.0, 1.0)) * dice.choice((0.0, 1.0, 1.0, 10.0 ** dice.uniform(-30.0, 0.0), 5e-324))

    width = end(*limits.WIDTH_RANGE)
    low = dice.choice((0.0, -0.5 * width, -dice.random() * width))
    if width > 1e-4 and dice.random() < 0.4:  # else it is not resolved so far away
        low = dice.choice((limits.LARGEST_DISPLACEMENT - width, -limits.LARGEST_DISPLACEMENT))
    high = low + width
    offset = dice.choice((low, high, 0.5 * (low + high)))
    reach, degree = max(high - offset, offset - low), dice.choice((0, 1, 2, limits.MAXIMUM_AMPLIFIER_DEGREE))
    powers, root = range(1, degree + 1), dice.choice((1.0 - 1e-12, 1.0 - 1e-6))
    shares = dice.choice((
        [dice.uniform(-1.0, 1.0) / degree for _ in powers], [math.comb(degree, k) * (-root) ** k for k in powers],
        [limits.LARGEST_AMPLIFIER * _INSIDE if k % 2 == 0 or offset == low else 0.0 for k in powers],
    ))  # fmt: skip
    values = {
        "kappa_omega": end(*limits.FORCE_RANGE), "rho": end(*limits.SATURATION_RANGE) / (high - low),
        "sigma": end(*limits.SIGMA_RANGE), "n": end(*limits.N_RANGE), "displacement_offset": offset,
        "displacement_min": low, "displacement_max": high,
        "kA": [1.0, *(share / reach**k for k, share in enumerate(shares, start=1))],
    }  # fmt: skip
    if dice.random() < 0.7:
        count = dice.choice((1, 2, 3, limits.MAXIMUM_DEGREE + 1))
        return values | {"kE": [size() * limits.FORCE_RANGE[1] / reach**k * _INSIDE for k in range(count)]}
    count = dice.choice((*limits.KNOTS, dice.randint(*limits.KNOTS)))
    places = dice.choice((limits.LEAST_SPACING * (1.0 + 1e-6), 1.0 / (count - 1))) * np.arange(count)
    knots = [low, *(low + places[1:-1] * (high - low)).tolist(), high]
    return values | {"FE_knots": knots, "FE_forces": [size() * limits.FORCE_RANGE[1] for _ in knots]}


def _stated(dice: random.Random, text: str) -> float:
    """A number of an uncertainty or of figures of a fit, at times of absurd size."""
    return abs(dice.choice(FLOATS[:-2])) if dice.random() < 0.06 else float(text)


def trial(dice: random.Random, folder: Path) -> str:
    """One model file given to all of its uses."""
    data = model_file(dice)
    if dice.random() < 0.15:
        data = dice.choice(_seeds())
        content = json.loads(data, parse_float=lambda text: _stated(dice, text))
        data = json.dumps(content | {"parameters": json.loads(data)["parameters"]}).encode()
    (folder / "model.json").write_bytes(data)
    return judge(folder / "model.json", dice)


def judge(path: Path, dice: random.Random | None = None) -> str:
    """A model file given to its uses: the dearest at times, or never for a file of the corpus."""
    least, dice = (0.1, random.Random(1)) if dice is None else (0.0, dice)
    spring = Spring.load(path)
    _check_response(path, spring)
    folder, p = path.parent, spring.parameters
    (folder / "other.json").write_bytes(dice.choice(_seeds()))
    motion = _path(spring, *dice.choice(((1.1, 1.1), (1.0,), (0.5, 1.0))))
    Record(motion, spring.response(motion), np.arange(motion.size) * 1e-3, path="record").save(folder / "record.csv")
    force = np.sort(spring.response([p.displacement_min, p.displacement_max]))
    mass = (force[0] + dice.uniform(0.2, 0.8) * (force[1] - force[0])) / 9.81  # that the spring holds, or any
    refused = []
    for use, share in ABSURD["uses of models"].items():
        if share > least and dice.random() < share:
            words = use.replace("FOLDER", str(folder)).replace("MODEL", str(path)).split()
            if judged([str(mass if mass > 0.0 else 1e3) if word == "MASS" else word for word in words], folder):
                refused.append(words[0])
    return f"accepted, refused by {', '.join(refused) or 'none'}"


def _path(spring: Spring, *shares: float) -> np.ndarray:
    """Two cycles of each share of the range about its middle."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    wave = np.sin(np.linspace(0.0, 4.0 * np.pi, 41))
    path = np.concatenate([p.displacement_min + half + share * half * wave for share in shares])
    return np.clip(path, -limits.LARGEST_DISPLACEMENT, limits.LARGEST_DISPLACEMENT)


def _check_response(path: Path, spring: Spring) -> None:
    motion = np.append(_path(spring, 1.1), np.array([1.0, -1.0, 0.0]) * limits.LARGEST_DISPLACEMENT)
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(motion))
    law, memory = SpringLaw(spring.parameters), stepper.start(float(motion[0]), 0.0)
    for x in motion[1:-3].tolist():  # as the Python-backed FMU does
        memory = stepper.integrate(law, stepper.trial(law, memory, x))
        finite("stepper", [*memory, stepper.force(law, memory), stepper.stiffness(law, memory)])
    again = path.with_name("again.json")
    spring.save(again)
    content = again.read_bytes()
    assert Spring.load(again) == spring
    Spring.load(again).save(again)
    assert again.read_bytes() == content
