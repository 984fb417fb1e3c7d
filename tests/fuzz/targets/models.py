"""Random model files, sound, at the corners of their limits and damaged, given to everything that takes a model.

A model that is accepted is the same again after it was saved, and finite in every output of every use. A loss factor
has no value where the secant stiffness is not positive, and nothing else may lack one. Refusals say what to do.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import random
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from strandspring import (
    BuildError,
    Record,
    Spring,
    SpringParameters,
    StrandspringError,
    build_fmu,
    compare,
    export,
    info,
    isolate,
    predict,
    study,
    synthesize,
    verify,
)
from strandspring.cli.main import main as command_line
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.core.parameters import LARGEST_DISPLACEMENT
from strandspring.model.modelfile import ModelFile
from targets.made import as_json, finite, kind_of, refuse_constant
from targets.made_models import corner, model_file, sound, stated

# Shares of the accepted models that are given to what takes long.
_SHARES = {"build": 0.02, "isolate": 0.3, "study": 0.3, "compare": 0.4, "commands": 0.4}
_OF_CORNERS = {
    "build": 0.0005, "isolate": 0.01, "study": 0.0, "compare": 0.0, "commands": 0.0, "steps": 0.1, "predict": 0.3,
    "synthesize": 0.0, "export": 0.02,
}  # fmt: skip
_CORNERS = 20  # in a trial: the harness takes longer over a trial than a spring does


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """One model file given to all of its uses."""
    yield "models"
    path = folder / "model.json"
    path.write_bytes(model_file(dice))
    yield from _outcome(path, dice, _SHARES)


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus given to all uses but the dearest."""
    yield f"corpus, {path.name}"
    yield from _outcome(path, random.Random(1), {"build": 0.0, "study": 0.5, "commands": 0.5})


def _outcome(path: Path, dice: random.Random, shares: Mapping[str, float]) -> Iterator[str]:
    try:
        spring = Spring.load(path)
    except StrandspringError as refusal:
        yield f"refused: {kind_of(refusal, path)}"
        return
    refused = _used(dice, path, spring, shares)
    yield f"accepted, refused by {', '.join(refused) or 'none'}"


def corners(dice: random.Random, folder: Path) -> Iterator[str]:
    """Some springs at the corners, given to their uses."""
    yield "corners"
    outcomes = Counter(_of_corner(dice, folder / "corner.json") for _ in range(_CORNERS))
    yield f"accepted {outcomes['accepted']} of {_CORNERS}"


def _of_corner(dice: random.Random, path: Path) -> str:
    content = sound(dice)
    try:
        if dice.random() < 0.75:
            model = ModelFile("corner", SpringParameters(**{"kE": (), **corner(dice)}))
        else:
            content |= {name: stated(dice, content[name]) for name in ("fit", "uncertainty")}
            model = ModelFile.from_content(content)
    except ValueError as refusal:
        kind_of(refusal, path)
        return "refused"
    spring = Spring.from_model(model)
    spring.save(path)
    _used(dice, path, spring, _OF_CORNERS)
    return "accepted"


def _used(dice: random.Random, path: Path, spring: Spring, shares: Mapping[str, float]) -> list[str]:
    """The uses that refuse a spring, of those that come up by their shares."""
    refused = []
    for use in [use for use in _USES if dice.random() < shares.get(use.__name__[1:], 1.0)]:
        try:
            use(dice, path, spring)
        except StrandspringError as refusal:
            kind_of(refusal, path)
            refused.append(use.__name__[1:])
        except BaseException as fault:
            fault.add_note(f"in {use.__name__[1:]} of {spring.parameters}")
            raise
    return refused


# ---- what must be finite ---------------------------------------------------------------------------------------------


def _words(text: str) -> None:
    found = re.findall(r".*(?<![a-z])(?:nan|inf)(?![a-z]).*", text, re.IGNORECASE)
    assert not found, found


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


# ---- uses ------------------------------------------------------------------------------------------------------------


