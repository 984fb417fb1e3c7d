"""What Python users may give as records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strandspring import Record, RecordError, identify, synthesize_ni
from strandspring.records.given import as_records, record_of_arrays

NI = synthesize_ni()


def test_arrays_tables_files_and_records_give_one_spring(tmp_path: Path) -> None:
    x, force = NI.displacement, NI.force
    path = tmp_path / "ni.csv"
    NI.save(path, "m")
    expected = identify(NI).parameters
    frame = pd.DataFrame({"stroke": x, "other": np.ones_like(x), "load": force})
    in_mm = pd.DataFrame({"stroke [mm]": 1e3 * x, "load [kN]": 1e-3 * force})
    for found in (
        identify(x, force),
        identify(displacement=x, force=force),
        identify(x.tolist(), force.tolist()),
        identify(pd.Series(x), pd.Series(force)),
        identify(frame),
        identify(frame, displacement="stroke", force="load"),
        identify([Record(x, force)]),
        identify(path),
        identify(str(path)),
    ):
        assert found.parameters == expected
    assert identify(in_mm).parameters.n == pytest.approx(expected.n, rel=1e-6)
    scaled = identify(1e3 * x, 1e-3 * force, units={"displacement": "mm", "force": "kN"})
    assert scaled.parameters.n == pytest.approx(expected.n, rel=1e-6)
    assert identify(-x, force, reverse="displacement").parameters == expected


def test_series_are_not_paired_across_indexes() -> None:
    x, force = pd.Series(NI.displacement), pd.Series(NI.force)
    with pytest.raises(RecordError, match="Series of displacement and force must have the same index"):
        identify(x.iloc[:-1], force.iloc[1:])
    assert record_of_arrays(x.iloc[3:], force.iloc[3:]).displacement.tolist() == NI.displacement[3:].tolist()
    assert record_of_arrays(x.iloc[:-1], NI.force[1:]).force.tolist() == NI.force[1:].tolist()


def test_assumed_units_are_noted() -> None:
    assert record_of_arrays([0.0, 1.0], [0.0, 1.0]).notes == (
        "units assumed: displacement in m, force in N, time in s",
    )
    (record,) = as_records(pd.DataFrame({"x": [0.0, 1.0], "F": [0.0, 1.0]}))
    assert "the unit of displacement is m (assumed, as none is given)" in record.notes
    assert record.displacement.tolist() == [0.0, 1.0]


def test_wrong_arguments_get_a_sentence() -> None:
    x, force = NI.displacement, NI.force
    with pytest.raises(TypeError, match=r"identify\(displacement, force\)|displacement and force"):
        identify(x)
    with pytest.raises(RecordError, match="keys displacement, force, time only, got 'x'"):
        identify(x, force, units={"x": "mm"})
    with pytest.raises(RecordError, match="not known"):
        identify(x, force, units={"force": "stone"})
    with pytest.raises(RecordError, match="no column is named like a force"):
        identify(pd.DataFrame({"x": x, "y": force}))
    with pytest.raises(TypeError, match="is a record already"):
        identify(NI, force="load")
    with pytest.raises(TypeError, match="Records must be a path"):
        identify(3.0)


def test_columns_of_a_table_that_hold_moments_or_text() -> None:
    path = 0.01 * np.sin(np.arange(40.0))
    moments = pd.date_range("2024-01-01", periods=40, freq="500ms")
    for times in (moments, moments.tz_localize("Asia/Tokyo"), moments - moments[0]):
        (record,) = as_records(pd.DataFrame({"Time [ms]": times, "x": path, "F": 2.0 * path}))
        assert record.time is not None
        assert record.time.tolist() == pytest.approx((0.5 * np.arange(40)).tolist())
    with pytest.raises(RecordError, match=r"but 'x' .* hold none; convert"):
        as_records(pd.DataFrame({"x": path.astype(str).astype(object), "F": path}))
