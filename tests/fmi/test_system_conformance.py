"""The FMU of a system of bodies under the laws of FMI, in FMI 2.0 and 3.0: states, instances, warnings, refusals.

Its values are tested in tests/systems.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from ctypes import byref, c_double, c_size_t
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from native_tools import ERROR, OK
from strandspring.errors import MountedSystemError
from strandspring.fmu.system.system_variables import ForceInput
from system_fmu3_tools import NativeSystem3
from system_fmu_tools import BOX, BOX_OPTIONS, BRANCHED, NativeSystem, shock, system_library

pytestmark = pytest.mark.long

STEP = 4e-4  # of co-simulation: four internal ones [s]


def instance(fmi: int, system: Any = BOX, name: str = "one") -> NativeSystem:
    library = system_library(system, replace(BOX_OPTIONS, fmi=fmi))
    return (NativeSystem if fmi == 2 else NativeSystem3)(library, name=name)


both = pytest.mark.parametrize("fmi", [2, 3])


@both
def test_states_reset_and_instances(fmi: int) -> None:
    inputs = shock(BOX, BOX_OPTIONS, 3, 60, 60.0)
    with instance(fmi, BRANCHED).begin() as one, instance(fmi, BRANCHED, name="two") as two, instance(5 - fmi) as other:
        expected = one.run(inputs, STEP)
        assert one.Reset() == OK
        one.begin(step=2e-4, gravity_z=-20.0).run(inputs, STEP)
        assert one.Reset() == OK
        one.begin().run(inputs[:, :30], STEP)
        state, content = one.snapshot(), one.serialized()
        for _ in range(2):
            # Between steps parameters may be set to what they are.
            assert one.set(**dict(zip(("step", "gravity_x"), one.get("step", "gravity_x"), strict=True))) == OK
            np.testing.assert_array_equal(one.run(inputs[:, 30:], STEP), expected[30:])
            assert one.SetFMUstate(state) == OK
            assert one.serialized() == content
        # Into another instance, that has not been initialized, but not of another FMU.
        assert two.restore(content) == OK
        np.testing.assert_array_equal(two.run(inputs[:, 30:], STEP), expected[30:])
        assert one.serialized() == content
        assert other.restore(content) == ERROR
        assert other.said == "The serialized state is from another FMU."
        for cut in (content[:-1], content[:80] + b"\xff" + content[81:]):
            assert one.restore(cut) == ERROR
            assert one.said == "The serialized state is truncated or damaged."
        for place, value, field in ((66, b"\x03\0\0\0", "mode"), (70, b"\xff" * 8, "time"), (190, b"\2", "flags")):
            crafted = bytearray(content)
            crafted[place : place + len(value)] = value
            total = 0xCBF29CE484222325  # FNV-1a
            for byte in crafted[28:]:
                total = (total ^ byte) * 0x100000001B3 % 2**64
            crafted[20:28] = total.to_bytes(8, "little")
            assert one.restore(bytes(crafted)) == ERROR
            assert one.said == f"The serialized state is damaged in its field `{field}`."
        assert one.serialized() == content
        assert one.FreeFMUstate(byref(state)) == OK


@both
def test_each_excursion_out_of_a_range_is_warned_of_once(fmi: int) -> None:
    step, names = BOX_OPTIONS.step, [f"displacement_corner_{k}_{axis}" for k in (1, 2, 3, 4) for axis in "zxy"]
    with instance(fmi).begin(load_recoil=3000.0) as one:
        assert (one.extrapolating, one.messages) == (False, [])
        rows, states = [], []
        for k in range(3000):
            if k == 240:
                one.set(load_recoil=0.0)
            assert one.go(k * step, step) == OK
            rows.append(one.get(*names))
            states.append(one.extrapolating)
        is_outside = np.abs(rows) > 0.03
        assert states == is_outside.any(axis=1).tolist()
        leaving = (np.diff(is_outside.astype(int), axis=0) > 0).sum(axis=0)
        excursion = r"`(\w+)` -?0\.\d+ m lies outside the identified range \[-0.03, 0.03\] m: the force is extrapolated"
        warned = [re.match(excursion, text)[1] for _, _, text in one.messages]  # type: ignore[index]
        assert [warned.count(name) for name in names] == leaving.tolist()
        assert leaving.max() > 1


REFUSED: list[tuple[Callable[[NativeSystem], int], str]] = [
    (lambda one: one.set(base_acceleration_x=np.nan), "`base_acceleration_x` must be finite, got nan; the previous "),
    (lambda one: one.set(load_recoil=np.inf), "`load_recoil` must be finite, got inf; the previous value is kept."),
    (lambda one: one.set(step=1e-5), "`step` is fixed after initialization; reset the instance to change it."),
    (lambda one: one.set(sway_c_g_x=0.0), "`sway_c_g_x` is calculated and cannot be set."),
    (lambda one: one.go(0.0, np.nan), "The step size at time 0.0 s must be finite and >= 0 [s], got nan."),
    (lambda one: one.go(0.0, -1.0), "The step size at time 0.0 s must be finite and >= 0 [s], got -1.0."),
    (lambda one: one.go(np.inf, 1.0), "The time of a step must be finite [s], got inf."),
    (
        lambda one: one.go(0.0, 1e300),
        "The step of 1e+300 s at time 0.0 s would take more than 100000000 steps of `step`",
    ),
    (lambda one: one.ExitInitializationMode(), "ExitInitializationMode must be called while"),
]


@both
def test_what_cannot_be_is_refused_and_leaves_the_state(fmi: int) -> None:
    with instance(fmi).begin() as one:
        for call, sentence in REFUSED:
            before = one.serialized()
            assert call(one) == ERROR, sentence
            assert sentence in one.said
            assert one.serialized() == before
        # Also where a velocity or an energy is beyond all bounds before a displacement is.
        for load, size in ((1e18, 0.1), (1e308, 0.1), (1e308, 1e-200)):
            assert one.set(load_recoil=load) == OK
            before = one.serialized()
            assert one.go(0.0, size) == ERROR
            assert one.said.startswith(
                f"The motion diverges in the step of {size} s at time 0.0 s: a displacement would"
            )
            assert one.serialized() == before
        assert one.set(load_recoil=0.0) == OK
        assert one.go(0.0, 0.1) == OK
    bounds = (("step", 2e-3, "[1e-12, 0.001] s"), ("omega_start", 1.5, "[-1.0, 1.0]"),
              ("gravity_y", -1e5, "[-10000.0, 10000.0] m/s^2"))  # fmt: skip
    with instance(fmi) as one:
        for name, value, limits in bounds:
            assert one.set(**{name: value}) == ERROR
            assert one.said == f"`{name}` must be within {limits}, got {value!r}; the previous value is kept."
    soft = replace(BOX, mounts=tuple(replace(mount, axes=mount.axes[:1]) for mount in BOX.mounts))
    with instance(fmi, soft) as one:
        one.enter_initialization()
        one.set(gravity_x=3.0)
        assert one.ExitInitializationMode() == ERROR
        assert one.said.startswith("The bodies find no static equilibrium under gravity (3.0, 0.0, -9.80665) m/s^2: ")
        assert one.GetReal(one.references("sway_c_g_x"), c_size_t(1), (c_double * 1)()) == ERROR
        one.set(gravity_x=0.0)
        assert one.ExitInitializationMode() == OK
    for change, sentence in (
        ({"step": 2e-3}, r"`step` must be within \[1e-12, 0.001\] s, the largest step that is stable, got 0.002\."),
        ({"step": float("nan")}, r"`step` must be within .*, got nan\."),
        ({"omega_start": -2.0}, r"`omega_start` must be within \[-1, 1\], got -2.0\."),
        ({"fmi": 4}, r"The version of FMI must be 2 or 3, got 4\."),
        ({"forces": (ForceInput("a", 0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),) * 62}, ".* at most 61 forces .* got 62.*"),
    ):
        with pytest.raises(MountedSystemError, match=f"^{sentence}$"):
            replace(BOX_OPTIONS, **change)  # type: ignore[arg-type]
