"""Which springs are refused, in Python and in C; polynomials, the spline, and the limits that both have."""

from __future__ import annotations

import ctypes
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.polynomial.polynomial import polyval

from kernel_tools import KERNEL, Kernel, by_path, by_stepper, c_parameters, library
from springs import EXAMPLES, along
from strandspring import SpringParameters
from strandspring.core import parameters as limits
from strandspring.core.branches import TIME_CONSTANT_RANGE
from strandspring.core.parameters import ARRAYS, problems
from strandspring.core.polynomials import antiderivative, derivative, least_value, polynomial

PLAIN = SpringParameters((1.0, 2000.0), (1.0, 2.0), 10.0, 500.0, 1.5, 0.5, 0.0, -0.25, 0.25)
KNOTS = (-0.25, -0.2, -0.1, 0.0, 0.1, 0.2, 0.25)
TABLE = replace(PLAIN, kE=(), FE_knots=KNOTS, FE_forces=(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
REFUSALS = [
    line.split(" | ")
    for line in Path(__file__).with_name("refusals.txt").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
]


def changed(changes: str) -> tuple[SpringParameters, dict[str, Any]]:
    """The spring that is changed, and the fields that change."""
    given: dict[str, Any] = {}
    for change in changes.removeprefix("table; ").split("; "):
        name, _, text = change.partition("=")
        value, _, times = text.partition("*")
        numbers = tuple(map(float, value.split())) * int(times or 1)
        given[name] = numbers if name in ARRAYS else numbers[0]
    return TABLE if changes.startswith("table") else PLAIN, given


def problem_in_c(good: SpringParameters, changes: dict[str, Any], size: int = 200) -> str:
    """What C says is wrong; empty if nothing is."""
    given, text = c_parameters(good), ctypes.create_string_buffer(size)
    for name, value in changes.items():
        if name in ARRAYS:
            count = {"kE": "elastic", "kA": "amplifier"}.get(name, name.removeprefix("FE_"))
            setattr(given, count, len(value))
            getattr(given, name)[: len(value)] = value[: len(getattr(given, name))]
        else:
            setattr(given, name, value)
    refused = library().spring_problem(ctypes.addressof(given), ctypes.addressof(text), size)
    assert refused == bool(text.value)
    return text.value.decode("ascii")


@pytest.mark.parametrize(("changes", "sentence"), REFUSALS)
def test_every_refusal_is_one_sentence(changes: str, sentence: str) -> None:
    good, given = changed(changes)
    with pytest.raises(ValueError, match=r".") as refusal:
        replace(good, **given)
    assert str(refusal.value) == sentence


# Who calls C counts right, and gives it finite numbers.
OF_C = [row for row in REFUSALS if not re.search("must (have|be empty|be finite)", row[1])]


@pytest.mark.long
@pytest.mark.parametrize(("changes", "sentence"), OF_C)
def test_c_refuses_in_the_same_words(changes: str, sentence: str) -> None:
    assert problem_in_c(*changed(changes)) == re.sub(r"\[(\d+)\]`", r"_\1`", sentence)


@pytest.mark.long
@given((st.floats(-1e16, -0.0) | st.floats(-1.7e308, -1e17)).filter(lambda value: np.frexp(value)[0] != -0.5))
@example(-1e15)
@example(-1e16)
@example(-2.5e-308)
@example(-0.00012)
def test_c_writes_numbers_as_python_does(value: float) -> None:
    # Between 1e16 and 1e17 C writes no exponent with 17 digits, and of a power of two it may write a digit more.
    assert problem_in_c(PLAIN, {"rho": value}) == f"`rho` must be > 0 [1/m], got {value!r}."


@pytest.mark.long
def test_c_has_nothing_against_good_springs_and_cuts_what_has_no_room() -> None:
    assert [problem_in_c(p, {}) for p in (PLAIN, TABLE, *EXAMPLES.values())] == [""] * (2 + len(EXAMPLES))
    assert problem_in_c(PLAIN, {"rho": -1.0}, 10) == "`rho` must"[:9]


@pytest.mark.parametrize("slope", [4.7, 5.0, 7.0, 9.3, 100.0])
def test_fa_may_not_touch_zero_inside_the_range(slope: float) -> None:
    # (1 - slope*x)^2 at its zero is computed as 0 or as rounding.
    with pytest.raises(ValueError, match=r"^the amplifier FA .* must be > 0 over .* got \S+ at displacement 0\.\d+ m"):
        replace(PLAIN, kA=(1.0, -2.0 * slope, slope * slope))


def test_all_that_is_wrong_is_listed_and_the_limits_themselves_are_allowed() -> None:
    wrong = object.__new__(SpringParameters)
    wrong.__dict__.update(asdict(PLAIN) | {"rho": -1.0, "n": 0.0, "sigma": 0.0})
    assert [sentence.split("`")[1] for sentence in problems(wrong)] == ["rho", "sigma", "n"]
    for change in ({"sigma": 0.5}, {"sigma": 1000.0}, {"n": 0.01}, {"n": 100.0}, {"displacement_offset": -0.25}):
        assert problems(replace(PLAIN, **change)) == []


def test_coefficients_become_floats_or_are_refused() -> None:
    p = replace(PLAIN, kE=[1, 2], kA=np.array([1, 3]))
    assert repr((p.kE, p.kA)) == "((1.0, 2.0), (1.0, 3.0))"
    for wrong in ("13", b"13", {0.0, 3000.0}):
        with pytest.raises(TypeError, match="`kE` must be a sequence of numbers"):
            replace(PLAIN, kE=wrong)


def test_python_and_c_have_the_same_limits() -> None:
    text = (KERNEL / "spring_limits.h").read_text()
    found = {name: float(value) for name, value in re.findall(r"([A-Z][A-Z_]+) = ([-+.e\d]+)", text)}
    for name, ends in {
        "SIGMA": limits.SIGMA_RANGE, "WIDTH": limits.WIDTH_RANGE, "FORCE": limits.FORCE_RANGE, "N": limits.N_RANGE,
        "SATURATION": limits.SATURATION_RANGE, "TIME_CONSTANT": TIME_CONSTANT_RANGE,
        "AMPLIFIER": (limits.LEAST_AMPLIFIER, limits.LARGEST_AMPLIFIER),
    }.items():  # fmt: skip
        words = ("{}_LOW", "{}_HIGH") if name in ("N", "SIGMA") else ("LEAST_{}", "LARGEST_{}")
        assert tuple(found.pop(word.format(name)) for word in words) == ends
    counts = [found.pop(f"SPRING_{name}") for name in ("COEFFICIENTS", "AMPLIFIERS", "KNOTS")]
    assert counts == [limits.MAXIMUM_DEGREE + 1, limits.MAXIMUM_AMPLIFIER_DEGREE + 1, limits.KNOTS[1]]
    assert found == {name: getattr(limits, name) for name in found}
    assert len(found) == 5


@settings(max_examples=100)
@given(
    st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=21).map(tuple), st.floats(-1.5, 1.5), st.floats(1e-6, 3.0)
)
def test_the_least_value_is_a_value_and_none_is_lower(values: tuple[float, ...], low: float, width: float) -> None:
    high = low + width
    least, where = least_value(values, low, high)
    assert low <= where <= high
    # 21 terms of up to 100*|x|^20 are summed with rounding 1e-16 each.
    size = np.max(np.abs([low, high, 1.0]))
    rounding = 1e-14 * float(polyval(size, np.abs(values))) + 1e-300
    assert least == pytest.approx(float(polyval(where, values)), rel=0.0, abs=rounding)
    assert least <= float(np.min(polyval(np.linspace(low, high, 2001), values))) + rounding
    # (c/k)*k rounds twice.
    assert derivative(antiderivative(values)) == pytest.approx(values, rel=1e-15, abs=1e-300)
    assert polynomial(values, low) == pytest.approx(float(polyval(low, values)), rel=0.0, abs=rounding)


@pytest.mark.long
@pytest.mark.parametrize("count", limits.KNOTS)
def test_a_table_is_the_cubic_spline_of_scipy(count: int) -> None:
    """Force, slope and work of a spring without friction worth the name, and the derivatives by its forces."""
    from scipy.interpolate import CubicSpline

    random, width = np.random.default_rng(count), 3.0
    places = np.cumsum(10.0 ** random.uniform(-1.5, 0.0, count - 1))
    knots = (0.0, *(width * places[:-1] / places[-1]).tolist(), width)
    forces = tuple(random.uniform(-5.0, 5.0, count).tolist())
    p = SpringParameters((), (1.0,), 1e-15, 1e-3, 1.0, 1.0, 0.7, 0.0, width, knots, forces)
    path = along(p, np.concatenate([np.linspace(-1.4, 1.4, 301), np.linspace(1.4, -1.0, 50)]))
    inside = np.clip(path, p.displacement_min, p.displacement_max)
    out = path - inside

    def by_scipy(forces: Any) -> Any:
        spline = CubicSpline(p.FE_knots, forces, bc_type="not-a-knot")
        force, slope, work = spline(inside), spline(inside, 1), spline.antiderivative()(inside)
        work = work + out * (force + 0.5 * slope * out)
        return np.array([force + slope * out, slope, work - work[0]])

    expected = by_scipy(p.FE_forces)
    scale = np.abs(expected).max(axis=1, keepdims=True)
    for respond in (by_stepper, by_path):
        assert np.all(np.abs(respond(p, path, 0.0)[1:] - expected) <= 1e-12 * scale)
    cardinal = [by_scipy(unit) for unit in np.eye(len(p.FE_knots))]
    for row, gradients in enumerate(Kernel(p).along(path, 0.0)[1]):
        by_forces = np.array([one[row] for one in cardinal]).T
        found = gradients["by_FE_forces"][:, : len(p.FE_knots)]
        assert np.abs(found - by_forces).max() <= 1e-12 * np.abs(by_forces).max()
