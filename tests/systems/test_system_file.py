"""SYSTEM.toml: what it says is what is built; mistakes are refused in one sentence that names file and field."""

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
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import schemas
from example_springs import write_models
from springs import EXAMPLES
from strandspring.docs.site import page_text
from strandspring.errors import MountedSystemError
from strandspring.ground.gravity import STANDARD_GRAVITY
from strandspring.ground.strict_toml import parse_toml
from strandspring.model.modelfile import ModelFile, load_model, save_model
from strandspring.vibration.bodies.loads import ChannelKind
from strandspring.vibration.bodies.parts import BASE, MotionKind
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.system_file import (
    SystemFile,
    load_system_file,
    system_of_content,
    system_schema,
)
from strandspring.vibration.description.system_tables import SystemTable
from strandspring.vibration.verdicts.verdicts import FigureKind

Content = dict[str, Any]
SYSTEMS = Path(__file__).resolve().parents[2] / "fmu_src/strandspring/examples/systems"
SI = {
    "length": "m", "mass": "kg", "time": "s", "angle": "rad", "velocity": "m/s", "acceleration": "m/s^2",
    "density": "(m/s^2)^2/Hz", "stiffness": "N/m", "inertia": "kg m^2", "force": "N",
}  # fmt: skip
HARDENING = EXAMPLES["hardening"]  # 0 N at 50 mm, within 30 and 70 mm
SCHEMA = system_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Models and records that the files name."""
    path = tmp_path_factory.mktemp("systems")
    for name in ("hardening", "wire_rope"):
        save_model(path / f"{name}.json", ModelFile(name, EXAMPLES[name]))
    (path / "damaged.json").write_text("{")
    rows = "\n".join(f"{0.001 * k:.3f},{k % 7},{k % 5},{k % 3}" for k in range(200))
    (path / "base.csv").write_text(f"t [s],ax [g],wz [deg/s],F [kN]\n{rows}\n")
    (path / "levels.csv").write_text("f [Hz],level\n10,0.01\n20,0.04\n100,0.04\n")
    return path


def box() -> Content:
    """A box on four mounts."""
    return {
        "format": "strandspring-system",
        "format_version": 1,
        "name": "box",
        "units": SI,
        "body": [
            {
                "name": "box",
                "mass": "20 kg",
                "inertia": {"xx": 0.25, "yy": 0.30, "zz": "0.35 kg m^2"},
                "point": [{"name": "board", "place": [0.1, 0, "50 mm"]}],
            }
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
    content = box()
    content["case"] = [{"name": "case", **keys}]
    (found,) = loaded(content, folder).cases
    return found


def test_what_the_file_says_is_built(folder: Path) -> None:
    content = box()
    content["mount"][0]["rotate"] = {"about": "+z", "angle": "90 deg"}
    content["run"] = {"step": "0.1 ms", "rest_omega": -0.5, "draws": 20, "seed": 7}
    file = loaded(content, folder)
    ((name, system),) = file.candidates
    assert (file.name, name, sorted(file.models)) == ("box", "as described", ["hardening.json", "wire_rope.json"])
    (body,) = system.bodies
    assert (body.mass, body.motion, body.inertia[2][2]) == (20.0, MotionKind.SIX, 0.35)
    assert [mount.name for mount in system.mounts] == [f"corner {k}" for k in range(1, 5)]
    assert all(mount.support == BASE and mount.body == 0 for mount in system.mounts)
    compression, x, y = system.mounts[0].axes
    assert compression.model == "hardening.json"
    assert compression.spring == file.models["hardening.json"].parameters
    elastic = np.polynomial.Polynomial(HARDENING.kE)
    assert elastic(compression.nominal - HARDENING.displacement_offset) == pytest.approx(50.0, rel=1e-12)
    assert compression.stops is not None
    assert (compression.stops.low, compression.stops.high, compression.stops.stiffness) == (0.031, 0.069, 1e5)
    assert (x.nominal, x.parallel, x.series, compression.damping) == (0.05, 2, 3, 10.0)
    for axis, direction in ((compression, (0, 0, -1)), (x, (0, 1, 0)), (y, (-1, 0, 0))):
        np.testing.assert_allclose(axis.direction, direction, atol=1e-15)
    assert [point.name for point in system.points] == ["board"]
    assert system.points[0].place == (0.1, 0.0, 0.05)
    assert file.limits.limit_of(FigureKind.ACCELERATION, "board") == 15 * STANDARD_GRAVITY
    assert file.limits.limit_of(FigureKind.SWAY, "board") == 0.025
    assert file.limits.of_all[FigureKind.TILT] == math.radians(5)
    assert file.limits.of_all[FigureKind.STROKE] == 0.9
    assert (file.options.step, file.options.rest_omega, file.options.draws, file.options.seed) == (1e-4, -0.5, 20, 7)
    assert [each.name for each in file.cases] == ["shock +x", "shock -z"]
    assert file.cases[1].channels[0].direction == (0.0, 0.0, -1.0)
    assert file.cases[0].duration > 0.011


def test_preload_is_zero_unless_given(folder: Path) -> None:
    content = box()
    axis = content["mount_type"]["corner"]["axes"][0]
    del axis["preload"]
    system = loaded(content, folder).candidates[0][1]
    assert system.mounts[0].axes[0].nominal == pytest.approx(0.05, abs=1e-15)  # where the elastic force is 0
    axis["model"] = "wire_rope.json"
    with pytest.raises(MountedSystemError, match=r"without `preload` a spring begins at 0 N.*give `preload`"):
        loaded(content | {"mount_type": _with_elastic_away_from_zero(content, folder)}, folder)


def _with_elastic_away_from_zero(content: Content, folder: Path) -> Content:
    pressed = ModelFile("pressed", HARDENING.__class__(**{**HARDENING.as_dict(), "kE": (900.0, *HARDENING.kE[1:2])}))
    save_model(folder / "pressed.json", pressed)
    types = copy.deepcopy(content["mount_type"])
    types["corner"]["axes"][0]["model"] = "pressed.json"
    return types


def test_candidates_take_the_place_of_mount_types(folder: Path) -> None:
    content = box()
    content["candidate"] = [{"name": "as it is"}, {"name": "feet", "types": {"corner": "foot"}}]
    (first, old), (second, new) = loaded(content, folder).candidates
    assert (first, second) == ("as it is", "feet")
    assert {axis.model for axis in old.axes} == {"hardening.json", "wire_rope.json"}
    assert {axis.model for axis in new.axes} == {"hardening.json"}


def test_bodies_stand_on_bodies_and_move_in_planes(folder: Path) -> None:
    content = box()
    content["body"][0]["motion"] = {"plane": [0, 1, 0]}
    content["body"][0]["inertia"] = "0.3 kg m^2"
    content["body"].append({"name": "top", "mass": 2, "center": [0, 0, 0.3], "motion": {"axis": [0, 0, 5]}})
    content["mount"][0]["body"] = "box"
    content["mount"].append({"name": "upper", "type": "foot", "body": "top", "on": "box", "place": [0, 0, 0.2]})
    system = loaded(content, folder).candidates[0][1]
    assert [body.motion for body in system.bodies] == [MotionKind.PLANE, MotionKind.AXIS]
    assert (system.mounts[-1].body, system.mounts[-1].support, system.mounts[-1].name) == (1, 0, "upper")
    assert [point.name for point in system.points] == ["board", "top"]
    assert system.points[1].place == (0.0, 0.0, 0.3)


def test_one_rotation_for_each_place(folder: Path) -> None:
    content = box()
    content["mount"][0]["rotate"] = [{"about": "z", "angle": f"{90 * k} deg"} for k in range(4)]
    system = loaded(content, folder).candidates[0][1]
    directions = [mount.axes[1].direction for mount in system.mounts]
    np.testing.assert_allclose(directions, [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)], atol=1e-15)


SHAPES = {  # largest value and integral of a pulse of 2 g and 10 ms, in g and g*s
    "half-sine": (2.0, 0.02 * 2 / math.pi),
    "versed-sine": (2.0, 0.01),
    "terminal-sawtooth": (2.0, 0.01),
    "initial-sawtooth": (2.0, 0.01),
    "rectangle": (2.0, 0.02),
    "triangle": (2.0, 0.01),
    "trapezoid": (2.0, 0.018),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_pulse_has_its_peak_and_area(folder: Path, shape: str) -> None:
    found = case(folder, pulse=shape, peak="2 g", duration="10 ms", direction="y", simulate="20 ms")
    (channel,) = found.channels
    peak, area = SHAPES[shape]
    averages = channel.signal.averages(1e-6, 20_000) / STANDARD_GRAVITY
    assert (found.kind, found.duration, channel.kind) == ("pulse", 0.02, ChannelKind.BASE_ACCELERATION)
    assert averages.max() == pytest.approx(peak, rel=2e-4)  # averages over 1/10000 of the duration
    assert averages.sum() * 1e-6 == pytest.approx(area, rel=1e-9)


def test_velocity_step_and_drop(folder: Path) -> None:
    (channel,) = case(folder, pulse="velocity-step", velocity="3 m/s", direction="z").channels
    np.testing.assert_allclose(channel.signal.averages(0.01, 3), [300.0, 0.0, 0.0])
    drop = case(folder, drop={"height": "0.5 m"})
    assert drop.velocity == pytest.approx((0.0, 0.0, -math.sqrt(STANDARD_GRAVITY)))
    assert drop.weightless
    assert case(folder, drop={"velocity": 2}, direction="-x").velocity == (-2.0, 0.0, 0.0)


def test_vibrations(folder: Path) -> None:
    dwell = case(folder, sine={"frequency": 20, "displacement": "1 mm", "duration": 2}, direction="z")
    assert dwell.channels[0].signal.amplitude == pytest.approx(1e-3 * (40 * math.pi) ** 2)
    assert dwell.settling == 1.0
    sweep = {"first": "5 Hz", "last": "40 Hz", "rate": "3 oct/min"}
    up = case(folder, sweep=sweep | {"amplitude": "1 g", "displacement": "2 mm"}, direction="z")
    assert up.channels[0].signal.duration == pytest.approx(60.0)
    assert up.channels[0].signal.amplitude.at([5.0, 40.0]) == pytest.approx(
        [2e-3 * (10 * math.pi) ** 2, STANDARD_GRAVITY]
    )
    constant = case(folder, sweep=sweep | {"displacement": "2 mm"}, direction="z").channels[0].signal.amplitude
    assert constant.at(20.0) == pytest.approx(2e-3 * (40 * math.pi) ** 2)
    tabled = case(folder, sweep=sweep | {"rate": "5 Hz/s", "table": [[5, "1 g"], ["40 Hz", 1]]}, direction="z")
    assert tabled.channels[0].signal.duration == pytest.approx(7.0)


def test_random_vibration_by_a_table_or_a_file(folder: Path) -> None:
    psd = [["10 Hz", "0.01 g^2/Hz"], ["20 Hz", "0.04 g^2/Hz"], [100, "0.04 g^2/Hz"]]
    written = case(folder, random={"psd": psd, "duration": "5 s", "seed": 3}, direction="z")
    read = case(
        folder,
        random={"file": "levels.csv", "unit": "g^2/Hz", "duration": "5 s", "seed": 3},
        direction="z",
    )
    assert written.channels[0].signal.density.points == pytest.approx(np.array(read.channels[0].signal.density.points))
    assert written.settling == 0.5


def test_record_of_the_base_and_forces(folder: Path) -> None:
    columns = {"x": "ax", "rz": 3}
    record = case(folder, record={"file": "base.csv", "columns": columns, "scale": 2.0})
    acceleration, rotation = record.channels
    assert (acceleration.kind, rotation.kind) == (ChannelKind.BASE_ACCELERATION, ChannelKind.BASE_ANGULAR_VELOCITY)
    assert rotation.direction == (0.0, 0.0, 1.0)
    assert acceleration.signal.at(0.003) == pytest.approx(2 * 3 * STANDARD_GRAVITY)
    assert rotation.signal.at(0.004) == pytest.approx(2 * math.radians(4))
    renamed = case(folder, record={"file": "base.csv", "columns": {"x": 4}, "units": {"x": "m/s^2"}})
    assert renamed.channels[0].signal.at(0.002) == pytest.approx(2.0)
    forced = case(folder, force={"file": "base.csv", "column": "F", "place": [0, 0, 1]}, direction="-x")
    (channel,) = forced.channels
    assert (channel.kind, channel.direction, channel.place) == (ChannelKind.FORCE, (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert channel.signal.at(0.002) == pytest.approx(2000.0)
    pulsed = case(folder, force={"pulse": "half-sine", "peak": "2 kN", "duration": "5 ms"}, direction="x")
    assert (pulsed.kind, pulsed.channels[0].signal.peak) == ("force", 2000.0)
    table = [[0, 0], ["1 ms", "1 kN"], [0.002, 0]]
    assert case(folder, force={"table": table}, direction="x").channels[0].signal.peak == 1000.0


def change(*path: str | int, to: Any = None) -> Callable[[Content], None]:
    """Sets a value of the box; leaves it out if None."""

    def changed(content: Content) -> None:
        *parents, last = path
        place: Any = content
        for key in parents:
            place = place[key]
        if to is None:
            del place[last]
        elif isinstance(place, list) and last == len(place):
            place.append(to)
        else:
            place[last] = to

    return changed


def case_of(**keys: Any) -> Callable[[Content], None]:
    return change("case", to=[{"name": "c", "direction": "z", **keys}])


BODY, AXES = ("body", 0), ("mount_type", "corner", "axes")
AXIS = (*AXES, 0)
GUIDED = {"name": "box", "mass": 20, "motion": {"axis": "z"}}
SINE = {"frequency": 20, "amplitude": 1, "duration": 1}
RECORD = {"file": "base.csv", "columns": {"x": "ax"}}


BAD: list[tuple[Callable[[Content], None], str]] = [
    (change("boddy", to=[]), "'boddy' is not a key here; use 'body' if you mean that."),
    (change("format", to="x"), "format: must be 'strandspring-system', got 'x'."),
    (change("format_version", to=2), "format_version: must be 1, got 2; the file was written for a newer strandspring"),
    (change("name"), "name: is missing; add it."),
    (change("body", to=[]), "body: must not be empty."),
    (change(*BODY, "mass", to="20 mm"), "body[1].mass: must be a mass such as '20 kg', got '20 mm', which is a"),
    (change(*BODY, "mass", to="-3 kg"), "body[1].mass: must be a mass > 0"),
    (change(*BODY, "mass", to=math.nan), "got a number that is not finite."),
    (change("limits", "stroke", to=math.nan), "limits.stroke: must be a finite number, got nan."),
    (change(*BODY, "mass", to=1e12), "body[1]: The mass of box must be within"),
    (change(*BODY, "inertia"), "body[1]: must have `inertia`"),
    (change(*BODY, "inertia", to=0.3), "must have xx, yy and zz for motion in six degrees of freedom"),
    (change(*BODY, "inertia", "xx", to=2.0), "No body has the inertia tensor of box"),
    (change(*BODY, "inertia", "xy", to=0.3), "No body has the inertia tensor of box"),
    (change(*BODY, "motion", to="five"), "body[1].motion: must be 'six', got 'five'."),
    (change(*BODY, "motion", to={"plain": "z"}), "body[1].motion: 'plain' is not a key here; use 'plane' if"),
    (change(*BODY, "motion", to=3), "must be 'six', { plane = normal } or { axis = direction }, got 3."),
    (change(*BODY, "name", to="base"), "body[1].name: 'base' is what mounts stand on"),
    (change(*BODY, "name", to="a\nb"), "body[1].name: must be a name of 1 to 80 printable characters"),
    (change(*BODY, "point", 1, to={"name": "board", "place": [0, 0, 0]}), "body.point: 'board' is the name of 2"),
    (change(*BODY, "point", 0, "place", to=[0, 1]), "body[1].point[1].place: must be a list of x, y and z"),
    (change(*BODY, "center", to=[0, 0, "1 kN"]), "body[1].center: must be a length such as '12 mm', got '1 kN'"),
    (change(*BODY, "center", to=[0, 0, 1e9]), "The centre of gravity of box must be within"),
    (change("gravity", to=[0, 0, 1e9]), "`gravity` must be finite and within"),
    (change("mount_type", to={}), "mount_type: must not be empty."),
    (change(*AXES, to=[]), "mount_type.corner.axes: must not be empty."),
    (change(*AXIS, "direction", to="q"), "mount_type.corner.axes[1].direction: must be '+x', '-x'"),
    (change(*AXIS, "direction", to=[0, 0, 0]), "must be a direction, got three zeros."),
    (change(*AXIS, "direction", to=[1, 0, 1]), "mount_type.corner.axes: must be perpendicular to each other"),
    (change(*AXIS, "model", to="none.json"), "mount_type.corner.axes[1].model: "),
    (change(*AXIS, "model", to="damaged.json"), "damaged.json, line 1: not valid JSON"),
    (change(*AXIS, "model", to="~nobody-of-this-name/a.json"), "names no user's folder"),
    (change(*AXIS, "preload", to="99 kN"), "preload of 99000 N is outside the elastic forces of its identified"),
    (change(*AXIS, "nominal", to="50 mm"), "must have either `preload` or `nominal`, got both"),
    (change(*AXES, 1, "nominal", to="9 m"), "outside its identified range of 30 to 70 mm"),
    (change(*AXIS, "stops", to={"stiffness": 1}), "`stops` must have `low` or `high`"),
    (change(*AXIS, "stops", "low", to="60 mm"), "must be between the stops, 60 and 69 mm"),
    (change(*AXIS, "parallel", to=0), "mount_type.corner.axes[1].parallel: must be >= 1, got 0."),
    (change(*AXIS, "parallel", to=1.5), "mount_type.corner.axes[1].parallel: must be a whole number, got 1.5."),
    (change(*AXIS, "damping", to="-3 N s/m"), "must be a damping coefficient >= 0, got '-3 N s/m'."),
    (change("mount", 0, "type", to="cornre"), "mount[1].type: 'cornre' is not a mount type; use 'corner'"),
    (change("mount", 0, "body", to="bok"), "mount[1].body: 'bok' is not a body; use 'box' if you mean that."),
    (change("mount", 0, "on", to="floor"), "mount[1].on: 'floor' is not a body"),
    (change("mount", 0, "on", to="box"), "mount[1].on: must be 'base' or another body than 'box'."),
    (change("mount", 0, "place", to=[0, 0, 0]), "mount[1]: must have either `place` or `places`"),
    (change("mount", 0, "rotate", to=[{"about": "z", "angle": 1}]), "one for each of the 4 places, got 1"),
    (change("mount", 0, "rotate", to=3), "mount[1].rotate: must be a table with about and angle, or a list"),
    (change("mount", 1, to={"name": "corner 2", "type": "foot", "place": [0, 0, 0]}), "'corner 2' is the name of 2"),
    (change("mount", 0, "places", to=[[0, 0, -0.12]] * 600), "at most 600 axes"),
    (change("body", 1, to={"name": "lid", "mass": 1, "motion": {"axis": "z"}}), "mount[1].body: must be given where"),
    # What nothing holds.
    (change(*AXES, 2), "no mount holds box along y, so that it can drift; add an axis along y"),
    (change("mount", 0, "places", to=[[0.1, 0, 0], [-0.1, 0, 0]]), "no mount holds box against rotation about x"),
    (change("mount", 0, "places", to=[[0, 0, 0]]), "no mount holds box against rotation about x"),
    (change("mount", 0, "places", to=[[0.1, 0.1, 0.0]]), "no mount holds box against a rotation about an axis"),
    # Candidates, limits and runs.
    (change("candidate", to=[{"name": "a", "types": {"cornr": "foot"}}]), "candidate[1].types: 'cornr' is not a mount"),
    (change("candidate", to=[{"name": "a", "types": {"corner": "feet"}}]), "type; use one of 'corner', 'foot'."),
    (change("candidate", to=[{"name": "a"}, {"name": "a"}]), "candidate: 'a' is the name of 2 of them"),
    (change("limits", "acceleration", to={"bord": 1}), "limits.acceleration: 'bord' is not a point; use"),
    (change("limits", "acceleration", to="15 mm"), "limits.acceleration: must be an acceleration such as '15 g'"),
    (change("limits", "srs", to={"bord": {"levels": [[10, "1 g"], [20, "2 g"]]}}), "limits.srs: 'bord' is not a point"),
    (change("limits", "srs", to="3 g"), "limits.srs: must be a table with levels and q, or a table with one for each"),
    (change("limits", "stroke", to=1.5), "limits.stroke: must be <= 1, got 1.5."),
    (
        change("limits", "stroke", to="90 %"),
        "limits.stroke: must be a number, got '90 %'; write 0.9.",
    ),
    (change("limits", "stroke", to="9 mm"), "got '9 mm'; write the number alone, without quotation marks."),
    (change("limits", "stroke", to="most"), "limits.stroke: must be a number, got 'most'."),
    (change(*AXIS, "parallel", to="2"), "axes[1].parallel: must be a whole number, got '2'; write 2."),
    (change(*AXIS, "parallel", to="2.5"), "axes[1].parallel: must be a whole number, got '2.5'."),
    (change("run", to={"rest_omega": "-50%"}), "run.rest_omega: must be a number, got '-50%'; write -0.5."),
    (change("run", to={"rest_omega": 2}), "run.rest_omega: must be <= 1, got 2."),
    (change("run", to={"rest_omega": "none"}), "run.rest_omega: must be 'unknown', got 'none'."),
    (change("run", to={"draws": -1}), "run.draws: must be >= 16, got -1."),
    # Cases.
    (change("case", 0, "pulse"), "case[1]: must be a table with exactly one of the keys pulse, drop, accel"),
    (change("case", 0, "pulse", to="halfsine"), "case[1].pulse: must be 'half-sine', 'versed-sine', 'term"),
    (change("case", 0, "peak"), "case[1]: a pulse has `peak` and `duration`"),
    (change("case", 0, "rise", to=0.001), "only a trapezoid has `rise` and `fall`"),
    (change("case", 0, "direction", to="x"), "case[1]: must have either `direction` or `directions`, got both"),
    (change("case", 0, "directions"), "case[1]: must have `direction`, such as '+x'"),
    (change("case", 0, "directions", to=["x", "+x"]), "'shock +x' is the name of 2 cases"),
    (change("case", 0, "simulate", to="1 ms"), "`simulate` must not end before the load does, at 0.011 s"),
    (change("case", 0, "duration", to="11 mm"), "case[1].duration: must be a time such as '11 ms', got '11 mm'"),
    (change("case", to=[{"name": "a", "drop": {}}] * 2), "case: 'a' is the name of 2 of them"),
    (case_of(drop={}), "case[1].drop: must have either `height` or `velocity`"),
    (case_of(pulse="trapezoid", peak=1, duration=1, rise=2), "The rise and the fall of a trapezoid must be"),
    (case_of(pulse="velocity-step", peak=1), "case[1]: a velocity step has `velocity`"),
    (
        change("case", to=[{"name": "c", "record": RECORD | {"scale": "2.5"}}]),
        "case[1].record.scale: must be a number, got '2.5'; write 2.5.",
    ),
    (case_of(sine=SINE | {"displacement": 1}), "case[1].sine: must have either `amplitude` or `displacement`"),
    (case_of(sine=SINE, settling=99), "`settling` of 99 s must be shorter"),
    (case_of(sine=SINE | {"soft_start": 9}), "`soft_start` must be at most 1 s"),
    (case_of(sweep={"first": 5, "last": 5, "rate": "1 oct/min"}), "must go from one frequency to another"),
    (case_of(sweep={"first": 5, "last": 9, "rate": "1 oct/min"}), "must have `amplitude`, `displacement` or both"),
    (case_of(sweep={"first": 5, "last": 9, "rate": 1}), "case[1].sweep.rate: must be a rate with its unit"),
    (case_of(sweep={"first": 5, "last": 9, "rate": "1 Hz"}), "got '1 Hz', which is a frequency"),
    (case_of(sweep={"first": 5, "last": 9, "rate": "1 Hz/s", "table": [[6, 1], [9, 1]]}), "must cover the sweep"),
    (case_of(random={"duration": 1}), "case[1].random: must have either `psd` or `file`"),
    (case_of(random={"duration": 1, "psd": [[1, 2]]}), "must be a list of 2 to 10000 pairs of a frequency and"),
    (case_of(random={"duration": 1, "psd": [[1, 2], [1, "x"]]}), "in entry 2: must be a spectral density"),
    (case_of(random={"duration": 9, "psd": [[9, 2], [1, 2]]}), "The frequencies of a table must rise"),
    (case_of(random={"duration": 9, "file": "levels.csv"}), "column 2 'level': has no unit; give that of"),
    (case_of(random={"duration": 9, "file": "none.csv"}), "case[1].random: "),
    (case_of(record=RECORD), "case[1]: 'direction' is not a key here"),
    (change("case", to=[{"name": "c", "record": {"file": "base.csv", "columns": {}}}]), "must name one column or more"),
    (
        change("case", to=[{"name": "c", "record": {"file": "base.csv", "columns": {"x": "az"}}}]),
        "x column 'az' is not in the file, which has column 1 't [s]'",
    ),
    (
        change("case", to=[{"name": "c", "record": RECORD | {"units": {"x": "mm"}}}]),
        "column 2 'ax [g]': its unit must be an acceleration such as '15 g', got '1 mm', which is a length",
    ),
    (case_of(force={}), "case[1].force: must have one of `pulse`, `table` and `file`"),
    (case_of(force={"body": "bx", "table": [[0, 0], [1, 1]]}), "'bx' is not a body; use 'box' if you mean that."),
    (case_of(force={"table": [[1, 0], [0, 1]]}), "The times of a pulse by a table must be >= 0 and never fall"),
]  # fmt: skip


def test_a_candidate_that_nothing_holds_is_named(folder: Path) -> None:
    content = box()
    change("mount", 0, "places", to=[[0, 0, 0]])(content)
    change("candidate", to=[{"name": "lean"}])(content)
    with pytest.raises(MountedSystemError, match=r"system.toml, candidate 'lean': no mount holds box against rotation"):
        loaded(content, folder)


@pytest.mark.parametrize(("damage", "refusal"), BAD, ids=[refusal[:60] for _, refusal in BAD])
def test_mistakes_are_refused_in_one_sentence(folder: Path, damage: Callable[[Content], None], refusal: str) -> None:
    content = box()
    damage(content)
    with pytest.raises(MountedSystemError) as caught:
        loaded(content, folder)
    text = str(caught.value)
    assert refusal in text
    assert text.startswith(str(folder / "system.toml"))
    assert text.endswith(".")
    assert "\n" not in text
    assert not any(word in text for word in ("pydantic", "Input should", "[type=", "Traceback", "=table", "=quantity"))


@pytest.mark.parametrize(
    ("keys", "refusal"),
    [
        ({"direction": "x", "sine": SINE}, "no body can move along +x, which makes the case void; see their `motion`."),
        ({"direction": "x", "force": {"table": [[0, 0], [1, 1]]}}, "box cannot move along +x"),
        ({"record": RECORD}, "no body can move along x"),
    ],
)
def test_load_along_a_direction_that_is_held(folder: Path, keys: Content, refusal: str) -> None:
    content = box()
    content["body"] = [GUIDED]
    del content["limits"]
    content["case"] = [{"name": "c", **keys}]
    with pytest.raises(MountedSystemError) as caught:
        loaded(content, folder)
    assert refusal in str(caught.value)


def test_two_bodies_that_drift_together_are_named(folder: Path) -> None:
    content = box()
    del content["mount_type"]["corner"]["axes"][2]
    content["mount"][0]["body"] = "box"
    content["body"].append({"name": "lid", "mass": 1, "inertia": {"xx": 1, "yy": 1, "zz": 1}})
    places = [[0.1, 0.1, 0.1], [-0.1, 0.1, 0.1], [0.0, -0.1, 0.1]]
    content["mount"].append({"name": "lid", "type": "foot", "body": "lid", "on": "box", "places": places})
    with pytest.raises(MountedSystemError, match="no mount holds box and lid along y, so that they can drift"):
        loaded(content, folder)


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


def test_documentation_names_every_key_and_its_example_loads(tmp_path: Path) -> None:
    page = "".join(page_text(name) for name in ("system-file", "catalogue", "load-cases"))
    parts = re.split(r"```(?:toml)?\n", page)
    texts, (example, _, of_catalogue) = parts[::2], parts[1::2]
    for path in SYSTEMS.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "system.toml").write_text(example, encoding="utf-8")
    assert len(load_system_file(tmp_path / "system.toml").cases) == 3
    content = parse_toml(example)
    content["mount_type"]["corner"]["axes"][0] = parse_toml(of_catalogue)["mount_type"]["wire_rope"]["axes"][0]
    assert "catalogue values of Example Ropes WR4-200, page 12, -z" in {
        axis.model for axis in system_of_content(content, FilesOfFolder(tmp_path)).candidates[0][1].axes
    }
    words = set(re.findall(r"[a-z][a-z_-]*", " ".join(re.findall(r"`([^`]+)`", "".join(texts)))))
    keys = {key for table in SCHEMA["$defs"].values() for key in table["properties"]} | set(SCHEMA["properties"])
    shapes = set(SCHEMA["$defs"]["PulseCase"]["properties"]["pulse"]["enum"])
    assert (keys | shapes) - words == set()


def test_schema_is_published_and_fits() -> None:
    for path in schemas.PUBLISHED:
        assert path.read_text(encoding="utf-8") == schemas.text(path), "run python tests/helpers/schemas.py"
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    VALIDATOR.validate(box())


@pytest.mark.parametrize("path", sorted(SYSTEMS.glob("*.toml")), ids=lambda path: path.stem)
def test_examples_load_fit_the_schema_and_run(path: Path) -> None:
    VALIDATOR.validate(parse_toml(path.read_text(encoding="utf-8")))
    file = load_system_file(path)
    assert len(file.candidates) * len(file.cases) > 1
    for _, system in file.candidates:
        run = simulate_case(system, file.cases[0])
        assert np.isfinite(run.figures.acceleration).all()


def test_models_of_the_examples_are_what_their_script_makes(tmp_path: Path) -> None:
    write_models(tmp_path, ["corner_shear"])
    made, bundled = (load_model(each / "corner_shear.json") for each in (tmp_path, SYSTEMS))
    assert "not measured" in bundled.description
    for name, value in bundled.parameters.as_dict().items():
        # The same fit on another computer: rounding of its last step.
        assert made.parameters.as_dict()[name] == pytest.approx(value, rel=1e-6, abs=1e-9)
    assert bundled.uncertainty["joint"]["parameters"] == made.uncertainty["joint"]["parameters"]


def lengths(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most).map(lambda value: round(value, 6))


@st.composite
def systems(draw: st.DrawFn) -> Content:
    """A system without a fault: a body on three mounts or more that are not in one line."""
    content = box()
    size = draw(lengths(0.05, 2.0))
    moments = [draw(lengths(0.8, 1.0)) for _ in range(3)]
    content["body"][0] |= {
        "mass": draw(lengths(0.1, 1e4)),
        "center": [draw(lengths(-0.1, 0.1)) * size for _ in range(3)],
        "inertia": dict(zip(("xx", "yy", "zz"), moments, strict=True)),
    }
    corner = content["mount_type"]["corner"]["axes"]
    corner[0]["preload"] = draw(lengths(-100.0, 100.0))
    del corner[0]["stops"]
    corner[1] |= {"parallel": draw(st.integers(1, 9)), "series": draw(st.integers(1, 9))}
    angles = [2 * math.pi * (k + draw(lengths(0.0, 0.5))) / 3 for k in range(3)]
    content["mount"][0]["places"] = [[size * math.cos(a), size * math.sin(a), -size] for a in angles]
    if draw(st.booleans()):
        content["mount"][0]["rotate"] = {
            "about": [draw(lengths(-1.0, 1.0)), 1.0, 0.5],
            "angle": draw(lengths(-3.0, 3.0)),
        }
    content["gravity"] = [0.0, 0.0, draw(lengths(-20.0, 0.0))]
    return content


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=systems())
def test_valid_systems_come_back_as_they_were_written(folder: Path, content: Content) -> None:
    VALIDATOR.validate(content)
    system = loaded(content, folder).candidates[0][1]
    table = SystemTable.model_validate(content)
    (body,) = system.bodies
    assert (body.mass, list(body.center), list(system.gravity)) == (
        content["body"][0]["mass"], content["body"][0]["center"], content["gravity"],
    )  # fmt: skip
    assert np.diag(body.inertia).tolist() == list(content["body"][0]["inertia"].values())
    assert [list(mount.place) for mount in system.mounts] == content["mount"][0]["places"]
    assert table.mount[0].name == "corner"
    elastic = np.polynomial.Polynomial(HARDENING.kE)
    for mount in system.mounts:
        directions = np.array([axis.direction for axis in mount.axes])
        np.testing.assert_allclose(directions @ directions.T, np.eye(3), atol=1e-14)
        compression = mount.axes[0]
        force = elastic(compression.nominal - HARDENING.displacement_offset)
        assert force == pytest.approx(content["mount_type"]["corner"]["axes"][0]["preload"], abs=1e-9)
