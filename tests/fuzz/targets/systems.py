"""Random SYSTEM.toml files: python tests/fuzz/targets/systems.py [--seed SEED] [--count COUNT] [FILE...]

The example systems and cases of every kind, with values exchanged, added and taken away, and the text damaged. A file
that is accepted has to have finite signals and mounts within their springs' ranges.
"""

from __future__ import annotations

import copy
import json
import random
import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import harness
from judged import finite, kind_of
from pieces.models_made import RAW
from pieces.records_pieces import mutated
from strandspring import StrandspringError
from strandspring.ground.strict_toml import parse_toml
from strandspring.vibration.description.system_file import SystemFile, load_system_file

_SYSTEMS = Path(__file__).resolve().parents[3] / "fmu_src/strandspring/examples/systems"
_NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 0.0, 0.5, 3, 1e-9, 1e3, 1e9, -1e9, 1e15, 1e100, 1e154, 1e300, 1.7e308, -1.7e308, 1e-300, 5e-324, 2**63,
    2**70, 10**400, RAW + "nan", RAW + "inf", RAW + "-inf", RAW + "1e400", RAW + "0x10", RAW + "1_000",
    RAW + "9" * 5000,
)  # fmt: skip
_TEXTS: tuple[Any, ...] = (
    "", " ", "12 mm", "20 g", "20 kg", "1 kN", "40 deg", "11 ms", "100 N/mm", "3 oct/min", "0.04 g^2/Hz", "1e400 m",
    "-5 mm", "5 furlong", "12", "nan m", "1 m/s/s", "((((", "1 m^9999999", "1 " + "m" * 5000, "+x", "-z", "six", "base",
    "box", "platform", "corner", "half-sine", "trapezoid", "velocity-step", "corner_shear.json", "recoil_spring.json",
    "none.json", "../none.json", "/dev/zero", "/dev/null", "~", "~nobody", "folder", "a\0b", "a\x1b[31m", "\u202e",
    "\u00e4" * 500,     "base.csv", "pipe", ".", "x" * 3000,
)  # fmt: skip
_OTHERS: tuple[Any, ...] = (
    True, False, [], {}, [[]], [0, 0, 0], [0, 0, 1], [1, 2, 3], ["1 mm", 0, 0], [[0, 0, 0]] * 3, [[0, 0], [1, 1]],
    {"a": 1}, {"x": "ax"}, {"file": "base.csv"}, [[0, 0, 0]] * 700, [{}] * 3, RAW + "2024-01-01", RAW + "12:00:00",
    RAW + "[" * 100 + "]" * 100, RAW + "{a." + "a." * 100 + "a = 1}",
)  # fmt: skip
_CASES: tuple[dict[str, Any], ...] = (
    {"drop": {"velocity": "1 m/s"}},
    {"pulse": "velocity-step", "velocity": "2 m/s", "direction": "z"},
    {"pulse": "trapezoid", "peak": "5 g", "duration": "20 ms", "rise": "2 ms", "direction": [1, 0, 1]},
    {
        "sine": {"frequency": 20, "displacement": "1 mm", "duration": "1 s", "soft_start": "0.1 s"},
        "directions": ["x", "z"],
    },
    {"sweep": {"first": 5, "last": 50, "rate": "10 Hz/s", "table": [[5, "0.1 g"], [50, "1 m/s^2"]]}, "direction": "z"},
    {"random": {"file": "levels.csv", "unit": "g^2/Hz", "duration": "2 s", "seed": 1}, "direction": "x"},
    {"random": {"psd": {"x": [[10, "3 dB/oct"], [40, "0.01 g^2/Hz"]]}, "duration": "2 s", "grms": {"x": "0.45 g"}}},
    {
        "random": {
            "psd": [[10, "0.01 g^2/Hz"], [40, "-3 dB/oct"]],
            "duration": "2 s",
            "sine": [{"frequency": 20, "amplitude": "1 g"}, {"first": 20, "last": 30, "amplitude": "1 g"}],
        },
        "direction": "x",
    },
    {"srs": {"levels": [[20, "6 dB/oct"], [60, "20 g"]], "q": 10, "duration": "0.2 s"}, "direction": "x"},
    {"acceleration": {"level": "2 g", "rise": "0.1 s", "duration": "0.2 s"}, "direction": "x"},
    {"record": {"file": "base.csv", "columns": {"x": "ax", "rz": 3}}},
    {"record": {"file": "base.csv", "time": 1, "columns": {"z": 2}, "units": {"z": "m/s^2"}, "scale": 2.0}},
    {"force": {"file": "base.csv", "column": "F", "place": [0, 0, "10 cm"]}, "direction": "x"},
)
_STEPS = 50


