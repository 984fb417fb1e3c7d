"""What FMUs refuse, how they say so, and what they log: calls in a wrong mode, arguments, impossible springs."""

from __future__ import annotations

import math
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p, create_string_buffer
from dataclasses import replace
from typing import Any

import pytest
from fmpy.fmi2 import fmi2EventInfo

from fmu_tools import SPRING
from forms import BRANCHES, FORMS, NATIVE_PATHS, STEPPED, SYSTEMS, rows
from native_tools import DISCARD, ERROR, OK, WARNING, Native, Native3, doubles
from springs import TABLE
from strandspring import SpringParameters
from system_fmu_tools import BOX, NativeSystem, system_library

pytestmark = pytest.mark.long

# Calls and modes: sections 3.2.3 and 4.2.4 of FMI 2.0, without the states that no instance reaches: error, fatal, and a
# step in progress, failed or cancelled. o: not legal there, but known from hosts, and does nothing.
LEGAL = """
                               model exchange             co-simulation
                               inst init event cont term  inst init step term
SetDebugLogging                x    x    x     x    x     x    x    x    x
SetupExperiment                x    -    -     -    -     x    -    -    -
EnterInitializationMode        x    -    -     -    -     x    -    -    -
ExitInitializationMode         -    x    -     -    -     -    x    -    -
Terminate                      o    o    x     x    o     o    o    x    o
Reset                          x    x    x     x    x     x    x    x    x
GetReal                        -    x    x     x    x     -    x    x    x
GetInteger                     -    x    x     x    x     -    x    x    x
GetBoolean                     -    x    x     x    x     -    x    x    x
GetString                      -    x    x     x    x     -    x    x    x
SetReal                        x    x    x     x    -     x    x    x    -
SetInteger                     x    x    x     -    -     x    x    x    -
SetBoolean                     x    x    x     -    -     x    x    x    -
SetString                      x    x    x     -    -     x    x    x    -
GetFMUstate                    x    x    x     x    x     x    x    x    x
SetFMUstate                    x    x    x     x    x     x    x    x    x
FreeFMUstate                   x    x    x     x    x     x    x    x    x
SerializedFMUstateSize         x    x    x     x    x     x    x    x    x
SerializeFMUstate              x    x    x     x    x     x    x    x    x
DeSerializeFMUstate            x    x    x     x    x     x    x    x    x
GetDirectionalDerivative       -    x    x     x    x     -    x    x    x
EnterEventMode                 -    -    x     x    -     -    -    -    -
NewDiscreteStates              -    -    x     -    -     -    -    -    -
EnterContinuousTimeMode        -    -    x     -    -     -    -    -    -
CompletedIntegratorStep        -    -    -     x    -     -    -    -    -
SetTime                        -    -    x     x    -     -    -    -    -
SetContinuousStates            -    -    -     x    -     -    -    -    -
GetDerivatives                 -    x    x     x    x     -    -    -    -
GetEventIndicators             -    x    x     x    x     -    -    -    -
GetContinuousStates            -    x    x     x    x     -    -    -    -
GetNominalsOfContinuousStates  x    -    x     x    x     -    -    -    -
SetRealInputDerivatives        -    -    -     -    -     x    x    x    -
GetRealOutputDerivatives       -    -    -     -    -     -    -    x    x
DoStep                         -    -    -     -    -     -    -    x    -
CancelStep                     -    -    -     -    -     -    -    -    -
GetStatus                      -    -    -     -    -     -    -    x    x
GetRealStatus                  -    -    -     -    -     -    -    x    x
GetIntegerStatus               -    -    -     -    -     -    -    x    x
GetBooleanStatus               -    -    -     -    -     -    -    x    x
GetStringStatus                -    -    -     -    -     -    -    x    x
"""
ROWS = {call: legal for call, *legal in (line.split() for line in LEGAL.splitlines()[3:])}
# Where FMI 3.0, sections 2.3, 3.2 and 4.2, says otherwise; what it has not is left out.
DIFFERENT = {
    "GetReal": "x" * 9, "GetBoolean": "x" * 9, "GetNominalsOfContinuousStates": "-xxxx----",
}  # fmt: skip
OF_FMI2 = {
    "SetupExperiment", "GetInteger", "GetString", "SetInteger", "SetString", "SetBoolean", "SetRealInputDerivatives",
    "CancelStep", *(call for call in ROWS if call.endswith("Status")),
}  # fmt: skip
ROWS3 = {call: DIFFERENT.get(call, legal) for call, legal in ROWS.items() if call not in OF_FMI2}
MODES: dict[str, Any] = {
    "me instantiated": lambda one: one,
    "me initialization": lambda one: one.enter_initialization(),
    "me event": lambda one: one.initialize(),
    "me continuous": lambda one: one.begin(),
    "me terminated": lambda one: one.initialize().Terminate(),
    "cs instantiated": lambda one: one,
    "cs initialization": lambda one: one.enter_initialization(),
    "cs step": lambda one: one.initialize(),
    "cs terminated": lambda one: one.initialize().Terminate(),
}
NOTHING = (None, c_size_t(0), None)


