"""What Python users may give as records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strandspring import Record, RecordError, identify, synthesize_ni
from strandspring.records.given import as_records, given_records, record_of_arrays

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
    assumed = "the unit of displacement is m (assumed, as none is given)"
    assert record_of_arrays([0.0, 0.1], [0.0, 1.0]).notes == (
        assumed,
        "the unit of force is N (assumed, as none is given)",
    )
    (record,) = as_records(pd.DataFrame({"x": [0.0, 0.1], "F": [0.0, 1.0]}))
    assert assumed in record.notes
    assert record.displacement.tolist() == [0.0, 0.1]
    result = identify(NI.displacement, NI.force, units={"force": "N"})
    assert f"Note: <arrays>: {assumed}" in result.summary().splitlines()
    assert f"Note: <arrays>: {assumed}" in result.spring().predict(NI.displacement, NI.force).summary().splitlines()
    assert "assumed" not in identify(NI).summary()


def test_units_in_names_of_series() -> None:
    x, force = pd.Series(1e3 * NI.displacement, name="stroke [mm]"), pd.Series(1e-3 * NI.force, name="F_kN")
    record = record_of_arrays(x, force)
    assert record.displacement.tolist() == pytest.approx(NI.displacement.tolist(), rel=1e-15)
    assert record.force.tolist() == pytest.approx(NI.force.tolist(), rel=1e-15)
    assert record.notes[0] == "the unit of displacement is mm (found in the Series)"
    assert record_of_arrays(x, force, units={"displacement": "um"}).displacement[5] == pytest.approx(1e-6 * x[5])
    with pytest.raises(RecordError, match="must be a displacement, but the Series gives it the unit 'kN' of a force"):
        record_of_arrays(force, x)


def test_messages_about_a_table_in_memory_name_no_file() -> None:
    frame = pd.DataFrame({"x [mm]": 1e3 * NI.displacement, "F [N]": NI.force})
    (record,) = given_records(frame, units={"displacement": "mm", "force": "kN"})
    assert "the unit of force is kN (as given, though the DataFrame says 'N')" in record.notes
    assert "the unit of displacement is mm (found in the DataFrame)" in given_records(frame)[0].notes
    for force, told in (("load", "is not in the DataFrame, which has"), (7, "got 7; the DataFrame has")):
        with pytest.raises(RecordError, match=told) as refused:
            given_records(frame, force)
        assert "file" not in str(refused.value)
    frame.loc[len(frame) - 1, "F [N]"] = np.nan
    (record,) = given_records(frame)
    assert f"1 incomplete row at the end (from row {len(frame)}) left out" in record.notes


@pytest.mark.parametrize("end", [-4.0, 0.51])
def test_displacements_beyond_half_a_metre_need_a_unit(end: float) -> None:
    x, force = [0.0, end], [0.0, np.sign(end)]
    told = r"without a unit is in m and must be within \+-0.5 m, found .*; give its unit, such as units="
    for data in ((x, force), (pd.DataFrame({"x": x, "F": force}),)):
        with pytest.raises(RecordError, match=told):
            given_records(*data)
        for unit in ("mm", "m"):
            (record,) = given_records(*data, units={"displacement": unit})
            assert record.displacement[1] == pytest.approx(end * {"mm": 1e-3, "m": 1.0}[unit])


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
