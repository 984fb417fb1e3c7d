"""The FMU of a system: valid, the motion of the kernel to the last bit, states, several instances, hostile calls."""

from __future__ import annotations

import re
import subprocess
import zipfile
from ctypes import byref, c_double, c_int, c_size_t, c_void_p
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from kernel_tools import compiled
from native_tools import CO_SIMULATION, ERROR, FUNCTIONS, MODEL_EXCHANGE, OK, Library, Native, doubles
from strandspring.errors import MountedSystemError
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.system.system_check import examine_system_fmu
from strandspring.fmu.system.system_native import build_system_fmu, system_contents
from strandspring.fmu.system.system_reference import expected_motion
from strandspring.fmu.system.system_variables import ForceInput, SystemFmuOptions, unique_names
from strandspring.ground.gravity import STANDARD_GRAVITY
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MountAxis, Point
from system_fmu_tools import (
    BOX,
    BOX_OPTIONS,
    BRANCHED,
    STAGES,
    STAGES_OPTIONS,
    NativeSystem,
    shock,
    system_library,
)

SYSTEMS = {
    "box": (BOX, BOX_OPTIONS, 3),
    "stages": (STAGES, STAGES_OPTIONS, 2),
    "branched": (BRANCHED, BOX_OPTIONS, 3),
}
STEP = 4e-4  # of co-simulation: four or two internal ones [s]


@pytest.fixture(params=SYSTEMS)
def case(request: pytest.FixtureRequest) -> tuple[MountedSystem, SystemFmuOptions, int]:
    return SYSTEMS[request.param]


def history(found: np.ndarray, system: MountedSystem) -> dict[str, np.ndarray]:
    points, axes = len(system.points), sum(len(mount.axes) for mount in system.mounts)
    ends = np.cumsum([3 * points, 3 * points, axes, axes, len(system.bodies), 3])
    accelerations, sway, forces, displacements, tilt, reaction, energy = np.split(found, ends, axis=1)
    return {
        "acceleration": accelerations.reshape(-1, points, 3),
        "sway": sway.reshape(-1, points, 3),
        "force": forces,
        "displacement": displacements,
        "tilt": tilt,
        "reaction": reaction,
        "energy": energy[:, 0],
    }


def test_the_fmu_is_valid_and_checks_itself(tmp_path: Path, case: Any) -> None:
    system, options, _ = case
    fmu = build_system_fmu(system, tmp_path, options, chosen_platforms("host"))
    assert validate_fmu(str(fmu)) == []
    report = examine_system_fmu(fmu, system, options)
    assert report.problems == ()
    assert report.force_difference == 0.0
    assert report.summary.startswith("valid; 250 steps of co-simulation took ")
    # Another system is noticed.
    other = replace(system, gravity=(0.0, 0.0, -9.0))
    assert any(
        "must be that of the reference" in problem for problem in examine_system_fmu(fmu, other, options).problems
    )


@pytest.mark.parametrize("omega", [-1.0, 0.0, 1.0])
def test_motion_is_that_of_the_kernel_to_the_last_bit(case: Any, omega: float) -> None:
    system, options, bases = case
    inputs = shock(system, options, bases, 300, 60.0)
    with NativeSystem(system_library(system, options)).begin(omega_start=omega) as one:
        found = history(one.run(inputs, STEP), system)
    parts = round(STEP / options.step)
    figures, expected = expected_motion(system, replace(options, omega_start=omega), inputs, STEP / parts, parts)
    for kind in ("sway", "force", "displacement"):
        np.testing.assert_array_equal(found[kind], getattr(expected, kind), err_msg=kind)
    # Which the kernel computes relative to a base whose acceleration it interpolates: rounding.
    largest = np.abs(expected.acceleration).max()
    np.testing.assert_allclose(found["acceleration"], expected.acceleration, atol=1e-14 * largest)
    assert np.abs(found["sway"]).max() > 1e-3
    assert found["energy"][-1] == figures.energies[2]