def trial(generator: np.random.Generator, folder: Path) -> Iterator[str]:
    """One file, read."""
    yield "systems"
    dice = random.Random(int(generator.integers(2**62)))
    _write_surroundings(folder)
    content = _sound(dice)
    for _ in range(dice.choice((0, 0, 1, 1, 1, 2))):
        dice.choice(_CHANGES)(dice, content)
    data = "\n".join(f"{json.dumps(key)} = {_toml(value)}" for key, value in content.items()).encode()
    if dice.random() < 0.1:
        data = mutated(generator, data)
    path = folder / "system.toml"
    path.write_bytes(data)
    yield _outcome(path)


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus, read."""
    _write_surroundings(path.parent)
    yield _outcome(path)


def _outcome(path: Path) -> str:
    try:
        file = load_system_file(path)
    except StrandspringError as refusal:
        return f"refused: {kind_of(refusal, path)}"
    _check(file)
    return "accepted"


def _check(file: SystemFile) -> None:
    for _, system in file.candidates:
        for axis in system.axes:
            assert axis.spring.displacement_min <= axis.nominal <= axis.spring.displacement_max
            assert axis.stated_amplitude is not None or file.models[axis.model].parameters == axis.spring
    for case in file.cases:
        finite(case.name, [case.duration, case.settling, *case.velocity])
        assert case.duration > 0.0
        for channel in case.channels:
            finite(case.name, channel.signal.averages(case.duration / _STEPS / 1000, _STEPS))


def _write_surroundings(folder: Path) -> None:
    for path in _SYSTEMS.glob("*.json"):
        shutil.copy(path, folder)
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(50))
    (folder / "base.csv").write_text(f"t [s],ax [g],wz [deg/s],F [kN]\n{rows}\n")
    (folder / "levels.csv").write_text("f [Hz],level\n10,0.01\n20,0.04\n100,0.04\n")
    (folder / "folder").mkdir()


@cache
def _examples() -> list[dict[str, Any]]:
    return [parse_toml(path.read_text(encoding="utf-8")) for path in sorted(_SYSTEMS.glob("*.toml"))]


def _sound(dice: random.Random) -> dict[str, Any]:
    """The content of a file without a fault, but for loads along directions that are held."""
    content = copy.deepcopy(dice.choice(_examples()))
    for number in range(dice.choice((0, 1, 1, 2))):
        content["case"].append({"name": f"case {number}", **copy.deepcopy(dice.choice(_CASES))})
    return content


def _places(value: Any) -> list[tuple[Any, Any]]:
    """Every container with every key of it."""
    found = []
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        found += [(value, key), *_places(value[key])]
    return found


def _other(dice: random.Random, content: dict[str, Any]) -> None:
    container, key = dice.choice(_places(content))
    container[key] = copy.deepcopy(dice.choice(dice.choice((_NUMBERS, _TEXTS, _OTHERS))))


def _scaled(dice: random.Random, content: dict[str, Any]) -> None:
    """A number times an absurd factor."""
    places = [(c, key) for c, key in _places(content) if isinstance(c[key], float)]
    if places:
        container, key = dice.choice(places)
        container[key] *= dice.choice((-1.0, 2.0, 0.5, 1e-3, 1e3, 1e9, 1e-9, 1e100, 1e-100))


def _exchanged(dice: random.Random, content: dict[str, Any]) -> None:
    """A value of the file in another place."""
    places = _places(content)
    (a, first), (b, second) = dice.choice(places), dice.choice(places)
    a[first] = copy.deepcopy(b[second])


def _lost(dice: random.Random, content: dict[str, Any]) -> None:
    container, key = dice.choice(_places(content))
    del container[key]


def _twice(dice: random.Random, content: dict[str, Any]) -> None:
    places = [c for c, _ in _places(content) if isinstance(c, list)]
    if places:
        container = dice.choice(places)
        container += copy.deepcopy(container) * dice.choice((1, 1, 30, 300))


def _unknown(dice: random.Random, content: dict[str, Any]) -> None:
    tables = [content, *(c for c, _ in _places(content) if isinstance(c, dict))]
    keys = ("mas", "", "\u00e4", "direction", "preload", "nominal", "rotate", "body", "x", "a.b")
    dice.choice(tables)[dice.choice(keys)] = dice.choice((1, "x", "12 mm", [], {}))


_CHANGES = (_other, _other, _other, _scaled, _exchanged, _lost, _twice, _unknown)


def _toml(value: Any) -> str:
    if isinstance(value, str) and value.startswith(RAW):
        return value.removeprefix(RAW)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


if __name__ == "__main__":
    harness.main(__file__, trial, 3000, judge)
