"""Parameters in words: a standard error, or the side on which the records bound a parameter."""

from __future__ import annotations

import pytest

from strandspring.api.common.text import parameter_lines, with_error
from strandspring.model.stated_figures import differ, in_words
from synthetic import spring_of


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (1152.71, 107.0, "1150 +- 110"),
        (-0.0358, 0.0999, "-0.04 +- 0.10"),
        (18476.5, 219.0, "18480 +- 220"),
        (2.0, 1e-9, "2 +- 1e-09"),
        (2.0, 1.7976931348623157e308, "2 +- 1.8e+308"),
        (2.0, 0.0, "2"),
        (2.0, None, "2"),
    ],
)
def test_a_value_is_rounded_by_its_error(value: float, error: float | None, text: str) -> None:
    assert with_error(value, error) == text


@pytest.mark.parametrize(
    ("error", "ends", "text"),
    [
        (0.2, [0.7, 1.5], "1.00 +- 0.20"),
        (0.2, [0.7, None], "1 > 0.7 (95 %)"),
        (0.2, [0.5, 1.5], "1 < 1.5 (95 %)"),
        (None, [0.5, 0.62], "1 < 0.62 (95 %)"),
        (None, [0.5, None], "1, not bounded by these records"),
        (None, [None, None], "1, not bounded by these records"),
    ],
)
def test_the_bound_of_sigma_is_no_finding(error: float | None, ends: list[float | None], text: str) -> None:
    lines = parameter_lines(spring_of(1.0, 1.0), {"sigma": error, "interval_95": {"sigma": ends}})
    (line,) = (" ".join(line.split()) for line in lines if line.split()[0] == "sigma")
    assert line == f"sigma {text}"


def test_figures_in_words_tell_both_where_they_differ() -> None:
    alone = {"rmse": 3.0, "rnl": 0.9, "energy": 2.0, "predicted_energy": 1.0}
    assert differ(alone, {**alone, "rnl": 0.902})
    assert differ(alone, {**alone, "predicted_energy": 1.1})
    assert not differ(alone, {**alone, "rnl": 0.9005, "predicted_energy": 1.01, "rmse": 2.9})
    assert not differ(alone, {})
    assert in_words({"rmse": "low", "rnl": None}) == ""