def test_tilt_and_reaction_are_those_of_a_rigid_body() -> None:
    """By places of four points, which symmetric mounts leave untilted at rest, and by Newton's law."""
    places = {"c": (0.0, 0.0, 0.0), "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    points = tuple(Point(name, 0, place) for name, place in places.items())
    system, options = replace(BOX, points=points), replace(BOX_OPTIONS, forces=())
    with NativeSystem(system_library(system, options)).begin() as one:
        found = history(one.run(shock(system, options, 3, 300, 60.0), STEP), system)
    sway = found["sway"]
    rotations = np.eye(3) + np.moveaxis(sway[:, 1:] - sway[:, :1], 1, 2)
    angles = np.arccos(np.clip(0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1.0), -1.0, 1.0))
    # The cosine of a small angle has lost half of its digits.
    np.testing.assert_allclose(found["tilt"][:, 0], angles, atol=1e-7)
    assert found["tilt"].max() > 0.02
    body = system.bodies[0]
    expected = body.mass * (np.array(system.gravity) - found["acceleration"][:, 0])
    np.testing.assert_allclose(found["reaction"], expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(found["reaction"][0, 2], -body.mass * STANDARD_GRAVITY, rtol=1e-9)


def test_equal_steps_are_equal_to_the_last_bit_whatever_was_read(case: Any) -> None:
    system, options, bases = case
    inputs = shock(system, options, bases, 60, 40.0)
    with NativeSystem(system_library(system, options)) as one, NativeSystem(system_library(system, options)) as other:
        found = one.begin().run(inputs, STEP)
        other.begin()
        names = [name for name in other.library.references if name.startswith(("base_", "load_"))]
        for k, values in enumerate(inputs.T.tolist()):
            other.set(**dict(zip(names, values, strict=True)))
            other.go(k * STEP, STEP)
        assert other.outputs() == found[-1].tolist()


def test_steps_of_co_simulation_matter_by_their_inputs_only() -> None:
    # Constant inputs: 40 steps of four internal ones, or four of 40.
    inputs = shock(BOX, BOX_OPTIONS, 3, 40, 0.0)
    with NativeSystem().begin() as one:
        short = one.run(inputs, STEP)[-1]
    with NativeSystem().begin() as one:
        long = one.run(inputs[:, :4], 10.0 * STEP)[-1]
    # Rounding of the step that is cut. Measured: 3e-16.
    np.testing.assert_allclose(long, short, rtol=1e-11, atol=1e-11 * np.abs(short).max())


def test_derivatives_of_inputs_go_straight_on() -> None:
    slope = 2000.0
    with NativeSystem().begin() as one:
        for k in range(20):
            assert one.set(base_acceleration_x=slope * 4.0 * k * 1e-3) == OK
            assert one.set_derivatives(slope, orders=(1,), names=("base_acceleration_x",)) == OK
            assert one.go(4.0 * k * 1e-3, 4e-3) == OK
        straight = one.outputs()
        # The input has gone on, and the derivative holds for one step.
        assert one.get("base_acceleration_x") == [slope * 80e-3]
    with NativeSystem().begin() as one:
        middles = slope * (np.arange(800) + 0.5) * 1e-4
        held = one.run(np.array([middles, 0.0 * middles, 0.0 * middles, 0.0 * middles]), 1e-4)[-1]
    np.testing.assert_allclose(straight, held, rtol=1e-9, atol=1e-9 * np.abs(held).max())


def test_internal_steps_converge_with_the_second_order() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 200, 40.0)
    found = []
    for step in (4e-4, 2e-4, 1e-4):
        with NativeSystem().begin(step=step) as one:
            found.append(one.run(inputs, STEP)[-1])
    coarse, fine = np.abs(found[0] - found[1]), np.abs(found[1] - found[2])
    largest = np.argmax(coarse / np.abs(found[2]).clip(1e-6))
    assert 3.0 < coarse[largest] / fine[largest] < 5.5


def test_forces_are_felt_at_once_and_accelerations_of_the_base_are_not() -> None:
    with NativeSystem().begin() as one:
        (still,) = one.get("acceleration_c_g_x")
        assert still == pytest.approx(0.0, abs=1e-9)
        one.set(base_acceleration_x=50.0)
        assert one.get("acceleration_c_g_x") == pytest.approx([still], abs=1e-12)
        one.set(load_recoil=200.0)
        assert one.get("acceleration_c_g_x")[0] == pytest.approx(10.0, rel=1e-9)
        assert one.go(0.0, 0.0) == OK  # a step of no length
        assert one.get("acceleration_c_g_x")[0] == pytest.approx(10.0, rel=1e-9)


