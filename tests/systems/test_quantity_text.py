"""Numbers with units: each reads as people mean it, and what could mean something else is refused."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring.vibration.description.quantity_text import (
    ACCELERATION,
    ACCELERATION_DENSITY,
    ANGLE,
    ANGULAR_VELOCITY,
    DAMPING,
    FORCE,
    FREQUENCY,
    FREQUENCY_RATE,
    INERTIA,
    LENGTH,
    MASS,
    OCTAVE_RATE,
    QUANTITIES,
    STIFFNESS,
    TIME,
    VELOCITY,
    QuantityError,
    QuantityKind,
    in_si,
    measured,
    stated_units,
    unit_in_si,
)

G = 9.80665
POUND = 0.45359237
INCH = 0.0254


@pytest.mark.parametrize(
    ("text", "quantity", "expected"),
    [
        ("12 mm", LENGTH, 0.012),
        ("-5mm", LENGTH, -0.005),
        ("−5 mm", LENGTH, -0.005),
        ('2"', LENGTH, 2 * INCH),
        ("1e-3 m", LENGTH, 1e-3),
        ("20 g", MASS, 0.02),
        ("20 lb", MASS, 20 * POUND),
        ("2 t", MASS, 2000.0),
        ("15 g", ACCELERATION, 15 * G),
        ("15 G", ACCELERATION, 15 * G),
        ("9.8 m/s²", ACCELERATION, 9.8),
        ("9.8 m s^-2", ACCELERATION, 9.8),
        ("40 deg", ANGLE, math.radians(40)),
        ("40°", ANGLE, math.radians(40)),
        ("1.5 kN", FORCE, 1500.0),
        ("20 lb", FORCE, 20 * POUND * G),
        ("11 ms", TIME, 0.011),
        ("0.04 g^2/Hz", ACCELERATION_DENSITY, 0.04 * G**2),
        ("0.04 g²/Hz", ACCELERATION_DENSITY, 0.04 * G**2),
        ("2 (m/s^2)^2/Hz", ACCELERATION_DENSITY, 2.0),
        ("2 m^2/s^3", ACCELERATION_DENSITY, 2.0),
        ("100 N/mm", STIFFNESS, 1e5),
        ("10 lb/in", STIFFNESS, 10 * POUND * G / INCH),
        ("50 N s/m", DAMPING, 50.0),
        ("50 N/(m/s)", DAMPING, 50.0),
        ("5 kg m^2", INERTIA, 5.0),
        ("5 kg·m²", INERTIA, 5.0),
        ("3 lb in^2", INERTIA, 3 * POUND * INCH**2),
        ("20 Hz", FREQUENCY, 20.0),
        ("60 1/min", FREQUENCY, 1.0),
        ("30 rpm", FREQUENCY, 0.5),
        ("30 rpm", ANGULAR_VELOCITY, math.pi),
        ("90 deg/s", ANGULAR_VELOCITY, math.pi / 2),
        ("3 m/s", VELOCITY, 3.0),
        ("3 oct/min", OCTAVE_RATE, 0.05),
        ("10 Hz/s", FREQUENCY_RATE, 10.0),
    ],
)
def test_is_what_people_mean(text: str, quantity: QuantityKind, expected: float) -> None:
    assert in_si(text, quantity) == pytest.approx(expected, rel=1e-14)


def test_rate_says_of_which_kind_it_is() -> None:
    assert measured("6 oct/min", OCTAVE_RATE, FREQUENCY_RATE) == (pytest.approx(0.1), OCTAVE_RATE)
    assert measured("6 Hz/s", OCTAVE_RATE, FREQUENCY_RATE) == (6.0, FREQUENCY_RATE)
    assert unit_in_si("g", ACCELERATION) == G


def test_number_without_unit_is_refused_unless_its_unit_is_stated() -> None:
    assert (in_si(3, FREQUENCY), in_si(0, LENGTH)) == (3.0, 0.0)
    with pytest.raises(QuantityError, match=r"10 has no unit; write '10 g' or '10 m/s\^2', or state the unit once, as"):
        in_si(10, ACCELERATION)
    with stated_units({"acceleration": G}):
        assert in_si(10, ACCELERATION) == 10 * G
        assert in_si("10 m/s^2", ACCELERATION) == 10.0
        with pytest.raises(QuantityError, match="10 has no unit; write '10 mm' or '10 m'"):
            in_si(10, LENGTH)
    for quantity in QUANTITIES:
        if quantity.key:
            with pytest.raises(QuantityError, match=r"write '3.5 (.*)' or '3.5 (.*)'") as caught:
                in_si(3.5, quantity)
            units = re.findall(r"'3.5 (.*?)'", str(caught.value))
            assert len({unit_in_si(unit, quantity) for unit in units}) == 2


@pytest.mark.parametrize("quantity", QUANTITIES[:-1], ids=lambda quantity: quantity.name)
def test_its_own_unit_is_one_and_its_example_is_read(quantity: QuantityKind) -> None:
    assert in_si(f"1 {quantity.unit}", quantity) == 1.0
    assert in_si(quantity.example, quantity) > 0.0


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("12 N", "must be a length such as '12 mm', got '12 N', which is a force"),
        ("20 kg", "which is a mass"),
        ("12", "got '12'; write the unit"),
        ("12 mN m", "which is something else"),
        ("12 mn", "mN (millinewton) or MN (meganewton)"),
        ("1,5 mm", "the decimal mark is a point"),
        ("12 furlong", "'furlong' is not a known unit"),
        ("1 m/s/s", "into parentheses"),
        ("1 m/s m", "into parentheses"),
        ("1e400 m", "not finite"),
        ("1e308 km", "not finite"),
        ("1 m^9", "not one"),
        ("", "got ''"),
        ("abc", "got 'abc'"),
        (True, "got true or false"),
        ([1], "got a list"),
        (10**400, "not finite"),
        (math.nan, "not finite"),
    ],
)
def test_refusal_says_what_was_found(text: object, refusal: str) -> None:
    with pytest.raises(QuantityError) as caught:
        in_si(text, LENGTH)
    assert refusal in str(caught.value)


@settings(deadline=None, max_examples=300)
@given(st.text(st.sampled_from("0123456789.eE+- mkNgsHzdeglbin/^()*·²\"'°"), max_size=80))
def test_any_text_is_read_or_refused(text: str) -> None:
    for quantity in (LENGTH, ACCELERATION):
        sentence = ""
        try:
            value = in_si(text, quantity)
        except QuantityError as refusal:
            value, sentence = 0.0, str(refusal)
        assert math.isfinite(value)
        assert sentence == "" or sentence.startswith("must be ")
