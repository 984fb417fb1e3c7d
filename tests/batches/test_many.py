"""Many springs: every file has its row, whatever it holds, and nothing is lost nor done twice."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest
from distributed import LocalCluster

from journal_content import execute, rows_in, written
from many_springs import DAMAGES, DeadlyWork, measured, one_of, write, write_batch, write_damaged
from strandspring import (
    ManyResult,
    RecordError,
    Spring,
    StrandspringError,
    TwoStageOptions,
    identify_many,
    read_record,
)
from strandspring.campaigns.batches import sources
from strandspring.campaigns.batches.batch import BatchSummary, Tally, identify_batch
from strandspring.campaigns.batches.figures_in_batch import modified_z
from strandspring.campaigns.batches.sources import find_springs
from strandspring.campaigns.jobs.runners import JobError, Local
from strandspring.loops.selection import Wanted
from terminal import Terminal

pytestmark = pytest.mark.long

ROWS = 360  # of a record, for speed
COUNT = 9
FAST = TwoStageOptions(degrees=(3, 2))  # where the method is of no matter


@pytest.fixture(scope="module")
def springs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of good records, of which one spring is twice as stiff as the others, and of ten damaged ones."""
    folder = tmp_path_factory.mktemp("springs")
    write_batch(folder, COUNT, ROWS)
    write(folder / "stiff.csv", measured(100, ROWS, stiffness=2.0))
    write_damaged(folder, ROWS)
    return folder


@pytest.fixture(scope="module")
def serial(springs: Path, tmp_path_factory: pytest.TempPathFactory) -> ManyResult:
    """They are identified in this process."""
    return identify_many(springs, tmp_path_factory.mktemp("serial"), workers=1)


@pytest.fixture
def few(tmp_path: Path) -> Path:
    """A folder of three records."""
    write_batch(tmp_path / "few", 3, ROWS)
    return tmp_path / "few"


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    return Terminal(capsys)