def test_static_equilibrium_carries_the_weight() -> None:
    forces = [f"force_corner_{k}_z" for k in (1, 2, 3, 4)]
    for omega in (-1.0, 0.0, 1.0):
        with NativeSystem() as one:
            one.enter_initialization()
            one.set(omega_start=omega)
            # Already in initialization mode; and gravity can be changed there.
            assert sum(one.get(*forces)) == pytest.approx(20.0 * 9.80665, rel=1e-9)
            one.set(gravity_z=-5.0, gravity_x=1.0)
            assert sum(one.get(*forces)) == pytest.approx(100.0, rel=1e-9)
            one.ExitInitializationMode()
            assert one.get("sway_c_g_z", "absorbed_energy") == [0.0, 0.0]
            one.go(0.0, 0.01)
            assert np.abs(one.get("acceleration_c_g_x", "acceleration_c_g_z")).max() < 1e-6


@pytest.mark.parametrize("system", [BOX, BRANCHED], ids=["box", "branched"])
def test_states_are_taken_set_and_serialized(system: MountedSystem) -> None:
    inputs, library = shock(system, BOX_OPTIONS, 3, 120, 60.0), system_library(system)
    with NativeSystem(library).begin() as one, NativeSystem(library, "two") as two:
        expected = one.run(inputs, STEP)
        one.Reset()
        one.begin()
        one.run(inputs[:, :50], STEP)
        state, content = one.snapshot(), one.serialized()
        assert one.serialized() == content
        np.testing.assert_array_equal(one.run(inputs[:, 50:], STEP), expected[50:])
        assert one.SetFMUstate(state) == OK
        assert one.serialized() == content
        np.testing.assert_array_equal(one.run(inputs[:, 50:], STEP), expected[50:])
        # Into another instance, that has not been initialized.
        assert two.restore(content) == OK
        np.testing.assert_array_equal(two.run(inputs[:, 50:], STEP), expected[50:])
        assert one.FreeFMUstate(byref(state)) == OK
        assert one.GetFMUstate(byref(state)) == OK
        assert one.FreeFMUstate(byref(state)) == OK


def test_a_damaged_or_foreign_state_is_refused() -> None:
    with NativeSystem().begin() as one, NativeSystem(system_library(STAGES, STAGES_OPTIONS)).begin() as other:
        one.run(shock(BOX, BOX_OPTIONS, 3, 3, 1.0), STEP)
        content = one.serialized()
        assert other.restore(content) == ERROR
        assert other.said == "The serialized state is from another FMU."
        assert one.restore(content[:-1]) == ERROR
        assert one.said == "The serialized state is truncated or damaged."
        fields = 66
        for place, value, field in (
            (fields, b"\x03\0\0\0", "mode"),
            (fields + 4, b"\xff" * 8, "time"),
            (fields + 20, b"\xff" * 8, "settings"),
            (fields + 60, b"\xff" * 8, "inputs"),
            (fields + 124, b"\2", "flags"),
            (fields + 136 + 48, b"\xff" * 8, "motion"),
            (len(content) - 8, b"\xff" * 8, "springs"),
        ):
            crafted = bytearray(content)
            crafted[place : place + len(value)] = value
            assert one.restore(resummed(bytes(crafted))) == ERROR
            assert one.said == f"The serialized state is damaged in its field `{field}`."
        assert one.serialized() == content


def resummed(content: bytes) -> bytes:
    """A state with the checksum (FNV-1a) that belongs to it."""
    total = 0xCBF29CE484222325
    for byte in content[28:]:
        total = (total ^ byte) * 0x100000001B3 % 2**64
    return content[:20] + total.to_bytes(8, "little") + content[28:]


def test_reset_returns_to_the_start_values() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 30, 60.0)
    with NativeSystem().begin() as one:
        expected = one.run(inputs, STEP)
        one.Reset()
        one.begin(step=2e-4, gravity_z=-20.0).run(inputs, STEP)
        one.Reset()
        np.testing.assert_array_equal(one.begin().run(inputs, STEP), expected)


