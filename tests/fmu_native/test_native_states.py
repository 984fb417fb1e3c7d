"""What FMUs refuse, and how it says so: calls in the wrong mode, wrong arguments, impossible springs."""

from __future__ import annotations

import math
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p, create_string_buffer

import numpy as np
import pytest
from fmpy.fmi2 import fmi2EventInfo

from fmu_tools import SPRING
from native_tools import (
    CO_SIMULATION,
    DISCARD,
    ERROR,
    MODEL_EXCHANGE,
    OK,
    WARNING,
    Native,
    close,
    doubles,
    library,
)
from strandspring.kernel.path import PathSolver

NOT_FINITE = [math.nan, math.inf, -math.inf]

# Sections 3.2.3 and 4.2.4 of FMI 2.0, without the states that no instance reaches: error, fatal, and a step in
# progress, failed or cancelled; o: not legal there, but known from hosts, and does nothing.
MODES = {
    "me instantiated": Native.__enter__,
    "me initialization": lambda one: one.enter_initialization(),
    "me event": lambda one: one.initialize(),
    "me continuous": lambda one: one.begin_continuous_time(),
    "me terminated": lambda one: one.initialize().Terminate(),
    "cs instantiated": Native.__enter__,
    "cs initialization": lambda one: one.enter_initialization(),
    "cs step": lambda one: one.initialize(),
    "cs terminated": lambda one: one.initialize().Terminate(),
}
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
ROWS = [line.split() for line in LEGAL.splitlines()[3:]]
NOTHING = (None, c_size_t(0), None)


@pytest.fixture
def spring():
    with Native() as one:
        yield one


def arguments(one: Native, call: str) -> tuple:
    """Arguments with which a call works wherever it is legal."""
    displacement, force, value = one.references("displacement"), one.references("force"), doubles([0.03])
    state = one.snapshot() if "FMUstate" in call else c_void_p()
    content = one.serialized() if "erialize" in call else b""
    size = c_size_t(len(content))
    return {
        "SetDebugLogging": (1, c_size_t(0), None),
        "SetupExperiment": (0, c_double(0.0), c_double(0.0), 0, c_double(0.0)),
        "GetReal": (force, c_size_t(1), value),
        "SetReal": (displacement, c_size_t(1), value),
        "GetBoolean": (one.references("extrapolating"), c_size_t(1), byref(c_int())),
        "GetInteger": NOTHING, "GetString": NOTHING, "SetInteger": NOTHING, "SetBoolean": NOTHING, "SetString": NOTHING,
        "GetFMUstate": (byref(state),), "SetFMUstate": (state,), "FreeFMUstate": (byref(state),),
        "SerializedFMUstateSize": (state, byref(size)),
        "SerializeFMUstate": (state, create_string_buffer(len(content)), size),
        "DeSerializeFMUstate": (content, size, byref(state)),
        "GetDirectionalDerivative": (force, c_size_t(1), displacement, c_size_t(1), value, doubles([0.0])),
        "NewDiscreteStates": (byref(fmi2EventInfo()),),
        "CompletedIntegratorStep": (1, byref(c_int()), byref(c_int())),
        "SetTime": (c_double(1.0),),
        "SetContinuousStates": (None, c_size_t(0)), "GetDerivatives": (None, c_size_t(0)),
        "GetContinuousStates": (None, c_size_t(0)), "GetNominalsOfContinuousStates": (None, c_size_t(0)),
        "GetEventIndicators": (value, c_size_t(1)),
        "SetRealInputDerivatives": (displacement, c_size_t(1), byref(c_int(1)), value),
        "GetRealOutputDerivatives": (force, c_size_t(1), byref(c_int(1)), value),
        "DoStep": (c_double(0.0), c_double(1.0), 1),
        "GetStatus": (0, byref(c_int())), "GetRealStatus": (2, value), "GetIntegerStatus": (0, byref(c_int())),
        "GetBooleanStatus": (3, byref(c_int())), "GetStringStatus": (1, byref(c_char_p())),
    }.get(call, ())  # fmt: skip


def test_the_table_knows_every_call(spring):
    assert len(ROWS) == 40  # of the 44 functions of FMI 2.0, all that take an instance that is alive
    assert all(hasattr(spring.library.functions, f"fmi2{call}") for call, *_ in ROWS)
    assert {len(row) for row in ROWS} == {1 + len(MODES)}


