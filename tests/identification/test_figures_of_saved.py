"""The figures of a model file are those of the spring in it, along the records as recorded.

They are recomputed from the file alone by an ODE solver. Where effects of a rig were removed, or noise of the
displacement smoothed, the figures are still those of the spring alone along the record.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spring_oracle import OracleSpring
from strandspring import Record, bundled_record, identify, read_record
from tools import slow_but
from zoo_rig import draw_case

ACTUATOR = Path(__file__).parents[1] / "data/actuator/circle_3bar.csv"
OMEGA = 1e-5  # error of omega that is allowed: ten times that of the solver


def records_of(name: str) -> tuple[Record, ...]:
    """A measured record, or those of a mount of the zoo: its name and the number of its case."""
    if name == "hinge":
        return (read_record(bundled_record(), reverse="displacement"),)
    if name == "actuator":
        whole = read_record(ACTUATOR, time=1, displacement=5, force=7)
        thinned = {column: getattr(whole, column)[::10] for column in ("displacement", "force")}
        return (replace(whole, **thinned, time=1e-3 * whole.time[::10]),)
    mount, _, index = name.rpartition(" ")
    return draw_case(mount, 0, int(index)).records


# By number: one, two and three amplitudes in turn, without a fault and with one.
@pytest.mark.parametrize(
    "name",
    slow_but(
        [
            "hinge",
            "actuator",
            "iwan 0",
            "two mechanisms 2",
            "vaiana-rosati 1",
            "maxwell rubber 0",
            "maxwell rubber 2",
            "degrading 2",
            "preisach 5",
            "hump 5",
        ],
        ("hinge", "actuator", "vaiana-rosati 1", "preisach 5"),
    ),
)
def test_figures_are_those_of_the_saved_spring_along_the_record(name: str, tmp_path: Path) -> None:
    records = records_of(name)
    found = identify(records)
    found.spring().save(tmp_path / "spring.json")
    content = json.loads((tmp_path / "spring.json").read_text(encoding="utf-8"))
    spring = OracleSpring(content["parameters"])
    assert len(content["fit"]["records"]) == len(records)
    for record, figures, fit in zip(records, content["fit"]["records"], found.fits, strict=True):
        predicted = spring.force(record.displacement, figures["omega_start"], record.time)
        compared = slice(figures["first_sample"], None)
        x, r, p = record.displacement[compared], record.force[compared], predicted[compared]
        assert figures["samples"] == r.size
        # Of a force, an error of omega is this much; no average over samples can err by more.
        mechanisms = [spring.values, *filter(None, [spring.values.get("second")])]
        tolerance = sum(
            OMEGA * each["kappa_omega"] * OracleSpring({**spring.values, **each}).amplifier(x).max()
            for each in mechanisms
        )
        rmse, rms = np.sqrt(np.mean((r - p) ** 2)), np.sqrt(np.mean(r**2))
        assert figures["rmse"] == pytest.approx(rmse, abs=tolerance)
        assert figures["rnl"] == pytest.approx(1.0 - rmse / rms, abs=tolerance / rms)
        # Hysteretic work; the energy of an error of the force is at most that along the whole way.
        FE, way = spring.elastic(x), np.abs(np.diff(x)).sum()
        rounding = 1e-9 * np.abs(r).max() * way
        assert fit.energy == pytest.approx(np.trapezoid(r - FE, x), abs=rounding)
        assert fit.predicted_energy == pytest.approx(np.trapezoid(p - FE, x), abs=tolerance * way + rounding)
