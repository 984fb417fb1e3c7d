"""Model files, sound, at the ends of their limits and damaged, given to everything that takes a model.

A model that is accepted is the same again after it was saved, and finite in every output of every use. A loss factor
has no value where the secant stiffness is not positive, and nothing else may lack one.
"""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import strandspring
from strandspring import Record, Spring, StrandspringError
from strandspring.core import parameters as limits
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from targets.mutator import FLOATS, finite, kind_of, mutated

_CORPUS = Path(__file__).parents[1] / "corpus/models"
_INSIDE = 1.0 - 1e-12  # what is rounded stays within


@cache
def seeds() -> list[bytes]:
    """Sound model files, of coefficients and tables, with uncertainty and without."""
    return [path.read_bytes() for path in sorted(_CORPUS.glob("sound_*"))]


def model_file(dice: random.Random) -> bytes:
    """A model file, sound or not."""
    data = dice.choice(seeds())
    if dice.random() < 0.4:
        content = json.loads(data)
        for name in ("kE", "FE_knots", "FE_forces"):
            content["parameters"].pop(name, None)
        content["parameters"] |= corner(dice)
        if dice.random() < 0.8:
            content |= {"uncertainty": {}, "fit": {}, "provenance": {}}
        data = json.dumps(content).encode()
    return mutated(dice, data) if dice.random() < 0.5 else data


def corner(dice: random.Random) -> dict[str, Any]:
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
    root = dice.choice((1.0 - 1e-12, 1.0 - 1e-6))
    shares = dice.choice((
        [dice.uniform(-1.0, 1.0) / max(degree, 1) for _ in range(degree)],
        [limits.LARGEST_AMPLIFIER * _INSIDE if k % 2 == 0 or offset == low else 0.0 for k in range(1, degree + 1)],
        [math.comb(degree, k) * (-root) ** k for k in range(1, degree + 1)],  # nearly zero at an end of the range
    ))  # fmt: skip
    values = {
        "kappa_omega": end(*limits.FORCE_RANGE), "rho": end(*limits.SATURATION_RANGE) / (high - low), "sigma": end(*limits.SIGMA_RANGE),
        "n": end(*limits.N_RANGE), "displacement_offset": offset, "displacement_min": low, "displacement_max": high,
        "kA": [1.0, *(share / reach**k for k, share in enumerate(shares, start=1))],
    }  # fmt: skip
    if dice.random() < 0.7:
        count = dice.choice((1, 2, 3, limits.MAXIMUM_DEGREE + 1))
        return values | {"kE": [size() * limits.FORCE_RANGE[1] / reach**k * _INSIDE for k in range(count)]}
    count = dice.choice((*limits.KNOTS, dice.randint(*limits.KNOTS)))
    close = [k * limits.LEAST_SPACING * (1.0 + 1e-6) for k in range(count)]
    places = dice.choice(([k / (count - 1) for k in range(count)], close, sorted(dice.random() for _ in close)))
    knots = [low, *(low + place * (high - low) for place in places[1:-1]), high]
    return values | {"FE_knots": knots, "FE_forces": [size() * limits.FORCE_RANGE[1] for _ in knots]}


def _stated(dice: random.Random, content: Any) -> Any:
    """The same uncertainty or figures of a fit with a few numbers of absurd size, which are no parameters."""
    if isinstance(content, dict):
        return {key: _stated(dice, value) for key, value in content.items()}
    if isinstance(content, list):
        return [_stated(dice, value) for value in content]
    return abs(dice.choice(FLOATS[:-2])) if isinstance(content, float) and dice.random() < 0.06 else content


def trial(dice: random.Random, folder: Path) -> str:
    """One model file given to all of its uses."""
    path = folder / "model.json"
    data = model_file(dice)
    if dice.random() < 0.15:
        content = json.loads(dice.choice(seeds()))
        data = json.dumps(
            {key: value if key == "parameters" else _stated(dice, value) for key, value in content.items()}
        ).encode()
    path.write_bytes(data)
    return judge(path, dice)


def judge(path: Path, dice: random.Random | None = None) -> str:
    """A model file given to its uses: the dearest at times, or never for a file of the corpus."""
    least, dice = (0.1, random.Random(1)) if dice is None else (0.0, dice)
    spring = Spring.load(path)
    refused = []
    for use, share in _USES.items():
        if share > least and dice.random() < share:
            try:
                use(dice, path, spring)
            except StrandspringError as refusal:
                kind_of(refusal, path.parent)
                refused.append(use.__name__[1:])
    return f"accepted, refused by {', '.join(refused) or 'none'}"


# ---- uses ------------------------------------------------------------------------------------------------------------


def _numbers(place: str, value: Any, undefined: tuple[str, ...] = ()) -> None:
    """Raise AssertionError at a number that is not finite, but for a loss factor without a positive stiffness."""
    if isinstance(value, dict):
        if value.get("secant_stiffness", 1.0) <= 0.0:
            undefined = ("loss_factor", "damping_ratio")
        for key, part in value.items():
            if key not in undefined:
                _numbers(f"{place}.{key}", part, undefined)
    elif isinstance(value, list | tuple):
        for part in value:
            _numbers(f"{place}[]", part)
    elif isinstance(value, float):
        assert math.isfinite(value), f"{place} is {value}"