def _path(spring: Spring, *shares: float) -> np.ndarray:
    """Two cycles of each share of the range about its middle."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    wave = np.sin(np.linspace(0.0, 4.0 * np.pi, 41))
    path = np.concatenate([p.displacement_min + half + share * half * wave for share in shares])
    return np.clip(path, -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)


def _record(dice: random.Random, spring: Spring) -> Record:
    path = _path(spring, *dice.choice(((1.1, 1.1), (1.0,), (0.5, 1.0))))
    return Record(path, spring.response(path), np.arange(path.size) * dice.choice((1e-3, 1.0)))


def _response(_dice: random.Random, path: Path, spring: Spring) -> None:
    motion = np.concatenate([_path(spring, 1.1), np.array([1.0, -1.0, 0.0]) * LARGEST_DISPLACEMENT])
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(motion))
    again = path.with_name("again.json")
    spring.save(again)
    assert Spring.load(again) == spring
    content = again.read_bytes()
    Spring.load(again).save(again)
    assert again.read_bytes() == content


def _steps(_dice: random.Random, _path_of: Path, spring: Spring) -> None:
    """As the Python-backed FMU computes them."""
    path = _path(spring, 1.1)
    law, memory = SpringLaw(spring.parameters), stepper.start(float(path[0]), 0.0)
    for x in path[1:].tolist():
        memory = stepper.integrate(law, stepper.trial(law, memory, x))
        finite("stepper", [*memory, stepper.force(law, memory), stepper.stiffness(law, memory)])


def _info(dice: random.Random, path: Path, spring: Spring) -> None:
    p = spring.parameters
    largest = LARGEST_DISPLACEMENT - max(abs(p.displacement_min), abs(p.displacement_max))
    amplitude = max(largest, 0.1 * (p.displacement_max - p.displacement_min))
    for given in (info(path), info(spring, amplitudes=[amplitude]), info(path, _record(dice, spring))):
        _words(given.summary())
        _numbers("info", given.as_json())
        given.to_frame()


def _predict(dice: random.Random, path: Path, spring: Spring) -> None:
    prediction = predict(path, _record(dice, spring))
    _words(prediction.summary())
    finite("predict", [prediction.rmse, prediction.rnl])
    frame = prediction.to_frame()
    finite("predict", frame[["displacement", "force", "predicted"]])
    if prediction.half_widths is not None:
        finite("interval", frame[["lower", "upper"]])


def _synthesize(dice: random.Random, path: Path, _spring: Spring) -> None:
    record = synthesize(path, samples=32, noise=dice.choice((0.0, 0.01)))
    finite("synthesize", [record.displacement, record.force])


def _export(_dice: random.Random, path: Path, _spring: Spring) -> None:
    for file in export(path, path.parent / "exported", ssv=True, modelica=True):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"(?i)[=(,{\"]\s*-?(?:nan|inf)\b", text), text


def _mass(dice: random.Random, spring: Spring) -> float:
    """A mass that the spring holds within its range, or anything else."""
    p = spring.parameters
    least, most = np.sort(spring.response([p.displacement_min, p.displacement_max])).tolist()
    mass = float(least + dice.uniform(0.2, 0.8) * (most - least)) / 9.81
    return mass if math.isfinite(mass) and mass > 0.0 and dice.random() < 0.9 else 10.0 ** dice.uniform(-9, 9)


def _isolate(dice: random.Random, path: Path, spring: Spring) -> None:
    isolation = isolate(path, _mass(dice, spring), points=6, extrapolate=dice.random() < 0.5)
    _words(isolation.summary())
    finite("isolate", isolation.to_frame().select_dtypes(float).drop(columns="phase", errors="ignore"))


def _study(dice: random.Random, path: Path, spring: Spring) -> None:
    result = study(path, _mass(dice, spring), points=4, draws=dice.choice((0, 2, 2)))
    result.summary()
    frame = result.to_frame()
    for column in ("frequency", "transmissibility"):
        assert not np.isinf(frame[column].to_numpy(dtype=float)).any(), frame


def _compare(dice: random.Random, path: Path, _spring: Spring) -> None:
    other = path.with_name("other.json")
    own = json.loads(path.read_text(encoding="utf-8-sig"))
    if dice.random() < 0.7 and own.get("uncertainty"):
        own["parameters"]["kappa_omega"] *= 1.1
    else:
        own = sound(dice)
    other.write_text(as_json(own), encoding="utf-8")
    Spring.load(other)
    comparison = compare(path, other, align="middle", draws=dice.choice((0, 20)))
    comparison.summary()
    comparison.as_json()


def _commands(dice: random.Random, path: Path, _spring: Spring) -> None:
    """A command under --json: its output is JSON without NaN, whatever it refuses."""
    command = dice.choice((["info"], ["isolate", "--mass", "5", "--points", "4"], ["compare", str(path)], ["export"]))
    printed, said = io.StringIO(), io.StringIO()
    extra = ["--ssv", "-o", str(path.parent)] if command == ["export"] else ["--json"]
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(said):
        try:
            command_line([*command, str(path), *extra])
            status: Any = 0
        except SystemExit as leaving:
            status = leaving.code
    assert status in (0, None, 1), (command, status, said.getvalue())
    if extra == ["--json"]:
        json.loads(printed.getvalue(), parse_constant=refuse_constant)


def _build(dice: random.Random, path: Path, _spring: Spring) -> None:
    try:
        fmu = build_fmu(path, path.parent / "built", **dice.choice(({"platforms": "host"}, {"backend": "python"})))
    except BuildError as problem:
        raise AssertionError("The model is accepted, but its FMU fails.") from problem
    assert verify(fmu).ok, verify(fmu).summary()


_USES: tuple[Callable[[random.Random, Path, Spring], None], ...] = (
    _response, _steps, _info, _predict, _synthesize, _export, _isolate, _study, _compare, _commands, _build,
)  # fmt: skip
