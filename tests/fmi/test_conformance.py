"""The conformance table: what FMI and the equations of the spring ask of every form of FMU.

Rows are the forms of `forms.FORMS`; each test is a column, over the forms that it holds for. Values are compared
with an ODE solver that knows nothing of the package (`oracles`), and to rounding with the package. More columns are in
test_fmi_parameters.py, and what is refused in test_fmi_refusals.py.
"""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fmu_tools import OTHER
from forms import FORMS, PATHS, SYSTEMS, rows
from native_tools import ERROR, OK, close, close_each
from oracles import oracle_force
from strandspring import Spring


@pytest.mark.parametrize("name", PATHS)
def test_values_along_a_path(name: str) -> None:
    """Over steps of any size and none, standstills and excursions; trials leave no trace and answer as in no time."""
    form, random = FORMS[name], np.random.default_rng(2)
    # Where branches decay, times that add up are rounded, too.
    rounding = 1e-10 if form.spring.branches else 1e-12
    for samples in (60,) if form.python else (60, 400):
        path, time = form.motion(samples)
        with form.begun(float(path[0]), **form.starts) as one:
            found = [one.get(*form.outputs)]
            for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
                for trial in random.normal(x, 0.01, random.integers(0, 3)):
                    assert one.set(displacement=trial) == OK
                    one.get(*form.outputs[: random.integers(1, len(form.outputs) + 1)])
                assert one.set(displacement=x) == OK
                trial_values = one.get(*form.outputs)
                one.advance(x, h)
                found.append(one.get(*form.outputs))
                if h == 0.0 or not form.spring.branches:
                    close(trial_values[:1], found[-1][:1], 1e-10)
                    close(trial_values, found[-1], 1e-9)
        close_each(np.transpose(found), form.expected(path, time, form.starts), rounding)
        if samples == 60:  # the solver's tolerance, over its strokes
            close(np.array(found)[:, 0], oracle_force(form.spring, path, time, tuple(form.starts.values())), 1e-8)


@pytest.mark.parametrize("name", PATHS)
def test_the_start_follows_the_displacement_until_initialization_ends(name: str) -> None:
    form = FORMS[name]
    p = replace(form.spring, branches=())
    with form.instance() as one:
        one.enter_initialization()
        for x in (p.displacement_min, p.displacement_max):
            assert one.set(displacement=x, **form.starts) == OK
            close(one.get("force"), Spring(p).response([x], (0.3, -0.2) if p.second else 0.3))
        assert one.get("omega") == [0.3]
        assert one.set(rho=0.5 * p.rho) == OK
        assert one.ExitInitializationMode() == OK
        assert one.get("rho") == [0.5 * p.rho]


# What is kept


@pytest.mark.parametrize("name", FORMS)
def test_a_serialized_state_goes_on_in_another_instance_and_reset_returns_to_the_start(name: str) -> None:
    form = FORMS[name]
    path, time = form.motion(80)
    own = [] if name in SYSTEMS else ["rho", "displacement"]
    names = [*form.outputs, *own, *(["velocity", "der(omega)"] if form.has_states else [])]
    with form.instance() as fresh, form.instance() as other, form.begun(float(path[0])) as one:
        content = form.moved(one)
        assert other.restore(content) == OK, other.said
        other.time = one.time
        assert other.get(*names) == one.get(*names)
        if not form.has_states:
            rest = [each.along(path[39:], time[39:], *names) for each in (one, other)]
            assert rest[0] == rest[1]
        assert one.serialized() == other.serialized()
        assert one.Terminate() == OK
        assert one.Reset() == OK
        assert one.serialized() == fresh.serialized() != content
        one.begin()
        assert name in SYSTEMS or one.get("rho") == [form.spring.rho]


@pytest.mark.parametrize("name", rows(lambda form: not form.python) + SYSTEMS)
def test_damaged_and_foreign_states_are_refused(name: str) -> None:
    form = FORMS[name]
    with form.begun() as one, form.instance(OTHER) as other:
        content = form.moved(one)
        for state in (b"", content[:-1], content[:-1] + bytes([content[-1] ^ 1]), content + b"\0"):
            assert one.restore(state) == ERROR
            assert one.said.startswith("The serialized state ")
        assert one.serialized() == content
        assert other.restore(content) == other.SetFMUstate(one.snapshot()) == ERROR
        assert other.messages[0][2] == "The serialized state is from another FMU."
        assert "must come from an instance of the same FMU" in other.said
        # As fmusim 0.0.39 gives it: the state in place of its address.
        assert form.fmi == 3 or one.FreeFMUstate(one.snapshot()) == OK


@pytest.mark.parametrize("name", ["python", "branches, python"])
def test_damaged_states_of_python_are_refused(name: str) -> None:
    form = FORMS[name]
    with form.begun() as one:
        content = form.moved(one)
        whole, damaged = json.loads(content), list[Any]()
        for key, value in whole.items():  # none left out, of another type, or with a part that cannot be
            damaged += [{k: v for k, v in whole.items() if k != key}, {**whole, key: "other"}, {**whole, key: [None]}]
            parts = value if isinstance(value, list) else []
            for i, bad in itertools.product(range(len(parts)), (None, [])):
                damaged.append({**whole, key: [*parts[:i], bad, *parts[i + 1 :]]})
        first, *others = whole["memory"]
        for bad in (1.5, math.inf):
            damaged.append({**whole, "memory": [[[*first[0][:1], bad, *first[0][2:]], *first[1:]], *others]})
        damaged += [{**whole, "more": 1}, {**whole, "settings": [-1.0] * len(whole["settings"])}]
        texts = [json.dumps(one).encode() for one in damaged if one != whole]
        for state in (b"", b"\x80\x04junk", b"[]", b"[" * 100_000, content[:-1], content + b"}", *texts):
            assert one.restore(state) == form.refusal, state[:80]
        with form.instance(OTHER) as other:
            other.initialize()
            assert one.restore(other.serialized()) == form.refusal
            assert "of another one" in one.said
        assert one.serialized() == content