def arguments(one: Native, call: str) -> tuple[Any, ...]:
    """Arguments with which a call works wherever it is legal."""
    displacement, force, value = one.references("displacement"), one.references("force"), doubles([0.03])
    state = one.snapshot() if "FMUstate" in call else c_void_p()
    content = one.serialized() if "erialize" in call else b""
    size, none = c_size_t(len(content)), (None, c_size_t(0))
    return {
        "SetDebugLogging": (1, c_size_t(0), None),
        "SetupExperiment": (0, c_double(0.0), c_double(0.0), 0, c_double(0.0)),
        "GetReal": (force, c_size_t(1), value), "SetReal": (displacement, c_size_t(1), value),
        "GetBoolean": (one.references("extrapolating"), c_size_t(1), byref(c_int())),
        "GetInteger": NOTHING, "GetString": NOTHING, "SetInteger": NOTHING, "SetBoolean": NOTHING, "SetString": NOTHING,
        "GetFMUstate": (byref(state),), "SetFMUstate": (state,), "FreeFMUstate": (byref(state),),
        "SerializedFMUstateSize": (state, byref(size)),
        "SerializeFMUstate": (state, create_string_buffer(len(content)), size),
        "DeSerializeFMUstate": (content, size, byref(state)),
        "GetDirectionalDerivative": (force, c_size_t(1), displacement, c_size_t(1), value, doubles([0.0])),
        "NewDiscreteStates": (byref(fmi2EventInfo()),), "CompletedIntegratorStep": (1, byref(c_int()), byref(c_int())),
        "SetTime": (c_double(1.0),), "SetContinuousStates": none, "GetDerivatives": none, "GetContinuousStates": none,
        "GetNominalsOfContinuousStates": none, "GetEventIndicators": (value, c_size_t(1)),
        "SetRealInputDerivatives": (displacement, c_size_t(1), byref(c_int(1)), value),
        "GetRealOutputDerivatives": (force, c_size_t(1), byref(c_int(1)), value),
        "DoStep": (c_double(0.0), c_double(1.0), 1),
        "GetStatus": (0, byref(c_int())), "GetRealStatus": (2, value), "GetIntegerStatus": (0, byref(c_int())),
        "GetBooleanStatus": (3, byref(c_int())), "GetStringStatus": (1, byref(c_char_p())),
    }.get(call, ())  # fmt: skip


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("fmi", [2, 3])
def test_calls_are_legal_where_the_standard_says(fmi: int, mode: str) -> None:
    column, table = list(MODES).index(mode), {2: ROWS, 3: ROWS3}[fmi]
    form = FORMS[
        {"me2": "model exchange", "cs2": "co-simulation", "me3": "fmi3 exchange", "cs3": "fmi3"}[mode[:2] + str(fmi)]
    ]
    for call, legal in table.items():
        with form.instance() as one:
            MODES[mode](one)
            given, before = arguments(one, call), one.serialized()
            one.messages.clear()
            status = getattr(one, call)(*given)
            if legal[column] == "o":
                assert (status, one.serialized(), one.messages) == (OK, before, [])
            elif legal[column] != "x":
                assert status == ERROR, (call, mode)
                assert one.serialized() == before
                assert one.said.startswith(f"fmi{fmi}")
                assert " must " in one.said
            else:
                # What is known of a step that is never pending is nothing.
                expected = DISCARD if call in ("GetStatus", "GetIntegerStatus", "GetStringStatus") else OK
                assert status == expected, (call, mode, one.messages)