@pytest.mark.parametrize("mode", MODES)
def test_calls_are_legal_where_the_standard_says(mode):
    column = 1 + list(MODES).index(mode)
    for call, *legal in ROWS:
        with Native(library(), MODEL_EXCHANGE if mode.startswith("me") else CO_SIMULATION) as one:
            MODES[mode](one)
            given = arguments(one, call)
            before = one.serialized()
            one.messages.clear()
            status = getattr(one, call)(*given)
            if legal[column - 1] == "o":
                assert (status, one.serialized(), one.messages) == (OK, before, [])
            elif legal[column - 1] != "x":
                assert status == ERROR, (call, mode)
                assert one.serialized() == before
                assert one.said.startswith(f"fmi2{call} must ")
            else:
                # What is known of a step that is never pending is nothing.
                expected = DISCARD if call in ("GetStatus", "GetIntegerStatus", "GetStringStatus") else OK
                assert status == expected, (call, mode, one.messages)


def test_what_is_expected_is_reported(spring):
    spring.enter_initialization()
    spring.DoStep(c_double(0.0), c_double(1.0), 1)
    assert (
        spring.said == "fmi2DoStep must be called while the instance is in step mode, but it is in initialization mode."
    )
    spring.SetTime(c_double(1.0))
    assert spring.said == "fmi2SetTime must be called in model exchange, but the instance is for co-simulation."
    spring.CancelStep()
    assert spring.said == "fmi2CancelStep must be called while a step is pending, and steps of this FMU never are."


def test_no_instance_is_an_error():
    functions = library().functions
    with Native() as one:
        one.initialize()
        for call, *_ in ROWS:
            assert getattr(functions, f"fmi2{call}")(None, *arguments(one, call)) == ERROR, call
    functions.fmi2FreeInstance(None)


def test_types_platform_and_version():
    functions = library().functions
    for name, expected in (("TypesPlatform", b"default"), ("Version", b"2.0")):
        function = getattr(functions, f"fmi2Get{name}")
        function.restype = c_char_p
        assert function() == expected


# Instances


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"guid": "{%s%n}"}, "The GUID must be {"), ({"guid": "{%s%n}"}, "got {%s%n}."),
        ({"name": ""}, "The name of an instance must not be empty."),
        ({"kind": 2}, "got 2."), ({"kind": -1}, "got -1."),
    ],
)  # fmt: skip
def test_instances_that_are_refused(given, text):
    one = Native(library(), **given)
    assert one.component is None
    assert one.messages[-1][:2] == (ERROR, "logStatusError")
    assert text in one.said


def test_a_logger_that_shows_formats_shows_all_of_a_message():
    written = Native(library(), guid="{%s%n}").said
    assert "{%s%n}" in written
    assert Native(library(), guid="{%s%n}", as_formats=True).said == written.replace("%", "%%")


def test_an_instance_without_callbacks_is_refused():
    of = library()
    assert of.functions.fmi2Instantiate(b"one", 1, of.guid.encode(), of.resources, None, 0, 0) is None


def test_start_and_stop_times(spring):
    for start, stop, text in (
        (math.nan, 1.0, "finite [s], got nan"),
        (1.0, 0.5, "got 0.5"),
        (1.0, math.nan, "got nan"),
    ):
        before = spring.serialized()
        assert spring.SetupExperiment(0, c_double(0.0), c_double(start), 1, c_double(stop)) == ERROR
        assert text in spring.said
        assert spring.serialized() == before


@pytest.mark.parametrize(
    ("time", "size", "text"),
    [
        (1.0, -1e-3, "-0.001"), (1.0, math.nan, "nan"), (1.0, math.inf, "inf"), (1.0, -math.inf, "-inf"),
        (math.nan, 1.0, "The time of a step must be finite [s], got nan"), (-math.inf, 1.0, "got -inf"),
        (1.7e308, 1.7e308, "1.7e+308"),
    ],
)  # fmt: skip
def test_steps_backward_and_of_no_finite_size_or_time(spring, time, size, text):
    spring.initialize()
    spring.step(0.03)
    spring.set(displacement=0.01)
    before = spring.serialized()
    assert spring.DoStep(c_double(time), c_double(size), 1) == ERROR
    assert text in spring.said
    assert spring.serialized() == before