def test_instances_and_systems_in_one_process_never_see_each_other() -> None:
    box, stages = shock(BOX, BOX_OPTIONS, 3, 40, 60.0), shock(STAGES, STAGES_OPTIONS, 2, 40, 20.0)
    library, other = system_library(), system_library(STAGES, STAGES_OPTIONS)
    with NativeSystem().begin() as one, NativeSystem(other).begin() as second:
        expected, expected_other = one.run(box, STEP), second.run(stages, STEP)
    with NativeSystem(library) as one, NativeSystem(library, "two") as two, NativeSystem(other, "other") as third:
        for each in (one, two, third):
            each.begin()
        rows = [[each.outputs()] for each in (one, two, third)]
        for k in range(40):
            for each, inputs, share, found in (
                (one, box, 1.0, rows[0]),
                (two, box, -0.5, rows[1]),
                (third, stages, 1.0, rows[2]),
            ):
                names = [name for name in each.library.references if name.startswith(("base_", "load_"))]
                each.set(**dict(zip(names, (share * inputs[:, k]).tolist(), strict=True)))
                assert each.go(k * STEP, STEP) == OK
                found.append(each.outputs())
        # In the first row no inputs were set.
        np.testing.assert_array_equal(rows[0][1:], expected[1:])
        np.testing.assert_array_equal(rows[2][1:], expected_other[1:])


def counted_from(zero: float) -> MountedSystem:
    """The box, with the displacements of its springs counted from another place [m]."""

    def moved(axis: MountAxis) -> MountAxis:
        low, middle, high = (zero + place for place in (-0.03, 0.0, 0.03))
        spring = replace(axis.spring, displacement_offset=middle, displacement_min=low, displacement_max=high)
        return replace(axis, spring=spring, nominal=zero + axis.nominal)

    return replace(BOX, mounts=tuple(replace(m, axes=tuple(moved(axis) for axis in m.axes)) for m in BOX.mounts))


@pytest.mark.parametrize("zero", [0.0, 0.5])
def test_each_excursion_out_of_a_range_is_warned_of_once(zero: float) -> None:
    step, names = BOX_OPTIONS.step, [f"displacement_corner_{k}_{axis}" for k in (1, 2, 3, 4) for axis in "zxy"]
    with NativeSystem(system_library(counted_from(zero), BOX_OPTIONS)).begin() as one:
        assert (one.extrapolating, one.messages) == (False, [])
        one.set(load_recoil=3000.0)
        rows, states = [], []
        for k in range(6000):
            if k == 240:
                one.set(load_recoil=0.0)
            assert one.go(k * step, step) == OK
            rows.append(one.get(*names))
            states.append(one.extrapolating)
        is_outside = np.abs(np.array(rows) - zero) > 0.03
        assert states == is_outside.any(axis=1).tolist()
        leaving = (np.diff(is_outside.astype(int), axis=0) > 0).sum(axis=0)
        limits = re.escape(f"[{zero - 0.03:g}, {zero + 0.03:g}]")
        excursion = rf"`(\w+)` -?0\.\d+ m lies outside the identified range {limits} m: the force is extrapolated"
        warned = [re.match(excursion, text)[1] for _, _, text in one.messages]
        assert [warned.count(name) for name in names] == leaving.tolist()
        assert leaving.max() > 1
        assert not states[-1]


def test_an_excursion_within_a_step_is_told() -> None:
    with NativeSystem().begin() as one:
        one.set(load_recoil=3000.0)
        one.go(0.0, 0.024)
        one.set(load_recoil=0.0)
        one.go(0.024, 1.0)
        assert one.extrapolating
        one.messages.clear()
        one.go(1.024, 0.01)
        assert (one.extrapolating, one.messages) == (False, [])


def test_parameters_may_be_set_to_what_they_are_between_steps() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 20, 60.0)
    with NativeSystem().begin() as one:
        expected = one.run(inputs, STEP)
    with NativeSystem().begin() as one:
        one.run(inputs[:, :1], STEP)
        names = ("step", "omega_start", "gravity_x", "gravity_z")
        assert one.set(**dict(zip(names, one.get(*names), strict=True))) == OK
        assert one.outputs() == expected[1].tolist()