def test_what_is_expected_is_said_and_no_instance_is_an_error() -> None:
    assert len(ROWS) == 40  # of the 44 functions of FMI 2.0, all that take an instance that is alive
    with FORMS["co-simulation"].instance() as one:
        one.enter_initialization()
        for call, sentence in (
            (lambda: one.go(0.0, 1.0),
             "fmi2DoStep must be called while the instance is in step mode, but it is in initialization mode."),
            (lambda: one.SetTime(c_double(1.0)),
             "fmi2SetTime must be called in model exchange, but the instance is for co-simulation."),
            (one.CancelStep, "fmi2CancelStep must be called while a step is pending, and steps of this FMU never are."),
        ):  # fmt: skip
            assert call() == ERROR
            assert one.said == sentence
        functions = one.library.functions
        for name in ROWS:
            assert getattr(functions, f"fmi2{name}")(None, *arguments(one, name)) == ERROR, name
        functions.fmi2FreeInstance(None)
        for name, expected in (("TypesPlatform", b"default"), ("Version", b"2.0")):
            function = getattr(functions, f"fmi2Get{name}")
            function.restype = c_char_p
            assert function() == expected
        assert one.ExitInitializationMode() == OK
        one.time = 0.25
        one.advance(0.03, 0.5)
        time, terminated = c_double(), c_int(-1)
        assert one.GetRealStatus(2, byref(time)) == one.GetBooleanStatus(3, byref(terminated)) == OK
        assert (time.value, terminated.value) == (0.75, 0)
        for name, kind in (("GetStatus", 0), ("GetStringStatus", 1), ("GetIntegerStatus", 0), ("GetRealStatus", 3)):
            assert getattr(one, name)(kind, byref(c_double())) == DISCARD
            assert "steps of this FMU are never pending" in one.said
        state, size = one.snapshot(), len(one.serialized())
        content = create_string_buffer(b"." * (size - 1))
        assert one.SerializeFMUstate(state, content, c_size_t(size - 1)) == ERROR
        assert one.said == f"A serialized state must have {size} bytes, got {size - 1}."
        assert content.value == b"." * (size - 1)


@pytest.mark.parametrize("name", ["co-simulation", "model exchange"])
def test_no_pointer_may_be_null(name: str) -> None:
    column, checked = list(MODES).index("cs step" if name == "co-simulation" else "me event"), 0
    for call, legal in ROWS.items():
        with FORMS[name].instance() as one:
            one.initialize()
            places = [
                i for i, v in enumerate(arguments(one, call)) if not isinstance(v, int | c_double | c_size_t | None)
            ]
            for place in places if legal[column] == "x" and call != "FreeFMUstate" else ():
                given = list(arguments(one, call))
                given[place] = None
                before = one.serialized()
                assert getattr(one, call)(*given) == ERROR, (call, place)
                assert "must not be NULL" in one.said
                assert one.serialized() == before
                checked += 1
            assert one.FreeFMUstate(None) == one.FreeFMUstate(byref(c_void_p())) == OK
            assert one.FreeFMUstate(one.snapshot()) == OK  # as fmusim 0.0.39 gives it
    assert checked >= 15


@pytest.mark.parametrize("name", ["model exchange", "fmi3 exchange", "states"])
def test_counts_must_be_those_of_the_description(name: str) -> None:
    form = FORMS[name]
    states, indicators = (2, 0) if form.has_states else (0, 1)
    with form.begun() as one:
        for call, right in (
            ("GetEventIndicators", indicators), ("GetDerivatives", states), ("GetContinuousStates", states),
            ("SetContinuousStates", states), ("GetNominalsOfContinuousStates", states),
        ):  # fmt: skip
            assert getattr(one, call)(doubles([0.0] * 3), c_size_t(right)) == OK, one.said
            for count in {right - 1, right + 1} - {-1}:
                assert getattr(one, call)(doubles([0.0] * 3), c_size_t(count)) == ERROR, call
                assert one.said.endswith(f"must have {right} elements, got {count}.")
    with FORMS["fmi3 arrays"].instance() as one:
        one.enter_initialization()
        for length in (0, 1, 3, 5):
            for setting in ("SetFloat64", "GetFloat64"):
                given = (one.references("kE"), c_size_t(1), doubles([1.0] * 5), c_size_t(length))
                assert Native3.__getattr__(one, setting)(*given) == ERROR  # type: ignore[arg-type]
        assert one.library.references.keys() >= {"kE", "kA", "rho"}


def sealed(content: bytearray) -> bytes:
    """A state with the checksum (FNV-1a) that belongs to it."""
    total = 0xCBF29CE484222325
    for byte in content[28:]:
        total = (total ^ byte) * 0x100000001B3 % 2**64
    content[20:28] = total.to_bytes(8, "little")
    return bytes(content)