def test_a_step_beyond_the_stop_time(spring):
    spring.enter_initialization(0.0, 0.3)
    spring.ExitInitializationMode()
    spring.step(0.03, time=0.2, size=0.1)  # 0.30000000000000004 s is the stop time rounded
    assert spring.DoStep(c_double(0.3), c_double(1e-3), 1) == ERROR
    assert spring.said == "The step of 0.001 s at time 0.3 s must not go beyond the stop time 0.3 s."


# Values


@pytest.mark.parametrize("bad", [*NOT_FINITE, 1.001e9])
def test_an_impossible_displacement(spring, bad):
    spring.initialize()
    spring.step(0.03)
    spring.set(displacement=0.035)
    before = spring.serialized()
    assert spring.set(displacement=bad) == ERROR
    assert spring.said == f"`displacement` must be within +-1e+09 m, got {bad!r}; the previous value is kept."
    assert spring.serialized() == before


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rho", -1.0), ("rho", 0.0), ("rho", 1e-309), ("rho", 1e154), ("kappa_omega", 0.0), ("kappa_omega", 1e154),
        ("sigma", 0.4), ("sigma", -1e308), ("n", 0.0), ("n", 1e3), ("kA_0", 2.0), ("kA_1", -1e3), ("kA_2", 1e300),
        ("kE_2", 1e308), ("displacement_min", 0.06), ("displacement_min", -1e154), ("displacement_max", 0.0),
        ("displacement_offset", 1.0), ("omega_start", 1.0000001), ("omega_start", 1e308),
    ],
)  # fmt: skip
def test_parameters_that_are_not_possible(spring, name, value):
    good = spring.enter_initialization().get(name)[0]
    assert spring.set(displacement=SPRING.displacement_offset, **{name: value}) == OK
    before = spring.serialized()
    found = doubles([0.0])
    for refused in (
        spring.ExitInitializationMode(),
        spring.GetReal(spring.references("force"), c_size_t(1), found),
        spring.GetDirectionalDerivative(*arguments(spring, "GetDirectionalDerivative")),
    ):
        assert refused == ERROR
        # FA is judged as a whole: its value over the range is what is wrong.
        assert ("the amplifier FA" if name == "kA_1" else f"`{name}`") in spring.said
        assert "got" in spring.said
    assert spring.serialized() == before
    spring.set(**{name: good})
    assert spring.ExitInitializationMode() == OK
    close(spring.step(0.03, "force"), PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])


@pytest.mark.parametrize("bad", NOT_FINITE)
@pytest.mark.parametrize("name", ["rho", "kE_2", "omega_start", "displacement_max"])
def test_parameters_that_are_not_finite(spring, name, bad):
    spring.enter_initialization()
    before = spring.serialized()
    assert spring.set(**{name: bad}) == ERROR
    assert spring.said == f"`{name}` must be finite, got {bad!r}; the previous value is kept."
    assert spring.serialized() == before


def test_a_fixed_parameter_after_initialization(spring):
    spring.initialize()
    before = spring.serialized()
    assert spring.set(displacement=0.03, omega_start=0.5) == ERROR
    assert spring.said == "`omega_start` is fixed after initialization; reset the instance to change it."
    assert spring.serialized() == before


@pytest.mark.parametrize("name", ["force", "stiffness", "absorbed_energy", "omega"])
def test_what_is_computed_cannot_be_set(spring, name):
    assert spring.set(**{name: 1.0}) == ERROR
    assert spring.said == f"`{name}` is calculated and cannot be set."


@pytest.mark.parametrize(
    ("call", "reference", "text"),
    [
        ("GetReal", 999, "value reference 999; they "), ("GetReal", 2**32 - 1, "4294967295"),
        ("GetReal", 4, "`extrapolating` (value reference 4) is Boolean, not Real."),
        ("GetInteger", 1, "is Real, not Integer"), ("GetBoolean", 1, "is Real, not Boolean"),
        ("GetString", 0, "is Real, not String"), ("GetString", 21, "value reference 21"),
        ("SetReal", 999, "value reference 999"), ("SetInteger", 0, "is Real, not Integer"),
        ("SetBoolean", 4, "`extrapolating` is calculated"), ("SetBoolean", 0, "is Real, not Boolean"),
        ("SetString", 0, "is Real, not String"),
    ],
)  # fmt: skip
def test_no_such_variable_or_another_type(spring, call, reference, text):
    spring.initialize()
    before = spring.serialized()
    value = create_string_buffer(8)
    assert getattr(spring, call)((c_uint * 2)(reference, reference), c_size_t(2), value) == ERROR
    assert text in spring.said
    assert spring.serialized() == before


