"""The calibration by SciPy, with a spring that is known."""

from __future__ import annotations

import re

import pytest

from strandspring.examples.calibration import main


def test_the_spring_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    main()
    printed = capsys.readouterr().out
    found = re.findall(r"(\S+) \+- (\S+) \S+ \(true (\S+)\)", printed)
    assert len(found) == 5
    for value, error, true in found:
        # Four standard errors, and half of the last digit of each that is printed.
        assert abs(float(value) - float(true)) <= 4.0 * float(error) + 1e-3 * float(true), printed