def test_a_crafted_state_is_refused_or_does_no_harm() -> None:
    """Among them one without the direction that a spring has that has moved, without which energy is no number."""
    with FORMS["co-simulation"].begun() as one:
        one.advance(0.03)
        before, refused = one.serialized(), set()
        assert sealed(bytearray(before)) == before
        crafts = [
            (place, bad)
            for place in range(66, len(before) - 7, 4)
            for bad in (b"\xff" * 8, b"\0" * 6 + b"\xf0\x7f", b"\7" * 8, b"\0" * 6 + b"\xf8\x3f")
        ]
        crafts += [(place, b"\0") for place in range(66, len(before) - 3) if before[place : place + 4] == b"\1\0\0\0"]
        for place, bad in crafts:
            content = bytearray(before)
            content[place : place + len(bad)] = bad
            if one.restore(sealed(content)) == ERROR:
                refused.add((one.said, len(bad)))
            elif len(bad) == 1:
                assert math.isfinite(one.get("absorbed_energy")[0])
            else:
                one.go(0.0, 1.0)
                one.GetReal(one.references("force"), c_size_t(1), doubles([0.0]))
            assert one.restore(before) == OK
    fields = ["mode", "time", "displacement", "input derivatives", "memory", "flags", "watch", "settings"]
    assert {(f"The serialized state is damaged in its field `{field}`.", 8) for field in fields} <= refused
    assert ("The serialized state is damaged in its field `memory`.", 1) in refused
    assert any("`rho` must be within" in text for text, _ in refused)
    for name in SYSTEMS:
        with FORMS[name].begun() as one:
            one.advance(1.0)
            before = one.serialized()
            for place, bad, field in ((66, b"\3\0\0\0", "mode"), (70, b"\xff" * 8, "time"), (190, b"\2", "flags")):
                content = bytearray(before)
                content[place : place + len(bad)] = bad
                assert one.restore(sealed(content)) == ERROR
                assert one.said == f"The serialized state is damaged in its field `{field}`."
            assert one.serialized() == before


@pytest.mark.parametrize("name", ["co-simulation", "python"])
def test_no_such_variable_or_another_type(name: str) -> None:
    form = FORMS[name]
    cases = [
        ("GetReal", 999, "value reference 999"), ("GetReal", 2**32 - 1, "" if form.python else "4294967295"),
        ("GetReal", 4, "`extrapolating`"), ("GetInteger", 1, "is Real, not Integer"),
        ("GetBoolean", 1, "is Real, not Boolean"), ("GetString", 0, "is Real, not String"),
        ("SetReal", 999, "value reference 999"), ("SetInteger", 0, "is Real, not Integer"),
        ("SetBoolean", 4, "is calculated"), ("SetString", 0, "is Real, not String"),
    ]  # fmt: skip
    with form.begun() as one:
        before = one.serialized()
        for call, reference, text in cases:
            value = (c_char_p * 1)(b"1") if "String" in call else create_string_buffer(8)
            assert getattr(one, call)((c_uint * 1)(reference), c_size_t(1), value) == form.refusal
            assert text in one.said
            assert one.serialized() == before


def test_instances_that_are_refused() -> None:
    form = FORMS["co-simulation"]
    for given, text in (
        ({"guid": "{%s%n}"}, "The GUID must be {"), ({"guid": "{%s%n}"}, "got {%s%n}."),
        ({"name": ""}, "The name of an instance must not be empty."), ({"kind": 2}, "got 2."),
        ({"kind": -1}, "got -1."),
    ):  # fmt: skip
        one = Native(form.library(), **given)  # type: ignore[arg-type]
        assert one.component is None
        assert one.messages[-1][:2] == (ERROR, "logStatusError")
        assert text in one.said
    formats = Native(form.library(), guid="{%s%n}", as_formats=True)
    assert formats.said == Native(form.library(), guid="{%s%n}").said.replace("%", "%%")
    of = form.library()
    assert of.functions.fmi2Instantiate(b"one", 1, of.guid.encode(), of.resources, None, 0, 0) is None
    states = Native(FORMS["states"].library())
    assert states.component is None
    assert states.said == "This form of the FMU has continuous states and no solver; instantiate it for model exchange."
    for given in ({"guid": "{x}"}, {"name": ""}, {"events": True}):
        for name in ("fmi3", "system, fmi3"):
            assert Native3(FORMS[name].library(), **given).component is None  # type: ignore[arg-type]


# Steps


@pytest.mark.parametrize("name", ["co-simulation", "fmi3", "system", "system, fmi3"])
def test_start_and_stop_times(name: str) -> None:
    with FORMS[name].instance() as one:
        for start, stop, text in (
            (math.nan, 1.0, "finite [s], got nan"), (1.0, 0.5, "got 0.5"), (1.0, math.nan, "got nan")
        ):  # fmt: skip
            before = one.serialized()
            setup = one.SetupExperiment(0, c_double(0.0), c_double(start), 1, c_double(stop))
            assert (setup or one.EnterInitializationMode()) == ERROR
            assert text in one.said
            assert one.serialized() == before


