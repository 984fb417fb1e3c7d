"""Parameter studies: what is drawn, what a run gives, what is told of them all."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from springs import TABLE
from strandspring import ModelError, Spring
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.runs import DONE
from strandspring.campaigns.studies.summaries import QUANTILES, summaries
from strandspring.ground.files import write_csv
from strandspring.model.joint import HYSTERETIC_UNITS, JointCovariance, joint_names
from strandspring.model.modelfile import ModelFile, save_model
from strandspring.vibration.bodies.parts import scaled
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, IsolationError, static_equilibrium
from studies import CHEAP, COMMAND, CORRELATION, ERRORS, SPREAD, SPRING, UNCERTAINTY, uncertainty_of_hysteresis
from terminal import Terminal, unfolded

pytestmark = pytest.mark.long

DRAWN = tuple(HYSTERETIC_UNITS)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    save_model("mount.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
    save_model("bare.json", ModelFile("bare", SPRING))
    return Terminal(capsys)


# Draws


def test_a_draw_is_the_same_whatever_was_drawn_before() -> None:
    several = [SPREAD.draw(SPRING, 3, k) for k in range(5)]
    assert SPREAD.draw(SPRING, 3, 4) == several[4]
    assert len({one.rho for one in several}) == 5
    assert SPREAD.draw(SPRING, 4, 4) != several[4]
    # Only the hysteresis is drawn.
    known = {name: getattr(SPRING, name) for name in DRAWN}
    assert replace(several[0], **known) == SPRING


def test_draws_scatter_as_the_uncertainty_says() -> None:
    number = 4000
    drawn = [SPREAD.draw(SPRING, 0, k) for k in range(number)]
    logs = np.log([[getattr(one, name) for name in DRAWN] for one in drawn])
    relative = np.array([ERRORS[name] / getattr(SPRING, name) for name in DRAWN])
    correlation = np.eye(4)
    for pair, value in CORRELATION.items():
        i, j = (DRAWN.index(name) for name in pair.split(","))
        correlation[i, j] = correlation[j, i] = value
    covariance = np.outer(relative, relative) * correlation
    # Five standard errors of a mean and of a covariance of normal numbers: one in 1e6 by chance, and the seed is fixed.
    middle = np.log([getattr(SPRING, name) for name in DRAWN])
    assert np.all(np.abs(logs.mean(axis=0) - middle) < 5.0 * relative / np.sqrt(number))
    error = np.sqrt((np.outer(relative, relative) ** 2 + covariance**2) / number)
    assert np.all(np.abs(np.cov(logs.T) - covariance) < 5.0 * error)


def test_draws_stay_possible_however_wide_the_spread() -> None:
    errors = {name: 5.0 * getattr(SPRING, name) for name in DRAWN}
    wide = JointCovariance.to_draw_from(SPRING, uncertainty_of_hysteresis(SPRING, errors, {}))
    drawn = [wide.draw(SPRING, 0, k) for k in range(300)]  # a spring that is not possible raises
    assert {0.5, 1000.0} <= {one.sigma for one in drawn}
    assert {0.01, 100.0} <= {one.n for one in drawn}


def test_all_coefficients_are_drawn_jointly_where_the_model_file_has_them() -> None:
    names = joint_names("kE", len(SPRING.kE), len(SPRING.kA) - 1)
    # The slope of FE and ln(kappa_omega) go together; FA is so uncertain that half of the draws are no spring.
    scale = [0.0, 30.0, 0.0, 0.0, 0.0, 5000.0, 0.0, 0.1, 0.0, 0.0]
    root = [[0.0] * k + [share] for k, share in enumerate(scale)]
    root[6][1] = 0.05
    content = {**UNCERTAINTY, "joint": {"parameters": names, "root": root}}
    spread = JointCovariance.to_draw_from(SPRING, content)
    drawn = [spread.draw(SPRING, 1, k) for k in range(500)]
    assert drawn[7] == spread.draw(SPRING, 1, 7)
    slope = np.array([one.kE[1] for one in drawn]) - SPRING.kE[1]
    kappa_omega = np.log([one.kappa_omega / SPRING.kappa_omega for one in drawn])
    assert kappa_omega == pytest.approx(slope / 30.0 * 0.05, abs=1e-12)
    # A standard deviation from 500 draws scatters by 3 %.
    assert np.std(slope) == pytest.approx(30.0, rel=0.15)
    assert min(one.kA[2] for one in drawn) > -2500.0  # FA > 0 at both ends
    assert {one.sigma for one in drawn} == {SPRING.sigma}
    # The slope of FA alone makes it negative at one end or the other.
    root[4][4] = 1e9
    hardly_known = JointCovariance.to_draw_from(SPRING, content)
    with pytest.raises(ModelError, match="None of 1000 springs drawn from the model's uncertainty is physically"):
        hardly_known.draw(SPRING, 0, 0)


def test_what_was_at_its_bound_is_taken_as_known() -> None:
    errors = {**ERRORS, "sigma": 0.0}
    spread = JointCovariance.to_draw_from(SPRING, uncertainty_of_hysteresis(SPRING, errors, CORRELATION))
    drawn = [spread.draw(SPRING, 0, k) for k in range(3)]
    assert {one.sigma for one in drawn} == {SPRING.sigma}
    # The slope of FA alone makes it negative at one end or the other.
    assert len({one.n for one in drawn}) == 3


def test_parameters_that_cannot_be_distinguished_are_drawn_together() -> None:
    content = uncertainty_of_hysteresis(SPRING, {"rho": 0.1 * SPRING.rho, "n": 0.2}, {"rho,n": -1.0})
    spread = JointCovariance.to_draw_from(SPRING, content)
    for k in range(5):
        one = spread.draw(SPRING, 0, k)
        assert np.log(one.n / SPRING.n) == pytest.approx(-2.0 * np.log(one.rho / SPRING.rho), rel=1e-9)


@pytest.mark.parametrize(
    ("uncertainty", "told"),
    [
        ({}, 'field "uncertainty" holds no joint covariance of the coefficients to draw from'),
        ({"n": 0.1, "correlation": {"rho,n": 0.9}}, "holds no joint covariance"),
        (uncertainty_of_hysteresis(SPRING, {"n": 11.0}, {}), "n is known to 1100 % only"),
        ({"joint": {"parameters": ["rho"], "root": [[1.0]]}}, 'field "uncertainty.joint.parameters" must be'),
    ],
)
def test_impossible_uncertainties_are_refused(uncertainty: dict[str, Any], told: str) -> None:
    with pytest.raises(ModelError, match=told):
        JointCovariance.to_draw_from(SPRING, uncertainty)


# Runs


def test_the_forces_of_a_table_are_drawn() -> None:
    names = joint_names("FE_forces", len(TABLE.FE_forces), len(TABLE.kA) - 1)
    root = [[0.0] * k + [0.5 if k < 10 else 1e-3] for k in range(len(names))]
    uncertainty = {"rho": 1.0, "joint": {"parameters": names, "root": root}}
    drawn = [JointCovariance.to_draw_from(TABLE, uncertainty).draw(TABLE, 5, k) for k in range(400)]
    assert {one.FE_knots for one in drawn} == {TABLE.FE_knots}
    scatter = np.std([one.FE_forces for one in drawn], axis=0)
    # A standard deviation of 400 values is known to 3.5 %.
    assert scatter == pytest.approx(np.full(10, 0.5), rel=0.15)


def test_a_factor_scales_every_force_of_a_table() -> None:
    path = np.linspace(TABLE.displacement_min, TABLE.displacement_max, 9)
    assert Spring(scaled(TABLE, 1.7, 1.7)).response(path) == pytest.approx(
        1.7 * Spring(TABLE).response(path), rel=1e-12
    )


def test_a_run_tells_what_the_frequency_response_does() -> None:
    study = Study(
        SPRING, Excitation.BASE_ACCELERATION, (4.0, 5.0), (0.5,), (0.9, 1.2), draws=2, seed=1, spread=SPREAD,
        load=30.0, parallel=2, series=3, damping=8.0, points=12,
    )  # fmt: skip
    (row,) = study.rows([7])
    drawn = SPREAD.draw(SPRING, 1, 1)
    assert (row.run, row.draw, row.mass, row.level, row.stiffness_factor) == (7, 1, 5.0, 0.5, 1.2)
    assert [getattr(row, name) for name in DRAWN] == [getattr(drawn, name) for name in DRAWN]
    stiff = replace(drawn, kE=tuple(1.2 * c for c in SPRING.kE), kappa_omega=1.2 * drawn.kappa_omega)
    system = IsolatedMass(stiff, 5.0, 30.0, 2, 3, 8.0)
    rest = static_equilibrium(system)
    band = np.geomspace(0.23 * rest.frequency, 5.0 * rest.frequency, 12)
    resonance = frequency_response(system, Excitation.BASE_ACCELERATION, 0.5, band).resonance
    assert (row.static_equilibrium, row.sag, row.outcome) == (rest.displacement, rest.sag, DONE)
    for name, value in asdict(resonance).items():
        assert getattr(row, name) == value, name


def test_every_grid_point_has_every_draw() -> None:
    study = replace(CHEAP, levels=(5e-5, 1e-4), stiffness_factors=(0.9, 1.0, 1.1), draws=2)
    rows = study.rows(range(len(study)))
    assert len(rows) == len(study) == 3 * 2 * 3 * 2
    assert len({(row.mass, row.level, row.stiffness_factor, row.draw) for row in rows}) == len(rows)
    assert {(row.draw, row.rho) for row in rows} == {(k, SPREAD.draw(SPRING, 7, k).rho) for k in range(2)}


def test_without_draws_the_identified_spring_is_run_once_at_each_grid_point() -> None:
    study = replace(CHEAP, draws=0, spread=None)
    rows = study.rows(range(len(study)))
    assert [row.mass for row in rows] == [4.0, 5.0, 400.0]
    assert {(row.draw, row.rho, row.n) for row in rows} == {(None, SPRING.rho, SPRING.n)}


def test_a_run_that_cannot_be_is_a_row_with_its_reason() -> None:
    heavy, leaving = replace(CHEAP, masses=(400.0,)), replace(CHEAP, levels=(0.005,), band=(6.0, 12.0))
    (row,) = heavy.rows([0])
    assert row.outcome.startswith("The static load of 3922.66 N on each spring must lie within")
    assert row.static_equilibrium is row.frequency is row.inside is None
    (row,) = leaving.rows([0])
    assert "outside the identified range of 30 to 70 mm" in row.outcome
    assert row.static_equilibrium is not None
    assert row.frequency is row.transmissibility is None


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"masses": (5.0, 0.0)}, r"`mass` must be within \[1e-09, 1e\+09\] kg, got 0.0"),
        ({"levels": (-1e-3,)}, r"Every level must be finite and > 0 \[m\], got -0.001"),
        ({"levels": ()}, "must have from 1 to 1000000 runs, got 0"),
        ({"stiffness_factors": (0.0,)}, "Every stiffness factor must be within .* got 0.0"),
        ({"band": (0.0, 5.0)}, r"The band must rise from above 0 \[Hz\]"),
        ({"points": 1}, "`points` must be >= 2"),
        ({"draws": -1}, "`draws` must be >= 0"),
        ({"spread": None}, "`spread` must be given"),
        ({"draws": 1_000_000}, "runs, got 3000000"),
    ],
)
def test_impossible_studies_are_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(IsolationError, match=told):
        replace(CHEAP, **change)


# What is told


def test_json_and_csv_say_the_same(terminal: Terminal) -> None:
    told = json.loads(terminal(*COMMAND, "--workers", "1", "-o", "results.csv", "--json"))
    table = pd.read_csv("results.csv")
    assert table["run"].tolist() == list(range(60))
    assert (told["runs"], told["draws"], told["seed"], told["unit"]) == (60, 20, 7, "m")
    light, _, heavy = told["points"]
    assert (light["mass"], light["level"], light["refused"], light["at_end_of_band"]) == (4.0, 1e-4, 0, 20)
    of_light = table[table["mass [kg]"] == 4.0]
    assert set(of_light["outcome"]) == {DONE}
    for name, column in (
        ("frequency", "resonance frequency [Hz]"),
        ("transmissibility", "transmissibility [1]"),
        ("loss_factor", "loss factor [1]"),
        ("sag", "sag [m]"),
    ):
        quantiles = of_light[column].quantile([0.05, 0.5, 0.95]).tolist()
        assert list(light["figures"][name].values()) == pytest.approx(quantiles, rel=1e-12), name
    assert light["figures"]["isolation_frequency"] is None  # the band ends below
    assert (heavy["refused"], heavy["figures"]["frequency"]) == (20, None)
    reason = heavy["reason"]
    assert reason.startswith("The static load of 3922.66 N on each spring")
    assert set(table[table["mass [kg]"] == 400.0]["outcome"]) == {reason}


def test_the_text_is_the_json_in_words(terminal: Terminal) -> None:
    command = [*COMMAND, "--draws", "3", "--workers", "1", "-o", "results.csv"]
    light, _, heavy = json.loads(terminal(*command, "--json"))["points"]
    text = terminal(*command, "--verbose")
    for said in (
        "9 runs: 3 draws (seed 7) at each of 3 grid points, 3 refused",
        *(f"{value:.4g}" for value in light["figures"]["transmissibility"].values()),
        f"  400 kg, 0.1 mm, stiffness x 1: 3 of 3 refused, most often: {heavy['reason']}",
        "  4 kg, 0.1 mm, stiffness x 1: 3 of 3 have their peak at an end of the band",
        "Results: results.csv",
    ):
        assert said in text, said


def test_motion_beyond_the_identified_range_is_reported(terminal: Terminal) -> None:
    command = ["study", "mount.json", "--mass", "5", "--base-displacement", "0.1", "--base-displacement", "3",
               "--band", "2", "40", "--points", "20", "--draws", "0", "-o", "results.csv"]  # fmt: skip
    refused = json.loads(terminal(*command, "--json"))
    assert [point["refused"] for point in refused["points"]] == [0, 1]
    told = json.loads(terminal(*command, "--extrapolate", "--json"))
    assert [point["extrapolating"] for point in told["points"]] == [0, 1]
    rows = pd.read_csv("results.csv")
    assert rows["beyond the identified range"].tolist() == [False, True]
    assert "in 1 of 1 the spring moves outside the identified range" in unfolded(terminal(*command, "--extrapolate"))


def summed_up(study: Study, rows: Iterable[RunRow], folder: Path) -> pd.DataFrame:
    """The summaries of rows that stand in the results."""
    write_csv(folder / "r.csv", [column.file_heading for column in study.columns], map(study.cells, rows))
    return summaries(study, folder / "r.csv")


def test_the_most_frequent_reason_is_reported_whatever_its_numbers(tmp_path: Path) -> None:
    study = replace(CHEAP, masses=(5.0,), draws=3)
    rows = [
        replace(row, outcome=outcome)
        for row, outcome in zip(
            study.rows(range(3)), ("Stuck at 3 Hz.", "Left at 1.5 mm.", "Left at -2e-05 mm."), strict=True
        )
    ]
    table = summed_up(study, rows, tmp_path)
    assert table[["refused", "reason"]].to_numpy().tolist() == [[3, "Left at 1.5 mm."]]


def test_quantiles_are_those_of_numpy_over_the_runs_that_have_a_figure(tmp_path: Path) -> None:
    study = replace(CHEAP, masses=(4.0, 5.0), levels=(1e-4, 2e-4), draws=37)
    generator = np.random.default_rng(5)
    names = [figure.key for figure in study.figures]
    rows = []
    for run in range(len(study)):
        values = generator.standard_normal(len(names)).tolist()
        known = {name: value for name, value in zip(names, values, strict=True) if generator.random() < 0.7}
        outcome = DONE if generator.random() < 0.8 else "No."
        inside, beyond = (generator.choice([None, False, True]) for _ in range(2))
        rows.append(
            RunRow(run, 0, 4.0, 1e-4, 1.0, 1.0, 1.0, 1.0, 1.0, **known, inside=inside, extrapolating=beyond,
                   outcome=outcome)
        )  # fmt: skip
    table = summed_up(study, rows, tmp_path)
    assert len(table) == 4
    for index, summary in enumerate(table.to_dict("records")):
        assert {name: summary[name] for name in ("mass", "level", "stiffness_factor")} == asdict(
            study.grid_point(index)
        )
        own = [row for row in rows[index::4] if row.outcome == DONE]
        assert (summary["runs"], summary["refused"]) == (37, 37 - len(own))
        assert summary["at_end_of_band"] == sum(row.inside is False for row in rows[index::4])
        assert summary["extrapolating"] == sum(row.extrapolating is True for row in rows[index::4])
        for name in names:
            values = [value for row in own if (value := getattr(row, name)) is not None]
            found = [summary[f"{name}_{end}"] for end in QUANTILES]
            assert found == pytest.approx(np.quantile(values, [0.05, 0.5, 0.95]), rel=1e-12)


def test_grids_are_given_by_numbers_or_ranges(terminal: Terminal) -> None:
    command = "study bare.json --mass 4:5:3 --mass 6 --stiffness 0.9 --stiffness 1 --force 0.1 --force 0.2:0.3:2"
    told = json.loads(
        terminal(*command.split(), "--draws", "0", "--band", "2", "3", "--points", "2", "-o", "r.csv", "--json")
    )
    grid = [(point["mass"], point["level"], point["stiffness_factor"]) for point in told["points"]]
    assert grid == [(m, f, s) for m in (4.0, 4.5, 5.0, 6.0) for f in (0.1, 0.2, 0.3) for s in (0.9, 1.0)]
    assert told["unit"] == "N"
    assert pd.read_csv("r.csv")["draw"].isna().all()


def test_a_mass_is_all_that_must_be_said(terminal: Terminal) -> None:
    told = json.loads(terminal("study", "mount.json", "--mass", "5:4:2", "--draws", "1", "-o", "r.csv", "--json"))
    rest = static_equilibrium(IsolatedMass(SPRING, 4.0)).displacement
    room = min(rest - SPRING.displacement_min, SPRING.displacement_max - rest)
    assert [point["level"] for point in told["points"]] == pytest.approx([0.01 * room] * 2, rel=1e-12)
    assert told["excitation"] == "base displacement"
    assert all(point["figures"]["frequency"] for point in told["points"])


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        ("bare.json --mass 5 --force 1", 1, 'bare.json: field "uncertainty" holds no joint covariance'),
        ("mount.json --mass 400", 1, "The static load of 3922.66 N on each spring must lie within"),
        ("mount.json --mass 5 --force 1 --base-displacement 1", 2, "exclude each other"),
        ("mount.json --mass 5 --force 1 --workers 2 --scheduler tcp://a:1", 2, "exclude each other"),
        ("mount.json --mass 5:x --force 1", 2, "'5:x' is neither a number nor LOW:HIGH:COUNT"),
        ("mount.json --mass 5:6:1 --force 1", 2, "'5:6:1' is neither a number"),
        ("mount.json --mass 5:6:2:3 --force 1", 2, "'5:6:2:3' is neither a number"),
        ("mount.json --mass 5:nan:3 --force 1", 2, "'--mass': must be a finite number > 0 [kg], got nan."),
        ("mount.json --mass 4:-6.5:3 --force 1", 2, "'--mass': must be a finite number > 0 [kg], got -6.5."),
        ("mount.json --mass 0 --force 1", 2, "'--mass': must be a finite number > 0 [kg], got 0."),
        ("mount.json --mass 5 --force nan", 2, "'--force': must be a finite number > 0 [N], got nan."),
        ("mount.json --mass 5 --base-displacement -2", 2,
         "'--base-displacement': must be a finite number > 0 [mm], got -2."),
        ("mount.json --mass 5 --stiffness 0", 2, "must be a finite number >= 1e-06 and <= 1e+06, got 0."),
        ("mount.json --mass 5 --force 1 --band 0 2", 2, "The band must rise from above 0 [Hz], got 0 to 2."),
        ("mount.json --mass 5 --force 1 --scheduler nowhere", 1, "No scheduler answers at 'nowhere' (missing port"),
    ],
)  # fmt: skip
def test_bad_commands_get_one_sentence(arguments: str, status: int, told: str, terminal: Terminal) -> None:
    terminal("study", *arguments.split(), "-o", "results.csv", status=status)
    assert told in terminal.err.strip().splitlines()[-1]
    assert not [path for path in Path().iterdir() if "results" in path.name]
