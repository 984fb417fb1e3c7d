"""Files of TOML: example systems with cases of every kind, and campaigns, with values exchanged, added and taken away.

A system that is accepted has finite signals, and mounts within their springs' ranges.
"""

from __future__ import annotations

import copy
import json
import random
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.strict_toml import parse_toml
from strandspring.loops.reading import Reading, entries, read_campaign
from strandspring.vibration.description.system_file import load_system_file
from targets.mutator import ABSURD, CORPUS, OTHERS, RAW, changed, finite, mutated
from targets.records import sound


def _as_toml(value: Any) -> str:
    if isinstance(value, str) and value.startswith(RAW):
        return value.removeprefix(RAW)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_as_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_as_toml, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


def _write(dice: random.Random, content: dict[str, Any], path: Path, values: list[Any], changes: int) -> None:
    """Write a file of TOML with some changes, now and then damaged."""
    for _ in range(changes):
        changed(dice, content, [*OTHERS, *values])
    text = "\n".join(f"{json.dumps(key)} = {_as_toml(value)}" for key, value in content.items())
    data = text.encode("utf-8", "surrogatepass")
    path.write_bytes(mutated(dice, data) if dice.random() < 0.15 else data)


@cache
def _examples() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    systems = [parse_toml(path.read_text(encoding="utf-8")) for path in sorted(SYSTEMS.glob("*.toml"))]
    return systems, json.loads((CORPUS / "cases.json").read_text(encoding="utf-8"))


def trial(dice: random.Random, folder: Path) -> str:
    """One file, read."""
    systems, cases = _examples()
    content = copy.deepcopy(dice.choice(systems))
    for number in range(dice.choice((0, 1, 1, 2))):
        content["case"].append({"name": f"case {number}", **copy.deepcopy(dice.choice(cases))})
    _write(dice, content, folder / "system.toml", ABSURD["of systems"], dice.choice((0, 0, 1, 1, 1, 2)))
    return judge(folder / "system.toml")


def judge(path: Path) -> str:
    """A file, read among those that it may name."""
    for model in SYSTEMS.glob("*.json"):
        shutil.copy(model, path.parent)
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(50))
    (path.parent / "base.csv").write_text(f"t [s],ax [g],wz [deg/s],F [kN]\n{rows}\n")
    (path.parent / "levels.csv").write_text("f [Hz],level\n10,0.01\n20,0.04\n100,0.04\n")
    (path.parent / "folder").mkdir()
    file = load_system_file(path)
    for axis in (axis for _, system in file.candidates for axis in system.axes):
        assert axis.spring.displacement_min <= axis.nominal <= axis.spring.displacement_max
        assert axis.stated_amplitude is not None or file.models[axis.model].parameters == axis.spring
    for case in file.cases:
        finite(case.name, [case.duration, case.settling, *case.velocity])
        assert case.duration > 0.0
        for channel in case.channels:
            finite(case.name, channel.signal.averages(case.duration / 50_000, 50))
    return "accepted"


def campaigns(dice: random.Random, folder: Path) -> str:
    """One description of a campaign, or what options select of a record."""
    time = np.linspace(0.0, 10.0, 2001)
    for name, size in (("a.csv", 100.0), ("b.csv", 200.0)):  # [mm], [N]
        motion = np.column_stack([time, 10.0 * np.sin(2.0 * np.pi * time), size * np.sin(2.0 * np.pi * time + 0.1)])
        np.savetxt(folder / name, motion, "%.5f", ",", header="t,x,F", comments="")
    (folder / "folder").mkdir()
    keys = {name: dice.choice(values) for name, values in ABSURD["selections"].items()}
    part = {name: keys[name] for name in dice.sample(sorted(keys), 3)}
    if dice.random() < 0.3:
        changed(dice, part, [*OTHERS, *ABSURD["of campaigns"]])
        try:
            wanted = Reading(**part)
        except TypeError:  # an unknown name, or not a number where arithmetic needs one
            return "accepted, no selection"
        return sound(wanted.read(folder / "a.csv"))
    files = [{"file": dice.choice(("a.csv", "b.csv", "*.csv")), **part} for _ in range(dice.choice((1, 2, 2, 50)))]
    content = {**dict(list(keys.items())[: dice.randrange(3)]), "record": files}
    _write(dice, content, folder / "d.toml", ABSURD["of campaigns"], dice.choice((0, 1, 1, 2)))
    record, *_ = read_campaign(folder / "d.toml")
    assert len(entries([folder / "d.toml"])) >= 1
    return sound(record)
