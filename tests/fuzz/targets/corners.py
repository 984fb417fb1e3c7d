"""Springs at the corners of what model files may hold: python tests/fuzz/targets/corners.py [--seed S] [--count N]

A model file that is accepted is finite in every output of every command: every one takes it here, what is dear on a
share. A loss factor has no value where the secant stiffness is not positive, and nothing else may lack one.
"""

from __future__ import annotations

import math
import random
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import harness
from judged import finite, kind_of
from pieces.corners_made import corner, stated
from pieces.models_made import sound
from strandspring import Record, Spring, SpringParameters, StrandspringError, build_fmu, export, info, isolate, predict
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.core.parameters import LARGEST_DISPLACEMENT
from strandspring.model.modelfile import ModelFile

_NOT_FINITE = re.compile(r".*(?<![a-z])(?:nan|inf)(?![a-z]).*", re.IGNORECASE)
_SHARES = {"steps": 0.1, "prediction": 0.3, "isolation": 0.01, "exported": 0.02, "fmu": 0.0005}
SPRINGS = 20  # in a trial: the harness takes longer over a trial than a spring does


def trial(generator: np.random.Generator, folder: Path) -> Iterator[str]:
    """Some springs given to all of their uses."""
    yield "corners"
    outcomes = Counter(_outcome(random.Random(int(seed)), folder) for seed in generator.integers(2**62, size=SPRINGS))
    yield f"accepted {outcomes['accepted']} of {SPRINGS}"


def _outcome(dice: random.Random, folder: Path) -> str:
    """What becomes of one spring."""
    content = sound(dice)
    try:
        if dice.random() < 0.75:
            model = ModelFile("corner", SpringParameters(**{"kE": (), **corner(dice)}))
        else:
            content |= {name: stated(dice, content[name]) for name in ("fit", "uncertainty")}
            model = ModelFile.from_content(content)
    except ValueError as refusal:
        kind_of(refusal, folder)
        return "refused"
    spring = Spring.from_model(model)
    for use in _USES:
        name = use.__name__[1:]
        if dice.random() < _SHARES.get(name, 1.0):
            try:
                use(dice, spring, folder)
            except StrandspringError as refusal:
                kind_of(refusal, folder)
            except BaseException as fault:
                fault.add_note(f"in {name} of {spring.parameters}")
                raise
    return "accepted"


def _path(spring: Spring, *shares: float) -> np.ndarray:
    """Two cycles of each share of the range about its middle."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    wave = np.sin(np.linspace(0.0, 4.0 * np.pi, 81))
    path = np.concatenate([p.displacement_min + half + share * half * wave for share in shares])
    return np.clip(path, -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)


def _response(_dice: random.Random, spring: Spring, _folder: Path) -> None:
    far = np.array([1.0, -1.0, 0.0]) * LARGEST_DISPLACEMENT
    path = np.concatenate([_path(spring, 1.1), far])
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(path))


def _steps(_dice: random.Random, spring: Spring, _folder: Path) -> None:
    """As the Python-backed FMU computes them."""
    path = _path(spring, 1.1)
    law, memory = SpringLaw(spring.parameters), stepper.start(float(path[0]), 0.0)
    for x in path[1:].tolist():
        memory = stepper.integrate(law, stepper.trial(law, memory, x))
        finite("stepper", [*memory, stepper.force(law, memory), stepper.stiffness(law, memory)])


def _information(dice: random.Random, spring: Spring, _folder: Path) -> None:
    p = spring.parameters
    _in_words_and_numbers(info(spring))
    largest = LARGEST_DISPLACEMENT - max(abs(p.displacement_min), abs(p.displacement_max))
    _in_words_and_numbers(info(spring, amplitudes=[max(largest, 0.1 * (p.displacement_max - p.displacement_min))]))
    _in_words_and_numbers(info(spring, _record(dice, spring)))


def _prediction(dice: random.Random, spring: Spring, _folder: Path) -> None:
    prediction = predict(spring, _record(dice, spring))
    _check_words(prediction.summary())
    finite("predict", [prediction.rmse, prediction.rnl])
    finite("predict", prediction.to_frame()[["displacement", "force", "predicted"]])
    if prediction.half_widths is not None:
        finite("interval", prediction.half_widths[0])


def _record(dice: random.Random, spring: Spring) -> Record:
    path = _path(spring, *dice.choice(((1.0,), (0.5, 1.0))))
    return Record(path, spring.response(path), np.arange(path.size) * dice.choice((1e-3, 1.0)))


def _isolation(_dice: random.Random, spring: Spring, _folder: Path) -> None:
    p = spring.parameters
    force = float(spring.response([p.displacement_min, 0.5 * (p.displacement_min + p.displacement_max)])[-1])
    isolation = isolate(spring, max(force, 1e-6) / 9.80665, points=6, extrapolate=True)
    _check_words(isolation.summary())
    finite("isolate", isolation.to_frame().select_dtypes(float).drop(columns="phase", errors="ignore"))


def _exported(_dice: random.Random, spring: Spring, folder: Path) -> None:
    spring.save(folder / "corner.json")
    for file in export(folder / "corner.json", folder / "exported", ssv=True, modelica=True):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"(?i)[=(,{\"]\s*-?(?:nan|inf)\b", text), text


def _fmu(dice: random.Random, spring: Spring, folder: Path) -> None:
    """The FMU is run and compared with the model when it is built."""
    build_fmu(spring, folder, **dice.choice(({"platforms": "host"}, {"backend": "python"})))


def _in_words_and_numbers(information: Any) -> None:
    _check_words(information.summary())
    _check_numbers("info", information.as_json())


def _check_words(text: str) -> None:
    found = _NOT_FINITE.findall(text)
    assert not found, found


def _check_numbers(place: str, value: Any) -> None:
    """Raise AssertionError at a number that is not finite, but for a loss factor without a positive stiffness."""
    if isinstance(value, dict):
        undefined = ("loss_factor", "damping_ratio") if value.get("secant_stiffness", 1.0) <= 0.0 else ()
        for key, part in value.items():
            if key not in undefined:
                _check_numbers(f"{place}.{key}", part)
    elif isinstance(value, list | tuple):
        for part in value:
            _check_numbers(f"{place}[]", part)
    elif isinstance(value, float):
        assert math.isfinite(value), f"{place} is {value}"


_USES: tuple[Callable[[random.Random, Spring, Path], None], ...] = (
    _response, _steps, _information, _prediction, _isolation, _exported, _fmu,
)  # fmt: skip

if __name__ == "__main__":
    harness.main(__file__, trial, 1000)
