"""The FMU of a system of bodies: the motion of the kernel to the last bit, in FMI 2.0 and 3.0, what it refuses, and
`build SYSTEM.toml`. That the kernel's motion is right is shown in test_motion.py.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from native_tools import OK
from strandspring import build_fmu
from strandspring.examples.system_models import SYSTEMS
from strandspring.fmu.archive import write_archive
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.related_files import sealed
from strandspring.fmu.system.system_check import examine_system_fmu
from strandspring.fmu.system.system_native import build_system_fmu
from strandspring.fmu.system.system_reference import expected_motion
from strandspring.vibration.bodies.parts import Point
from system_fmu_tools import (
    BOX,
    BOX_OPTIONS,
    BRANCHED,
    STAGES,
    STAGES_OPTIONS,
    NativeSystem,
    NativeSystem3,
    shock,
    system_library,
)
from terminal import Terminal, unfolded

pytestmark = pytest.mark.long

ROWS = {"box": (BOX, BOX_OPTIONS, 3), "stages": (STAGES, STAGES_OPTIONS, 2), "branched": (BRANCHED, BOX_OPTIONS, 3)}
STEP = 4e-4  # of co-simulation: four or two internal ones [s]


def instance(fmi: int, system: Any = BOX, options: Any = BOX_OPTIONS) -> NativeSystem:
    return (NativeSystem if fmi == 2 else NativeSystem3)(system_library(system, replace(options, fmi=fmi)))


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("row", ROWS)
@pytest.mark.parametrize("omega", [-1.0, 0.3])
def test_motion_is_that_of_the_kernel_to_the_last_bit(row: str, fmi: int, omega: float) -> None:
    system, options, bases = ROWS[row]
    inputs = shock(system, options, bases, 200, 60.0)
    with instance(fmi, system, options).begin(omega_start=omega) as one:
        rows = one.run(inputs, STEP)
    parts = round(STEP / options.step)
    figures, expected = expected_motion(system, replace(options, omega_start=omega), inputs, STEP / parts, parts)
    points, axes = 3 * len(system.points), len(system.axes)
    ends = np.cumsum([points, points, axes, axes, len(system.bodies), 3])
    acceleration, sway, force, displacement, _, reaction, energy = np.split(rows, ends, axis=1)
    for name, found in (("sway", sway), ("force", force), ("displacement", displacement)):
        np.testing.assert_array_equal(found, getattr(expected, name).reshape(found.shape), err_msg=name)
    # Which the kernel computes relative to a base whose acceleration it interpolates: rounding.
    right = expected.acceleration.reshape(acceleration.shape)
    np.testing.assert_allclose(acceleration, right, atol=1e-14 * np.abs(right).max())
    assert np.abs(sway).max() > 1e-3
    assert energy[-1, 0] == figures.energies[2]
    if row == "box" and fmi == 2:  # Newton's law of its point at the centre of gravity, but for the force from outside
        body, pushed = system.bodies[0], np.array([inputs[3, 0], 0.0, 0.0]) / system.bodies[0].mass
        carried = body.mass * (np.array(system.gravity) + pushed - acceleration[:, 3:])
        np.testing.assert_allclose(reaction[0], carried[0], atol=1e-9 * np.abs(carried).max())


def test_gravity_and_bases_act_as_the_pages_say() -> None:
    with instance(2) as one:
        forces = [f"force_corner_{k}_z" for k in (1, 2, 3, 4)]
        one.enter_initialization()
        # Already in initialization mode; and gravity can be changed there.
        assert sum(one.get(*forces)) == pytest.approx(20.0 * 9.80665, rel=1e-9)
        one.set(gravity_z=-5.0, gravity_x=1.0)
        assert sum(one.get(*forces)) == pytest.approx(100.0, rel=1e-9)
        one.ExitInitializationMode()
        assert one.get("sway_c_g_z", "absorbed_energy") == [0.0, 0.0]
        one.set(base_acceleration_x=50.0, load_recoil=200.0)
        assert one.go(0.0, 0.0) == OK  # a step of no length
        assert one.get("acceleration_c_g_x")[0] == pytest.approx(10.0, rel=1e-5)


def test_a_step_is_of_any_size_and_derivatives_of_inputs_go_straight_on() -> None:
    slope, inputs = 2000.0, shock(BOX, BOX_OPTIONS, 3, 40, 0.0)
    with instance(2).begin() as short, instance(2).begin() as long:
        expected = short.run(inputs, STEP)[-1]
        found = long.run(inputs[:, :4], 10.0 * STEP)[-1]
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())  # measured: 3e-16
    with instance(2).begin() as one, instance(2).begin() as two:
        for k in range(20):
            assert one.set(base_acceleration_x=slope * 4.0 * k * 1e-3) == OK
            assert one.set_derivatives(slope, orders=(1,), names=("base_acceleration_x",)) == OK
            assert one.go(4.0 * k * 1e-3, 4e-3) == OK
        middles = slope * (np.arange(800) + 0.5) * 1e-4
        held = two.run(np.array([middles, *np.zeros((3, 800))]), 1e-4)[-1]
        np.testing.assert_allclose(one.outputs(), held, rtol=1e-9, atol=1e-9 * np.abs(held).max())


def test_values_at_the_beginning_of_steps_are_late_and_averages_of_second_order() -> None:
    def sway(step: float, averaged: bool) -> float:
        times, length = step * np.arange(round(0.03 / step) + 1), 0.02
        integral = -100.0 * length / np.pi * np.cos(np.pi * np.minimum(times, length) / length)
        pulse = np.where(times < length, 100.0 * np.sin(np.pi * times / length), 0.0)[:-1]
        with instance(3).begin() as one:
            one.run(np.array([np.diff(integral) / step if averaged else pulse, *np.zeros((3, pulse.size))]), step)
            return one.get("sway_c_g_x")[0]

    exact = sway(1e-4, averaged=True)
    late, middle = ([abs(sway(step, averaged) / exact - 1.0) for step in (1e-3, 5e-4)] for averaged in (False, True))
    assert late == pytest.approx([0.018, 0.0084], rel=0.05)  # what the page for simulation engineers says
    assert middle == pytest.approx([2.0e-4, 4.8e-5], rel=0.05)


@pytest.mark.parametrize("fmi", [2, 3])
def test_description_and_bytes(fmi: int, tmp_path: Path) -> None:
    import fmpy
    from fmpy.validation import validate_fmu

    options, platforms = replace(BOX_OPTIONS, fmi=fmi), chosen_platforms("host")
    odd = replace(BOX, points=(*BOX.points, Point('<&"\n\0 Ö', 0, (0.0, 0.0, 0.0))))
    fmu = build_system_fmu(odd, tmp_path, options, platforms)
    assert validate_fmu(str(fmu)) == []
    assert build_system_fmu(odd, tmp_path / "two", options, platforms).read_bytes() == fmu.read_bytes()
    report = examine_system_fmu(fmu, odd, options)
    assert (report.problems, report.force_difference) == ((), 0.0)
    other = examine_system_fmu(fmu, replace(odd, gravity=(0.0, 0.0, -9.0)), options)
    assert any("must be that of the reference" in problem for problem in other.problems)
    description = fmpy.read_model_description(str(fmu))
    table = {v.name: v for v in description.modelVariables}
    inputs = [v.name for v in table.values() if v.causality == "input"]
    assert inputs == [*(f"base_acceleration_{name}" for name in "xyz"), "load_recoil"]
    for unknown in description.outputs:
        depends = [d.name for d in unknown.dependencies]
        assert ("load_recoil" in depends) == unknown.variable.name.startswith("acceleration_")
        assert not set(depends) & set(inputs[:3])
    starts = [float(v) for v in (table["step"].start, table["step"].max, table["gravity_z"].start)]
    assert starts == [1e-4, 1e-3, -9.80665]
    # Only what a body can follow is an input.
    upper = build_system_fmu(STAGES, tmp_path, replace(STAGES_OPTIONS, fmi=fmi), platforms)
    variables = fmpy.read_model_description(str(upper)).modelVariables
    inputs = [v.name for v in variables if v.causality == "input"]
    assert inputs == ["base_acceleration_x", "base_acceleration_z"]


# ---- the command ----------------------------------------------------------------------------------


# Of files in the FMU what is replaced by what, and said then: by `info` of its own files, by `verify` of others.
CHANGES = Path(__file__).with_name("changes.json")


def test_an_fmu_is_built_shown_and_built_again_from_itself_and_must_be_sound(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Also of models of the same name from several folders, and of a record."""
    terminal = Terminal(capsys)
    shutil.copytree(SYSTEMS, tmp_path / "systems")
    monkeypatch.chdir(tmp_path)
    text = Path("systems/electronics_box.toml").read_text()
    for name, moved in (("corner_compression", "one"), ("corner_shear", "two")):
        Path(moved).mkdir()
        shutil.move(f"systems/{name}.json", f"{moved}/corner.json")
        text = text.replace(f"{name}.json", f"../{moved}/corner.json")
    Path("shaken.csv").write_text("time [s],up [m/s^2]\n" + "".join(f"{1e-3 * k:g},{k % 7 - 3}\n" for k in range(200)))
    case = '[[case]]\nname = "shaken"\nrecord = { file = "../shaken.csv", columns = { z = "up" } }\n'
    Path("systems/changed.toml").write_text(text + case)
    told = json.loads(terminal("build", "systems/changed.toml", "--candidate", "softer", "-o", "out", "--json"))
    (built,) = told["fmus"]
    fmu = Path(built["path"])
    assert built["check"].startswith("valid; 250 steps of co-simulation took ")
    assert told["step"] == pytest.approx(0.05 * told["stable_step"], rel=0.06)
    said = unfolded(terminal("verify", str(fmu)))
    assert "The reference run is reproduced exactly (250 steps, co-simulation)." in said
    for path in ("systems", "one", "two"):
        shutil.rmtree(path)
    assert build_fmu(fmu, "again").read_bytes() == fmu.read_bytes()
    terminal("build", str(fmu), "-o", "told", "--fmi", "3")  # of the other version of FMI
    terminal("build", str(fmu), "--candidate", "other", status=1)
    assert f"{fmu} is of the candidate softer; build that of another one from the SYSTEM.toml." in terminal.err
    with zipfile.ZipFile(fmu) as archive:
        held = {name: archive.read(name) for name in archive.namelist() if not name.endswith("sha256.json")}
    for member, old, new, sentence in json.loads(CHANGES.read_text(encoding="utf-8")):
        changed = held[member].replace(old.encode(), new.encode("utf-8", "surrogateescape"))
        assert changed != held[member]
        write_archive(Path("changed.fmu"), sealed({**held, member: changed}))
        terminal("info" if member.startswith("resources") else "verify", "changed.fmu", status=1)
        assert sentence in terminal.err
