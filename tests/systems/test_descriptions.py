"""SYSTEM.toml: what it says is what is built; mistakes are refused in one sentence that names file and field.

Values in another unit than they are read in are refused or get a caution.
"""

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.signal import welch

import schemas
from example_springs import write_models
from springs import EXAMPLES
from strandspring.docs.site import page_text
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.gravity import STANDARD_GRAVITY as G
from strandspring.ground.strict_toml import parse_toml
from strandspring.model.modelfile import ModelFile, load_model, save_model
from strandspring.vibration.bodies.loads import ChannelKind
from strandspring.vibration.bodies.parts import BASE, MotionKind
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.description import quantity_text as quantities
from strandspring.vibration.description.named_files import FilesOfFolder, named_models
from strandspring.vibration.description.quantity_text import QuantityError, in_si, measured, stated_units, unit_in_si
from strandspring.vibration.description.system_file import (
    SystemFile,
    load_system_file,
    read_description,
    system_of_content,
    system_schema,
)
from strandspring.vibration.verdicts.implausible_loads import implausible_loads
from strandspring.vibration.verdicts.implausible_relations import implausible_relations
from strandspring.vibration.verdicts.implausible_sizes import implausible_sizes
from strandspring.vibration.verdicts.verdicts import FigureKind

Content = dict[str, Any]
SI = {
    "length": "m", "mass": "kg", "time": "s", "angle": "rad", "velocity": "m/s", "acceleration": "m/s^2",
    "density": "(m/s^2)^2/Hz", "stiffness": "N/m", "inertia": "kg m^2", "force": "N",
}  # fmt: skip
HARDENING = EXAMPLES["hardening"]  # 0 N at 50 mm, within 30 and 70 mm
SCHEMA = system_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)
EXAMPLE = read_description(SYSTEMS / "electronics_box.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Models and records that the files name."""
    path = tmp_path_factory.mktemp("systems")
    for name in ("hardening", "wire_rope"):
        save_model(path / f"{name}.json", ModelFile(name, EXAMPLES[name]))
    (path / "damaged.json").write_text("{")
    pressed = {**HARDENING.as_dict(), "kE": (900.0, *HARDENING.kE[1:2])}
    save_model(path / "pressed.json", ModelFile("pressed", type(HARDENING)(**pressed)))
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(200))
    (path / "base.csv").write_text(f"t [s],ax [g],wz [deg/s],F [kN]\n{rows}\n")
    (path / "levels.csv").write_text("f [Hz],level\n10,0.01\n20,0.04\n100,0.04\n")
    return path


def box() -> Content:
    """A box on four mounts."""
    return {
        "format": "strandspring-system", "format_version": 1, "name": "box", "units": SI,
        "body": [
            {"name": "box", "mass": "20 kg", "inertia": {"xx": 0.25, "yy": 0.30, "zz": "0.35 kg m^2"},
             "point": [{"name": "board", "place": [0.1, 0, "50 mm"]}]}
        ],
        "mount_type": {
            "corner": {
                "axes": [
                    {"direction": "-z", "model": "hardening.json", "preload": "50 N", "damping": "10 N s/m",
                     "stops": {"low": "31 mm", "high": "69 mm", "stiffness": "100 N/mm"}},
                    {"direction": "+x", "model": "wire_rope.json", "nominal": "50 mm", "parallel": 2, "series": 3},
                    {"direction": [0, 2, 0], "model": "wire_rope.json", "nominal": "50 mm"},
                ]
            },
            "foot": {"axes": [{"direction": d, "model": "hardening.json"} for d in ("x", "y", "z")]},
        },
        "mount": [
            {"name": "corner", "type": "corner", "places": [[x, y, -0.12] for x in (-0.15, 0.15) for y in (-0.1, 0.1)]}
        ],
        "limits": {"acceleration": "15 g", "sway": {"board": "25 mm"}, "tilt": "5 deg", "stroke": 0.9},
        "case": [
            {"name": "shock", "pulse": "half-sine", "peak": "40 g", "duration": "11 ms", "directions": ["+x", "-z"]}
        ],
    }  # fmt: skip


