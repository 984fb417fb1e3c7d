"""`simulate` on the examples that come with the program."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

import strandspring
from strandspring import Simulation, simulate
from strandspring.api.vibration import simulating
from strandspring.errors import MountedSystemError
from strandspring.examples import systems
from strandspring.vibration.description.system_file import load_system_file
from strandspring.vibration.verdicts.verdicts import CaseVerdict, FigureKind, Limits

pytestmark = pytest.mark.long

EXAMPLES = Path(systems.__path__[0])
CRADLE = EXAMPLES / "gun_cradle.toml"


@pytest.fixture(scope="module")
def cradle() -> Simulation:
    return simulate(CRADLE, "one round", draws=16, seed=4)


@pytest.mark.parametrize(
    "path",
    [
        # Its random vibration takes half a minute.
        pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem == "avionics_tray" else [])
        for path in sorted(EXAMPLES.glob("*.toml"))
    ],
)
def test_every_example_is_answered_in_full(path: Path) -> None:
    file = load_system_file(path)
    found = simulate(file, courses=False, draws=16)
    assert len(found.answers) == len(file.candidates) * len(file.cases)
    assert not {answer.verdict for answer in found.answers} & {CaseVerdict.REFUSED, CaseVerdict.OUTSIDE}
    assert all(run.energies.relative_residual < 1e-2 for answer in found.answers for run in answer.runs)
    text = found.summary()
    assert text.startswith(f"{file.name}: ")
    assert all(name in text for name, _ in file.candidates)
    assert all(case.name in text for case in file.cases)


def test_a_range_beyond_its_limit_fails(cradle: Simulation) -> None:
    ranges = [answer.worst(FigureKind.SWAY) for answer in cradle.answers]
    low, high = (sorted(getattr(sway, end) for sway in ranges if sway) for end in ("low", "high"))
    for limit, verdicts in (
        (0.99 * low[0], {CaseVerdict.FAILS}),
        (0.5 * (low[0] + high[0]), {CaseVerdict.UNDECIDED}),
        (1.01 * high[1], {CaseVerdict.PASSES}),
    ):
        tight = replace(cradle.file, limits=Limits({FigureKind.SWAY: {"breech": limit}}))
        found = simulate(tight, cases="one round", courses=False, draws=16, seed=4)
        assert {answer.verdict for answer in found.answers} == verdicts


def test_frame_csv_and_json_hold_the_same_figures(cradle: Simulation, tmp_path: Path) -> None:
    frame = cradle.to_frame()
    cradle.save_csv(tmp_path / "figures.csv")
    with (tmp_path / "figures.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(frame.columns)
    assert [float(row["value"]) for row in rows] == frame["value"].tolist()
    json = [figure for case in cradle.as_json()["cases"] for figure in case["figures"]]
    assert [figure["value"] for figure in json] == frame["value"].tolist()
    for end in ("low", "high"):
        assert [figure[end] for figure in json] == frame[end].tolist()
    passed = {"four springs": "pass", "five springs": "pass"}
    assert cradle.verdicts().to_dict() == {"one round": passed, "all cases": passed}


def test_answers_do_not_depend_on_the_number_of_threads(cradle: Simulation) -> None:
    alone = simulate(CRADLE, "one round", draws=16, seed=4, workers=1)
    assert alone.to_frame().equals(cradle.to_frame())


def test_candidates_and_cases_are_chosen_by_name() -> None:
    found = simulate(EXAMPLES / "electronics_box.toml", cases="shock", candidates="softer", courses=False)
    assert [answer.case.name for answer in found.answers] == ["shock +x", "shock +y", "shock +z", "shock -z"]
    with pytest.raises(MountedSystemError, match=r"no candidate 'hard'; give one of 'standard', 'softer'\."):
        simulate(EXAMPLES / "electronics_box.toml", candidates="hard")
    with pytest.raises(MountedSystemError, match=r"no load case 'shok'; there are shock \+x"):
        simulate(EXAMPLES / "electronics_box.toml", "shok")


def test_omega_at_rest_that_is_given_is_the_only_one_run() -> None:
    file = load_system_file(CRADLE)
    known = replace(file, options=replace(file.options, rest_omega=0.0))
    found = simulate(known, cases="one round", candidates="four springs", courses=False)
    assert not any(run.start.omega.any() for run in found.answers[0].runs)
    assert "at the omega that is given" not in found.summary()


def test_a_file_of_which_nothing_can_be_run_is_refused() -> None:
    with pytest.raises(MountedSystemError, match="the integration is stable up to"):
        simulate(CRADLE, step=1.0)


def test_histories_are_written_for_each_answer(cradle: Simulation, tmp_path: Path) -> None:
    written = cradle.save_histories(tmp_path / "new" / "folder")
    assert [path.name for path in written] == ["four_springs_one_round.csv", "five_springs_one_round.csv"]
    with written[0].open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    largest = max(abs(float(row["breech acceleration x [m/s^2]"])) for row in rows)
    figure = cradle.answers[0].worst(FigureKind.ACCELERATION)
    assert figure is not None
    assert figure.low <= largest <= figure.high


def test_histories_that_memory_does_not_hold_are_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(simulating, "_MOST_NUMBERS", 150_000)
    found = simulate(CRADLE, "one round")
    assert [answer.courses is None for answer in found.answers] == [False, True]
    found.report(tmp_path / "report.html")
    assert "Histories are left out of 1 of 2 answers" in (tmp_path / "report.html").read_text(encoding="utf-8")
    with pytest.raises(MountedSystemError, match="No histories were kept"):
        simulate(CRADLE, "one round", courses=False).save_histories(tmp_path)


def test_a_result_shows_itself(cradle: Simulation, tmp_path: Path) -> None:
    assert repr(cradle).splitlines()[0] == "Gun cradle: 2 candidates in 1 load case: 2 pass"
    assert "four springs" in cradle._repr_html_()
    cradle.save_plot(tmp_path / "sheet.svg")
    again = (tmp_path / "sheet.svg").read_bytes()
    cradle.save_plot(tmp_path / "sheet.svg")
    assert (tmp_path / "sheet.svg").read_bytes() == again
    assert {"simulate", "Simulation"} <= set(dir(strandspring))
