"""Random SYSTEM.toml files.

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

from strandspring import StrandspringError
from strandspring.ground.strict_toml import parse_toml
from strandspring.vibration.description.system_file import SystemFile, load_system_file
from targets.made import OTHERS, RAW, as_toml, changed, damaged, finite, kind_of

_SYSTEMS = Path(__file__).resolve().parents[3] / "fmu_src/strandspring/examples/systems"
_VALUES: tuple[Any, ...] = (
    *OTHERS, "12 mm", "20 g", "20 kg", "1 kN", "40 deg", "11 ms", "100 N/mm", "3 oct/min", "0.04 g^2/Hz", "1e400 m",
    "-5 mm", "5 furlong", "12", "nan m", "1 m/s/s", "((((", "1 m^9999999", "1 " + "m" * 5000, "+x", "-z", "six", "base",
    "box", "platform", "corner", "half-sine", "trapezoid", "velocity-step", "corner_shear.json", "recoil_spring.json",
    "none.json", "../none.json", "/dev/zero", "/dev/null", "~", "~nobody", "folder", "base.csv", "pipe", ".",
    [1, 2, 3], ["1 mm", 0, 0], [[0, 0, 0]] * 3, [[0, 0], [1, 1]], {"x": "ax"}, {"file": "base.csv"}, [[0, 0, 0]] * 700,
    RAW + "2024-01-01", RAW + "12:00:00", RAW + "{a." + "a." * 100 + "a = 1}", RAW + "nan", RAW + "-inf", RAW + "0x10",
    RAW + "1_000",
)  # fmt: skip
_CASES: tuple[dict[str, Any], ...] = (
    {"drop": {"velocity": "1 m/s"}},
    {"pulse": "velocity-step", "velocity": "2 m/s", "direction": "z"},
    {"pulse": "trapezoid", "peak": "5 g", "duration": "20 ms", "rise": "2 ms", "direction": [1, 0, 1]},
    {"sine": {"frequency": 20, "displacement": "1 mm", "duration": "1 s", "soft_start": "0.1 s"},
     "directions": ["x", "z"]},
    {"sweep": {"first": 5, "last": 50, "rate": "10 Hz/s", "table": [[5, "0.1 g"], [50, "1 m/s^2"]]}, "direction": "z"},
    {"random": {"file": "levels.csv", "unit": "g^2/Hz", "duration": "2 s", "seed": 1}, "direction": "x"},
    {"random": {"psd": {"x": [[10, "3 dB/oct"], [40, "0.01 g^2/Hz"]]}, "duration": "2 s", "grms": {"x": "0.45 g"}}},
    {"random": {"psd": [[10, "0.01 g^2/Hz"], [40, "-3 dB/oct"]], "duration": "2 s", "sine": [
        {"frequency": 20, "amplitude": "1 g"}, {"first": 20, "last": 30, "amplitude": "1 g"}]}, "direction": "x"},
    {"srs": {"levels": [[20, "6 dB/oct"], [60, "20 g"]], "q": 10, "duration": "0.2 s"}, "direction": "x"},
    {"acceleration": {"level": "2 g", "rise": "0.1 s", "duration": "0.2 s"}, "direction": "x"},
    {"record": {"file": "base.csv", "columns": {"x": "ax", "rz": 3}}},
    {"record": {"file": "base.csv", "time": 1, "columns": {"z": 2}, "units": {"z": "m/s^2"}, "scale": 2.0}},
    {"force": {"file": "base.csv", "column": "F", "place": [0, 0, "10 cm"]}, "direction": "x"},
)  # fmt: skip
_STEPS = 50


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """One file, read."""
    yield "systems"
    content = copy.deepcopy(dice.choice(_examples()))
    for number in range(dice.choice((0, 1, 1, 2))):
        content["case"].append({"name": f"case {number}", **copy.deepcopy(dice.choice(_CASES))})
    for _ in range(dice.choice((0, 0, 1, 1, 1, 2))):
        changed(dice, content, _VALUES)
    data = "\n".join(f"{json.dumps(key)} = {as_toml(value)}" for key, value in content.items()).encode()
    path = folder / "system.toml"
    path.write_bytes(damaged(dice, data) if dice.random() < 0.1 else data)
    yield _outcome(path)


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus, read."""
    yield f"corpus, {path.name}"
    yield _outcome(path)


def _outcome(path: Path) -> str:
    _write_surroundings(path.parent)
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