@pytest.mark.parametrize("name", [*STEPPED, *SYSTEMS])
def test_steps_that_are_refused_change_nothing(name: str) -> None:
    form = FORMS[name]
    with form.instance() as one:
        one.enter_initialization(0.0, None if form.python else 0.3)
        assert name in SYSTEMS or one.set(displacement=form.spring.displacement_offset) == OK
        assert form.python or one.go(0.0, 1e-3) == ERROR
        assert one.ExitInitializationMode() == OK
        one.time = 0.2
        one.advance(form.spring.displacement_max, 0.1)  # 0.30000000000000004 s is the stop time rounded
        content = one.serialized()
        refused = [(0.1, -1e-3, "-0.001"), (0.1, math.nan, "nan"), (0.1, math.inf, "inf"), (0.1, -math.inf, "-inf")]
        if not form.python:
            refused += [
                (math.nan, 0.1, "The time of a step must be finite [s], got nan"), (-math.inf, 1.0, "got -inf"),
                (1.7e308, 1.7e308, "1.7e+308"),
                (0.3, 1e-3, "The step of 0.001 s at time 0.3 s must not go beyond the stop time 0.3 s."),
            ]  # fmt: skip
        for time, size, text in refused:
            assert one.go(time, size) == form.refusal
            assert text in one.said
            assert one.serialized() == content


def test_motion_of_a_system_that_diverges_is_refused() -> None:
    for name in SYSTEMS:
        with FORMS[name].begun() as one:
            # Also where a velocity or an energy is beyond all bounds before a displacement is.
            for load, size in ((1e18, 0.1), (1e308, 0.1), (1e308, 1e-200)):
                assert one.set(load_recoil=load) == OK
                before = one.serialized()
                assert one.go(0.0, size) == ERROR
                assert one.said.startswith(f"The motion diverges in the step of {size} s at time 0.0 s: a displacement")
                assert one.serialized() == before
            assert one.go(0.0, 1e300) == ERROR
            assert "The step of 1e+300 s at time 0.0 s would take more than 100000000 steps of `step`" in one.said
            assert one.set(load_recoil=0.0) == one.go(0.0, 0.1) == OK


# Of the input, beyond any displacement, also where half of the acceleration is 0; a rate that none can have. Where the
# size of a step is given, the step refuses.
DERIVATIVES: list[tuple[tuple[float, ...], tuple[int, ...], str, float, str]] = [
    ((math.nan,), (1,), "displacement", 0.0, "derivative of order 1 of `displacement` must be finite, got nan"),
    ((math.inf,), (2,), "displacement", 0.0, "derivative of order 2 of `displacement` must be finite, got inf"),
    ((1.0,), (3,), "displacement", 0.0, "must be 1 or 2, got 3"),
    ((1.0,), (0,), "displacement", 0.0, "must be 1 or 2, got 0"), ((1.0,), (1,), "force", 0.0, "`force` is not an in"),
    ((1.0,), (1,), "rho", 0.0, "`rho` is not an input"),
    ((1e200, 1e308), (1, 2), "displacement", 1e10, "1e+200 m/s and 1e+308 m/s^2 of `displacement` must keep it within"),
    ((-1e8,), (1,), "displacement", 100.0, "must keep it within +-1e+09 m"),
    ((1e8, -2e6), (1, 2), "displacement", 100.0, "must keep it within +-1e+09 m"),  # on the way only
    ((-1e8, 2e6), (1, 2), "displacement", 100.0, "must keep it within +-1e+09 m"),
    ((0.0, -1e300), (1, 2), "displacement", 1e-150, "and its rate within +-1e+09 m/s, in the step at time 0.0 s."),
    ((0.0, 5e-324), (1, 2), "displacement", 1e171, "of `displacement` must keep it within +-1e+09 m"),
    ((0.0, 1e300), (1, 2), "displacement", 1e-150, "and its rate within +-1e+09 m/s, in the step at time 0.0 s."),
]  # fmt: skip


def test_derivatives_of_inputs_that_are_refused() -> None:
    for values, orders, variable, size, text in DERIVATIVES:
        with FORMS["co-simulation"].begun() as one:
            names = [variable] * len(values)
            assert not size or one.set_derivatives(*values, orders=orders, names=names) == OK
            before = one.serialized()
            assert (one.go(0.0, size) if size else one.set_derivatives(*values, orders=orders, names=names)) == ERROR
            assert text in one.said
            assert one.serialized() == before
    with FORMS["branches"].begun() as one:
        assert one.set_derivatives(0.1, orders=(1,)) == ERROR
        assert "moves straight through a step" in one.said


