"""Studies of a SYSTEM.toml: what is varied, what is drawn, what a run gives, what is said of them all."""

from __future__ import annotations

import copy
import io
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from distributed import LocalCluster

import strandspring
from journal_content import execute, written
from strandspring import StrandspringError
from strandspring.campaigns.jobs.cluster import Cluster
from strandspring.campaigns.jobs.runners import Local, Runner
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.campaigns.studies.summaries import summaries
from strandspring.campaigns.studies.system_planning import planned_study, undrawn
from strandspring.campaigns.studies.system_study import SystemRow, SystemStudy, system_row
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.files import write_csv
from strandspring.model.modelfile import load_model, save_model
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.system_file import read_description, system_of_content
from strandspring.vibration.verdicts.answers import answer_case
from strandspring.vibration.verdicts.drawn_springs import Drawn
from strandspring.vibration.verdicts.draws import Unknowns
from strandspring.vibration.verdicts.verdicts import CaseVerdict, FigureKind
from studies import Counter
from terminal import Terminal

pytestmark = pytest.mark.long

BOX = SYSTEMS / "electronics_box.toml"
CONTENT = read_description(BOX)
CONTENT["units"] |= {"mass": "kg", "damping": "N s/m"}
FILES = FilesOfFolder(SYSTEMS)
MASSES = {"body.box.mass": "15 kg:25 kg:3"}
DROP = {"cases": "drop", "step": 5e-4}
MARGINS = ("acceleration_margin", "sway_margin", "tilt_margin", "stroke_margin")


def study(vary: dict[str, Any], content: dict[str, Any] = CONTENT, **options: Any) -> SystemStudy:
    return planned_study(content, FILES, vary, **{"draws": 16, "seed": 0, **DROP, **options})


