"""`predict`: ways to give data, figures, table, plot and cautions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from strandspring import Record, RecordError, Spring, bundled_record, predict, synthesize
from strandspring.api.identifying.prediction import prediction_error
from synthetic import record_of, sine, spring_of

ROOT = Path(__file__).resolve().parents[2]
HINGE = ROOT / "models/rubber_hinge.json"
SPRING = Spring(spring_of(1.0, 1.0), "mount")


def test_the_ways_to_give_data_are_those_of_identify(tmp_path: Path) -> None:
    record = record_of(SPRING.parameters, sine(), 0.01, 3)
    path = tmp_path / "loop.csv"
    record.save(path)
    expected = predict(SPRING, record).fits[0]
    for prediction in (
        predict(SPRING, record.displacement, record.force),
        predict(SPRING, displacement=record.displacement, force=record.force),
        predict(SPRING, path),
        SPRING.predict([record]),
    ):
        assert np.array_equal(prediction.fits[0].predicted, expected.predicted)
        assert prediction.rnl == expected.rnl
    with pytest.raises(TypeError, match="Arrays are given"):
        predict(SPRING, record.displacement)
    with pytest.raises(ValueError, match="at least one record"):
        predict(SPRING, [])


def test_a_path_that_does_not_move_is_predicted() -> None:
    rest = Record(np.full(50, SPRING.parameters.displacement_offset), np.ones(50))
    assert np.isfinite(predict(SPRING, rest).rmse)


def test_a_record_without_force_is_refused() -> None:
    record = Record(record_of(SPRING.parameters, sine(), 0.0, 2).displacement, np.zeros(sine().size))
    with pytest.raises(RecordError, match=r"the force is 0 N in all samples compared, .*; check that the column"):
        predict(SPRING, record)


def test_noise_is_all_that_is_left() -> None:
    prediction = predict(SPRING, synthesize(SPRING, noise=0.02, seed=1))
    force = prediction.records[0].force
    # Multiplicative noise of 2 %: rmse is 2 % of the rms force, within 5 % for 3001 samples; RNL is 1 - 0.02.
    assert prediction.rmse == pytest.approx(0.02 * np.sqrt(np.mean(force**2)), rel=0.05)
    assert prediction.rnl == pytest.approx(0.98, abs=1e-3)
    assert prediction.cautions == ()


def test_the_table_holds_every_sample_and_the_interval_of_the_model() -> None:
    record = bundled_record()
    prediction = predict(HINGE, record, reverse="displacement")
    frame = prediction.to_frame()
    assert frame.columns.tolist() == ["record", "displacement", "force", "predicted", "lower", "upper"]
    assert len(frame) == len(prediction.records[0])
    assert set(frame["record"]) == {str(record)}
    assert (frame["lower"] < frame["predicted"]).all()
    steady = frame.iloc[len(frame) // 3 :]  # the first cycle was left out of the identification
    assert ((steady["lower"] <= steady["force"]) & (steady["force"] <= steady["upper"])).mean() > 0.85
    assert predict(SPRING, synthesize(SPRING)).to_frame()[["lower", "upper"]].isna().all(axis=None)


def test_two_records_and_the_plot() -> None:
    records = [record_of(SPRING.parameters, sine(), 0.01, seed) for seed in (1, 2)]
    prediction = predict(SPRING, records)
    frame = prediction.to_frame()
    assert len(frame) == sum(map(len, records))
    axes = Figure().subplots()
    assert prediction.plot(axes) is axes
    assert len(axes.lines) == 4
    assert prediction.summary().splitlines()[0].startswith("Predicted with mount: rmse ")
    assert "<table" in prediction._repr_html_()
    assert repr(prediction).splitlines()[0] == prediction.summary().splitlines()[0]


def test_what_asks_for_caution_is_said() -> None:
    record = synthesize(SPRING, amplitudes=[0.025])
    (sentence,) = predict(SPRING, record).cautions
    assert "outside the identified range 30 to 70 mm" in sentence
    backwards = Record(record.displacement[::-1], record.force[::-1])
    assert len(predict(SPRING, backwards).cautions) == 2


def test_the_path_is_the_displacement_as_recorded() -> None:
    clean = sine(6, 3000)
    jitter = clean + 2e-4 * np.random.default_rng(0).standard_normal(clean.size)  # 0.5 % of the range
    stiff = Spring(replace(SPRING.parameters, rho=5000.0), "stiff")
    prediction = predict(stiff, jitter, stiff.response(clean))
    (fit,) = prediction.fits
    assert np.array_equal(prediction.columns()["displacement"], jitter)
    np.testing.assert_allclose(fit.predicted, stiff.response(jitter, fit.omega_start), rtol=0.0, atol=1e-9)


def test_the_interval_is_along_the_path_as_recorded() -> None:
    prediction = predict(HINGE, bundled_record(), reverse="displacement")
    jitter = prediction.records[0].displacement + 1e-4 * np.random.default_rng(0).standard_normal(2336)
    moved = predict(HINGE, Record(jitter, prediction.records[0].force))
    assert moved.interval is not None
    assert moved.half_widths is not None
    interval, joint = moved.interval
    error = prediction_error(moved.model.parameters, joint, moved.records[0], moved.fits[0].omega_start)
    assert np.array_equal(moved.half_widths[0], interval.reach(moved.fits[0].predicted, error))


def test_a_path_that_jumps_is_followed() -> None:
    turning = SPRING.parameters.displacement_offset + 0.02 * np.array([0.0, 1.0, -1.0, 0.5, -0.5, 0.25, -0.3, 1.0] * 3)
    jumping = predict(SPRING, turning, force=SPRING.response(turning))
    assert jumping.rnl > 0.99999  # the force is the model's own