def _words(text: str) -> None:
    found = re.findall(r".*(?<![a-z])(?:nan|inf)(?![a-z]).*", text, re.IGNORECASE)
    assert not found, found


def _path(spring: Spring, *shares: float) -> np.ndarray:
    """Two cycles of each share of the range about its middle."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    wave = np.sin(np.linspace(0.0, 4.0 * np.pi, 41))
    path = np.concatenate([p.displacement_min + half + share * half * wave for share in shares])
    return np.clip(path, -limits.LARGEST_DISPLACEMENT, limits.LARGEST_DISPLACEMENT)


def _record(dice: random.Random, spring: Spring) -> Record:
    path = _path(spring, *dice.choice(((1.1, 1.1), (1.0,), (0.5, 1.0))))
    return Record(path, spring.response(path), np.arange(path.size) * dice.choice((1e-3, 1.0)))


def _mass(dice: random.Random, spring: Spring) -> float:
    """A mass that the spring holds within its range, or anything else."""
    p = spring.parameters
    least, most = np.sort(spring.response([p.displacement_min, p.displacement_max])).tolist()
    mass = float(least + dice.uniform(0.2, 0.8) * (most - least)) / 9.81
    return mass if math.isfinite(mass) and mass > 0.0 and dice.random() < 0.9 else 10.0 ** dice.uniform(-9, 9)


def _response(_dice: random.Random, path: Path, spring: Spring) -> None:
    motion = np.concatenate([_path(spring, 1.1), np.array([1.0, -1.0, 0.0]) * limits.LARGEST_DISPLACEMENT])
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(motion))
    law, memory = SpringLaw(spring.parameters), stepper.start(float(motion[0]), 0.0)
    for x in motion[1:-3].tolist():  # as the Python-backed FMU does
        memory = stepper.integrate(law, stepper.trial(law, memory, x))
        finite("stepper", [*memory, stepper.force(law, memory), stepper.stiffness(law, memory)])
    again = path.with_name("again.json")
    spring.save(again)
    assert Spring.load(again) == spring
    content = again.read_bytes()
    Spring.load(again).save(again)
    assert again.read_bytes() == content


def _info(dice: random.Random, path: Path, spring: Spring) -> None:
    p = spring.parameters
    largest = limits.LARGEST_DISPLACEMENT - max(abs(p.displacement_min), abs(p.displacement_max))
    amplitude = max(largest, 0.1 * (p.displacement_max - p.displacement_min))
    for given in (
        strandspring.info(path),
        strandspring.info(spring, amplitudes=[amplitude]),
        strandspring.info(path, _record(dice, spring)),
    ):
        _words(given.summary())
        _numbers("info", given.as_json())
        given.to_frame()


def _predict(dice: random.Random, path: Path, spring: Spring) -> None:
    prediction = strandspring.predict(path, _record(dice, spring))
    _words(prediction.summary())
    finite("predict", [prediction.rmse, prediction.rnl])
    names = ["displacement", "force", "predicted", *(["lower", "upper"] if prediction.half_widths is not None else [])]
    finite("predict", prediction.to_frame()[names])
    record = strandspring.synthesize(path, samples=32, noise=dice.choice((0.0, 0.01)))
    finite("synthesize", [record.displacement, record.force])


def _export(_dice: random.Random, path: Path, _spring: Spring) -> None:
    for file in strandspring.export(path, path.parent / "exported", ssv=True, modelica=True):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"(?i)[=(,{\"]\s*-?(?:nan|inf)\b", text), text


def _isolate(dice: random.Random, path: Path, spring: Spring) -> None:
    isolation = strandspring.isolate(path, _mass(dice, spring), points=6, extrapolate=dice.random() < 0.5)
    _words(isolation.summary())
    finite("isolate", isolation.to_frame().select_dtypes(float).drop(columns="phase", errors="ignore"))


def _study(dice: random.Random, path: Path, spring: Spring) -> None:
    result = strandspring.study(path, _mass(dice, spring), points=4, draws=dice.choice((0, 2, 2)))
    result.summary()
    frame = result.to_frame()
    for column in ("frequency", "transmissibility"):
        assert not np.isinf(frame[column].to_numpy(dtype=float)).any(), frame


def _compare(dice: random.Random, path: Path, _spring: Spring) -> None:
    other = path.with_name("other.json")
    other.write_bytes(dice.choice(seeds()))
    comparison = strandspring.compare(path, other, align="middle", draws=dice.choice((0, 20)))
    comparison.summary()
    comparison.as_json()


def _build(dice: random.Random, path: Path, _spring: Spring) -> None:
    try:
        fmu = strandspring.build_fmu(
            path, path.parent / "built", **dice.choice(({"platforms": "host"}, {"backend": "python"}))
        )
    except strandspring.BuildError as problem:
        raise AssertionError("The model is accepted, but its FMU fails.") from problem
    assert strandspring.verify(fmu).ok, strandspring.verify(fmu).summary()


# With the share of the accepted models that are given to them.
_USES: dict[Callable[[random.Random, Path, Spring], None], float] = {
    _response: 1.0, _info: 0.6, _predict: 0.6, _export: 0.5, _isolate: 0.2, _study: 0.2, _compare: 0.3, _build: 0.02,
}  # fmt: skip