def pointers(one: Native, call: str) -> list[int]:
    """Which arguments of a call are pointers to something that must be there."""
    given = arguments(one, call)
    return [i for i, value in enumerate(given) if not isinstance(value, int | c_double | c_size_t | None)]


@pytest.mark.parametrize("kind", [MODEL_EXCHANGE, CO_SIMULATION])
def test_no_pointer_may_be_null(kind):
    column = [*MODES].index("cs step" if kind == CO_SIMULATION else "me event")
    checked = 0
    for call, *legal in ROWS:
        with Native(library(), kind) as one:
            one.initialize()
            for place in pointers(one, call) if legal[column] == "x" and call != "FreeFMUstate" else ():
                given = list(arguments(one, call))
                given[place] = None
                before = one.serialized()
                assert getattr(one, call)(*given) == ERROR, (call, place)
                assert "must not be NULL" in one.said
                assert one.serialized() == before
                checked += 1
    assert checked >= 15


def test_to_free_no_state_is_fine(spring):
    assert spring.FreeFMUstate(None) == OK
    assert spring.FreeFMUstate(byref(c_void_p())) == OK


def test_a_state_itself_is_freed_as_by_its_address(spring):
    """As fmusim 0.0.39 gives it."""
    state = spring.snapshot()
    assert spring.FreeFMUstate(state) == OK
    assert spring.messages == []


def test_counts_must_be_those_of_the_description():
    with Native(kind=MODEL_EXCHANGE) as one:
        one.begin_continuous_time()
        for call, count in (("GetEventIndicators", 0), ("GetEventIndicators", 2), ("GetDerivatives", 1),
                            ("GetContinuousStates", 1), ("SetContinuousStates", 1),
                            ("GetNominalsOfContinuousStates", 1)):  # fmt: skip
            assert getattr(one, call)(doubles([0.0, 0.0]), c_size_t(count)) == ERROR, call
            assert one.said.endswith(f"elements, got {count}.")


# Messages


def test_categories(spring):
    spring.initialize()
    for on, categories, warned, refused in (
        (1, [b"logStatusError"], False, True), (1, [b"logStatusWarning"], True, False), (1, [b"logAll"], True, True),
        (0, [], False, False), (1, [], True, True), (0, [b"logAll"], False, False),
    ):  # fmt: skip
        assert spring.SetDebugLogging(on, c_size_t(len(categories)), (c_char_p * len(categories))(*categories)) == OK
        spring.messages.clear()
        spring.step(0.06)
        spring.set(displacement=math.nan)
        spring.step(0.02)
        told = {status for status, _, _ in spring.messages}
        assert (WARNING in told, ERROR in told) == (warned, refused)


@pytest.mark.parametrize("bad", [b"logFatal", b"", b"%s%n#r0#\xc3\xbc", b"x" * 500, None])
def test_unknown_categories_are_refused(spring, bad):
    spring.SetDebugLogging(1, c_size_t(1), (c_char_p * 1)(b"logStatusError"))
    assert spring.SetDebugLogging(1, c_size_t(2), (c_char_p * 2)(b"logAll", bad)) == ERROR
    shown = "NULL" if bad is None else bad[:63].decode("latin-1").translate({0xC3: "?", 0xBC: "?", ord("#"): "?"})
    assert spring.said == f"A log category must be logAll, logStatusWarning or logStatusError, got {shown}."
    # What had been chosen holds on.
    spring.initialize()
    spring.step(0.06)
    assert [status for status, _, _ in spring.messages] == [ERROR]


def test_warnings_and_errors_are_logged_without_debug_logging():
    with Native(logging=False) as one:
        one.initialize()
        one.step(0.06)
        one.set(displacement=math.nan)
        assert [status for status, _, _ in one.messages] == [WARNING, ERROR]