def content(folder: Path) -> dict[str, bytes]:
    """All results in a folder; the journal is in the order in which the files were finished."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != sources.JOURNAL}


def finished(folder: Path) -> int:
    """Rows in the journal."""
    journal = folder / sources.JOURNAL
    return rows_in(journal)


# Every file has its row


def test_every_file_is_identified_or_named_with_the_reason(serial: ManyResult) -> None:
    frame = serial.to_frame()
    frame.index = pd.Index([Path(file).stem for file in frame["file"]])
    assert len(frame) == COUNT + 1 + len(DAMAGES)
    assert list(frame["file"]) == sorted(frame["file"])
    for name, (_, status, reason) in DAMAGES.items():
        row = frame.loc[f"damaged_{name}"]
        assert row["status"] == status, name
        assert reason in row["reason"], name
        assert not (serial.folder / f"damaged_{name}.json").exists()
    good = frame[frame["status"] == "identified"]
    assert len(good) == COUNT + 1
    assert good["reason"].isna().all()
    assert serial.problem == (
        f"{len(DAMAGES)} of {len(frame)} springs are not identified (3 refused, 7 unreadable); springs.csv says why."
    )
    for name in DAMAGES:
        assert f"damaged_{name}.csv: " in serial.summary()


def test_a_row_tells_what_the_model_file_does(serial: ManyResult, springs: Path) -> None:
    row = serial.to_frame().set_index("model").loc["spring_0004.json"]
    spring = Spring.load(serial.folder / "spring_0004.json")
    p, known = spring.parameters, spring.model.uncertainty
    assert row["sha256"] == read_record(springs / "spring_0004.csv").sha256
    assert (row["samples"], bool(row["has times"])) == (ROWS, True)
    for name, unit in (("kappa_omega", "N"), ("rho", "1/m"), ("sigma", "1"), ("n", "1")):
        assert row[f"{name} [{unit}]"] == getattr(p, name)
        assert row[f"{name} standard error [{unit}]"] == known[name]
        assert [row[f"{name} {end} 95 % [{unit}]"] for end in ("low", "high")] == known["interval_95"][name]
        # The record is long enough that the true spring is within a few standard errors.
        assert abs(getattr(p, name) - getattr(one_of(4), name)) < 5.0 * known[name]
    assert [row["kE_0 [N/m^0]"], row["kE_1 [N/m^1]"]] == list(p.kE[:2])
    assert row["kA_1 standard error [1/m^1]"] == known["kA"][1]
    fit = spring.model.fit
    assert [row["rmse [N]"], row["RNL [1]"]] == [fit["rmse"], fit["rnl"]]
    assert row["energy over measured [1]"] == fit["predicted_energy"] / fit["energy"]
    assert row["RNL as fitted [1]"] == fit["fitted"]["rnl"]
    assert row["verdict"] == fit["verdict"]["sentence"]
    assert row["held-out error [%]"] == 100.0 * fit["verdict"]["error"]
    amplitude = row["amplitude [m]"]
    assert amplitude == serial.batch.amplitude == 0.02
    x0 = p.displacement_offset
    path = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, -1, 400), np.linspace(-1, 1, 400)]) * amplitude
    force = spring.response(x0 + np.concatenate([path, path[200:]]))[-800:]
    loop = path[200:]
    assert row["secant stiffness [N/m]"] == pytest.approx((force[-1] - force[399]) / (2 * amplitude), rel=1e-9)
    energy = np.trapezoid(np.append(force[-1], force), np.append(loop[-1], loop))
    assert row["energy per cycle [J]"] == pytest.approx(energy, rel=1e-3)  # trapezia


def test_csv_and_parquet_say_the_same(serial: ManyResult) -> None:
    assert serial.batch.columnar_table is not None
    frame, other = serial.to_frame(), pd.read_parquet(serial.batch.columnar_table)
    assert list(frame) == list(other)
    for name in frame:
        assert [None if pd.isna(v) else v for v in frame[name]] == [None if pd.isna(v) else v for v in other[name]]


def test_processes_and_a_cluster_give_the_same_bytes(serial: ManyResult, springs: Path, tmp_path: Path) -> None:
    counts: list[tuple[str, float, int]] = []
    many = identify_many(springs, tmp_path / "two", workers=2, progress=lambda *count: counts.append(count))
    assert content(tmp_path / "two") == content(serial.folder)
    files = many.batch.files
    assert (counts[0], counts[-1]) == (("Identifying", 0, files), ("Identifying", files, files))
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as cluster:
        identify_many(springs, tmp_path / "cluster", scheduler=cluster.scheduler_address)
    assert content(tmp_path / "cluster") == content(serial.folder)


def test_notes_and_cautions_are_summed_up(few: Path) -> None:
    write(few / "bare.csv", measured(3, ROWS), "time,displacement,force")
    many = identify_many(few, few / "models", workers=1)
    assert f"3 files: the unit of force is N (found in the file) (first: {few / 'spring_0000.csv'})" in many.notes
    assert any(line.startswith("1 file: the unit of force is N (assumed, as none is given) (") for line in many.notes)
    assert many.summary().count("the unit of force") == 2
    kinds = Tally()
    for k in range(3000):
        kinds.add(str(k), [f"{'x' * k} in line {k}"])
    assert len(kinds.kinds) <= 1001
    assert kinds.lines(3000)[0].startswith("2000 files: other sentences")


def test_a_file_under_two_names_is_said_to_count_twice(few: Path) -> None:
    (few / "spring_again.csv").write_bytes((few / "spring_0001.csv").read_bytes())
    many = identify_many(few, few / "models", workers=1)
    (caution,) = (line for line in many.cautions if "that of another file" in line)
    assert caution.startswith("1 file: ")
    assert "spring_again.csv" in caution


# Nothing is lost nor done twice


def test_the_same_call_again_identifies_only_what_has_changed(few: Path) -> None:
    models = few / "models"
    first = identify_many(few, models, workers=1, options=FAST)
    before = content(models)
    again = identify_many(few, models, workers=1, options=FAST)
    assert (first.batch.earlier, again.batch.earlier, content(models)) == (0, 3, before)

    write(few / "spring_0001.csv", measured(7, ROWS))
    (models / "spring_0002.json").unlink()
    assert identify_many(few, models, workers=1, options=FAST).batch.earlier == 1
    assert content(models)["spring_0001.json"] != before["spring_0001.json"]
    assert content(models)["spring_0002.json"] == before["spring_0002.json"]

    (few / "spring_0001.csv").write_bytes(b"")
    assert identify_many(few, models, workers=1, options=FAST).problem.startswith(
        "1 of 3 springs is not identified (1 unreadable)"
    )
    assert not (models / "spring_0001.json").exists()  # it was that of other data
    write(few / "spring_0001.csv", measured(7, ROWS))

    said: list[str] = []
    other = identify_many(few, models, workers=1, options=TwoStageOptions(degrees=(2, 1)), notify=said.append)
    assert other.batch.earlier == 0
    assert "3 files were identified with other options or another version; they are identified anew." in said


def test_rows_of_other_files_are_kept(few: Path) -> None:
    models = few / "models"
    identify_many(few, models, workers=1, options=FAST)
    (few / "spring_0009.csv").write_bytes(b"")
    assert identify_many(few / "spring_0009.csv", models, workers=1, options=FAST).batch.files == 1
    assert identify_many(few, models, workers=1, options=FAST).batch.earlier == 4


def test_damaged_rows_of_the_journal_are_dropped_and_reported(few: Path) -> None:
    models = few / "models"
    identify_many(few, models, workers=1, options=FAST)
    before = content(models)
    execute(models / sources.JOURNAL, "UPDATE row SET checksum = 0 WHERE key IN (SELECT key FROM row LIMIT 2)")
    said: list[str] = []
    again = identify_many(few, models, workers=1, options=FAST, notify=said.append)
    assert again.batch.earlier == 1
    assert "2 damaged rows were dropped; their files are identified again." in said[0]
    assert content(models) == before


def test_a_damaged_journal_and_other_files_are_refused(few: Path) -> None:
    models = few / "models"
    identify_many(few, models, workers=1, options=FAST)
    journal = models / sources.JOURNAL
    journal.write_bytes(journal.read_bytes()[:-5000])
    with pytest.raises(JobError, match=r"springs.journal.sqlite is damaged: .*; remove it to start again"):
        identify_many(few, models, workers=1, options=FAST)
    journal.write_text("my notes\n")
    with pytest.raises(JobError, match="is not the journal of a batch"):
        identify_many(few, models, workers=1, options=FAST)
    assert journal.read_text() == "my notes\n"


def test_an_impossible_row_is_identified_again(few: Path) -> None:
    models = few / "models"
    identify_many(few, models, workers=1, options=FAST)
    before = content(models)
    journal = models / sources.JOURNAL
    ((manifest,),) = execute(journal, "SELECT manifest FROM job")
    rows = execute(journal, "SELECT key, content FROM row")
    changes = (b'"spring_000', b'"../spring_000'), (b'"identified"', b'"indented"'), (b'"kappa_omega":', b'"kappa":')
    for (key, values), (name, other) in zip(rows, changes, strict=True):
        forged = values[:20] + values[20:].replace(name, other, 1)
        execute(journal, "REPLACE INTO row VALUES (?, ?, ?)", key, zlib.crc32(forged, zlib.crc32(manifest)), forged)
    assert identify_many(few, models, workers=1, options=FAST).batch.earlier == 0
    assert content(models) == before


def test_two_runs_into_one_folder_are_refused(few: Path) -> None:
    def begin_again(_: str, done: float, files: int) -> None:
        if done == 1:
            with pytest.raises(JobError, match=r"springs.journal.sqlite is in use by another run of the same command"):
                identify_many(few, few / "models", workers=1, options=FAST)
            assert files == 3

    identify_many(few, few / "models", workers=1, options=FAST, progress=begin_again)


def test_a_run_that_cannot_begin_leaves_no_folder(few: Path) -> None:
    with pytest.raises(JobError, match="No scheduler answers"):
        identify_many(few, few / "new" / "nested", scheduler="nowhere")
    assert not (few / "new").exists()
    (few / "models" / sources.TABLE).mkdir(parents=True)
    with pytest.raises(StrandspringError, match="it is a folder or a device"):
        identify_many(few, few / "models", workers=1, options=FAST)
    assert not (few / "models" / sources.JOURNAL).exists()


@pytest.mark.parametrize(
    "end",
    [
        signal.SIGINT,
        pytest.param(signal.SIGKILL, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, marks=pytest.mark.slow),
    ],
    ids=["interrupted", "killed", "terminated"],
)
def test_a_run_that_is_ended_goes_on(end: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    many = 100  # so many that the signal comes before the last one
    write_batch(tmp_path / "springs", many, ROWS)
    program = subprocess.Popen(
        [sys.executable, "-m", "strandspring", "identify-many", "springs", "-o", "models",
         "--method", "two-stage", "--degrees", "3,2"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60.0
    while written(tmp_path / "models" / sources.JOURNAL) < 60_000:
        assert program.poll() is None, program.communicate()
        assert time.monotonic() < deadline
        workers = psutil.Process(program.pid).children(recursive=True)
        time.sleep(0.005)
    program.send_signal(end)
    said, complained = program.communicate(timeout=60)
    assert not psutil.wait_procs(workers, timeout=20)[1]  # none is left behind
    kept = finished(tmp_path / "models")
    assert 5 <= kept < many
    assert (said, "Traceback" in complained) == ("", False)
    if end is signal.SIGKILL:
        for part in (tmp_path / "models").glob(".*.part"):
            part.unlink()  # as a later command does, but not within a minute
    else:
        assert program.returncode == 128 + end
        assert f"{kept} of {many} files are kept in models/springs.journal.sqlite; the same command" in complained
    monkeypatch.chdir(tmp_path)  # the same paths as before
    again = identify_many("springs", "models", workers=1, options=FAST)
    identify_many("springs", "whole", workers=1, options=FAST)
    assert again.batch.earlier == kept
    assert content(Path("models")) == content(Path("whole"))


def deadly_batch(folder: Path) -> BatchSummary:
    springs, _ = find_springs([folder], folder / "models")
    return identify_batch(springs, folder / "models", DeadlyWork(FAST, Wanted()), Local(2))


def test_a_worker_that_dies_costs_its_file_only(few: Path) -> None:
    write_batch(few, 6, ROWS, first=3)
    (few / "deadly.csv").write_text("of no matter")
    summary = deadly_batch(few)
    assert dict(summary.statuses) == {"identified": 9, "failed": 1}
    ((file, status, reason),) = summary.problems
    assert (Path(file).name, status) == ("deadly.csv", "failed")
    assert reason.startswith("The process that identified it died")


def test_a_worker_that_dies_once_costs_nothing(few: Path) -> None:
    write(few / "deadly.csv", measured(5, ROWS))
    (few / "once").write_text("")
    assert dict(deadly_batch(few).statuses) == {"identified": 4}
    assert (few / "once").read_text() == "died"


@pytest.mark.parametrize(
    ("fail", "said"),
    [
        (lambda *_: 1 // 0, "ZeroDivisionError: integer division"),
        (lambda *_: np.log(np.zeros(1)), "RuntimeWarning: divide by zero"),  # an error here, and not hidden
    ],
)
def test_an_error_of_the_program_is_a_row(
    few: Path, monkeypatch: pytest.MonkeyPatch, fail: Callable[..., object], said: str
) -> None:
    monkeypatch.setattr("strandspring.campaigns.batches.spring_row.identify_records", fail)
    many = identify_many(few, few / "models", workers=1)
    assert many.batch.statuses["failed"] == 3
    assert f"An error of the program ({said}" in many.summary()


def test_a_script_needs_no_guard(few: Path) -> None:
    script = few / "script.py"
    script.write_text(
        f"from strandspring import identify_many\nprint('once')\n"
        f"print(identify_many({str(few)!r}, {str(few / 'models')!r}, workers=2).batch.statuses['identified'])\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "once\n3\n"


# Names


def test_files_of_one_name_keep_apart(few: Path, tmp_path: Path) -> None:
    write_batch(tmp_path / "more", 3, ROWS, first=0)
    write(tmp_path / "more" / "SPRING_0002.txt", measured(2, ROWS))
    many = identify_many(
        [few, tmp_path / "more", few / "spring_0001.csv"], tmp_path / "models", workers=1, options=FAST
    )
    models = many.to_frame()["model"].tolist()
    assert models[:3] == ["few_spring_0000.json", "few_spring_0001.json", "few_spring_0002.json"]
    assert models[4:6] == ["more_spring_0000.json", "more_spring_0001.json"]
    digests = [models[3], models[6]]  # names that differ in case only
    assert all(name.lower().startswith("more_spring_0002_") for name in digests)
    assert len({name.lower() for name in models}) == 7
    assert {path.name for path in (tmp_path / "models").glob("*.json")} == set(models)
    assert many.left_out == (f"1 file given more than once, first: {few / 'spring_0001.csv'}",)


def test_hostile_names_do_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = measured(0, ROWS)
    folder = tmp_path / "-springs"
    folder.mkdir()
    names = [
        "=HYPERLINK(1).csv", "-c.csv", "@sum.csv", "+1.csv", "con.csv", "a\nb,c\".csv", "\x1b[31m.csv", "..csv",
        "Größe µ.csv", "x" * 240 + ".csv", "x" * 239 + "y.csv", "NA.csv", "$(id).csv", "12.csv",
    ]  # fmt: skip
    for name in names:
        write(folder / name, table)
    bad = os.fsdecode(b"\xff\xfe.csv")
    write(folder / bad, table)
    monkeypatch.chdir(folder)
    given = [*names, bad]
    many = identify_many(given, tmp_path / "models", workers=1, options=FAST)
    again = identify_many(given, tmp_path / "models", workers=1, options=FAST)
    assert many.is_complete
    assert again.batch.earlier == len(given)
    frame = many.to_frame()
    assert frame["model"].str.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}\.json").all()
    assert frame["model"].nunique() == len(given)
    with many.batch.table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(given)
    assert not [row for row in rows if row["file"][0] in "=+-@" or not row["file"].isprintable()]
    assert rows[0]["file"] == "'=HYPERLINK(1).csv"
    assert [float(row["rmse [N]"]) for row in rows] == frame["rmse [N]"].tolist()  # numbers stay numbers
    assert "\x1b" not in many.summary()


def test_folders_are_searched_for_records_only(few: Path, terminal: Terminal) -> None:
    (few / "README.md").write_text("notes")
    (few / ".hidden.csv").write_text("")
    (few / "deeper").mkdir()
    (few / "deeper" / "x.csv").write_text("")
    for _ in range(2):  # its own results are no records
        terminal("identify-many", "few", "-o", "few", "--workers", "1")
        assert "1 file not named like a record left out, first: few/README.md" in terminal.err
        assert "3 of 3 springs identified" in terminal.out


# Outliers


def test_the_rule_flags_as_few_of_a_clean_batch_as_it_says() -> None:
    generator = np.random.default_rng(1)
    for size, share in ((8, 0.02), (15, 0.01), (30, 0.004), (100, 0.001), (1000, 0.0005)):
        figures = np.exp(0.05 * generator.standard_normal((100_000 // size, size)))
        flagged = np.mean([np.abs(modified_z(row)) > 3.5 for row in figures])
        # Some 40 to 2000 of 100 000 are flagged; in a batch they come together, which makes the scatter larger.
        assert 0.6 * share < flagged < 1.4 * share, size


@pytest.mark.parametrize(
    ("figures", "flagged"),
    [
        ([10.0] * 20 + [10.02], []),  # closer than any rig measures
        ([10.0] * 20 + [10.2], [20]),
        ([10.0] * 20 + [-3.0, 0.0], [20, 21]),
        ([10.0] * 20 + [np.nan], []),
        ([0.5] * 12 + [0.6, 0.7, 0.8, 0.9, 1.0] * 2, []),  # more than half at a bound
        ([10.0] * 6 + [20.0], []),  # too few
        ([-1.0] * 20, []),
    ],
)  # fmt: skip
def test_the_rule_at_its_limits(figures: list[float], flagged: list[int]) -> None:
    assert np.flatnonzero(np.abs(modified_z(np.array(figures))) > 3.5).tolist() == flagged


def test_a_stiff_spring_is_an_outlier_of_its_batch(serial: ManyResult) -> None:
    frame = serial.to_frame().set_index("model")
    assert "secant stiffness" in frame.loc["stiff.json", "outlier"]
    # Of nine springs with seven figures each, of which about three are independent, 9*3*0.02 = 0.5 are expected to be
    # flagged by chance; with these seeds there is none.
    assert frame["outlier"].notna().sum() == 1
    assert list(serial.batch.outliers) == [frame.loc["stiff.json", "file"]]
    assert "Outliers: 1 (robust z" in serial.summary()


def test_a_spring_that_was_moved_less_has_no_figures_beyond(few: Path) -> None:
    table = measured(3, ROWS)
    write(few / "short.csv", table[: 2 * ROWS // 3])  # up to 70 % of the amplitude
    many = identify_many(few, few / "models", workers=1)
    frame = many.to_frame().set_index("model")
    assert pd.isna(frame.loc["short.json", "secant stiffness [N/m]"])
    assert "1 spring was not moved so far and has no figures there, first: " in many.summary()
    fixed = identify_many(few, few / "models", workers=1, amplitude=0.01)
    assert fixed.batch.earlier == 4
    assert fixed.to_frame()["amplitude [m]"].tolist() == [0.01] * 4


# The command


def test_the_command_says_the_same_as_its_json(few: Path, terminal: Terminal) -> None:
    (few / "bad.csv").write_text("")
    told = json.loads(terminal("identify-many", "few", "-o", "models", "--workers", "1", "--json", status=1))
    assert told["statuses"] == {"identified": 3, "refused": 0, "unreadable": 1, "failed": 0}
    assert [problem["file"] for problem in told["problems"]] == ["few/bad.csv"]
    last = "strandspring: 1 of 4 springs is not identified (1 unreadable); springs.csv says why."
    assert terminal.err.splitlines()[-1] == last
    text = terminal("identify-many", "few", "-o", "models", "--verbose", status=1)
    assert "; 4 files were finished by an earlier run" in text
    assert "  few/bad.csv: unreadable: the file is empty; give a file" in text
    assert "Table: models/springs.csv" in text
    assert "3 files: the unit of displacement is mm (found in the file)" in terminal.err
    (few / "bad.csv").unlink()
    terminal("identify-many", "few", "-o", "models")


@pytest.mark.usefixtures("few")
def test_a_missing_package_is_reported_in_one_sentence(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    terminal("identify-many", "few", "-o", "models", "--workers", "1")
    sentence = 'springs.parquet needs pyarrow and was not written; install it with pip install "strandspring[formats]".'
    assert sentence in terminal.err.splitlines()
    assert not Path("models/springs.parquet").exists()


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        ("nowhere -o models --workers 2 --scheduler tcp://a:1", 2, "exclude each other"),
        ("few -o few/spring_0000.csv", 1, "few/spring_0000.csv/springs.csv cannot be written"),
        ("empty -o few", 1, "There is no record to identify"),
        ("nowhere -o models", 1, "nowhere: no such file or folder; check the path."),
        ("few few/x.json -o few", 1, "The record few/x.json would be overwritten; write to another folder."),
        ("few -o models --amplitude 0", 2, "--amplitude"),
        ("few -o models --force-unit furlong", 2, "unit 'furlong' of the force is not known"),
        ("few -o models --scheduler nowhere", 1, "No scheduler answers at 'nowhere'"),
    ],
)
def test_bad_commands_get_one_sentence(
    arguments: str, status: int, told: str, terminal: Terminal, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    terminal("identify-many", *arguments.split(), status=status)
    assert told in terminal.err.strip().splitlines()[-1]
    assert not (tmp_path / "models").exists()


def test_bad_arguments_are_refused(few: Path) -> None:
    with pytest.raises(TypeError, match="colour"):
        identify_many(few, few / "models", colour="red")
    with pytest.raises(RecordError, match="`amplitude` must be finite and > 0"):
        identify_many(few, few / "models", amplitude=-1.0)
    with pytest.raises(TypeError, match="exclude each other"):
        identify_many(few, few / "models", workers=1, scheduler="tcp://a:1")