def toml(value: Any) -> str:
    """A value as TOML writes it inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)


def loaded(content: Content, folder: Path) -> SystemFile:
    path = folder / "system.toml"
    path.write_text("\n".join(f"{json.dumps(key)} = {toml(value)}" for key, value in content.items()), encoding="utf-8")
    return load_system_file(path)


def case(folder: Path, **keys: Any) -> Any:
    """The load case that a table describes."""
    (found,) = loaded(box() | {"case": [{"name": "case", **keys}]}, folder).cases
    return found


def signal(folder: Path, **keys: Any) -> Any:
    return case(folder, direction="z", **keys).channels[0].signal


def test_what_the_file_says_is_built(folder: Path) -> None:
    content = box()
    content["mount"][0]["rotate"] = {"about": "+z", "angle": "90 deg"}
    content["run"] = {"step": "0.1 ms", "rest_omega": -0.5, "draws": 20, "seed": 7}
    file = loaded(content, folder)
    ((name, system),) = file.candidates
    assert (file.name, name, sorted(file.models)) == ("box", "as described", ["hardening.json", "wire_rope.json"])
    (body,) = system.bodies
    assert (body.mass, body.motion, np.diag(body.inertia).tolist()) == (20.0, MotionKind.SIX, [0.25, 0.3, 0.35])
    assert [mount.name for mount in system.mounts] == [f"corner {k}" for k in range(1, 5)]
    assert [list(mount.place) for mount in system.mounts] == content["mount"][0]["places"]
    assert all(mount.support == BASE and mount.body == 0 for mount in system.mounts)
    compression, x, y = system.mounts[0].axes
    assert (compression.model, compression.spring) == ("hardening.json", file.models["hardening.json"].parameters)
    elastic = np.polynomial.Polynomial(HARDENING.kE)
    assert elastic(compression.nominal - HARDENING.displacement_offset) == pytest.approx(50.0, rel=1e-12)
    stops = compression.stops
    assert stops is not None
    assert (stops.low, stops.high, stops.stiffness) == (0.031, 0.069, 1e5)
    assert (x.nominal, x.parallel, x.series, compression.damping) == (0.05, 2, 3, 10.0)
    for axis, direction in ((compression, (0, 0, -1)), (x, (0, 1, 0)), (y, (-1, 0, 0))):
        np.testing.assert_allclose(axis.direction, direction, atol=1e-15)
    assert [(point.name, point.place) for point in system.points] == [("board", (0.1, 0.0, 0.05))]
    limits, options = file.limits, file.options
    assert limits.limit_of(FigureKind.ACCELERATION, "board") == 15 * G
    assert limits.limit_of(FigureKind.SWAY, "board") == 0.025
    assert (limits.of_all[FigureKind.TILT], limits.of_all[FigureKind.STROKE]) == (math.radians(5), 0.9)
    assert (options.step, options.rest_omega, options.draws, options.seed) == (1e-4, -0.5, 20, 7)
    assert [each.name for each in file.cases] == ["shock +x", "shock -z"]
    assert file.cases[1].channels[0].direction == (0.0, 0.0, -1.0)
    assert file.cases[0].duration > 0.011


def test_candidates_bodies_on_bodies_and_preloads(folder: Path) -> None:
    content = box()
    content["candidate"] = [{"name": "as it is"}, {"name": "feet", "types": {"corner": "foot"}}]
    content["mount"][0]["rotate"] = [{"about": "z", "angle": f"{90 * k} deg"} for k in range(4)]
    del content["mount_type"]["corner"]["axes"][0]["preload"]
    (first, old), (second, new) = loaded(content, folder).candidates
    assert (first, second) == ("as it is", "feet")
    assert {axis.model for axis in old.axes} == {"hardening.json", "wire_rope.json"}
    assert {axis.model for axis in new.axes} == {"hardening.json"}
    assert old.mounts[0].axes[0].nominal == pytest.approx(0.05, abs=1e-15)  # where the elastic force is 0
    directions = [mount.axes[1].direction for mount in old.mounts]
    np.testing.assert_allclose(directions, [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], atol=1e-15)

    content = box()
    content["body"][0] |= {"motion": {"plane": [0, 1, 0]}, "inertia": "0.3 kg m^2"}
    content["body"].append({"name": "top", "mass": 2, "center": [0, 0, 0.3], "motion": {"axis": [0, 0, 5]}})
    content["mount"][0]["body"] = "box"
    content["mount"].append({"name": "upper", "type": "foot", "body": "top", "on": "box", "place": [0, 0, 0.2]})
    system = loaded(content, folder).candidates[0][1]
    assert [body.motion for body in system.bodies] == [MotionKind.PLANE, MotionKind.AXIS]
    assert (system.mounts[-1].body, system.mounts[-1].support, system.mounts[-1].name) == (1, 0, "upper")
    assert [(point.name, point.place) for point in system.points[1:]] == [("top", (0.0, 0.0, 0.3))]


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        ("half-sine", 0.04 / math.pi), ("versed-sine", 0.01), ("terminal-sawtooth", 0.01), ("initial-sawtooth", 0.01),
        ("rectangle", 0.02), ("triangle", 0.01), ("trapezoid", 0.018),
    ],
)  # fmt: skip
def test_a_pulse_has_its_peak_and_area(folder: Path, shape: str, area: float) -> None:
    """Of 2 g and 10 ms, in g*s."""
    found = case(folder, pulse=shape, peak="2 g", duration="10 ms", direction="y", simulate="20 ms")
    (channel,) = found.channels
    averages = channel.signal.averages(1e-5, 2000) / G
    assert (found.kind, found.duration, channel.kind) == ("pulse", 0.02, ChannelKind.BASE_ACCELERATION)
    assert averages.max() == pytest.approx(2.0, rel=2e-3)  # averages over 1/1000 of the duration
    assert averages.sum() * 1e-5 == pytest.approx(area, rel=1e-9)


FLAT = [[20, "0.01 g^2/Hz"], [200, "0.01 g^2/Hz"]]
# As printed: +3 dB/oct from 20 to 80 Hz, 0.04 g^2/Hz up to 350 Hz, -3 dB/oct up to 2000 Hz.
PRINTED = [["20 Hz", "+3 dB/oct"], ["80 Hz", "0.04 g^2/Hz"], ["350 Hz", "0.04 g^2/Hz"], [2000, "-3 dB/oct"]]


def test_steps_drops_and_sines(folder: Path) -> None:
    step = signal(folder, pulse="velocity-step", velocity="3 m/s")
    np.testing.assert_allclose(step.averages(0.01, 3), [300.0, 0.0, 0.0])
    drop = case(folder, drop={"height": "0.5 m"})
    assert drop.velocity == pytest.approx((0.0, 0.0, -math.sqrt(G)))
    assert drop.weightless
    assert case(folder, drop={"velocity": 2}, direction="-x").velocity == (-2.0, 0.0, 0.0)
    dwell = case(folder, sine={"frequency": 20, "displacement": "1 mm", "duration": 2}, direction="z")
    assert dwell.channels[0].signal.amplitude == pytest.approx(1e-3 * (40 * math.pi) ** 2)
    assert dwell.settling == 1.0
    sweep = {"first": "5 Hz", "last": "40 Hz", "rate": "3 oct/min"}
    up = signal(folder, sweep=sweep | {"amplitude": "1 g", "displacement": "2 mm"})
    assert up.duration == pytest.approx(60.0)
    assert up.amplitude.at([5.0, 40.0]) == pytest.approx([2e-3 * (10 * math.pi) ** 2, G])
    constant = signal(folder, sweep=sweep | {"displacement": "2 mm"}).amplitude
    assert constant.at(20.0) == pytest.approx(2e-3 * (40 * math.pi) ** 2)
    tabled = signal(folder, sweep=sweep | {"rate": "5 Hz/s", "table": [[5, "+6 dB/oct"], ["10 Hz", "8 g"], [40, 8]]})
    assert tabled.duration == pytest.approx(7.0)
    # 6 dB are a factor 10^0.3 in amplitude.
    assert tabled.amplitude.at(5.0) / G == pytest.approx(8.0 / 10.0**0.3, rel=1e-12)
    held = case(folder, acceleration={"level": "2 g"}, direction="x")
    assert held.channels[0].signal.averages(1e-3, round(1e3 * held.duration)).max() == pytest.approx(2.0 * G)
    assert "constant acceleration of 2 g, reached within" in held.text


def test_random_vibration_and_shocks_by_their_spectrum(folder: Path) -> None:
    def level(f: float) -> float:
        # 3 dB are a factor 10^0.3 in power.
        return 0.04 * 10.0 ** (0.3 * math.log2(f / 80.0) if f < 80.0 else -0.3 * math.log2(max(f / 350.0, 1.0)))

    printed = case(folder, random={"psd": PRINTED, "duration": "5 s", "grms": "6.06 g"}, direction="z")
    frequencies = [20.0, 40.0, 2000.0]
    density = printed.channels[0].signal.density.at(frequencies) / G**2
    assert density == pytest.approx([level(f) for f in frequencies], rel=1e-12)
    power = sum(quad(level, low, high)[0] for low, high in ((20.0, 80.0), (80.0, 350.0), (350.0, 2000.0)))
    assert f"{math.sqrt(power):.4g} g (6.06 g stated) rms" in printed.text
    psd = [["10 Hz", "0.01 g^2/Hz"], ["20 Hz", "0.04 g^2/Hz"], [100, "0.04 g^2/Hz"]]
    written, read = (
        case(folder, random={**given, "duration": "5 s", "seed": 3}, direction="z")
        for given in ({"psd": psd}, {"file": "levels.csv", "unit": "g^2/Hz"})
    )
    assert written.channels[0].signal.density.points == pytest.approx(np.array(read.channels[0].signal.density.points))
    assert written.settling == 0.5
    # Axes at once are uncorrelated and have their own density: 180 Hz for 60 s are some 2e4 independent values.
    psds = {"x": FLAT, "y": [[20, "0.04 g^2/Hz"], [200, "0.04 g^2/Hz"]], "z": PRINTED}
    three = case(folder, random={"psd": psds, "duration": "60 s", "grms": {"z": "6.06 g"}})
    assert [channel.direction for channel in three.channels] == [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    assert "x 1.342 g and y 2.683 g and z 6.06" in three.text
    values = np.array([channel.signal.averages(2e-4, 300_000) for channel in three.channels])
    assert np.abs(np.corrcoef(values) - np.eye(3)).max() < 0.04
    frequency, density = welch(values[1] / G, 5e3, nperseg=2500)
    inside = density[(frequency > 30.0) & (frequency < 190.0)]
    assert inside.mean() == pytest.approx(0.04, rel=0.02)  # 80 lines of 240 averages: 0.7 %
    # Sines stand on random vibration: powers add. Scatter of the random part: 1/(2*sqrt(180*20)) of it.
    tones = [{"frequency": 60, "amplitude": "3 g"}, {"first": 100, "last": 150, "amplitude": "2 g"}]
    mixed = case(folder, random={"psd": FLAT, "sine": tones, "duration": "20 s"}, direction="z")
    assert "1.342 g rms from 20 to 200 Hz for 20 s, with sines of 3 g at 60 Hz, 2 g from 100 to 150 Hz" in mixed.text
    total = mixed.averages(2e-4, 100_000).sum(axis=0) / G
    assert np.mean(total**2) == pytest.approx(1.8 + 0.5 * 9.0 + 0.5 * 4.0, rel=0.02)
    srs: Content = {"levels": [[10, "+6 dB/oct"], [40, "20 g"], [500, "20 g"]], "duration": "300 ms"}
    shocks = [case(folder, srs=srs | given, direction="z") for given in ({"q": 25}, {"damping": 0.02})]
    assert shocks[0].kind == "srs"
    assert "from 10 to 500 Hz at Q = 25, synthesized by 69 wavelets in 0.3 s with a peak of" in shocks[0].text
    assert shocks[0].channels[0].signal is shocks[1].channels[0].signal


def test_record_of_the_base_and_forces(folder: Path) -> None:
    record = case(folder, record={"file": "base.csv", "columns": {"x": "ax", "rz": 3}, "scale": 2.0})
    acceleration, rotation = record.channels
    assert (acceleration.kind, rotation.kind) == (ChannelKind.BASE_ACCELERATION, ChannelKind.BASE_ANGULAR_VELOCITY)
    assert rotation.direction == (0.0, 0.0, 1.0)
    assert acceleration.signal.at(0.003) == pytest.approx(2 * 3 * G)
    assert rotation.signal.at(0.004) == pytest.approx(2 * math.radians(4))
    renamed = case(folder, record={"file": "base.csv", "columns": {"x": 4}, "units": {"x": "m/s^2"}})
    assert renamed.channels[0].signal.at(0.002) == pytest.approx(2.0)
    (channel,) = case(folder, force={"file": "base.csv", "column": "F", "place": [0, 0, 1]}, direction="-x").channels
    assert (channel.kind, channel.direction, channel.place) == (ChannelKind.FORCE, (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert channel.signal.at(0.002) == pytest.approx(2000.0)
    assert signal(folder, force={"pulse": "half-sine", "peak": "2 kN", "duration": "5 ms"}).peak == 2000.0
    assert signal(folder, force={"table": [[0, 0], ["1 ms", "1 kN"], [0.002, 0]]}).peak == 1000.0


# ---- refusals -------------------------------------------------------------------------------------

LINEAR = {"stiffness": "45 N/mm", "loss_factor": 0.3, "amplitude": "5 mm", "stroke": "20 mm"}
POINTS = [["2 mm", "90 N"], ["5 mm", "200 N"], ["10 mm", "310 N"], ["15 mm", "500 N"], ["20 mm", "1000 N"]]
CURVE = {"curve": POINTS, "symmetric": True, "loss_factor": 0.3, "amplitude": "5 mm", "stroke": "20 mm"}
BASES: dict[str, Callable[[], Content]] = {
    "box": box,
    "example": lambda: copy.deepcopy(EXAMPLE),
    "linear": lambda: copy.deepcopy(LINEAR),
    "curve": lambda: copy.deepcopy(CURVE),
}


def refusals() -> list[tuple[str, str, str]]:
    """The rows of refusals.txt: the description, its changes, and what is said."""
    rows, base = [], ""
    for line in (Path(__file__).parent / "refusals.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            base = line[1:-1]
        elif line and not line.startswith("#"):
            changes, _, words = line.partition(" => ")
            rows.append((base, changes, words))
    return rows


def changed(base: str, changes: str) -> Content:
    """A description with its changes."""
    content = BASES[base]()
    for one in changes.split("; "):
        path, _, text = one.partition(": ")
        *parents, last = (int(key) if key.isdigit() else key for key in path.split("."))
        place, value = content, json.loads(text)
        for key in parents:
            place = place[key]
        if path == "case" and isinstance(value, dict):
            value = [{"name": "c", **value}]
        if value is None:
            del place[last]
        elif isinstance(place, list) and last == len(place):
            place.append(value)
        else:
            place[last] = value
    if base in ("linear", "curve"):
        axis = {"direction": "-z", "catalogue": content}
        content = box()
        content["mount_type"]["corner"]["axes"][0] = axis
    return content


def is_said(words: str, text: str) -> bool:
    return re.search(".*".join(map(re.escape, words.split("..."))), text) is not None


@pytest.mark.parametrize(("base", "changes", "words"), refusals())
def test_mistakes_are_refused_in_one_sentence(folder: Path, base: str, changes: str, words: str) -> None:
    content = changed(base, changes)
    if base == "example":
        try:
            sentences = all_sentences(system_of_content(content, FilesOfFolder(SYSTEMS)))
        except MountedSystemError as refusal:
            sentences = [str(refusal)]
    else:
        with pytest.raises(MountedSystemError) as caught:
            loaded(content, folder)
        sentences = [str(caught.value)]
        field = "" if base == "box" else "mount_type.corner.axes[1].catalogue"
        assert is_said(f"{folder / 'system.toml'}, {field}" if field else str(folder / "system.toml"), sentences[0])
    assert any(is_said(words, sentence) for sentence in sentences), sentences
    for text in sentences:
        assert text.endswith(".")
        assert "\n" not in text
        assert not any(word in text for word in ("pydantic", "Input should", "[type=", "=table", "=quantity"))


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("a = [", "is not valid TOML"),
        ("a = " + "9" * 5000, "an integer has too many digits"),
        ("a = " + "[" * 4000, "nested"),
        ("a = " + "[" * 100 + "]" * 100, "nested more than 60 levels deep"),
        (".".join(["a"] * 100_000) + " = 1", "dotted keys have more than 1000 parts"),
        (".".join(['"a"'] * 100_000) + " = 1", "dotted keys have more than 1000 parts"),
        ("#" * 1_000_001, "may have at most 1000000"),
    ],
)
def test_what_is_no_toml_or_too_much(tmp_path: Path, text: str, refusal: str) -> None:
    path = tmp_path / "system.toml"
    path.write_text(text)
    with pytest.raises(MountedSystemError) as caught:
        load_system_file(path)
    assert refusal in str(caught.value)


# ---- values in another unit -----------------------------------------------------------------------

T = np.arange(0.0, 10.0, 0.002)
SHAKE = 20.0 * np.sin(2.0 * np.pi * 12.0 * T)


def all_sentences(file: SystemFile) -> list[str]:
    sentences = []
    for _, system in file.candidates[:1]:
        sentences += [*implausible_sizes(system), *implausible_relations(system)]
        for one in file.cases:
            sentences += [*implausible_loads(system, one), *implausible_relations(system, one)]
    return sentences


@pytest.mark.parametrize(
    ("values", "times", "unit", "time", "words"),
    [
        (
            SHAKE * np.minimum(T, 1.0) + 9.7,
            T,
            "m/s^2",
            "s",
            "begins at 0.989... g and has a median of ...measures gravity",
        ),
        (SHAKE + 0.3, T, "m/s^2", "s", "offset (median) of 0.03... g, which within 9.998 s would move the base by 1"),
        (SHAKE, 1e3 * T, "m/s^2", "s", "sampled 0.5 times per second and lasts 9998 s, ... may be ms read as s"),
        (SHAKE, T, "m/s^2", "us", "sampled 5e+08 times per second"),
        (1000.0 * SHAKE, T, "g", "s", "peak of the record is ... outside the usual 0.05 to 2000 g"),
        (90.0 * np.sin(T), T, "rad/s", "s", "turns at up to 9... rad/s; ... may be deg/s"),
    ],
)
def test_a_record_in_another_unit_is_seen(
    tmp_path: Path, values: np.ndarray, times: np.ndarray, unit: str, time: str, words: str
) -> None:
    for name in named_models(EXAMPLE):
        (tmp_path / name).write_bytes((SYSTEMS / name).read_bytes())
    rows = "\n".join(f"{t!r},{a!r}" for t, a in zip(times.tolist(), values.tolist(), strict=True))
    (tmp_path / "base.csv").write_text(f"time [{time}],a [{unit}]\n{rows}\n")
    record = {"file": "base.csv", "columns": {"rx" if "rad" in unit else "z": 2}}
    content = copy.deepcopy(EXAMPLE) | {"case": [{"name": "c", "record": record}]}
    try:
        sentences = all_sentences(system_of_content(content, FilesOfFolder(tmp_path)))
    except MountedSystemError as refusal:
        sentences = [str(refusal)]
    assert any(is_said(words, sentence) for sentence in sentences), sentences


def test_places_in_another_unit_blame_neither_masses_nor_inertia() -> None:
    content = copy.deepcopy(EXAMPLE)
    places = [[coordinate / 1000.0 for coordinate in place] for place in content["mount"][0]["places"]]
    content["mount"][0]["places"] = places
    (sentence,) = implausible_sizes(system_of_content(content, FilesOfFolder(SYSTEMS)).candidates[0][1])
    assert "check the unit of `place`" in sentence


POUND, INCH = 0.45359237, 0.0254
TEXTS: list[tuple[str, str, float]] = [
    ("LENGTH", "12 mm", 0.012), ("LENGTH", "-5mm", -0.005), ("LENGTH", "−5 mm", -0.005), ("LENGTH", '2"', 2 * INCH),
    ("LENGTH", "1e-3 m", 1e-3), ("MASS", "20 g", 0.02), ("MASS", "20 lb", 20 * POUND), ("MASS", "2 t", 2000.0),
    ("ACCELERATION", "15 g", 15 * G), ("ACCELERATION", "15 G", 15 * G), ("ACCELERATION", "9.8 m/s²", 9.8),
    ("ACCELERATION", "9.8 m s^-2", 9.8), ("ANGLE", "40 deg", math.radians(40)), ("ANGLE", "40°", math.radians(40)),
    ("FORCE", "1.5 kN", 1500.0), ("FORCE", "20 lb", 20 * POUND * G), ("TIME", "11 ms", 0.011),
    ("ACCELERATION_DENSITY", "0.04 g^2/Hz", 0.04 * G**2), ("ACCELERATION_DENSITY", "0.04 g²/Hz", 0.04 * G**2),
    ("ACCELERATION_DENSITY", "2 (m/s^2)^2/Hz", 2.0), ("ACCELERATION_DENSITY", "2 m^2/s^3", 2.0),
    ("STIFFNESS", "100 N/mm", 1e5), ("STIFFNESS", "10 lb/in", 10 * POUND * G / INCH), ("DAMPING", "50 N s/m", 50.0),
    ("DAMPING", "50 N/(m/s)", 50.0), ("INERTIA", "5 kg m^2", 5.0), ("INERTIA", "5 kg·m²", 5.0),
    ("INERTIA", "3 lb in^2", 3 * POUND * INCH**2), ("FREQUENCY", "20 Hz", 20.0), ("FREQUENCY", "60 1/min", 1.0),
    ("FREQUENCY", "30 rpm", 0.5), ("ANGULAR_VELOCITY", "30 rpm", math.pi), ("ANGULAR_VELOCITY", "180 deg/s", math.pi),
    ("VELOCITY", "3 m/s", 3.0), ("OCTAVE_RATE", "3 oct/min", 0.05), ("FREQUENCY_RATE", "10 Hz/s", 10.0),
]  # fmt: skip


@pytest.mark.parametrize(("quantity", "text", "expected"), TEXTS)
def test_a_number_with_a_unit_is_what_people_mean(quantity: str, text: str, expected: float) -> None:
    assert in_si(text, getattr(quantities, quantity)) == pytest.approx(expected, rel=1e-14)


def test_a_number_without_a_unit_is_refused_unless_its_unit_is_stated() -> None:
    rates = quantities.OCTAVE_RATE, quantities.FREQUENCY_RATE
    assert measured("6 oct/min", *rates) == (pytest.approx(0.1), rates[0])
    assert measured("6 Hz/s", *rates) == (6.0, rates[1])
    assert (in_si(3, quantities.FREQUENCY), in_si(0, quantities.LENGTH)) == (3.0, 0.0)
    with stated_units({"acceleration": G}):
        assert in_si(10, quantities.ACCELERATION) == 10 * G
        assert in_si("10 m/s^2", quantities.ACCELERATION) == 10.0
        with pytest.raises(QuantityError, match="10 has no unit; write '10 mm' or '10 m', or state the unit once, as"):
            in_si(10, quantities.LENGTH)
    for quantity in quantities.QUANTITIES:
        if quantity is not quantities.QUANTITIES[-1]:
            assert in_si(f"1 {quantity.unit}", quantity) == 1.0
            assert in_si(quantity.example, quantity) > 0.0
        if quantity.key:
            with pytest.raises(QuantityError, match=r"write '3.5 (.*)' or '3.5 (.*)'") as caught:
                in_si(3.5, quantity)
            units = re.findall(r"'3.5 (.*?)'", str(caught.value))
            assert len({unit_in_si(unit, quantity) for unit in units}) == 2


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("12 N", "must be a length such as '12 mm', got '12 N', which is a force"), ("20 kg", "which is a mass"),
        ("12", "got '12'; write the unit"), ("12 mN m", "which is something else"),
        ("12 mn", "mN (millinewton) or MN (meganewton)"), ("1,5 mm", "the decimal mark is a point"),
        ("12 furlong", "'furlong' is not a known unit"), ("1 m/s/s", "into parentheses"),
        ("1 m/s m", "into parentheses"), ("1e400 m", "not finite"), ("1e308 km", "not finite"), ("1 m^9", "not one"),
        ("", "got ''"), ("abc", "got 'abc'"), (True, "got true or false"), ([1], "got a list"),
        (10**400, "not finite"), (math.nan, "not finite"),
    ],
)  # fmt: skip
def test_what_is_no_length_is_refused(text: object, refusal: str) -> None:
    with pytest.raises(QuantityError) as caught:
        in_si(text, quantities.LENGTH)
    assert refusal in str(caught.value)


@settings(max_examples=200)
@given(st.text(st.sampled_from("0123456789.eE+- mkNgsHzdeglbin/^()*·²\"'°"), max_size=80))
def test_any_text_is_read_or_refused(text: str) -> None:
    for quantity in (quantities.LENGTH, quantities.ACCELERATION):
        value, sentence = 0.0, "must be "
        try:
            value = in_si(text, quantity)
        except QuantityError as refusal:
            sentence = str(refusal)
        assert math.isfinite(value)
        assert sentence.startswith("must be ")


# ---- the schema, the pages and the examples -------------------------------------------------------


def test_documentation_names_every_key_and_its_example_loads(tmp_path: Path) -> None:
    for path in schemas.PUBLISHED:
        assert path.read_text(encoding="utf-8") == schemas.text(path), "run python tests/helpers/schemas.py"
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    VALIDATOR.validate(box())
    page = "".join(page_text(name) for name in ("system-file", "catalogue", "load-cases"))
    parts = re.split(r"```(?:toml)?\n", page)
    texts, (example, _, of_catalogue) = parts[::2], parts[1::2]
    for path in SYSTEMS.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "system.toml").write_text(example, encoding="utf-8")
    assert len(load_system_file(tmp_path / "system.toml").cases) == 3
    content = parse_toml(example)
    content["mount_type"]["corner"]["axes"][0] = parse_toml(of_catalogue)["mount_type"]["wire_rope"]["axes"][0]
    axes = system_of_content(content, FilesOfFolder(tmp_path)).candidates[0][1].axes
    assert "catalogue values of Example Ropes WR4-200, page 12, -z" in {axis.model for axis in axes}
    words = set(re.findall(r"[a-z][a-z_-]*", " ".join(re.findall(r"`([^`]+)`", "".join(texts)))))
    keys = {key for table in SCHEMA["$defs"].values() for key in table["properties"]} | set(SCHEMA["properties"])
    shapes = set(SCHEMA["$defs"]["PulseCase"]["properties"]["pulse"]["enum"])
    assert (keys | shapes) - words == set()


@pytest.mark.parametrize("path", sorted(SYSTEMS.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_load_fit_the_schema_are_plausible_and_run(path: Path) -> None:
    VALIDATOR.validate(parse_toml(path.read_text(encoding="utf-8")))
    file = load_system_file(path)
    assert len(file.candidates) * len(file.cases) > 1
    assert all_sentences(file) == []
    run = simulate_case(file.candidates[-1][1], file.cases[0])
    assert np.isfinite(run.figures.acceleration).all()


@pytest.mark.slow
def test_models_of_the_examples_are_what_their_script_makes(tmp_path: Path) -> None:
    write_models(tmp_path, ["corner_shear"])
    made, bundled = (load_model(each / "corner_shear.json") for each in (tmp_path, SYSTEMS))
    assert "not measured" in bundled.description
    for name, value in bundled.parameters.as_dict().items():
        # The same fit on another computer: rounding of its last step.
        assert made.parameters.as_dict()[name] == pytest.approx(value, rel=1e-6, abs=1e-9)
    assert bundled.uncertainty["joint"]["parameters"] == made.uncertainty["joint"]["parameters"]
