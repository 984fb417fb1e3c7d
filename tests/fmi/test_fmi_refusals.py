"""What FMUs refuse, how they say so, and what they log: arguments, and impossible springs.

Instances, calls in a wrong mode, null pointers and crafted states are refused in tests/fuzz. `calls.toml` holds bad
arguments; `refused.json` holds the sentences that a person last read, by form and call, and
`python tests/fmi/test_fmi_refusals.py` writes them anew. That nothing changes with what is refused is asserted of each.
"""

from __future__ import annotations

import itertools
import json
import math
import sys
from collections.abc import Callable, Iterator
from ctypes import c_char_p, c_double, c_size_t, c_uint, create_string_buffer
from pathlib import Path
from typing import Any

import pytest
import tomllib

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in (".", "helpers")]

from forms import FORMS, STEPPED, SYSTEMS, Form
from native_tools import CO_SIMULATION, DISCARD, ERROR, OK, WARNING, Native

pytestmark = pytest.mark.long
KEPT = Path(__file__).with_name("refused.json")

CASES = tomllib.loads(Path(__file__).with_name("calls.toml").read_text("utf-8"))


# What was read

ROWS_OF_FORMS = [
    "co-simulation", "model exchange", "states", "fmi3", "fmi3 exchange", "python", "table", "branches",
    "branches, python", *SYSTEMS,
]  # fmt: skip
Case = tuple[str, Callable[..., int], tuple[Any, ...]]


def variables_of(one: Native) -> list[str]:
    """All that can be set, and some that are calculated."""
    calculated = [v.name for v in one.library.variables if v.causality == "output" and v.type in ("Real", "Float64")]
    return [v.name for v in one.library.variables if v.causality in ("input", "parameter")] + calculated[:2]


def before_the_path(one: Native) -> Iterator[Case]:
    """Values of which no spring can be: set, and then refused at the end of initialization mode."""

    def left(name: str, bad: float) -> int:
        return one.set(**{name: bad}) or int(one.ExitInitializationMode())

    def entered(start: float, stop: float) -> int:
        times = c_double(start), 1, c_double(stop)
        return int(one.Reset() or one.SetupExperiment(0, c_double(0.0), *times) or one.EnterInitializationMode())

    for name, bad in itertools.product(variables_of(one), CASES["values"]):
        yield f"{name} = {bad!r} before", left, (name, bad)
    for start, stop in ((math.nan, 1.0), (1.0, 0.5), (1.0, math.nan)):
        yield f"from {start} to {stop}", entered, (start, stop)


def on_the_path(form: Form, one: Native) -> Iterator[Case]:
    """Values, derivatives and steps."""
    known, is_spring = one.library.references, "force" in one.library.references

    def set_both(name: str, bad: float) -> int:
        return one.set(**{one.input: 0.03} | {name: bad})  # all or none

    def moved(values: list[float], orders: list[int], size: float) -> int:
        return one.set_derivatives(*values, orders=orders, names=[one.input] * len(values)) or one.go(0.0, size)

    def loaded(load: float, size: float) -> int:
        return one.set(load_recoil=load) or one.go(0.0, size)

    for name, bad in itertools.product([*variables_of(one), "omega", "velocity"], CASES["values"]):
        if name in known:
            yield f"{name} = {bad!r}", set_both, (name, bad)
    for call, reference in itertools.product(CASES["typed"], (0, 1, 4, 999, 2**31) if form.fmi == 2 else ()):
        value = (c_char_p * 1)(b"1") if "String" in call else create_string_buffer(8)
        yield f"{call} {reference}", getattr(one, call), ((c_uint * 1)(reference), c_size_t(1), value)
    for unknown, by, seed in () if form.python or form.has_states or not is_spring else CASES["derivatives"]:
        if unknown in known:
            yield f"d {unknown}/d {by} * {seed}", one.directional, (["force", unknown], {by: seed})
    if one.kind == CO_SIMULATION:
        for time, size in itertools.product(CASES["times"], CASES["sizes"]):
            yield f"step of {size} at {time}", one.go, (time, size)
        for name, order in () if form.python or not is_spring else CASES["rates"]:
            yield f"rate {order} of {name}", one.output_derivatives, ("force", name, order)
        for case in CASES["motions"] if form.fmi == 2 and not form.python else ():
            yield "sets {} of orders {}, step of {}".format(*case), moved, case
        for case in () if is_spring else CASES["loads"]:
            yield "sets a load of {}, step of {}".format(*case), loaded, case


def refusals(name: str) -> dict[str, str]:
    """What an FMU says to each call that it refuses, which changes nothing but what was set before."""
    form, found = FORMS[name], dict[str, str]()
    for begins in (False, True):
        with form.instance() as one:
            one.enter_initialization()
            assert name in SYSTEMS or one.set(displacement=form.spring.displacement_offset) == OK
            assert not begins or one.ExitInitializationMode() == OK
            content = one.serialized()
            for label, call, given in on_the_path(form, one) if begins else before_the_path(one):
                status = call(*given)
                assert status in (OK, DISCARD, form.refusal), label
                if status != OK:
                    assert not begins or "sets" in label or one.serialized() == content, label
                    found[label] = one.said
                assert one.restore(content) == OK
    return found


@pytest.mark.parametrize("name", ROWS_OF_FORMS)
def test_refusals_say_what_was_read_and_change_nothing(name: str) -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))[name]
    assert refusals(name) == kept
    assert len(kept) > 30


@pytest.mark.parametrize("name", FORMS)
def test_the_reference_after_the_last_is_none(name: str) -> None:
    with FORMS[name].begun() as one:
        after = (c_uint * 1)(max(one.library.references.values()) + 1)
        assert one.GetReal(after, c_size_t(1), (c_double * 1)()) == FORMS[name].refusal


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_refused_step_leaves_every_output_as_it_was(name: str) -> None:
    with FORMS[name].begun() as one:
        one.advance(9.0, 0.01)
        outputs = [v.name for v in one.library.variables if v.causality == "output"]
        before = one.get(*outputs)
        assert one.set(load_recoil=1e18) == OK
        assert one.go(one.time, 0.1) != OK
        assert one.set(load_recoil=0.0) == OK
        assert one.get(*outputs) == before


@pytest.mark.parametrize("name", ["co-simulation", "fmi3", *SYSTEMS])
def test_steps_go_to_the_stop_time_as_it_rounds(name: str) -> None:
    with FORMS[name].instance() as one:
        one.enter_initialization(0.0, 0.3)
        assert one.go(0.0, 1e-3) == ERROR
        assert one.ExitInitializationMode() == OK
        one.time = 0.2
        one.advance(0.03, 0.1)  # 0.30000000000000004 s
        assert one.go(0.3, 1e-3) == ERROR
        assert one.said == "The step of 0.001 s at time 0.3 s must not go beyond the stop time 0.3 s."


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
            assert one.set(displacement=high + 9.0 * span) == OK
            assert one.extrapolating
            one.advance(x)
            assert one.extrapolating is outside
        expected = [high + 0.02 * span, low - span, high + span, low - 0.5 * span]
        assert [status for status, _, _ in one.messages] == [WARNING] * len(expected)
        assert [float(text.split()[1]) for _, _, text in one.messages] == pytest.approx(expected, rel=1e-15)
        assert all(f"[{low}, {high}] m" in text for _, _, text in one.messages)


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


if __name__ == "__main__":
    lines = (f"{json.dumps(name)}: {json.dumps(refusals(name))}" for name in ROWS_OF_FORMS)
    KEPT.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