HOSTILE = [
    ({"base_acceleration_x": np.nan}, r"`base_acceleration_x` must be finite, got nan; the previous value is kept\."),
    ({"load_recoil": np.inf}, r"`load_recoil` must be finite, got inf; the previous value is kept\."),
    ({"step": 1e-5}, r"`step` is fixed after initialization; reset the instance to change it\."),
    ({"sway_c_g_x": 0.0}, r"`sway_c_g_x` is calculated and cannot be set\."),
]


@pytest.mark.parametrize(("values", "sentence"), HOSTILE)
def test_values_that_cannot_be_are_refused(values: dict[str, float], sentence: str) -> None:
    with NativeSystem().begin() as one:
        before = one.serialized()
        assert one.set(**values) == ERROR
        assert re.fullmatch(sentence, one.said)
        assert one.serialized() == before


@pytest.mark.parametrize(
    ("name", "value", "bounds"),
    [
        ("step", 0.0, "[1e-12, 0.001] s"), ("step", -1e-5, "[1e-12, 0.001] s"), ("step", 2e-3, "[1e-12, 0.001] s"),
        ("omega_start", 1.5, "[-1.0, 1.0]"), ("gravity_y", -1e5, "[-10000.0, 10000.0] m/s^2"),
    ],
)  # fmt: skip
def test_parameters_out_of_bounds_are_refused(name: str, value: float, bounds: str) -> None:
    with NativeSystem() as one:
        assert one.set(**{name: value}) == ERROR
        assert one.said == f"`{name}` must be within {bounds}, got {value!r}; the previous value is kept."


@pytest.mark.parametrize(
    ("time", "size", "sentence"),
    [
        (0.0, np.nan, "The step size at time 0.0 s must be finite and >= 0 [s], got nan."),
        (0.0, -1.0, "The step size at time 0.0 s must be finite and >= 0 [s], got -1.0."),
        (np.inf, 1.0, "The time of a step must be finite [s], got inf."),
        (0.0, 1e300, "The step of 1e+300 s at time 0.0 s would take more than 100000000 steps of `step` 0.0001 s; take "
                     "a shorter one."),
    ],
)  # fmt: skip
def test_steps_that_cannot_be_are_refused(time: float, size: float, sentence: str) -> None:
    with NativeSystem().begin() as one:
        before = one.serialized()
        assert one.go(time, size) == ERROR
        assert one.said == sentence
        assert one.serialized() == before


@pytest.mark.parametrize(("load", "size"), [(1e18, 0.1), (1e308, 0.1), (1e308, 1e-200)])
def test_a_motion_that_diverges_is_an_error_and_leaves_the_state(load: float, size: float) -> None:
    """Also where a velocity or an energy is beyond all bounds before a displacement is."""
    with NativeSystem().begin() as one:
        one.go(0.0, 0.01)
        one.set(load_recoil=load)
        before = one.serialized()
        assert one.go(0.01, size) == ERROR
        assert one.said == (
            f"The motion diverges in the step of {size} s at time 0.01 s: a displacement would be beyond 1e+09 m, or "
            "another value beyond 1e+100. Check the inputs, or take a smaller `step`."
        )
        assert one.serialized() == before
        one.set(load_recoil=0.0)
        assert one.go(0.01, 0.1) == OK


def test_bodies_that_cannot_rest_are_refused() -> None:
    stages = system_library(STAGES, STAGES_OPTIONS)
    with NativeSystem(stages) as one:
        one.enter_initialization()
        one.set(gravity_y=9.0)  # which no body follows
        assert one.ExitInitializationMode() == OK
    soft = replace(BOX, mounts=tuple(replace(mount, axes=mount.axes[:1]) for mount in BOX.mounts))
    with NativeSystem(system_library(soft)) as one:
        one.enter_initialization()
        one.set(gravity_x=3.0)
        assert one.ExitInitializationMode() == ERROR
        assert one.said.startswith("The bodies find no static equilibrium under gravity (3.0, 0.0, -9.80665) m/s^2: ")
        found = (c_double * 1)()
        assert one.GetReal(one.references("sway_c_g_x"), c_size_t(1), found) == ERROR
        one.set(gravity_x=0.0)
        assert one.ExitInitializationMode() == OK


