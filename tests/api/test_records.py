"""What Python users pass as records, and what they pass by mistake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from strandspring import (
    ModelError,
    RecordError,
    RefinedOptions,
    ReportDetails,
    Spring,
    StrandspringError,
    TwoStageOptions,
    compare,
    identify,
    identify_many,
    predict,
    select,
)
from synthetic import record_of, sine, spring_of

SPRING = Spring(spring_of(1.0, 1.0), "mount")
RECORD = record_of(SPRING.parameters, sine(), 0.0)
X, F = RECORD.displacement, RECORD.force


def test_millimetres_without_a_unit_are_noticed() -> None:
    with pytest.raises(RecordError, match=r"must be within \+-0.5 m, found .* units=\{\"displacement\": \"mm\"\}"):
        predict(SPRING, 1e3 * X, F)
    assert predict(SPRING, 1e3 * X, F, units={"displacement": "mm"}).rnl == pytest.approx(predict(SPRING, X, F).rnl)


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        ({"units": "mm"}, RecordError, "`units` must be a mapping"),
        ({"units": {"disp": "mm"}}, RecordError, "got 'disp'"),
        ({"reverse": "time"}, RecordError, "`reverse` must be 'displacement' or 'force', got 'time'"),
        ({"options": "refined"}, TypeError, "such as RefinedOptions\\(\\), got 'refined'"),
        ({"method": "two_stage"}, ValueError, "`method` must be refined, two-stage, paper, ni, got 'two_stage'"),
        ({"method": "paper", "options": RefinedOptions()}, TypeError, "`method` and `options` exclude each other"),
        ({"save_anyway": "no"}, TypeError, "`save_anyway` must be True or False, got 'no'"),
    ],
)
def test_wrong_arguments_of_identify(arguments: dict[str, Any], error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        identify(X, F, **arguments)


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        ({"reverse": "time"}, RecordError, "`reverse` must be"),
        ({"units": {"force": "furlong"}}, RecordError, "unit 'furlong' of the force is not known"),
        ({"workers": -1}, ValueError, "`workers` must be at least 1"),
        ({"options": "refined"}, TypeError, "RefinedOptions"),
    ],
)
def test_wrong_arguments_of_a_batch_are_not_blamed_on_the_files(
    arguments: dict[str, Any], error: type[Exception], told: str, tmp_path: Path
) -> None:
    RECORD.save(tmp_path / "a.csv")
    with pytest.raises(error, match=told):
        identify_many(tmp_path / "a.csv", tmp_path / "models", **arguments)
    assert not (tmp_path / "models").exists()


def test_a_method_by_its_name() -> None:
    assert identify(RECORD, method="two-stage").parameters == identify(RECORD, TwoStageOptions()).parameters


def test_other_wrong_arguments() -> None:
    wrong: Any = "a.csv"
    with pytest.raises(TypeError, match="read files with `read_record`"):
        select(wrong, cycles=(1, 2))
    for cycles in (2, "2:3"):
        with pytest.raises(RecordError, match="`cycles` must be a pair"):
            select(RECORD, cycles=cycles)  # type: ignore[arg-type]
    for degrees in (3, (1, 2, 3), "ab"):
        with pytest.raises(ValueError, match="`degrees` must be N,M"):
            RefinedOptions(degrees=degrees)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"got str; read a model file with `Spring\.load`"):
        Spring(wrong, "mount")
    with pytest.raises(ModelError, match="must be text, got SpringParameters"):
        Spring(SPRING.parameters, SPRING.parameters)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="`mass` must be finite and > 0"):
        compare(SPRING, SPRING, mass=-1.0)
    with pytest.raises(StrandspringError, match="pairs of label and text"):
        ReportDetails(fields={"Temperature": "23 °C"})  # type: ignore[arg-type]
