"""The figures that are praised are those of the spring that is saved, along the displacement as recorded."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import reports
from strandspring import Identification, build_fmu, simulate_fmu

pytestmark = pytest.mark.long


@pytest.fixture(
    scope="module",
    params=[reports.lagging, pytest.param(reports.hinge, marks=pytest.mark.slow)],
    ids=["lagging", "hinge"],
)
def found(request: pytest.FixtureRequest) -> Identification:
    made: Callable[[], Identification] = request.param
    return made()


def test_the_headline_is_that_of_the_saved_spring_by_an_independent_integration(
    found: Identification, tmp_path: Path
) -> None:
    from oracles import OracleSpring

    found.spring().save(tmp_path / "m.json")
    saved = json.loads((tmp_path / "m.json").read_text(encoding="utf-8"))
    stated, oracle = saved["fit"], OracleSpring(saved["parameters"])
    squares, works = np.zeros(2), np.zeros(2)
    for record, own in zip(found.records, stated["records"], strict=True):
        part = slice(own["first_sample"], None)
        force = oracle.force(record.displacement, own["omega_start"], record.time)[part]
        squares += np.sum((force - record.force[part]) ** 2), np.sum(record.force[part] ** 2)
        elastic, path = oracle.elastic(record.displacement)[part], record.displacement[part]
        works += [np.trapezoid(each - elastic, path) for each in (record.force[part], force)]
        assert np.sqrt(np.mean((force - record.force[part]) ** 2)) == pytest.approx(own["rmse"], rel=1e-5)
    assert found.rnl == stated["rnl"] == pytest.approx(1.0 - np.sqrt(squares[0] / squares[1]), abs=1e-6)
    # The trapezoidal rule between samples.
    assert [stated["energy"], stated["predicted_energy"]] == pytest.approx(works.tolist(), rel=1e-3)
    # So does the FMU driven by the recorded displacement.
    fmu = build_fmu(found, tmp_path, zero=0.0, name="alone", platforms="host")
    for record, fit in zip(found.records, found.fits, strict=True):
        motion = simulate_fmu(fmu, record.displacement, parameters={"omega_start": fit.omega_start})
        np.testing.assert_allclose(motion.force, fit.predicted, rtol=0.0, atol=1e-9 * fit.rms_force)
