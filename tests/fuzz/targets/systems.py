"""SYSTEM.toml files: the example systems and cases of every kind, with values exchanged, added and taken away.

A file that is accepted has finite signals, and mounts within their springs' ranges.
"""

from __future__ import annotations

import copy
import json
import random
import shutil
from functools import cache
from pathlib import Path
from typing import Any

from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.strict_toml import parse_toml
from strandspring.vibration.description.system_file import load_system_file
from targets.mutator import ABSURD, CORPUS, OTHERS, changed, finite, toml_file


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
    for _ in range(dice.choice((0, 0, 1, 1, 1, 2))):
        changed(dice, content, [*OTHERS, *ABSURD["of systems"]])
    path = folder / "system.toml"
    path.write_bytes(toml_file(dice, content))
    return judge(path)


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