def test_derivatives_that_cannot_be_are_refused() -> None:
    with NativeSystem().begin() as one:
        for names, orders, values, sentence in (
            (["sway_c_g_x"], [1], [1.0], "`sway_c_g_x` is not an input, so its derivatives cannot be set."),
            (["load_recoil"], [2], [1.0], "The order of a derivative of `load_recoil` must be 1, got 2."),
            (["load_recoil"], [1], [np.nan], "The derivative of `load_recoil` must be finite, got nan."),
        ):
            assert one.set_derivatives(*values, orders=orders, names=names) == ERROR
            assert one.said == sentence
        one.set(load_recoil=1e308)
        assert one.set_derivatives(1e308, orders=(1,), names=("load_recoil",)) == OK
        before = one.serialized()
        assert one.go(0.0, 3.0) == ERROR
        assert one.said == "The derivative 1e+308 of `load_recoil` must keep it finite in the step at time 0.0 s."
        assert one.serialized() == before
        order, found = c_int(1), c_double()
        assert (
            one.GetRealOutputDerivatives(one.references("sway_c_g_x"), c_size_t(1), byref(order), byref(found)) == ERROR
        )
        assert one.said == "This FMU gives no derivatives of outputs."
        seed = doubles([1.0])
        assert one.GetDirectionalDerivative(
            one.references("sway_c_g_x"), c_size_t(1), one.references("load_recoil"), c_size_t(1), seed, byref(found)
        ) == ERROR  # fmt: skip
        assert one.said == "This FMU gives no directional derivatives."


def test_calls_in_a_wrong_state_are_refused() -> None:
    with NativeSystem() as one:
        assert one.go(0.0, 1e-3) == ERROR
        assert "fmi2DoStep must be called while the instance is in step mode, but it is instantiated." in one.said
        one.begin()
        assert one.ExitInitializationMode() == ERROR
        value = c_int(1)
        assert one.SetBoolean(one.references("extrapolating"), c_size_t(1), byref(value)) == ERROR
        assert one.said == "`extrapolating` is calculated and cannot be set."
        found = c_double()
        assert one.GetReal((one.references("extrapolating")), c_size_t(1), byref(found)) == ERROR
        assert one.said == "`extrapolating` (value reference 0) is Boolean, not Real."
        assert one.Terminate() == OK
        assert one.go(0.0, 1e-3) == ERROR
    refused = Native(system_library(), MODEL_EXCHANGE)
    assert refused.component is None
    assert refused.said == "This FMU has a solver of its own; instantiate it for co-simulation."
    refused = Native(system_library(), CO_SIMULATION, guid="{other}")
    assert refused.component is None
    assert refused.said.startswith("The GUID must be {")
    assert system_library().functions.fmi2FreeInstance(c_void_p(None)) is not None


def test_exported_functions_are_those_of_co_simulation() -> None:
    exported = {name for name in FUNCTIONS if hasattr(system_library().functions, name)}
    of_exchange = {
        *("fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode", "fmi2CompletedIntegratorStep"),
        *("fmi2SetTime", "fmi2SetContinuousStates", "fmi2GetDerivatives", "fmi2GetEventIndicators"),
        *("fmi2GetContinuousStates", "fmi2GetNominalsOfContinuousStates"),
    }
    assert exported == FUNCTIONS - of_exchange
    assert not hasattr(system_library().functions, "motion_rest")


def test_description(tmp_path: Path) -> None:
    description = fmpy.read_model_description(str(build_system_fmu(BOX, tmp_path, BOX_OPTIONS, ())))
    assert description.modelName == "Electronics_box"
    assert description.modelExchange is None
    table = {v.name: v for v in description.modelVariables}
    assert [v.valueReference for v in table.values()] == list(range(len(table)))
    inputs = [v.name for v in table.values() if v.causality == "input"]
    assert inputs == [*(f"base_acceleration_{name}" for name in "xyz"), "load_recoil"]
    assert all(v.type == "Real" for v in table.values() if v.causality == "output")
    outputs = {unknown.variable.name: [d.name for d in unknown.dependencies] for unknown in description.outputs}
    assert outputs["acceleration_circuit_board_y"] == ["load_recoil"]
    assert all(depends == [] for name, depends in outputs.items() if not name.startswith("acceleration_"))
    assert table["step"].start == "0.0001"
    assert float(table["step"].max) == 1e-3
    assert float(table["gravity_z"].start) == -9.80665
    # Only what a body can follow is an input.
    stages = fmpy.read_model_description(str(build_system_fmu(STAGES, tmp_path, STAGES_OPTIONS, ())))
    assert [v.name for v in stages.modelVariables if v.causality == "input"] == [
        "base_acceleration_x", "base_acceleration_z",
    ]  # fmt: skip
    assert stages.modelName == "spring_2_stages"


