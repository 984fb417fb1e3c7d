"""Values that were given in another unit than they are read in: each is refused, or gets a caution that says so."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring.api.vibration.simulating import simulate
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.vibration.bodies.loads import LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.description.named_files import FilesOfFolder, HeldFiles, named_models
from strandspring.vibration.description.system_file import load_system_file, read_description, system_of_content
from strandspring.vibration.verdicts.implausible_loads import implausible_loads
from strandspring.vibration.verdicts.implausible_relations import implausible_relations
from strandspring.vibration.verdicts.implausible_sizes import implausible_sizes

Content = dict[str, Any]
CONTENT = read_description(SYSTEMS / "electronics_box.toml")
BODY, CASE = ("body", 0), ("case", 0)
T = np.arange(0.0, 10.0, 0.002)
SHAKE = 20.0 * np.sin(2.0 * np.pi * 12.0 * T)


def change(*path: str | int, to: Any) -> Callable[[Content], None]:
    def changed(content: Content) -> None:
        *parents, last = path
        place: Any = content
        for key in parents:
            place = place[key]
        place[last] = to

    return changed


def case(**keys: Any) -> Callable[[Content], None]:
    return change("case", to=[{"name": "c", **keys} if "record" in keys else {"name": "c", "direction": "z", **keys}])


def record(values: np.ndarray, times: np.ndarray = T, unit: str = "m/s^2", time: str = "s") -> tuple[Any, str]:
    """A case with a record of the base, and the file."""
    rows = "\n".join(f"{t!r},{a!r}" for t, a in zip(times.tolist(), values.tolist(), strict=True))
    name = "rx" if "rad" in unit else "z"
    return case(record={"file": "base.csv", "columns": {name: 2}}), f"time [{time}],a [{unit}]\n{rows}\n"


def random(psd: list[list[Any]]) -> Callable[[Content], None]:
    return case(random={"psd": psd, "duration": "5 s"})


INERTIA, AXIS = ("body", 0, "inertia"), ("mount_type", "corner", "axes", 0)
PLACES = ("mount", 0, "places")
PSD = [[20, "0.01 g^2/Hz"], [200, "0.01 g^2/Hz"]]
TRAPS: list[tuple[str, Any, str]] = [
    # Numbers without a unit.
    ("a peak", change(*CASE, "peak", to=10), r"case\[1\].peak: 10 has no unit; write '10 g' or '10 m/s\^2'"),
    ("a density", random([[20, 0.015], [200, 0.015]]), r"write '0.015 g\^2/Hz' or '0.015 \(m/s\^2\)\^2/Hz'"),
    ("a mass", change(*BODY, "mass", to=20), r"body\[1\].mass: 20 has no unit; write '20 kg' or '20 lb'"),
    ("a place", change("units", to={"inertia": "kg m^2"}), r"place: 100 has no unit; write '100 mm' or '100 m'"),
    ("an inertia", change("units", to={"length": "mm"}), r"0.25 has no unit; write '0.25 kg m\^2' or '0.25 kg mm\^2'"),
    ("a limit", change("limits", "acceleration", to=15), "limits.acceleration: 15 has no unit"),
    ("a duration", change(*CASE, "duration", to=11), "write '11 ms' or '11 s'"),
    ("a stop", change("mount_type", "corner", "axes", 0, "stops", "stiffness", to=400), "'400 N/mm' or '400 N/m'"),
    # Places.
    ("a point in m", change("units", "length", to="m"), "within .*100 m, got .-180.0, 0.0, 0.0. m; check its"),
    ("a point [m]", change(*BODY, "point", 0, "place", to=["50 m", 0, 0]), "circuit board is 50 m from the centre"),
    ("a mount", change("mount", 0, "places", 0, to=["15 m", 0, 0]), "Mount corner 1 is 15.* m from .* are 216.6 mm"),
    ("a centre", change(*BODY, "center", to=[0, 0, "60 m"]), "The mounts of box are 60.12 m from its centre"),
    ("one of mm in m", change(*PLACES, 0, to=[0.15, 0.1, -0.12]), "Mount corner 1 is 0.2166 mm from .* are 216.6 mm"),
    ("a point of mm in m", change(*BODY, "point", 0, "place", to=[0.1, 0, 0.05]), "Point circuit board is 0.1118 mm"),
    ("all in um", change("units", "length", to="um"), "The mounts of box are 0.2166 mm from its centre of gravity"),
    # Masses and moments of inertia.
    ("a mass in g", change(*BODY, "mass", to="45 g"), "0.045 kg with box weigh 0.441 N, .* check the unit of `mass`"),
    ("a mass in t", change(*BODY, "mass", to="20 t"), "2e.04 kg with box weigh 1.96e.05 N"),
    ("kg mm^2 as kg m^2", change(*INERTIA, to={"xx": 2.5e5, "yy": 3e5, "zz": 3.5e5}), "radius of gyration of 132.3 m"),
    ("lb in^2 as kg m^2", change(*INERTIA, to={"xx": 854, "yy": 1025, "zz": 1196}), r"lb in\^2, and of `mass`"),
    ("kg m^2 as kg mm^2", change("units", "inertia", to="kg mm^2"), "radius of gyration of 0.1323 mm"),
    ("a soft spring", change("mount_type", "corner", "axes", 0, "series", to=900_000), "of .* outside 0.1 to"),
    # Records.
    ("gravity", record(SHAKE * np.minimum(T, 1.0) + 9.7), "begins at 0.989. g and has a median of .*measures gravity"),
    ("an offset", record(SHAKE + 0.3), r"offset \(median\) of 0.03.* g, which within 9.998 s would move the base by 1"),
    ("times in ms", record(SHAKE, 1e3 * T), "sampled 0.5 times per second and lasts 9998 s, .* may be ms read as s"),
    ("times in s", record(SHAKE, T, time="us"), r"sampled 5e.08 times per second"),
    ("mV as g", record(1000.0 * SHAKE, unit="g"), "peak of the record is .* outside the usual 0.05 to 2000 g"),
    ("deg/s as rad/s", record(90.0 * np.sin(T), unit="rad/s"), "turns at up to 9.* rad/s; .* may be deg/s"),
    # Levels.
    ("a long pulse", change(*CASE, "duration", to="11 s"), "The pulse lasts 11 s; check the unit of `duration`"),
    ("a pulse in mm/s^2", change(*CASE, "peak", to="18 mm/s^2"), r"The peak is 0.001835 g \(0.018 m/s\^2\)"),
    ("grms", random([[20, "40 g^2/Hz"], [2000, "40 g^2/Hz"]]), "The rms is 281.4 g"),
    ("a tiny grms", random([[20, "1e-9 g^2/Hz"], [200, "1e-9 g^2/Hz"]]), "The rms is 0.00042"),
    ("a low density", random([[0.25, "1 g^2/Hz"], [200, "1 g^2/Hz"]]), "base would move by .* lowest frequency"),
    ("a slow sine", case(sine={"frequency": 0.2, "amplitude": "1 g", "duration": "20 s"}), "would move by .-6.21 m"),
    ("a sweep", case(sweep={"first": 0.1, "last": 9, "rate": "9 oct/min", "amplitude": "1 g"}), "move by .-24.8 m"),
    ("a fall", change("case", 1, "drop", "height", to="50 m"), "The fall ends at 31.32 m/s"),
    ("a held level", case(acceleration={"level": "500 g"}), "constant acceleration is 500 g .* unit of its `level`"),
    ("a speed", change(*CASE, "peak", to="900 g"), "changes the velocity of the base by 61.8. m/s"),
    # Values that contradict each other.
    ("a pull", change(*AXIS, "direction", to="+z"), "weight of box pulls corner 1 compression.* its `direction`"),
    ("two at one place", change(*PLACES, 1, to=[150, 100, -120]), "corner 1 and corner 2 act at one place"),
    ("kN s/m", change(*AXIS, "damping", to="100 kN s/m"), "a damping ratio of 108, .* check the unit of `damping`"),
    ("0.1 s", case(random={"psd": PSD, "duration": "0.1 s"}), "0.71 periods of the lowest .* last 14 times as long"),
    ("a fall up", change("case", 1, "direction", to="+z"), "The fall goes against gravity"),
    ("N as kN", case(force={"pulse": "half-sine", "peak": "2000 kN", "duration": "6 ms"}), "1.02e.04 times the weight"),
]  # fmt: skip


def all_sentences(system: MountedSystem, cases: Sequence[LoadCase]) -> list[str]:
    of_cases = [sentence for case in cases for find in (implausible_loads, implausible_relations)
                for sentence in find(system, case)]  # fmt: skip
    return [*implausible_sizes(system), *implausible_relations(system), *of_cases]


@pytest.mark.parametrize(("damage", "words"), [trap[1:] for trap in TRAPS], ids=[trap[0] for trap in TRAPS])
def test_a_value_in_another_unit_is_seen(tmp_path: Path, damage: Any, words: str) -> None:
    content = copy.deepcopy(CONTENT)
    for name in named_models(CONTENT):
        (tmp_path / name).write_bytes((SYSTEMS / name).read_bytes())
    if isinstance(damage, tuple):
        damage, text = damage
        (tmp_path / "base.csv").write_text(text)
    damage(content)
    try:
        file = system_of_content(content, FilesOfFolder(tmp_path))
    except MountedSystemError as refusal:
        sentences = [str(refusal)]
    else:
        system = file.candidates[0][1]
        sentences = all_sentences(system, file.cases)
    assert any(re.search(words, sentence) for sentence in sentences), sentences
    assert all(sentence.endswith(".") for sentence in sentences)


@pytest.mark.parametrize("path", sorted(SYSTEMS.glob("*.toml")), ids=lambda path: path.stem)
def test_the_examples_are_plausible(path: Path) -> None:
    file = load_system_file(path)
    for _, system in file.candidates:
        assert all_sentences(system, file.cases) == []


def test_places_in_another_unit_blame_neither_masses_nor_inertia() -> None:
    content = copy.deepcopy(CONTENT)
    places = [[coordinate / 1000.0 for coordinate in place] for place in content["mount"][0]["places"]]
    content["mount"][0]["places"] = places
    file = system_of_content(content, FilesOfFolder(SYSTEMS))
    (sentence,) = implausible_sizes(file.candidates[0][1])
    assert "check the unit of `place`" in sentence


def test_a_verdict_shows_the_caution() -> None:
    content = copy.deepcopy(CONTENT)
    content["case"][0] |= {"peak": "0.02 g"}
    content["body"][0]["mass"] = "45 g"
    content["case"][1]["direction"] = "+z"
    file = system_of_content(content, HeldFiles.read(FilesOfFolder(SYSTEMS), named_models(CONTENT), ()))
    lines = " ".join(" ".join(simulate(file, ["shock +z", "drop"], "standard", workers=1).text_lines()).split())
    assert "0.045 kg with box weigh" in lines
    assert "The peak is 0.02 g" in lines
    assert "standard, drop: The fall goes against gravity" in lines
