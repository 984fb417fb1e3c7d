"""Functions of the package on springs and records that are known."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import strandspring
from springs import MOUNT
from strandspring import (
    Outcome,
    Record,
    Spring,
    SpringParameters,
    identify,
    info,
    isolate,
    predict,
    simulate,
    synthesize,
)
from strandspring.api.records import Overview
from strandspring.examples.system_models import SYSTEMS
from strandspring.vibration.description.system_file import load_system_file
from strandspring.vibration.one_mass.options import Excitation
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import IsolatedMass
from strandspring.vibration.verdicts.verdicts import CaseVerdict, FigureKind, Limits
from synthetic import spring_of

pytestmark = pytest.mark.long

SPRING = Spring(spring_of(1.0, 1.0), "mount", "a mount")
CRADLE = SYSTEMS / "gun_cradle.toml"
NI = synthesize("ni")


def test_arrays_tables_files_and_records_give_one_spring(tmp_path: Path) -> None:
    import pandas as pd

    x, force = NI.displacement, NI.force
    NI.save(tmp_path / "ni.csv", "m")
    frame = pd.DataFrame({"stroke": x, "other": np.ones_like(x), "load": force})
    expected = predict(SPRING, NI).fits[0]
    for prediction in (
        predict(SPRING, displacement=x.tolist(), force=pd.Series(force)),
        predict(SPRING, frame, displacement="stroke", force="load"),
        predict(SPRING, pd.DataFrame({"stroke [mm]": 1e3 * x, "load [kN]": 1e-3 * force})),
        predict(SPRING, 1e3 * x, 1e-3 * force, units={"displacement": "mm", "force": "kN"}),
        predict(SPRING, -x, force, reverse="displacement"),
        predict(SPRING, str(tmp_path / "ni.csv")),
        SPRING.predict([Record(x, force)]),
    ):
        assert prediction.fits[0].predicted == pytest.approx(expected.predicted, rel=1e-12, abs=1e-12)
        assert prediction.rnl == pytest.approx(expected.rnl, rel=1e-12)
    assumed = "The unit is assumed, as none is given. (displacement in m; force in N)"
    assert f"Note: <arrays>: {assumed}" in predict(SPRING, x, force).summary()
    times = pd.date_range("2024-01-01", periods=x.size, freq="500ms", tz="Asia/Tokyo")
    (record,) = predict(SPRING, frame.assign(**{"Time [ms]": times})).records
    assert record.time == pytest.approx(0.5 * np.arange(x.size))


def test_a_synthesized_record_is_the_response_with_its_noise_and_sensors() -> None:
    record = synthesize(SPRING, amplitudes=[0.01, 0.02], cycles=2, samples=100, frequency=0.5)
    assert record.force == pytest.approx(SPRING.response(record.displacement), rel=1e-12, abs=1e-10)  # of 1 ulp in mm
    assert np.ptp(record.displacement) == pytest.approx(0.04, rel=1e-12)
    assert record.time is not None
    assert (len(record), record.time[-1]) == (401, pytest.approx(8.0))
    clean, noisy = (synthesize(SPRING, [0.03], noise=noise, seed=4) for noise in (0.0, 0.02))
    # The standard deviation of 3001 standard normal numbers is 1 within 5 % (nearly 4 of its standard errors).
    assert np.std(noisy.force / clean.force - 1.0) == pytest.approx(0.02, rel=0.05)
    assert noisy.notes[0] == "Noise level 0.02, seed 4."
    assert "outside the identified range" in noisy.notes[1]
    plain = synthesize(SPRING)
    coarse = synthesize(SPRING, drift=0.02, displacement_resolution=2e-5, force_resolution=0.5)
    assert np.max(np.abs(coarse.displacement - plain.displacement)) <= 1e-5 * (1.0 + 1e-9)  # half a step
    growth = 1.0 + 0.02 * np.arange(len(plain)) / len(plain)
    assert np.max(np.abs(coarse.force - growth * plain.force)) <= 0.25 * (1.0 + 1e-9)
    # Multiplicative noise of 2 % is all that is left of it: RNL is 1 - 0.02.
    assert predict(SPRING, synthesize(SPRING, noise=0.02, seed=1)).rnl == pytest.approx(0.98, abs=1e-3)
    (sentence,) = predict(SPRING, synthesize(SPRING, [0.025])).cautions
    assert "beyond 30 to 70 mm" in sentence


def test_the_curve_is_that_of_the_balance_and_peaks_are_resolved() -> None:
    system = IsolatedMass(MOUNT, 5.1)
    band = np.geomspace(2.6, 57.0, 200)
    plain = frequency_response(system, Excitation.BASE_DISPLACEMENT, 6e-4, band)
    result = isolate(Spring(MOUNT), 5.1, base_displacement=[3e-4, 6e-4], band=(2.6, 57.0), zero="rig")
    resolved = result.models[0].responses[1]
    assert resolved.resonance.transmissibility == pytest.approx(plain.resonance.transmissibility, rel=1e-9)
    near = [np.log([p.amplitude for p in response.points if 3.6 < p.frequency < 4.0]) for response in (resolved, plain)]
    # No corner is left in the superharmonic peak that 200 points show as a needle.
    assert len(near[0]) >= 15
    assert np.abs(np.diff(near[0])).max() < 0.5 * np.abs(np.diff(near[1])).max()
    assert [one.agrees for one in isolate(Spring(MOUNT), 5.1, base_displacement=3e-4, points=4).verify()] == [True] * 3


def test_a_range_beyond_its_limit_fails(tmp_path: Path) -> None:
    import pandas as pd

    file = load_system_file(CRADLE)
    cradle = simulate(CRADLE, "one round", draws=16, seed=4)
    ranges = [answer.worst(FigureKind.SWAY) for answer in cradle.answers]
    low, high = (sorted(getattr(sway, end) for sway in ranges if sway) for end in ("low", "high"))
    for limit, verdict in (
        (0.99 * low[0], CaseVerdict.FAILS),
        (0.5 * (low[0] + high[0]), CaseVerdict.UNDECIDED),
        (1.01 * high[1], CaseVerdict.PASSES),
    ):
        tight = replace(file, limits=Limits({FigureKind.SWAY: {"breech": limit}}))
        found = simulate(tight, "one round", courses=False, draws=16, seed=4)
        assert {answer.verdict for answer in found.answers} == {verdict}
    written, figure = cradle.save_histories(tmp_path / "new"), cradle.answers[0].worst(FigureKind.ACCELERATION)
    assert [path.name for path in written] == ["four_springs_one_round.csv", "five_springs_one_round.csv"]
    assert figure is not None
    assert figure.low <= pd.read_csv(written[0])["breech acceleration x [m/s^2]"].abs().max() <= figure.high


def test_records_are_identified_and_their_cautions_are_warnings(tmp_path: Path) -> None:
    path = tmp_path / "a loop.csv"
    synthesize(SPRING).save(path, "mm")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        built = strandspring.build_fmu(path, tmp_path)
    assert [str(one.message) for one in said] == list(identify(path).cautions)
    assert built.name == "a_loop.fmu"
    assert strandspring.verify(built).ok


@pytest.mark.parametrize("first", [0.005, 0.025])
def test_a_record_has_the_same_loops_wherever_they_are_counted(first: float) -> None:
    cycles = np.linspace(0.0, 8.0, 801)
    path = np.interp(cycles, [0.0, 5.0, 8.0], [first, 0.025, 0.025]) * np.sin(2.0 * np.pi * cycles)
    spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.03, 0.03))
    record = Record(path, spring.response(path), cycles)
    found = identify(record, method="two-stage")
    (shown,) = Overview([record]).as_json()["records"]
    counts = [
        len(shown["cycles"]),
        sum(loop["cycles"] for loop in shown["loops"]),
        info(found.spring(), record).to_frame()["cycles"].sum(),
        sum(loop.cycles for loop in found.recorded),
    ]
    assert counts == [counts[0]] * 4
    # They are the loops that the spring was identified from.
    smaller = replace(record, displacement=0.1 * path)
    kinds = [{finding.kind for finding in predict(found.spring(), one).findings} for one in (record, smaller)]
    assert [Outcome.OTHER_AMPLITUDES in of for of in kinds] == [False, True]