def test_the_same_system_gives_the_same_bytes(tmp_path: Path) -> None:
    platforms = chosen_platforms("host")
    one = build_system_fmu(BOX, tmp_path / "one", BOX_OPTIONS, platforms).read_bytes()
    assert build_system_fmu(BOX, tmp_path / "two", BOX_OPTIONS, platforms).read_bytes() == one
    guids = {
        re.findall(rb'guid="([^"]+)"', system_contents(system, options, ())["modelDescription.xml"])[0]
        for system, options in (
            (BOX, BOX_OPTIONS),
            (replace(BOX, gravity=(0.0, 0.0, -9.0)), BOX_OPTIONS),
            (BOX, replace(BOX_OPTIONS, step=2e-4)),
            (BOX, replace(BOX_OPTIONS, forces=())),
            (STAGES, STAGES_OPTIONS),
        )
    }
    assert len(guids) == 5


@pytest.mark.slow
def test_sources_compiled_by_the_system_give_the_same_motion(tmp_path: Path) -> None:
    fmu = build_system_fmu(STAGES, tmp_path, STAGES_OPTIONS, chosen_platforms("host"))
    folder = tmp_path / "unpacked"
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    (binary,) = (folder / "binaries").rglob("*.*")
    binary.unlink()
    flags = ("-O2", "-fPIC", "-fvisibility=hidden", "-Wno-sign-conversion")
    unit = folder / "sources/fmu/system/c/system_all.c"
    linked = compiled(tmp_path / "unit.o", *flags, "-DFMI2_FUNCTION_PREFIX=stages_", "-c", unit)
    # No other name, so that several can be linked into one program.
    names = subprocess.run(["nm", "-g", "--defined-only", linked], capture_output=True, text=True, check=True).stdout
    assert all(line.split()[-1].startswith("stages_") for line in names.splitlines())
    compiled(binary, *flags, "-shared", unit, "-lm")
    inputs = shock(STAGES, STAGES_OPTIONS, 2, 100, 20.0)
    with (
        NativeSystem(Library(folder)).begin() as one,
        NativeSystem(system_library(STAGES, STAGES_OPTIONS)).begin() as two,
    ):
        np.testing.assert_array_equal(one.run(inputs, STEP), two.run(inputs, STEP))


def test_names_are_plain_and_unique() -> None:
    texts = ["circuit board", "circuit-board", "Ö", "", "a" * 50, "a" * 60, "x<&\"'\n"]
    names = unique_names(texts)
    assert len(set(names)) == len(texts)
    assert all(re.fullmatch(r"[A-Za-z0-9_]{1,34}", name) for name in names)
    odd = replace(BOX, points=(*BOX.points, Point('<&"\n\0 Ö', 0, (0.0, 0.0, 0.0))), name='<&"\n\0 Ö')
    contents = system_contents(odd, BOX_OPTIONS, ())
    assert b"acceleration_unnamed_x" in contents["modelDescription.xml"]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"step": 2e-3}, r"`step` must be within \[1e-12, 0.001\] s, the largest step that is stable, got 0.002\."),
        ({"step": 0.0}, r"`step` must be within .*, got 0.0\."),
        ({"step": float("nan")}, r"`step` must be within .*, got nan\."),
        ({"omega_start": -2.0}, r"`omega_start` must be within \[-1, 1\], got -2.0\."),
        ({"forces": (ForceInput("a", 0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),) * 62}, r".* at most 61 forces .* got 62.*"),
    ],
)
def test_options_that_cannot_be_are_refused(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(MountedSystemError, match=f"^{sentence}$"):
        replace(BOX_OPTIONS, **change)
