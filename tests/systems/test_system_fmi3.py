"""The FMU of FMI 3.0 of a system: valid, the bits of FMI 2.0, states, arrays of wrong sizes, calls that it refuses."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from ctypes import byref, c_bool, c_double, c_int, c_int32, c_size_t, c_uint, c_void_p
from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import fmi3LogMessageCallback
from fmpy.validation import validate_fmu
from lxml import etree

import strandspring
from kernel_tools import compiled
from native_tools import ERROR, FUNCTIONS3, HEADERS, OK, Library, doubles
from portable_host import environment
from strandspring.api.fmus.building_system import SystemToBuild
from strandspring.compiled.images import SYSTEM_FILES
from strandspring.compiled.sources import c_sources
from strandspring.errors import MountedSystemError
from strandspring.fmu.description.fmi3_files import BUILD_DESCRIPTION
from strandspring.fmu.native.platforms import chosen_platforms, host_folder
from strandspring.fmu.system.system_check import examine_system_fmu
from strandspring.fmu.system.system_native import build_system_fmu, system_contents, system_identifier
from strandspring.fmu.system.system_variables import SystemFmuOptions
from strandspring.vibration.bodies.mounted import MountedSystem
from system_fmu3_tools import NativeSystem3, system_library3
from system_fmu_tools import BOX, BOX_OPTIONS, STAGES, STAGES_OPTIONS, NativeSystem, shock, system_library

SYSTEMS = {"box": (BOX, BOX_OPTIONS, 3), "stages": (STAGES, STAGES_OPTIONS, 2)}
STEP = 4e-4  # of co-simulation [s]
EXAMPLES = Path(strandspring.__file__).parent / "examples" / "systems"
SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"


@pytest.fixture(params=SYSTEMS)
def case(request: pytest.FixtureRequest) -> tuple[MountedSystem, SystemFmuOptions, int]:
    return SYSTEMS[request.param]


@cache
def box_contents() -> dict[str, bytes]:
    return system_contents(BOX, replace(BOX_OPTIONS, fmi=3), ())


# ---- the motion ------------------------------------------------------------------------------------------------------


def test_the_fmu_is_valid_and_checks_itself(tmp_path: Path, case: Any) -> None:
    system, options, _ = case
    fmu = build_system_fmu(system, tmp_path, replace(options, fmi=3), chosen_platforms("host"))
    assert fmu.name == f"{system_identifier(system)}_fmi3.fmu"
    assert validate_fmu(str(fmu)) == []
    report = examine_system_fmu(fmu, system, options)
    assert report.problems == ()
    assert report.force_difference == 0.0
    assert report.summary.startswith("valid; 250 steps of co-simulation took ")
    # Another system is noticed.
    other = examine_system_fmu(fmu, replace(system, gravity=(0.0, 0.0, -9.0)), options)
    assert any("must be that of the reference" in problem for problem in other.problems)
    without = build_system_fmu(system, tmp_path / "without", replace(options, fmi=3), ())
    assert "no binary for this computer" in str(examine_system_fmu(without, system, options).not_run)


@pytest.mark.parametrize("omega", [-1.0, 0.0, 1.0])
def test_motion_has_the_bits_of_fmi_2(case: Any, omega: float) -> None:
    system, options, bases = case
    inputs = shock(system, options, bases, 300, 60.0)
    with (
        NativeSystem(system_library(system, options)).begin(omega_start=omega) as two,
        NativeSystem3(system_library3(system, options)).begin(omega_start=omega) as three,
    ):
        expected = two.run(inputs, STEP)
        np.testing.assert_array_equal(three.run(inputs, STEP), expected)
        assert three.extrapolating == two.extrapolating
    assert np.ptp(expected, axis=0).max() > 1.0


@pytest.mark.parametrize(
    ("name", "candidate"),
    [("electronics_box", "standard"), ("gun_cradle", "four springs"), ("two_stage_platform", None)],
)
def test_examples_have_the_bits_of_fmi_2(name: str, candidate: str | None) -> None:
    found = SystemToBuild.load(str(EXAMPLES / f"{name}.toml"), candidate)
    system, options = found.system, found.options
    library = system_library(system, options)
    bases = sum(name.startswith("base_acceleration_") for name in library.references)
    inputs = shock(system, options, bases, 100, 40.0)
    with (
        NativeSystem(library).begin() as two,
        NativeSystem3(system_library3(system, options)).begin() as three,
    ):
        expected = two.run(inputs, STEP)
        np.testing.assert_array_equal(three.run(inputs, STEP), expected)
        warnings = [(status, category, text) for status, category, text in two.messages]
        assert three.messages == warnings
    assert np.isfinite(expected).all()


def test_inputs_hold_over_a_step() -> None:
    """Values at the beginning of steps are half a step late; averages of the steps are of second order."""
    length, end = 20e-3, 30e-3  # of a half-sine of 100 m/s^2, and of the run [s]

    def pulse(time: np.ndarray) -> np.ndarray:
        return np.where(time < length, 100.0 * np.sin(np.pi * time / length), 0.0)

    def integral(time: np.ndarray) -> np.ndarray:
        return -100.0 * length / np.pi * np.cos(np.pi * np.minimum(time, length) / length)

    def sway(step: float, averaged: bool) -> float:
        times = step * np.arange(round(end / step) + 1)
        inputs = np.zeros((4, len(times) - 1))
        inputs[0] = np.diff(integral(times)) / step if averaged else pulse(times[:-1])
        with NativeSystem3().begin() as one:
            one.run(inputs, step)
            return one.get("sway_c_g_x")[0]

    exact = sway(1e-4, averaged=True)
    late, middle = ([abs(sway(step, averaged) / exact - 1.0) for step in (1e-3, 5e-4)] for averaged in (False, True))
    # What the page for simulation engineers says.
    assert late == pytest.approx([0.018, 0.0084], rel=0.05)
    assert middle == pytest.approx([2.0e-4, 4.8e-5], rel=0.05)


# ---- states ----------------------------------------------------------------------------------------------------------


def test_states_are_taken_set_and_serialized() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 120, 60.0)
    with NativeSystem3().begin() as one, NativeSystem3(name="two") as two, NativeSystem().begin() as other:
        expected = one.run(inputs, STEP)
        assert one.Reset() == OK
        one.begin()
        one.run(inputs[:, :50], STEP)
        state, content = one.snapshot(), one.serialized()
        np.testing.assert_array_equal(one.run(inputs[:, 50:], STEP), expected[50:])
        assert one.SetFMUState(state) == OK
        assert one.serialized() == content
        np.testing.assert_array_equal(one.run(inputs[:, 50:], STEP), expected[50:])
        # Into another instance, that has not been initialized.
        assert two.restore(content) == OK
        np.testing.assert_array_equal(two.run(inputs[:, 50:], STEP), expected[50:])
        # Not into the FMU of FMI 2.0, which is another one.
        assert other.restore(content) == ERROR
        assert other.said == "The serialized state is from another FMU."
        assert one.restore(content[:-1]) == ERROR
        assert one.said == "The serialized state is truncated or damaged."
        assert one.FreeFMUState(byref(state)) == OK
        assert one.SetFMUState(state) == ERROR
        assert one.said == "`snapshot` of fmi3SetFMUState must not be NULL."


def test_reset_returns_to_the_start_values() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 30, 60.0)
    with NativeSystem3().begin() as one:
        expected = one.run(inputs, STEP)
        one.Reset()
        one.begin(step=2e-4, gravity_z=-20.0).run(inputs, STEP)
        one.Reset()
        assert one.get("step", "gravity_z", "base_acceleration_x", "time") == [1e-4, -9.80665, 0.0, 0.0]
        np.testing.assert_array_equal(one.begin().run(inputs, STEP), expected)


def test_instances_of_both_versions_never_see_each_other() -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 40, 60.0)
    with NativeSystem3().begin() as one:
        expected = one.run(inputs, STEP)
    with NativeSystem3() as one, NativeSystem3(name="two") as two, NativeSystem() as third:
        rows: dict[str, list[list[float]]] = {"one": [], "third": []}
        for each in (one, two, third):
            each.begin()
        for k in range(40):
            for each, share, name in ((one, 1.0, "one"), (two, -0.5, ""), (third, 1.0, "third")):
                names = [name for name in each.library.references if name.startswith(("base_", "load_"))]
                each.set(**dict(zip(names, (share * inputs[:, k]).tolist(), strict=True)))
                assert each.go(k * STEP, STEP) == OK
                if name:
                    rows[name].append(each.outputs())
    np.testing.assert_array_equal(rows["one"], expected[1:])
    np.testing.assert_array_equal(rows["third"], expected[1:])


# ---- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"base_acceleration_x": np.nan}, "`base_acceleration_x` must be finite, got nan; the previous value is kept."),
        ({"load_recoil": np.inf}, "`load_recoil` must be finite, got inf; the previous value is kept."),
        ({"step": 1e-5}, "`step` is fixed after initialization; reset the instance to change it."),
        ({"sway_c_g_x": 0.0}, "`sway_c_g_x` is calculated and cannot be set."),
        ({"time": 0.0}, "`time` is calculated and cannot be set."),
        ({"extrapolating": 0.0}, "`extrapolating` (value reference 1) is Boolean, not Float64."),
        # Nothing is set before all values have been checked.
        ({"load_recoil": 5.0, "sway_c_g_x": 0.0}, "`sway_c_g_x` is calculated and cannot be set."),
    ],
)
def test_values_that_cannot_be_are_refused(values: dict[str, float], sentence: str) -> None:
    with NativeSystem3().begin() as one:
        before = one.serialized()
        assert one.set(**values) == ERROR
        assert one.said == sentence
        assert one.serialized() == before
        assert len(one.messages) == 1


@pytest.mark.parametrize(
    ("name", "value", "bounds"),
    [
        ("step", 0.0, "[1e-12, 0.001] s"), ("step", 2e-3, "[1e-12, 0.001] s"), ("omega_start", 1.5, "[-1.0, 1.0]"),
        ("gravity_y", -1e5, "[-10000.0, 10000.0] m/s^2"),
    ],
)  # fmt: skip
def test_parameters_out_of_bounds_are_refused(name: str, value: float, bounds: str) -> None:
    with NativeSystem3() as one:
        assert one.set(**{name: value}) == ERROR
        assert one.said == f"`{name}` must be within {bounds}, got {value!r}; the previous value is kept."


@pytest.mark.parametrize("count", [0, 1, 3])
def test_arrays_of_another_size_are_refused(count: int) -> None:
    with NativeSystem3().begin() as one:
        before = one.serialized()
        assert one.set_so_many(count, base_acceleration_x=1.0, load_recoil=2.0) == ERROR
        assert one.said == f"`values` of fmi3SetFloat64 must have 2 elements, as the variables have, got {count}."
        references, found = one.references("time", "step"), (c_double * 4)()
        assert one.GetFloat64(references, c_size_t(2), found, c_size_t(count)) == ERROR
        assert one.said == f"`values` of fmi3GetFloat64 must have 2 elements, as the variables have, got {count}."
        flags = (c_bool * 4)()
        of_flag = one.references("extrapolating", "extrapolating")
        assert one.GetBoolean(of_flag, c_size_t(2), flags, c_size_t(count)) == ERROR
        assert one.GetFloat64(None, c_size_t(1), found, c_size_t(1)) == ERROR
        assert one.said == "The value references and `values` of fmi3GetFloat64 must not be NULL."
        assert one.serialized() == before


@pytest.mark.parametrize("reference", [0, -1, 1000, 2**31])
def test_there_are_no_other_variables(reference: int) -> None:
    with NativeSystem3().begin() as one:
        last = max(one.library.references.values())
        assert one.library.references["time"] == last
        found = c_double()
        for unknown in (last + 1, c_uint(reference).value):
            assert one.GetFloat64(byref(c_uint(unknown)), c_size_t(1), byref(found), c_size_t(1)) == ERROR
            assert (
                one.said == f"There is no variable with value reference {unknown}, which was given to fmi3GetFloat64."
            )


def test_steps_that_cannot_be_are_refused() -> None:
    with NativeSystem3().begin() as one:
        before = one.serialized()
        for time, size, sentence in (
            (0.0, np.nan, "The step size at time 0.0 s must be finite and >= 0 [s], got nan."),
            (np.inf, 1.0, "The time of a step must be finite [s], got inf."),
            (0.0, 1e300, "The step of 1e+300 s at time 0.0 s would take more than 100000000 steps of `step` 0.0001 s; "
                         "take a shorter one."),
        ):  # fmt: skip
            assert one.go(time, size) == ERROR
            assert one.said == sentence
        one.set(load_recoil=1e18)
        diverging = one.serialized()
        assert one.go(0.0, 0.1) == ERROR
        assert one.said.startswith("The motion diverges in the step of 0.1 s at time 0.0 s: ")
        assert one.serialized() == diverging
        flag, reached = c_bool(), c_double()
        of_flags = [byref(flag)] * 3
        for missing in range(4):
            given = [None if k == missing else one_of for k, one_of in enumerate([*of_flags, byref(reached)])]
            assert one.DoStep(c_double(0.0), c_double(1e-3), c_bool(True), *given) == ERROR
            assert one.said.endswith(" of fmi3DoStep must not be NULL.")
        one.set(load_recoil=0.0)
        assert one.serialized() == before
        assert one.go(0.0, 1e-3) == OK
        assert one.get("time") == [1e-3]


def test_the_stop_time_and_times_of_the_experiment_are_checked() -> None:
    with NativeSystem3() as one:
        status = one.EnterInitializationMode(c_bool(False), c_double(0.0), c_double(1.0), c_bool(True), c_double(0.5))
        assert status == ERROR
        assert one.said == "The stop time must not be before the start time 1.0 s, got 0.5."
        one.enter_initialization(1.0, 1.5)
        assert one.get("time") == [1.0]
        assert one.ExitInitializationMode() == OK
        assert one.go(1.4, 0.2) == ERROR
        assert "must not go beyond the stop time 1.5 s" in one.said


def test_nothing_calculated_is_read_before_initialization_mode() -> None:
    with NativeSystem3() as one:
        assert one.get("step", "gravity_z", "load_recoil", "time") == [1e-4, -9.80665, 0.0, 0.0]
        sentence = "Nothing calculated is known before initialization mode, in which the bodies come to rest."
        found, flag = c_double(), c_bool()
        assert one.GetFloat64(one.references("sway_c_g_x"), c_size_t(1), byref(found), c_size_t(1)) == ERROR
        assert one.said == sentence
        assert one.GetBoolean(one.references("extrapolating"), c_size_t(1), byref(flag), c_size_t(1)) == ERROR
        assert one.said == sentence
        one.enter_initialization()
        assert sum(one.get(*(f"force_corner_{k}_z" for k in (1, 2, 3, 4)))) == pytest.approx(20.0 * 9.80665, rel=1e-9)
        assert not one.extrapolating


def test_bodies_that_cannot_rest_are_refused() -> None:
    soft = replace(BOX, mounts=tuple(replace(mount, axes=mount.axes[:1]) for mount in BOX.mounts))
    with NativeSystem3(system_library3(soft)) as one:
        one.enter_initialization()
        one.set(gravity_x=3.0)
        assert one.ExitInitializationMode() == ERROR
        assert one.said.startswith("The bodies find no static equilibrium under gravity (3.0, 0.0, -9.80665) m/s^2: ")
        one.set(gravity_x=0.0)
        assert one.ExitInitializationMode() == OK


def test_an_instance_is_refused() -> None:
    for options, sentence in (
        ({"events": True}, "`eventModeUsed` must be false: this FMU has no event mode in co-simulation."),
        ({"intermediate": 1}, "`nRequiredIntermediateVariables` must be 0: this FMU has no intermediate update."),
        ({"name": ""}, "The name of an instance must not be empty."),
    ):
        refused = NativeSystem3(**options)  # type: ignore[arg-type]
        assert refused.component is None
        assert [text for _, _, text in refused.messages] == [sentence]
    refused = NativeSystem3(token="{other}")  # noqa: S106
    assert refused.component is None
    assert refused.said == f"The instantiation token must be {refused.library.guid}, got {{other}}."


@pytest.mark.parametrize(
    ("interface", "more", "sentence"),
    [
        ("ModelExchange", 0, "This FMU has a solver of its own; instantiate it for co-simulation."),
        ("ScheduledExecution", 3, "This FMU has no clocks for scheduled execution; instantiate it for co-simulation."),
    ],
)
def test_other_interfaces_are_refused(interface: str, more: int, sentence: str) -> None:
    library, said = system_library3(), []
    logger = fmi3LogMessageCallback(lambda _, status, category, text: said.append((status, category, text.decode())))
    call = getattr(library.functions, f"fmi3Instantiate{interface}")
    call.restype = c_void_p
    token = library.guid.encode()
    assert call(b"one", token, None, c_bool(False), c_bool(True), None, logger, *[None] * more) is None
    assert said == [(ERROR, b"logStatusError", sentence)]


OF_EXCHANGE = (
    "EnterEventMode", "EvaluateDiscreteStates", "EnterContinuousTimeMode", "UpdateDiscreteStates", "SetTime",
    "CompletedIntegratorStep", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates", "GetEventIndicators",
    "SetContinuousStates", "GetContinuousStates", "GetContinuousStateDerivatives", "GetNominalsOfContinuousStates",
)  # fmt: skip


def test_calls_of_model_exchange_are_refused() -> None:
    with NativeSystem3().begin() as one:
        before = one.serialized()
        for number, call in enumerate(OF_EXCHANGE, start=1):
            arguments = [c_double(0.0)] if call == "SetTime" else [None] * 6
            assert getattr(one, call)(*arguments) == ERROR, call
            assert one.said == f"fmi3{call} must be called in model exchange, but the instance is for co-simulation."
            assert len(one.messages) == number
        assert one.serialized() == before


def test_derivatives_and_other_types_are_refused() -> None:
    with NativeSystem3().begin() as one:
        found, seed, order = c_double(), doubles([1.0]), c_int32(1)
        output, known, size = one.references("sway_c_g_x"), one.references("load_recoil"), c_size_t(1)
        assert one.GetOutputDerivatives(output, size, byref(order), byref(found), size) == ERROR
        assert one.said == "This FMU gives no derivatives of outputs."
        for kind in ("Directional", "Adjoint"):
            call = getattr(one, f"Get{kind}Derivative")
            assert call(output, size, known, size, seed, size, byref(found), size) == ERROR
            assert one.said == f"This FMU gives no {kind.lower()} derivatives."
        number = c_int()
        assert one.GetInt32(output, size, byref(number), size) == ERROR
        reference = one.library.references["sway_c_g_x"]
        assert one.said == f"`sway_c_g_x` (value reference {reference}) is Float64, not Int32."
        flag = c_bool(True)
        assert one.SetBoolean(one.references("extrapolating"), size, byref(flag), size) == ERROR
        assert one.said == "`extrapolating` is calculated and cannot be set."
        assert one.EnterConfigurationMode() == ERROR
        assert one.said == "fmi3EnterConfigurationMode must not be called: there are no structural parameters."


def test_calls_in_a_wrong_mode_are_refused() -> None:
    with NativeSystem3() as one:
        assert one.go(0.0, 1e-3) == ERROR
        assert one.said == "fmi3DoStep must be called while the instance is in step mode, but it is instantiated."
        one.begin()
        assert one.ExitInitializationMode() == ERROR
        assert one.Terminate() == OK
        assert one.set(load_recoil=1.0) == ERROR
        # What was reached can still be read.
        assert one.get("sway_c_g_x") == [0.0]


def test_warnings_come_where_logging_is_on() -> None:
    with NativeSystem3().begin() as one:
        assert one.SetDebugLogging(c_bool(False), c_size_t(0), None) == OK
        one.set(load_recoil=3000.0)
        one.go(0.0, 0.024)
        assert (one.extrapolating, one.messages) == (True, [])
        assert one.set(load_recoil=np.nan) == ERROR
        assert len(one.messages) == 1  # errors cannot be silenced


# ---- files -----------------------------------------------------------------------------------------------------------


def test_description_is_that_of_fmi_2_but_for_what_fmi_3_asks(tmp_path: Path) -> None:
    two, three = (
        fmpy.read_model_description(str(build_system_fmu(BOX, tmp_path, replace(BOX_OPTIONS, fmi=fmi), ())))
        for fmi in (2, 3)
    )
    assert (three.modelName, three.modelExchange) == ("Electronics_box_fmi3", None)
    assert three.guid != two.guid
    simulation = three.coSimulation
    assert simulation.canGetAndSetFMUstate
    assert simulation.canSerializeFMUstate
    assert simulation.canHandleVariableCommunicationStepSize
    for absent in ("hasEventMode", "providesIntermediateUpdate", "mightReturnEarlyFromDoStep"):
        assert not getattr(simulation, absent)
    *variables, time = three.modelVariables
    assert (time.name, time.causality, time.unit) == ("time", "independent", "s")
    assert [v.valueReference for v in three.modelVariables] == list(range(1, len(variables) + 2))
    for one, other in zip(variables, two.modelVariables, strict=True):
        for attribute in ("name", "causality", "variability", "initial", "unit", "displayUnit", "start", "description"):
            assert getattr(one, attribute) == getattr(other, attribute), (one.name, attribute)
        assert (one.type, other.type) in {("Float64", "Real"), ("Boolean", "Boolean")}
    parameters = ["step", "omega_start", "gravity_x", "gravity_y", "gravity_z"]
    for one, other in zip(three.outputs, two.outputs, strict=True):
        assert [v.name for v in one.dependencies] == [*(v.name for v in other.dependencies), *parameters]
    for one, other in zip(three.initialUnknowns, two.initialUnknowns, strict=True):
        assert [v.name for v in one.dependencies] == [v.name for v in other.dependencies]


@pytest.mark.parametrize(
    ("schema", "path"),
    [("fmi3ModelDescription", "modelDescription.xml"), ("fmi3BuildDescription", BUILD_DESCRIPTION)],
)
def test_schemas(schema: str, path: str) -> None:
    found = etree.XMLSchema(file=str(SCHEMAS / f"{schema}.xsd"))
    found.validate(etree.parse(BytesIO(box_contents()[path])))
    assert [str(entry.message) for entry in found.error_log] == []


def test_files_are_those_of_fmi_3() -> None:
    contents = box_contents()
    folders = {name.split("/")[0] for name in contents} - {"modelDescription.xml"}
    assert folders == {"documentation", "terminalsAndIcons", "sources", "resources", "extra"}
    assert contents["terminalsAndIcons/icon.png"].startswith(b"\x89PNG")
    # Importers bring the headers of FMI.
    sources = {name.removeprefix("sources/") for name in contents if name.startswith("sources/")}
    assert sources == {*c_sources(SYSTEM_FILES[3]), "buildDescription.xml"}
    root = ElementTree.fromstring(contents[BUILD_DESCRIPTION])
    assert {one.get("modelIdentifier") for one in root} == {"Electronics_box_fmi3"}
    assert {one.get("name") for one in root.iter("SourceFile")} == {SYSTEM_FILES[3]} < sources
    page = contents["documentation/index.html"].decode()
    for told in ("FMI 3.0 FMU", "no input derivatives", "fmi3DoStep", SYSTEM_FILES[3], "buildDescription.xml"):
        assert told in page, told
    assert "fmi2" not in page
    page2 = system_contents(BOX, BOX_OPTIONS, ())["documentation/index.html"].decode()
    for told in ("FMI 2.0 FMU", "With input derivatives of order 1", "fmi2DoStep", "sources/fmu/system/c/system_all.c"):
        assert told in page2, told


def test_the_same_system_gives_the_same_bytes(tmp_path: Path) -> None:
    options, platforms = replace(BOX_OPTIONS, fmi=3), chosen_platforms("host")
    one = build_system_fmu(BOX, tmp_path / "one", options, platforms)
    assert build_system_fmu(BOX, tmp_path / "two", options, platforms).read_bytes() == one.read_bytes()
    with zipfile.ZipFile(one) as archive:
        assert [name for name in archive.namelist() if name.startswith("binaries/")] == [
            f"binaries/{host_folder(3)}/Electronics_box_fmi3{fmpy.sharedLibraryExtension}"
        ]
    tokens = {
        re.findall(rb'instantiationToken="([^"]+)"', system_contents(system, chosen, ())["modelDescription.xml"])[0]
        for system, chosen in (
            (BOX, options), (replace(BOX, gravity=(0.0, 0.0, -9.0)), options), (BOX, replace(options, step=2e-4)),
            (STAGES, replace(STAGES_OPTIONS, fmi=3)),
        )
    }  # fmt: skip
    assert len(tokens) == 4


def test_names_leave_room_for_the_ending() -> None:
    long = replace(BOX, name="a" * 100)
    assert [len(system_identifier(long, fmi)) for fmi in (2, 3)] == [64, 64]
    assert system_identifier(long, 3).endswith("a_fmi3")


def test_other_versions_are_refused() -> None:
    with pytest.raises(MountedSystemError, match=r"^The version of FMI must be 2 or 3, got 1\.$"):
        replace(BOX_OPTIONS, fmi=1)


def test_exported_functions_are_those_of_fmi_3() -> None:
    functions = system_library3().functions
    assert {name for name in FUNCTIONS3 if hasattr(functions, name)} == FUNCTIONS3
    assert not hasattr(functions, "fmi3_motion_rest")


@pytest.mark.slow
def test_sources_compiled_by_the_system_give_the_same_motion(tmp_path: Path) -> None:
    options = replace(STAGES_OPTIONS, fmi=3)
    fmu = build_system_fmu(STAGES, tmp_path, options, ())
    assert "no binary" in str(examine_system_fmu(fmu, STAGES, options).not_run)
    # By buildDescription.xml.
    subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", str(fmu)],
        cwd=tmp_path, env=environment(), check=True, capture_output=True, timeout=300,
    )  # fmt: skip
    report = examine_system_fmu(fmu, STAGES, options)
    assert (report.not_run, report.problems) == (None, ())
    folder = tmp_path / "unpacked"
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    inputs = shock(STAGES, STAGES_OPTIONS, 2, 100, 20.0)
    with (
        NativeSystem3(Library(folder)).begin() as one,
        NativeSystem3(system_library3(STAGES, STAGES_OPTIONS)).begin() as two,
    ):
        np.testing.assert_array_equal(one.run(inputs, STEP), two.run(inputs, STEP))
    # By hand, with a prefix: no other name, so that several can be linked into one program.
    flags = ("-O2", "-fPIC", "-fvisibility=hidden", "-Wno-sign-conversion", f"-I{HEADERS}")
    unit = folder / "sources" / SYSTEM_FILES[3]
    linked = compiled(tmp_path / "unit.o", *flags, "-DFMI3_FUNCTION_PREFIX=stages_", "-c", unit)
    names = subprocess.run(["nm", "-g", "--defined-only", linked], capture_output=True, text=True, check=True).stdout
    assert all(line.split()[-1].startswith("stages_") for line in names.splitlines())