@pytest.mark.parametrize("name", NATIVE_PATHS)
def test_refused_derivatives_of_outputs_write_nothing(name: str) -> None:
    form = FORMS[name]
    refused: list[tuple[str, str, float, int, str]] = [
        ("displacement", "displacement", 1.0, ERROR, "`displacement` is not an output"),
        ("omega", "displacement", 1.0, ERROR, "`omega` is not an output"),
        ("rho", "displacement", 1.0, ERROR, "`rho` is not an output"),
        ("force", "stiffness", 1.0, ERROR, "`stiffness` is calculated"),
        ("force", "input_resolution", 1.0, ERROR, "respect to `input_resolution`"),
        ("extrapolating", "displacement", 1.0, ERROR, "`extrapolating`"),
        ("force", "extrapolating", 1.0, ERROR, "`extrapolating`"),
        ("force", "kappa_omega", math.nan, ERROR, "The seed of `kappa_omega` must be finite, got nan."),
        ("force", "displacement", 1e308, DISCARD, "overflows; use smaller seeds."),
        ("force", "n", 1.0, ERROR, "An FMU for real time gives no derivatives with respect to `n`")
        if form.is_real_time
        else ("absorbed_energy", "rho", 1.0, ERROR, "respect to `rho` is available in initialization mode"),
    ]
    with form.begun() as one:
        for unknown, known, seed, status, text in refused:
            assert one.directional(["stiffness", unknown], {known: seed}) == status, (unknown, known)
            assert text in one.said
            assert list(one.found) == [7.0, 7.0]
        for output, order, text in (
            ("force", 0, "order of the derivative of `force` must be 1, got 0"), ("force", 2, "must be 1, got 2"),
            ("displacement", 1, "`displacement` is not an output"), ("omega", 1, "`omega` is not an output"),
        ):  # fmt: skip
            if not form.exchange:
                assert one.output_derivatives("force", output, order=order) == ERROR
                assert text in one.said


# Values


@pytest.mark.parametrize("name", [*rows(), *SYSTEMS])
def test_values_that_are_refused_change_nothing(name: str) -> None:
    form = FORMS[name]
    kept, calculated = "; the previous value is kept.", "is calculated and cannot be set."
    fixed = "is fixed after initialization; reset the instance to change it."
    with form.begun(**({} if form.has_states or name in SYSTEMS else form.starts)) as one:
        content = form.moved(one)
        if form.exchange:  # where parameters may be set
            assert one.EnterEventMode() == OK
            content = one.serialized()
        refused = {
            **{("displacement", bad): f"`displacement` must be within +-1e+09 m, got {bad!r}{kept}"
               for bad in (math.nan, math.inf, -math.inf, 1.001e9)},
            **{("n", bad): f"`n` must be finite, got {bad!r}{kept}" for bad in (math.nan, math.inf, -math.inf)},
            ("rho", -1.0): "`rho` must be > 0 [1/m], got -1.0",
            ("sigma", 0.4): "`sigma` must be within [0.5, 1000], got 0.4",
            ("kA_0", 2.0): f"`kA_0` {fixed}", ("kA_1", -1e5): "the amplifier FA (coefficients `kA`) must be > 0",
            ("displacement_max", 1.0): f"`displacement_max` {fixed}", ("omega_start", 0.5): f"`omega_start` {fixed}",
            ("second_rho", -1.0): "`second_rho` must be > 0 [1/m], got -1.0.",
            ("branch_2_stiffness", -5.0): "`branch_2_stiffness` must be within [0, ",
            ("branch_0_time_constant", 0.0): "`branch_0_time_constant` must be within [1e-09, 1e+09] s, got 0.0.",
            ("FE_forces_2", 1e154): "`FE_forces_2` must be within +-1e+15 N, got 1e+154.",
            **{("input_resolution", bad): "`input_resolution`" for bad in (-1e-9, 2e9, math.nan)},
            ("velocity", math.inf): f"`velocity` must be within +-1e+09 m/s, got inf{kept}",
            **{(output, 1.0): f"`{output}` {calculated}" for output in ("force", "stiffness", "der(omega)")},
            ("omega", 1.0): f"`omega` {calculated}",
            ("base_acceleration_x", math.nan): f"`base_acceleration_x` must be finite, got nan{kept}",
            ("load_recoil", math.inf): f"`load_recoil` must be finite, got inf{kept}",
            ("step", 1e-5): f"`step` {fixed}", ("sway_c_g_x", 0.0): f"`sway_c_g_x` {calculated}",
        }  # fmt: skip
        if form.has_states:
            del refused["omega", 1.0]
            refused["omega", math.nan] = f"`omega` must be within +-1e+100, got nan{kept}"
            assert form.spring.second or one.set_states(0.0, math.nan) == ERROR
        given = {pair: text for pair, text in refused.items() if pair[0] in one.library.references}
        assert len(given) > (3 if name in SYSTEMS else 10)
        for (variable, bad), text in given.items():
            good = {} if variable == one.input else {one.input: form.spring.displacement_min}
            assert one.set(**good, **{variable: bad}) == form.refusal, variable
            assert text in one.said
            assert one.serialized() == content  # all or none


