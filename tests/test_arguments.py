"""What Python users give to the functions of the package, and what they give by mistake."""

from __future__ import annotations

from decimal import Decimal
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import strandspring
from springs import EXAMPLES
from strandspring import Reading, Record, Spring, SpringParameters, identify, predict
from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.arguments import flag, limits, number, numbers, whole

SPRING = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
ROPE = Spring(EXAMPLES["wire_rope"])
CRADLE = SYSTEMS / "gun_cradle.toml"
X, F = 0.01 * np.sin(np.arange(40.0)), np.arange(40.0)
TURNS = 2.0 * np.pi * np.linspace(0.0, 10.0, 4001)
CYCLES = Record(0.01 * np.sin(TURNS), 100.0 * np.sin(TURNS + 0.1), TURNS / (2.0 * np.pi))


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What the rows of arguments.txt may name."""
    import pandas as pd

    names = {name: getattr(strandspring, name) for name in strandspring.__all__}
    checks = {check.__name__: check for check in (flag, limits, number, numbers, whole)}
    springs = {"SPRING": SPRING, "ROPE": ROPE, "CRADLE": CRADLE}
    return names | checks | springs | {"X": X, "F": F, "CYCLES": CYCLES, "np": np, "pd": pd, "nan": np.nan}


def test_numbers_of_any_kind_are_taken_and_nothing_else() -> None:
    import pandas as pd

    for value in (2, 2.0, np.int8(2), np.float32(2), np.array(2.0), Decimal(2)):
        assert number("mass", value) == 2.0
    assert number("mass", 10**400) == np.inf  # which is out of every bound
    for values in ([1, 2], range(1, 3), np.array([1, 2]), pd.Series([1.0, 2.0], index=[5, 9]), iter([1, 2])):
        assert numbers("amplitudes", values) == (1.0, 2.0)
    assert numbers("amplitudes", np.array(3.0)) == numbers("amplitudes", 3) == (3.0,)
    assert limits("band", [1, 2.5]) == (1.0, 2.5)
    assert [whole("draws", value) for value in (3, np.int16(3), np.array(3))] == [3, 3, 3]
    assert flag("robust", True) is flag("robust", np.bool_(True)) is True


def test_methods_of_a_spring_are_the_functions_of_these_names() -> None:
    for name in ("predict", "info", "synthesize", "compare", "isolate", "study", "build_fmu", "export"):
        assert getattr(Spring, name) is getattr(strandspring, name)
        assert getattr(SPRING, name).__self__ is SPRING
    kinds = {parameter.kind for parameter in signature(SPRING.isolate).parameters.values()}
    assert Parameter.VAR_KEYWORD not in kinds


def test_options_are_given_as_such_or_as_keywords() -> None:
    shown = signature(identify).parameters
    assert {"units", "reverse", "cycles", "reading", "method", "fitting"} <= set(shown)
    assert (shown["reverse"].kind, signature(SPRING.study).parameters["points"].default) == (Parameter.KEYWORD_ONLY, 24)
    as_such = predict(SPRING, X, F, reading=Reading(reverse="force", units={"force": "kN"}))
    as_keywords = predict(SPRING, X, F, reverse="force", force_unit="kN")
    for prediction in (as_such, as_keywords):
        assert prediction.records[0].force.tolist() == (-1e3 * F).tolist()


def calls() -> list[Any]:
    """Call and sentence of each row of arguments.txt."""
    lines = Path(__file__).with_name("arguments.txt").read_text(encoding="utf-8").splitlines()
    return [line.split(" => ") for line in lines if line and not line.startswith("#")]


@pytest.mark.parametrize(("call", "sentence"), calls())
def test_wrong_arguments_are_named(
    call: str, sentence: str, names: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    with pytest.raises((TypeError, ValueError)) as caught:
        eval(call, names)  # noqa: S307
    assert sentence in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
