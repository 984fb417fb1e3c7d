"""The figures that are praised are those of the spring that is saved, along the displacement as recorded."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import reports
from strandspring import (
    Identification,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    build_fmu,
    identify,
    predict,
    simulate_fmu,
)
from strandspring.model.stated_figures import energy_ratio

SUBSTEPS = 8  # of a fourth-order step between two samples


def jittering() -> Identification:
    """A sensor whose last digits turn back and forth, beside a stiff loop."""
    clean = 0.02 * np.sin(np.linspace(0.0, 8.0 * np.pi, 4001)) * np.repeat([1.0, 0.6], [2001, 2000])
    force = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 3000.0, 1.0, 1.0, 0.0, -0.02, 0.02)).response(clean)
    noise = np.random.default_rng(0).standard_normal((2, clean.size))
    record = Record(clean + 4e-5 * noise[0], force + 0.05 * noise[1], path="jitter.csv")
    return identify(record, options=RefinedOptions(mechanisms=1))  # what `integrated` knows


CASES: dict[str, Callable[[], Identification]] = {
    "hinge": reports.hinge, "lagging": reports.lagging, "campaign": reports.campaign, "jitter": jittering,
}  # fmt: skip


@pytest.fixture(scope="module", params=CASES)
def found(request: pytest.FixtureRequest) -> Identification:
    return CASES[request.param]()


def integrated(content: dict[str, Any], path: np.ndarray, omega_start: float) -> tuple[np.ndarray, np.ndarray]:
    """Elastic force and whole force by Runge and Kutta's method on paper eq. (11), from a model file."""
    p = content["parameters"]

    def slope(u: float) -> float:
        # Of u = omega in the direction of motion, over the travel.
        return float(p["rho"] * (1.0 - (1.0 if u >= 0.0 else 1.0 - 2.0 * p["sigma"]) * abs(u) ** p["n"]))

    omega = np.empty(path.size)
    omega[0] = omega_start
    for k, step in enumerate(np.diff(path)):
        sign, h = np.sign(step) or 1.0, abs(step) / SUBSTEPS
        u = sign * omega[k]
        for _ in range(SUBSTEPS if step else 0):
            a = slope(u)
            b = slope(u + 0.5 * h * a)
            c = slope(u + 0.5 * h * b)
            u = min(u + h / 6.0 * (a + 2.0 * b + 2.0 * c + slope(u + h * c)), 1.0)
        omega[k + 1] = sign * u
    low, high = p["displacement_min"], p["displacement_max"]
    inside = np.clip(path, low, high)
    if "kE" in p:
        law = np.polynomial.Polynomial(p["kE"])
        x = inside - p["displacement_offset"]
        elastic = law(x) + law.deriv()(x) * (path - inside)
    else:
        spline = CubicSpline(p["FE_knots"], p["FE_forces"], bc_type="not-a-knot")
        elastic = spline(inside) + spline(inside, 1) * (path - inside)
    amplifier = np.polynomial.Polynomial(p["kA"])(inside - p["displacement_offset"])
    return elastic, elastic + p["kappa_omega"] * omega * amplifier


def test_the_headline_is_that_of_the_saved_spring_by_an_independent_integration(
    found: Identification, tmp_path: Path
) -> None:
    found.spring().save(tmp_path / "m.json")
    content = json.loads((tmp_path / "m.json").read_text(encoding="utf-8"))
    errors, forces, works = [], [], np.zeros(2)
    for record, stated in zip(found.records, content["fit"]["records"], strict=True):
        elastic, force = integrated(content, record.displacement, stated["omega_start"])
        own = slice(stated["first_sample"], None)
        errors.append((force - record.force)[own])
        forces.append(record.force[own])
        assert np.sqrt(np.mean(errors[-1] ** 2)) == pytest.approx(stated["rmse"], rel=1e-3)
        for k, each in enumerate((record.force, force)):
            works[k] += np.trapezoid((each - elastic)[own], record.displacement[own])
    square = np.sum(np.concatenate(forces) ** 2)
    rnl = 1.0 - np.sqrt(np.sum(np.concatenate(errors) ** 2) / square)
    # The cusp of omega at 0 (n < 1) costs the integration its order.
    assert found.rnl == pytest.approx(rnl, abs=1e-4)
    assert content["fit"]["rnl"] == found.rnl
    assert [content["fit"][name] for name in ("energy", "predicted_energy")] == pytest.approx(works, rel=1e-3)
    assert f"RNL {found.rnl:.4f}, energy {works[1] / works[0]:.2f} of the measured" in found.text_lines()[1]


def test_the_fmu_driven_by_the_recorded_displacement_gives_the_headline(found: Identification, tmp_path: Path) -> None:
    fmu = build_fmu(found, tmp_path, zero=0.0, name="alone", platforms="host")
    for record, fit in zip(found.records, found.fits, strict=True):
        motion = simulate_fmu(fmu, record.displacement, parameters={"omega_start": fit.omega_start})
        np.testing.assert_allclose(motion.force, fit.predicted, rtol=0.0, atol=1e-9 * fit.rms_force)


def test_predicting_its_own_record_gives_about_the_headline(found: Identification) -> None:
    # omega_start is estimated, and the samples before the steady part are compared, too.
    prediction = predict(found.spring(), list(found.records))
    for record, fit, own in zip(found.records, prediction.fits, found.fits, strict=True):
        errors = (fit.predicted - record.force)[own.first_sample :]
        assert np.sqrt(np.mean(errors**2)) == pytest.approx(own.rmse, rel=0.02)


def test_both_figures_are_told_where_they_differ() -> None:
    found = reports.lagging()
    own, fitted = found.figures, found.fitted_figures
    _, first, of_record, beside, *_ = found.text_lines()
    assert first.endswith("(the saved spring alone)")
    assert f"RNL {own['rnl']:.4f}, energy {energy_ratio(own):.2f} of the measured" in of_record
    assert beside.strip() == (
        f"with what was removed: RNL {fitted['rnl']:.4f}, energy {energy_ratio(fitted):.2f} of the measured"
    )
    assert not any("what was removed" in line for line in reports.campaign().text_lines())