# Values in initialization mode of which no spring can be, and what the refusal names, if not the variable.
IMPOSSIBLE: dict[SpringParameters, list[tuple[str, float, str]]] = {
    SPRING: [
        *(("rho", bad, "") for bad in (-1.0, 0.0, 1e-309, 1e154)), ("kappa_omega", 0.0, ""), ("kappa_omega", 1e154, ""),
        ("sigma", 0.4, ""), ("sigma", -1e308, ""), ("n", 0.0, ""), ("n", 1e3, ""), ("kA_0", 2.0, ""),
        ("kA_1", -1e3, "the amplifier FA"), ("kA_2", 1e300, ""), ("kE_2", 1e308, ""), ("displacement_min", 0.06, ""),
        ("displacement_min", -1e154, ""), ("displacement_max", 0.0, ""), ("displacement_offset", 1.0, ""),
        ("omega_start", 1.0000001, ""), ("omega_start", 1e308, ""),
    ],
    TABLE: [
        ("FE_knots_3", 0.03, "`FE_knots_3` must lie above `FE_knots_2` by 4e-05 m or more, 0.001 of the range"),
        ("displacement_max", 0.08, "`FE_knots_9` must be `displacement_max`, 0.08 m, got 0.07."),
        ("FE_forces_2", 1e154, "`FE_forces_2` must be within +-1e+15 N, got 1e+154."),
    ],
    BRANCHES: [
        ("second_n", 1e4, "`second_n` must be within [0.01, 100], got 10000.0."),
        ("second_kA_1", -1e4, "the amplifier FA (coefficients `second_kA`) must be > 0 over the identified range"),
        ("second_omega_start", 1.0000001, "`second_omega_start` must be within [-1, 1], got 1.0000001."),
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", rows(lambda form: "arrays" not in form.options))
def test_a_spring_that_cannot_be_does_not_leave_initialization(name: str) -> None:
    form = FORMS[name]
    impossible = [case for case in IMPOSSIBLE[form.spring] if case[0] in form.library().references]
    if form.has_states:
        states = ("omega", "second_omega")[: len(form.spring.mechanisms)]
        impossible += [(state, 1.05, f"`{state}` must begin within [-1, 1], got 1.05.") for state in states]
    for variable, bad, text in impossible:
        with form.instance() as one:
            good = one.enter_initialization().get(variable)[0]
            assert one.set(displacement=form.spring.displacement_offset, **{variable: bad}) == OK
            content = one.serialized()
            for _ in range(2):
                assert one.ExitInitializationMode() == form.refusal, (variable, bad)
                assert (text or f"`{variable}`") in one.said, one.said
                assert "got" in one.said
            if not form.python and "omega" not in variable:
                assert one.directional(["force"], {"displacement": 1.0}) == ERROR
                assert (text or f"`{variable}`") in one.said, one.said
            assert one.serialized() == content
            assert one.set(**{variable: good}) == OK
            assert one.ExitInitializationMode() == OK


def test_a_system_that_cannot_be_does_not_leave_initialization() -> None:
    soft = replace(BOX, mounts=tuple(replace(mount, axes=mount.axes[:1]) for mount in BOX.mounts))
    with NativeSystem(system_library(soft)) as one:
        for variable, value, limits in (
            ("step", 2e-3, "[1e-12, 0.001] s"), ("omega_start", 1.5, "[-1.0, 1.0]"),
            ("gravity_y", -1e5, "[-10000.0, 10000.0] m/s^2"),
        ):  # fmt: skip
            assert one.set(**{variable: value}) == ERROR
            assert one.said == f"`{variable}` must be within {limits}, got {value!r}; the previous value is kept."
        one.enter_initialization()
        one.set(gravity_x=3.0)
        assert one.ExitInitializationMode() == ERROR
        assert one.said.startswith("The bodies find no static equilibrium under gravity (3.0, 0.0, -9.80665) m/s^2: ")
        assert one.GetReal(one.references("sway_c_g_x"), c_size_t(1), doubles([0.0])) == ERROR
        one.set(gravity_x=0.0)
        assert one.ExitInitializationMode() == OK


# What is logged


@pytest.mark.parametrize("name", STEPPED)
def test_one_warning_for_each_excursion(name: str) -> None:
    form = FORMS[name]
    low, high = form.spring.displacement_min, form.spring.displacement_max
    span = high - low
    with form.begun(high) as one:
        one.advance(low)  # the ends are inside
        excursions = [
            (low, False), (high + 0.02 * span, True), (high + span, True), (high, False), (low - span, True),
            (low, False), (high + span, True), (low - 0.5 * span, True),
        ]  # fmt: skip
        for x, outside in excursions:
            if not form.is_real_time:
                assert one.set(displacement=high + 9.0 * span) == OK
                assert one.extrapolating
            one.advance(x)
            assert one.extrapolating is outside
        expected = [] if form.is_real_time else [high + 0.02 * span, low - span, high + span, low - 0.5 * span]
        assert [status for status, _, _ in one.messages] == [WARNING] * len(expected)
        assert [float(text.split()[1]) for _, _, text in one.messages] == pytest.approx(expected, rel=1e-15)
        assert all(f"[{low}, {high}] m" in text for _, _, text in one.messages)


@pytest.mark.parametrize("name", SYSTEMS)
def test_each_excursion_of_a_system_out_of_a_range_is_warned_of_once(name: str) -> None:
    names = [f"displacement_corner_{k}_{axis}" for k in (1, 2, 3, 4) for axis in "zxy"]
    with FORMS[name].begun(load_recoil=3000.0) as one:
        assert (one.extrapolating, one.messages) == (False, [])
        states: list[list[bool]] = []
        for k in range(3000):
            assert k != 240 or one.set(load_recoil=0.0) == OK
            assert one.go(k * 1e-4, 1e-4) == OK
            states.append([abs(x) > 0.03 for x in one.get(*names)])
            assert one.extrapolating == any(states[-1])
        excursion = "lies outside the identified range [-0.03, 0.03] m: the force is extrapolated"
        assert all(excursion in text for _, _, text in one.messages)
        warned = [text.split("`")[1] for _, _, text in one.messages]
        for variable, of_one in zip(names, zip(*states, strict=True), strict=True):
            assert warned.count(variable) == sum(
                now and not was for was, now in zip((False, *of_one[:-1]), of_one, strict=True)
            )
        assert len(set(warned)) < len(warned)


@pytest.mark.parametrize("name", ["co-simulation", "fmi3"])
def test_categories(name: str) -> None:
    with FORMS[name].begun() as one:
        for on, categories, warned, refused in (
            (1, [b"logStatusError"], False, True), (1, [b"logStatusWarning"], True, False),
            (1, [b"logAll"], True, True), (0, [], False, False), (1, [], True, True), (0, [b"logAll"], False, False),
        ):  # fmt: skip
            many = c_size_t(len(categories)), (c_char_p * len(categories))(*categories)
            if name == "fmi3":  # each is switched by itself there, and errors are always logged
                one.SetDebugLogging(0, c_size_t(1), (c_char_p * 1)(b"logAll"))
            assert one.SetDebugLogging(on, *many) == OK
            one.messages.clear()
            one.advance(0.06)
            one.set(displacement=math.nan)
            one.advance(0.02)
            told = {status for status, _, _ in one.messages}
            assert (WARNING in told, ERROR in told) == (warned, refused or name == "fmi3"), (on, categories)


@pytest.mark.parametrize("bad", [b"logFatal", b"", b"%s%n#r0#\xc3\xbc", b"x" * 500, None])
def test_unknown_categories_are_refused_and_what_had_been_chosen_holds_on(bad: bytes | None) -> None:
    with FORMS["co-simulation"].instance(logging=False) as one:
        one.SetDebugLogging(1, c_size_t(1), (c_char_p * 1)(b"logStatusError"))
        assert one.SetDebugLogging(1, c_size_t(2), (c_char_p * 2)(b"logAll", bad)) == ERROR
        shown = "NULL" if bad is None else bad[:63].decode("latin-1").translate({0xC3: "?", 0xBC: "?", ord("#"): "?"})
        assert one.said == f"A log category must be logAll, logStatusWarning or logStatusError, got {shown}."
        one.begin().advance(0.06)
        assert [status for status, _, _ in one.messages] == [ERROR]
    with FORMS["co-simulation"].instance(logging=False) as one:  # without debug logging, errors and warnings are
        one.begin().advance(0.06)
        one.set(displacement=math.nan)
        assert [status for status, _, _ in one.messages] == [WARNING, ERROR]