def changed(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    content = copy.deepcopy(CONTENT)
    change(content)
    return content


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    for name in ("electronics_box.toml", *(path.name for path in SYSTEMS.glob("corner*.json"))):
        shutil.copy(SYSTEMS / name, name)
    return Terminal(capsys)


# What is varied


def test_a_grid_point_is_the_file_with_other_values() -> None:
    planned = study(
        {"body.box.mass": "15 kg,25 kg", "mount_type.*.axes.*.damping": [0.0, 40.0], "mount.corner.places": "3,4"}
    )
    assert planned.grid_size == 8
    assert planned.values(1) == (15.0, 0.0, 4.0)
    assert planned.values(6) == (25.0, 40.0, 3.0)
    for point in range(8):
        mass, damping, places = planned.values(point)
        file = planned.described(point)
        for _, system in file.candidates:
            assert system.bodies[0].mass == mass
            assert {axis.damping for axis in system.axes} == {damping}
            assert len(system.mounts) == places


@pytest.mark.parametrize(
    ("path", "given", "value_of", "expected"),
    [
        ("body.box.center.3", "-10 mm,10 mm", lambda f: f.candidates[0][1].bodies[0].center[2], [-0.01, 0.01]),
        ("body.1.inertia.xy", [0.01, 0.02], lambda f: f.candidates[0][1].bodies[0].inertia[0][1], [0.01, 0.02]),
        ("body.box.point.connector.place.1", "50%,100%", lambda f: f.candidates[0][1].points[1].place[0],
         [-0.09, -0.18]),
        ("mount.corner.places.*.1", "50%:150%:2", lambda f: [m.place[0] for m in f.candidates[0][1].mounts],
         [[0.075, -0.075, 0.075, -0.075], [0.225, -0.225, 0.225, -0.225]]),
        ("mount.corner.type", "corner,soft_corner", lambda f: f.candidates[0][1].axes[0].model,
         ["corner_compression.json", "corner_soft_compression.json"]),
        ("mount_type.corner.axes.1.stops.high", "30 mm,31 mm",
         lambda f: f.candidates[0][1].axes[0].stops.high, [0.03, 0.031]),
        ("mount_type.corner.axes.1.parallel", "1:3:3", lambda f: f.candidates[0][1].axes[0].parallel,
         [1, 2, 3]),
        ("case.shock.peak", "10 g,20 g", lambda f: f.cases[0].channels[0].signal.peak, [98.0665, 196.133]),
        ("case.transport.random.seed", "3,4", lambda f: f.cases[-1].channels[0].signal.seed, [3, 4]),
        (
            "limits.acceleration.circuit board", "10 m/s^2,20 m/s^2",
            lambda f: f.limits.limit_of(FigureKind.ACCELERATION, "circuit board"), [10, 20],
        ),
        ("run.rest_omega", "-1:1:3", lambda f: f.options.rest_omega, [-1.0, 0.0, 1.0]),
        ("gravity.3", "-9.81 m/s^2,-1.62 m/s^2", lambda f: f.candidates[0][1].gravity[2], [-9.81, -1.62]),
        ("case.shock.pulse", "half-sine,triangle", lambda f: type(f.cases[0].channels[0].signal).__name__,
         ["HalfSine", "StraightPulse"]),
    ],
)  # fmt: skip
def test_paths_lead_to_their_values(path: str, given: Any, value_of: Callable[[Any], Any], expected: list[Any]) -> None:
    planned = study({path: given})
    found = [value_of(planned.described(point)) for point in range(planned.grid_size)]
    for one, other in zip(found, expected, strict=True):
        assert one == (other if isinstance(other, str) else pytest.approx(other, rel=1e-12))


def test_a_list_of_rotations_is_cut_with_its_places() -> None:
    turn = [{"about": "+z", "angle": f"{angle} deg"} for angle in (0, 10, 20, 30)]
    content = changed(lambda c: c["mount"][0].update(rotate=turn))
    planned = study({"mount.corner.places": [3]}, content)
    assert len(planned.described(0).candidates[0][1].mounts) == 3


def test_what_is_varied_beyond_the_first_places_is_left_out_with_them() -> None:
    planned = study({"mount.corner.places": [3, 4], "mount.corner.places.*.3": "-100,-200"})
    for point in range(4):
        count, height = planned.values(point)
        mounts = planned.described(point).candidates[0][1].mounts
        assert [mount.place[2] for mount in mounts] == [1e-3 * height] * int(count)


@pytest.mark.parametrize(
    ("path", "given", "said"),
    [
        ("body.box.mas", "1,2", "'body.box.mas' is not the path of a value of this description; use 'body.box.mass'"),
        ("box.mass", "1,2", "use 'body.box.mass' if you mean that"),
        ("mount_type.corner.axes.4.damping", "1,2", r"use 'mount_type.corner.axes.roll.damping'"),
        ("body.box", "1,2", "use 'body.box.mass' if"),
        ("body.box.name", "a,b", "is not the path of a value"),
        ("case.shock.directions", "+x", "is not the path of a value"),
        ("run.draws", "1,2", "is not the path of a value"),
        ("", "1,2", "'' is not the path of a value of this description; use one of 'gravity.1'"),
        ("x" * 5000, "1,2", "is not the path of a value of this description; use one of"),
        ("body.box.mass", "15 N:25 N:3", r"body\[1\].mass: must be a mass such as '20 kg', got '15.0 N'"),
        ("body.box.mass", "15 kg:25 g:3", "all values must have one unit, got 'kg' and 'g'"),
        ("case.shock.peak", "10 g,100", "all values must have one unit, got 'g' and ''"),
        ("body.box.mass", "15 kg:25 kg:1", "COUNT must be a whole number from 2 to 10000, got '1'"),
        ("body.box.mass", "15 kg:25 kg:99999999999", "COUNT must be a whole number from 2 to 10000"),
        ("body.box.mass", "15 kg:25 kg", "got '15 kg:25 kg'; give LOW:HIGH:COUNT"),
        ("body.box.mass", "-10 %:10 %:3", "percent are shares of what the file says, got '-10 %'; write 110 %"),
        ("body.box.mass", "heavy,light", "got 'heavy,light'; give LOW:HIGH:COUNT or a list with commas"),
        ("body.box.mass", "", "got ''; give LOW:HIGH:COUNT"),
        ("body.box.mass", "1e999", "got '1e999'; give"),
        ("body.box.mass", [], "got .*; give LOW:HIGH:COUNT"),
        ("body.box.mass", [float("nan")], "give LOW:HIGH:COUNT"),
        ("body.box.mass", [0.0, -1.0], "must be a mass > 0, got 0"),
        ("body.box.mass", "20,20", "has a value twice"),
        ("mount_type.corner.axes.1.preload", "50%,60%", "has no number in the file to take percent of"),
        ("mount.corner.places", "4,6", "must be how many of the 4 places have a mount, from 1 to 4"),
        ("mount.corner.places", "50%", "has no number in the file to take percent of"),
        ("mount.corner.places", "2.5", "must be how many of the 4 places"),
        ("mount_type.corner.axes.1.parallel", "1.5,2.5", "must be a whole number"),
        ("case.shock.pulse", "round,square", "must be 'half-sine'"),
    ],
)  # fmt: skip
def test_impossible_paths_and_values_are_refused_before_anything_runs(path: str, given: Any, said: str) -> None:
    with pytest.raises(MountedSystemError, match=said):
        study({path: given})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"vary": {"body.box.mass": [1.0, 2.0], "body.1.mass": [3.0]}}, "body.box.mass and body.1.mass vary the same"),
        ({"cases": "crash"}, "There is no load case 'crash'; there are shock"),
        ({"candidates": "x"}, "There is no candidate 'x'; give one of 'standard', 'softer'"),
        ({"draws": 15}, "`draws` must be >= 16, got 15"),
        (
            {"vary": {"body.box.mass": "1 kg:2 kg:1000", "case.drop.drop.height": "1 mm:2 mm:1000"}},
            "A study must have from 1 to 1000000 runs, got 2000000",
        ),
    ],
)
def test_impossible_studies_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(MountedSystemError, match=said):
        study(**{"vary": MASSES, **options})


