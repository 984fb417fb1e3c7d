"""Random model files, sound and damaged, given to everything that takes a model.

    python tests/fuzz/targets/models.py [--seed SEED] [--count COUNT] [FILE...]

A model that is accepted has to have a finite response and to be the same again after it was saved; then every function
takes it. See `harness` for what counts as a failure; here so do answers that are not finite and refusals that do not
say what to do.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import harness
from judged import finite, kind_of
from pieces.models_made import model_file, sound, written
from strandspring import (
    BuildError,
    Spring,
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

# Shares of the accepted models that are given to what takes long.
_SHARES = {"build": 0.02, "isolate": 0.3, "study": 0.3, "compare": 0.4, "commands": 0.4}
_SAMPLES = 41


def trial(generator: np.random.Generator, folder: Path) -> Iterator[str]:
    """One model file given to all of its uses."""
    yield "models"
    seed = int(generator.integers(2**62))
    path = folder / "model.json"
    path.write_bytes(model_file(seed))
    yield _outcome(path, random.Random(seed), _SHARES)


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus given to all uses but the dearest."""
    yield _outcome(path, random.Random(1), {"build": 0.0})


def _outcome(path: Path, dice: random.Random, shares: Mapping[str, float]) -> str:
    """What becomes of a model file in those of its uses that come up by their shares."""
    try:
        spring = Spring.load(path)
    except StrandspringError as refusal:
        return f"refused: {kind_of(refusal, path)}"
    refused = []
    uses = [use for use in _USES if dice.random() < shares.get(use.__name__[1:], 1.0)]
    for use in uses:
        try:
            use(dice, path, spring)
        except StrandspringError as refusal:
            kind_of(refusal, path)
            refused.append(use.__name__[1:])
        except BaseException as fault:
            fault.add_note(f"in {use.__name__[1:]}")
            raise
    return f"accepted, refused by {', '.join(refused) or 'none'}"


def _middle_path(spring: Spring) -> np.ndarray:
    """Two cycles over the identified range and somewhat beyond it."""
    p = spring.parameters
    half = 0.5 * (p.displacement_max - p.displacement_min)
    path: np.ndarray = p.displacement_min + half + 1.1 * half * np.sin(np.linspace(0.0, 12.0, _SAMPLES))
    return path


def _response(_dice: random.Random, path: Path, spring: Spring) -> None:
    motion = _middle_path(spring)
    for answer in (spring.response, spring.omega, spring.stiffness, spring.absorbed_energy):
        finite(answer.__name__, answer(motion))
    again = path.with_name("again.json")
    spring.save(again)
    assert Spring.load(again) == spring
    content = again.read_bytes()
    Spring.load(again).save(again)
    assert again.read_bytes() == content


def _info(dice: random.Random, path: Path, spring: Spring) -> None:
    given = info(path) if dice.random() < 0.5 else info(path, _record(spring))
    given.summary()
    frame = given.to_frame()
    if len(frame):
        # A loss factor is not a number where the stiffness is not positive, and so is the frequency of a model's loop.
        finite("info", frame[["amplitude", "low", "high", "secant_stiffness", "energy_per_cycle", "max_force"]])
        finite("info", frame["loss_factor"].dropna())


def _record(spring: Spring) -> Any:
    from strandspring import Record

    motion = np.tile(_middle_path(spring), 2)
    return Record(motion, spring.response(motion), np.arange(motion.size, dtype=np.float64))


def _predict(_dice: random.Random, path: Path, spring: Spring) -> None:
    prediction = predict(path, _record(spring))
    finite("predict", [prediction.rmse, prediction.rnl])
    frame = prediction.to_frame()
    finite("predict", frame[["displacement", "force", "predicted"]])
    if prediction.half_widths is not None:
        finite("interval", frame[["lower", "upper"]])
    prediction.summary()


def _synthesize(dice: random.Random, path: Path, _spring: Spring) -> None:
    record = synthesize(path, samples=32, noise=dice.choice((0.0, 0.01)))
    finite("synthesize", [record.displacement, record.force])


def _export(_dice: random.Random, path: Path, _spring: Spring) -> None:
    for written_file in export(path, path.parent / "exported", ssv=True, modelica=True):
        text = written_file.read_text(encoding="utf-8").lower()
        assert not any(word in text for word in ('"nan"', '"inf"', "= nan", "= inf", ", inf", ", nan")), text


def _mass(dice: random.Random, spring: Spring) -> float:
    """A mass that the spring holds within its range, or anything else."""
    p = spring.parameters
    least, most = np.sort(spring.response([p.displacement_min, p.displacement_max])).tolist()
    mass = float(least + dice.uniform(0.2, 0.8) * (most - least)) / 9.81
    return mass if math.isfinite(mass) and mass > 0.0 and dice.random() < 0.9 else 10.0 ** dice.uniform(-9, 9)


def _isolate(dice: random.Random, path: Path, spring: Spring) -> None:
    isolation = isolate(path, _mass(dice, spring), points=6, extrapolate=dice.random() < 0.5)
    isolation.summary()
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
    if dice.random() < 0.7 and own["uncertainty"] if "uncertainty" in own else False:
        own["parameters"]["kappa_omega"] *= 1.1
    else:
        own = sound(dice)
    other.write_text(written(own), encoding="utf-8")
    Spring.load(other)
    comparison = compare(path, other, align="middle", draws=dice.choice((0, 20)))
    comparison.summary()
    comparison.as_json()


def _commands(dice: random.Random, path: Path, _spring: Spring) -> None:
    """A command under --json: its output is JSON without NaN, whatever it refuses."""
    import contextlib
    import io

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
        json.loads(printed.getvalue(), parse_constant=_refuse)


def _refuse(text: str) -> float:
    raise AssertionError(f"{text} in JSON")


def _build(dice: random.Random, path: Path, _spring: Spring) -> None:
    try:
        fmu = build_fmu(path, path.parent / "built", **dice.choice(({"platforms": "host"}, {"backend": "python"})))
    except BuildError as problem:
        raise AssertionError("The model is accepted, but its FMU fails.") from problem
    assert verify(fmu).ok, verify(fmu).summary()


_USES: tuple[Callable[[random.Random, Path, Spring], None], ...] = (
    _response,
    _info,
    _predict,
    _synthesize,
    _export,
    _isolate,
    _study,
    _compare,
    _commands,
    _build,
)

if __name__ == "__main__":
    harness.main(__file__, trial, 10_000, judge)