# Runs


def test_a_run_is_the_answer_of_simulate() -> None:
    planned = study(MASSES, cases=None)
    run = ((2 * 1 + 0) * 2 + 1) * 6 + 3  # third mass, second candidate, fourth case
    assert planned.place(run) == (2, 0, 1, 3)
    file = system_of_content(changed(lambda c: c["body"][0].update(mass="25 kg")), FILES)
    name, system = file.candidates[1]
    unknowns = Unknowns(Drawn.from_models(system, file.models), 16, 0, None)
    answer = answer_case(name, system, file.cases[3], file.limits, unknowns, 5e-4)
    (row,) = planned.rows([run])
    assert row == system_row(run, answer)
    assert row.outcome == "done"
    least = min(m for m in (row.acceleration_margin, row.sway_margin, row.tilt_margin, row.stroke_margin) if m)
    assert least == min(figure.margin for figure in answer.figures if figure.margin is not None)
    assert row.sway == max(figure.high for figure in answer.figures_of(FigureKind.SWAY))
    assert replace(planned, seed=3).rows([run]) != [row]


def test_every_grid_point_has_every_candidate_and_case() -> None:
    planned = study(MASSES, cases=["drop", "shock"])
    places = [planned.place(run) for run in range(len(planned))]
    assert len({*places}) == len(planned) == 3 * 2 * 5
    assert places == sorted(places)


def test_draws_are_the_same_springs_everywhere() -> None:
    planned = study({"body.box.mass": [15.0, 20.0], "mount.corner.type": "corner,soft_corner"})
    springs = {}
    for point in range(4):
        file = planned.described(point)
        for _, system in file.candidates:
            drawn = Drawn.from_models(system, file.models)
            assert drawn.missing == ()
            for k in range(3):
                for before, after in zip(system.axes, drawn.system(system, 5, k).axes, strict=True):
                    assert after == replace(before, spring=after.spring)
                    springs.setdefault((before.model, k), {*()}).add(after.spring)
    assert len(springs) == 4 * 3
    assert all(len(one) == 1 for one in springs.values())
    assert len({spring for one in springs.values() for spring in one}) == 4 * 3


def test_a_grid_point_that_cannot_be_is_a_row_with_its_reason() -> None:
    planned = study({"body.box.mass": "0%,100%,10000%"}, candidates="standard")
    none, good, heavy = planned.rows(range(3))
    assert none.outcome == "body[1].mass: must be a mass > 0, got '0.0 kg'."
    assert (none.accelerations, none.sway, none.verdict) == ((), None, "refused")
    assert (good.verdict, good.outcome, len(good.accelerations)) == ("pass", "done", 2)
    assert (heavy.verdict, heavy.outcome) == ("outside", "outside")


def test_motion_beyond_the_identified_range_is_told() -> None:
    (row,) = study({"case.drop.drop.height": ["500 mm"]}, candidates="softer").rows([0])
    assert (row.verdict, row.outcome) == ("outside", "outside")
    assert row.stroke is not None
    assert row.stroke > 1.0


def test_files_without_uncertainty_are_named(tmp_path: Path) -> None:
    for path in SYSTEMS.glob("corner*.json"):
        model = load_model(path)
        save_model(tmp_path / path.name, replace(model, uncertainty={}) if "shear" in path.name else model)
    planned = planned_study(CONTENT, FilesOfFolder(tmp_path), MASSES, "drop", "standard")
    assert planned.draws == 64
    assert [text.split(":")[0] for text in undrawn(planned)] == ["corner_shear.json is taken as known in all draws"]


def test_a_description_is_no_model() -> None:
    with pytest.raises(StrandspringError, match=r"electronics_box.toml must be a model file; .* by `study_system`"):
        strandspring.study(BOX, 5.0)


# Where they are done


@pytest.fixture(scope="module")
def drawn() -> SystemStudy:
    return study({"body.box.mass": "15 kg:25 kg:9"}, seed=1, cases="drop")


@pytest.fixture(scope="module")
def expected(drawn: SystemStudy, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("serial") / "results.csv"
    run_study(drawn, path, Local(1))
    return path.read_bytes()


def test_a_candidate_passes_only_where_the_upper_ends_leave_a_margin(expected: bytes) -> None:
    table = pd.read_csv(io.BytesIO(expected))
    margins = table[[name for name in table.columns if name.startswith("margin of ")]].min(axis="columns")
    assert {*table["verdict"]} == {"pass", "not decided"}
    assert ((table["verdict"] == "pass") == (margins >= 0.0)).all()
    assert (table["draws beyond a limit [1]"][margins >= 0.0] == 0.0).all()


def test_several_processes_give_the_same_bytes(drawn: SystemStudy, expected: bytes, tmp_path: Path) -> None:
    results, counter = tmp_path / "results.csv", Counter()
    run_study(drawn, results, Local(2), counter)
    assert results.read_bytes() == expected
    assert (counter.first, counter.last) == (0, 18)


def test_an_interrupted_study_goes_on_where_it_ended(drawn: SystemStudy, expected: bytes, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    results = tmp_path / "results.csv"
    with pytest.raises(KeyboardInterrupt):
        run_study(drawn, results, Local(1), Counter(11, interrupt))
    assert not results.exists()
    execute(journal_path(results), "INSERT INTO row VALUES (12, 0, x'5b31322c')")
    for other, said in (
        (replace(drawn, seed=2), "seed 1 instead of 2"),
        (study({"body.box.mass": [15.0, 20.0, 25.0]}, seed=1), "vary "),
        (replace(drawn, files=replace(drawn.files, models={})), "another system"),
    ):
        with pytest.raises(MountedSystemError, match=f"is the journal of another study .*{said}"):
            run_study(other, results, Local(1))
    counter, notes = Counter(), list[str]()
    run_study(drawn, results, Local(1), counter, notes.append)
    assert counter.first == 11
    assert "1 damaged row was dropped" in notes[0]
    assert results.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [results]


@pytest.mark.slow
def test_a_killed_command_goes_on_where_it_ended(tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    command = [sys.executable, "-m", "strandspring", "study", str(BOX), "--vary", "body.box.mass=15 kg:25 kg:24",
               "--case", "drop", "--step", "0.0005", "--draws", "16", "--workers", "1", "-o"]  # fmt: skip
    process = subprocess.Popen([*command, str(results)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while written(journal_path(results)) < 60_000:
            assert process.poll() is None
            time.sleep(0.01)
    finally:
        process.kill()
        process.wait()
    assert not results.exists()
    again = subprocess.run([*command, str(results)], capture_output=True, text=True, check=True)
    assert re.search(r"\d+ of 48 runs were finished before", again.stderr)
    subprocess.run([*command, str(tmp_path / "at once.csv")], capture_output=True, check=True)
    assert results.read_bytes() == (tmp_path / "at once.csv").read_bytes()


@pytest.mark.slow
def test_files_travel_to_a_cluster(tmp_path: Path) -> None:
    folder = tmp_path / "description"
    folder.mkdir()
    for path in SYSTEMS.glob("corner*.json"):
        shutil.copy(path, folder)
    times = np.arange(0.0, 0.3, 1e-3)
    rows = "\n".join(f"{t:.3f},{5.0 * np.sin(60.0 * t):.6f}" for t in times)
    (folder / "base.csv").write_text(f"t [s],a [g]\n{rows}\n")
    record = {"name": "ride", "record": {"file": "base.csv", "columns": {"z": "a"}}}
    content = changed(lambda c: c.update(case=[record]))
    vary = {"case.ride.record.scale": [1.0, 1.5], "body.box.mass": "15 kg,20 kg"}
    planned = planned_study(content, FilesOfFolder(folder), vary)
    shutil.rmtree(folder)

    def results(name: str, runner: Runner) -> bytes:
        run_study(planned, tmp_path / name, runner)
        return (tmp_path / name).read_bytes()

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        assert results("far.csv", Cluster(cluster.scheduler_address)) == results("near.csv", Local(1))
    assert set(pd.read_csv(tmp_path / "near.csv")["outcome"]) <= {"done", "outside"}


# What is said


def test_summaries_are_the_worst_of_all_cases(tmp_path: Path) -> None:
    planned = study({"body.box.mass": [15.0, 20.0]}, cases=None)
    generator = np.random.default_rng(3)
    verdicts = [verdict.value for verdict in CaseVerdict]
    rows = []
    for run in range(len(planned)):
        verdict = verdicts[int(generator.choice(5, p=[0.6, 0.1, 0.1, 0.1, 0.1]))]
        if verdict == "refused":
            rows.append(SystemRow(run, outcome=f"No {run}."))
            continue
        a, b, sway, tilt, stroke, beyond, *margins = generator.random(10).tolist()
        names = dict(zip(MARGINS, margins, strict=True))
        rows.append(
            SystemRow(
                run,
                (a, b),
                sway,
                tilt,
                stroke,
                "corner",
                1.0,
                error=0.0,
                governing="sway of x",
                beyond=beyond,
                verdict=verdict,
                **names,
            )
        )
    write_csv(tmp_path / "r.csv", [column.file_heading for column in planned.columns], map(planned.cells, rows))
    table = summaries(planned, tmp_path / "r.csv")
    assert len(table) == 4
    for number, summary in enumerate(table.to_dict("records")):
        point, candidate = divmod(number, 2)
        own = [row for row in rows if planned.place(row.run)[0::2] == (point, candidate)]
        assert (summary["body.box.mass"], summary["candidate"]) == (
            *planned.values(point), planned.candidates[candidate][1],
        )  # fmt: skip
        assert summary["verdict"] == verdicts[max(verdicts.index(row.verdict) for row in own)]
        known = [row for row in own if row.verdict != "refused"]
        assert summary["beyond"] == max(row.beyond or 0.0 for row in known)
        assert summary["refused"] == len(own) - len(known)
        nearest = min(known, key=lambda row: min(getattr(row, name) for name in MARGINS))
        case = planned.cases[planned.place(nearest.run).case][1]
        assert summary["least_margin"] == f"sway of x in {case}"
        assert summary["stroke_median"] == pytest.approx(max(row.stroke or 0.0 for row in known))


def test_a_study_of_which_every_run_is_refused_has_no_figures(tmp_path: Path) -> None:
    planned = study({"body.box.mass": [15.0, 20.0]})
    rows = [SystemRow(run, outcome=f"No {run}.") for run in range(len(planned))]
    write_csv(tmp_path / "r.csv", [column.file_heading for column in planned.columns], map(planned.cells, rows))
    table = summaries(planned, tmp_path / "r.csv")
    assert table["refused"].tolist() == [1] * 4
    assert table["reason"].tolist() == [row.outcome for row in rows]
    assert table[["least_margin", "stroke_median", "margin_q05"]].isna().all(axis=None)


def test_json_text_csv_and_python_say_the_same(terminal: Terminal) -> None:
    command = ("study", "electronics_box.toml", "--vary", "body.box.mass=0%,100%,200%", "--case", "drop", "--step",
               "0.0005", "--draws", "16", "--workers", "1", "-o", "out.csv")  # fmt: skip
    told = json.loads(terminal(*command, "--plot", "out.svg", "--json"))
    assert (told["runs"], told["draws"], told["cases"]) == (6, 16, ["drop"])
    assert told["vary"] == [{"path": "body.box.mass", "unit": "%", "values": [0.0, 100.0, 200.0]}]
    table = pd.read_csv("out.csv")
    assert table["body.box.mass [%]"].tolist() == [0.0, 0.0, 100.0, 100.0, 200.0, 200.0]
    assert table["verdict"].tolist() == [point["verdict"] for point in told["points"]]
    good = told["points"][2]
    row = table.iloc[2]
    assert good["figures"]["sway"]["median"] == row["sway [m]"]
    assert good["figures"]["acceleration"]["median"] == max(
        row[f"acceleration of {p} [m/s^2]"] for p in ("circuit board", "connector")
    )
    assert good["least_margin"] == f"{row['least margin']} in drop"
    text = terminal(*command, "--verbose")
    for said in (
        "Electronics box: 6 runs of 16 draws (seed 0): 2 candidates in 1 load case at each of 3 grid points: ",
        f"{1e3 * row['sway [m]']:.4g}",
        "body.box.mass 0 %, standard: 1 of 1 refused, most often: body[1].mass: must be a mass > 0",
        "Results: out.csv",
    ):
        assert said in text, said
    found = strandspring.study_system("electronics_box.toml", {"body.box.mass": "0%,100%,200%"}, **DROP, draws=16)  # type: ignore[arg-type]
    pd.testing.assert_frame_equal(found.to_frame(), table)
    assert found.quantiles()["sway_median"].tolist()[2] == row["sway [m]"]
    assert "3 grid points" in repr(found)
    assert "<table" in found._repr_html_()


def test_a_plot_has_a_marker_for_each_candidate_at_each_grid_point() -> None:
    from matplotlib.figure import Figure

    found = strandspring.study_system(BOX, {"body.box.mass": "0%,80%,100%"}, **DROP, draws=16)  # type: ignore[arg-type]
    axes = found.plot(Figure().subplots())
    markers = [len(container[0].get_xdata()) for container in axes.containers]
    assert sum(markers) == 4
    assert axes.get_ylabel() == "largest acceleration [g]"
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "standard: refused" in names
    assert any(name.startswith("softer: pass, least margin: ") and name.endswith(" in drop") for name in names)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("electronics_box.toml",), 2, "Missing option '--vary'"),
        (("electronics_box.toml", "--vary", "body.box.mass=1,2", "--mass", "3"), 2, "--mass does not apply to elec"),
        (("electronics_box.toml", "--vary", "body.box.mass=1,2", "--zero", "rig"), 2, "use --vary PATH=VALUES"),
        (("corner_shear.json", "--mass", "3", "--case", "x"), 2, "--case applies to a SYSTEM.toml only"),
        (("corner_shear.json",), 2, "Missing option '--mass'"),
        (("electronics_box.toml", "--vary", "body.box.mass"), 2, "--vary must be PATH=VALUES"),
        (("electronics_box.toml", "--vary", "a=1", "--vary", "a=2"), 2, "--vary a is given twice"),
        (("electronics_box.toml", "--vary", "a=1"), 1, "electronics_box.toml, 'a' is not the path of a value"),
        (("none.toml", "--vary", "a=1"), 1, "none.toml: "),
        (("electronics_box.toml", "--vary", "a=1", "--plot", "s.csv"), 2, "must end in"),
    ],
)
def test_options_that_do_not_apply_are_refused(
    terminal: Terminal, arguments: tuple[str, ...], status: int, said: str
) -> None:
    terminal("study", *arguments, "-o", "s.csv", status=status)
    assert said in terminal.err.replace("\n", " ")
    assert not Path("s.csv").exists()
