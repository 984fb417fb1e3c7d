"""Many springs: every file has its row, whatever it holds, and nothing is lost nor done twice."""

from __future__ import annotations

import csv
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from journal_content import execute
from many_springs import measured, one_of, write, write_batch
from strandspring import ManyResult, RecordError, Spring, TwoStageOptions, identify_many
from strandspring.campaigns.batches import sources
from strandspring.campaigns.batches.batch import identify_batch
from strandspring.campaigns.batches.figures_in_batch import modified_z
from strandspring.campaigns.batches.sources import SpringFile, find_springs
from strandspring.campaigns.batches.spring_row import BatchWork, Finished
from strandspring.campaigns.jobs.options import Workers
from strandspring.errors import JobError
from strandspring.loops.reading import Reading

pytestmark = pytest.mark.long

ROWS = 360  # of a record, for speed
COUNT = 9
FAST = TwoStageOptions(degrees=(3, 2))  # where the method is of no matter


# The status that a damaged file gets, and a part of the reason.
DAMAGES = {
    "empty": ("unreadable", "the file is empty"), "folder": ("unreadable", "is a folder"),
    "nan": ("unreadable", "line 52"), "truncated": ("refused", "does not go back and forth"),
    "snap": ("refused", "snap-through"),
}  # fmt: skip


def write_damaged(folder: Path) -> None:
    """A file of each damage."""
    files, table = {name: folder / f"damaged_{name}.csv" for name in DAMAGES}, measured(0, ROWS)
    files["empty"].touch()
    files["folder"].mkdir()
    write(files["truncated"], table[: ROWS // 20])
    collapsed = table.copy()
    collapsed[table[:, 1] > 60.0, 2] *= -1.0  # beyond half the largest amplitude
    write(files["snap"], collapsed)
    table[50, 2] = np.nan
    write(files["nan"], table)


class DeadlyWork(BatchWork):
    """Dies of every file called deadly, always or, where its folder holds "once", once."""

    def rows(self, tasks: Sequence[SpringFile]) -> list[Finished]:
        for spring in tasks:
            once = Path(spring.path).with_name("once")
            if spring.name.startswith("deadly") and not (once.exists() and once.read_text()):
                if once.exists():
                    once.write_text("died")
                os._exit(9)
        return super().rows(tasks)


@pytest.fixture(scope="module")
def springs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of good records, of which one spring is twice as stiff as the others, and of damaged ones."""
    folder = tmp_path_factory.mktemp("springs")
    write_batch(folder, COUNT, ROWS)
    write(folder / "stiff.csv", measured(100, ROWS, stiffness=2.0))
    write_damaged(folder)
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


def content(folder: Path) -> dict[str, bytes]:
    """All results in a folder; the journal is in the order in which the files were finished."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != sources.JOURNAL}


def test_every_file_is_identified_or_named_with_the_reason(serial: ManyResult) -> None:
    frame, summary = serial.to_frame(), serial.summary()
    assert (len(frame), list(frame["file"])) == (COUNT + 1 + len(DAMAGES), sorted(frame["file"]))
    by_name = frame.set_index(frame["file"].map(lambda file: Path(file).stem))
    for name, (status, reason) in DAMAGES.items():
        row = by_name.loc[f"damaged_{name}"]
        assert (row["status"], reason in row["reason"]) == (status, True), name
        assert not (serial.folder / f"damaged_{name}.json").exists()
        assert f"damaged_{name}.csv" in summary
    assert frame["status"].tolist().count("identified") == COUNT + 1
    assert serial.problem == (
        f"{len(DAMAGES)} of {len(frame)} springs are not identified (2 refused, 3 unreadable); springs.csv says why."
    )
    # A stiff spring is an outlier. Of nine springs with seven figures each, of which about three are independent,
    # 9*3*0.02 = 0.5 are expected to be flagged by chance; with these seeds there is none.
    assert frame[frame["outlier"].notna()]["model"].tolist() == ["stiff.json"]
    assert "secant stiffness" in by_name.loc["stiff", "outlier"]


def test_a_row_tells_what_the_model_file_does(serial: ManyResult) -> None:
    import pandas as pd

    frame = serial.to_frame()
    row, spring = frame.set_index("model").loc["spring_0004.json"], Spring.load(serial.folder / "spring_0004.json")
    p, known, fit = spring.parameters, spring.model.uncertainty, spring.model.fit
    for name, unit in (("kappa_omega", "N"), ("rho", "1/m"), ("sigma", "1"), ("n", "1")):
        assert row[f"{name} [{unit}]"] == getattr(p, name)
        assert [row[f"{name} {end} 95 % [{unit}]"] for end in ("low", "high")] == known["interval_95"][name]
        # The record is long enough that the true spring is within a few standard errors.
        assert abs(getattr(p, name) - getattr(one_of(4), name)) < 5.0 * known[name]
    assert [row["rmse [N]"], row["RNL [1]"]] == [fit["rmse"], fit["rnl"]]
    amplitude = serial.batch.amplitude * np.array([*np.linspace(1, -1, 400), *np.linspace(-1, 1, 400)])
    loop = spring.response(p.displacement_offset + np.tile(amplitude, 3))[-800:]
    assert row["secant stiffness [N/m]"] == pytest.approx((loop[-1] - loop[399]) / (2 * amplitude[0]), rel=1e-9)
    assert row["energy per cycle [J]"] == pytest.approx(np.trapezoid(loop, amplitude), rel=1e-3)  # trapezia
    other = pd.read_parquet(serial.folder / "springs.parquet")
    assert frame.astype(object).fillna(0).equals(other.astype(object).fillna(0))


def test_processes_and_a_cluster_give_the_same_bytes(serial: ManyResult, springs: Path, tmp_path: Path) -> None:
    from distributed import LocalCluster

    counts: list[tuple[str, float, int]] = []
    many = identify_many(springs, tmp_path / "two", workers=2, progress=lambda *count: counts.append(count))
    assert content(tmp_path / "two") == content(serial.folder)
    files = many.batch.files
    assert (counts[0], counts[-1]) == (("Identifying", 0, files), ("Identifying", files, files))
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as cluster:
        identify_many(springs, tmp_path / "cluster", scheduler=cluster.scheduler_address)
    assert content(tmp_path / "cluster") == content(serial.folder)


def test_only_what_has_changed_is_identified_again(few: Path) -> None:
    models, journal, said = few / "models", few / "models" / sources.JOURNAL, list[str]()

    def earlier(options: TwoStageOptions = FAST, source: Path = few) -> int:
        said.clear()
        return identify_many(source, models, workers=1, options=options, notify=said.append).batch.earlier

    assert (earlier(), earlier()) == (0, 3)
    before = content(models)
    # Damaged rows, and those of a knowing hand: names that lead elsewhere, kinds and parameters that there are not.
    execute(journal, "UPDATE row SET checksum = 0 WHERE key IN (SELECT key FROM row LIMIT 2)")
    assert earlier() == 1
    assert "2 damaged rows were dropped; their files are identified again." in said[0]
    ((manifest,),) = execute(journal, "SELECT manifest FROM job")
    changes = (b'"spring_000', b'"../spring_000'), (b'"identified"', b'"indented"'), (b'"kappa_omega":', b'"kappa":')
    for (key, values), (name, other) in zip(execute(journal, "SELECT key, content FROM row"), changes, strict=True):
        forged = values[:20] + values[20:].replace(name, other, 1)
        execute(journal, "REPLACE INTO row VALUES (?, ?, ?)", key, zlib.crc32(forged, zlib.crc32(manifest)), forged)
    assert (earlier(), content(models)) == (0, before)
    # Other data, and a model that is gone; then another file alone.
    write(few / "spring_0001.csv", measured(7, ROWS))
    (models / "spring_0002.json").unlink()
    assert earlier() == 1
    changed = [name for name, model in content(models).items() if name.endswith("json") and model != before[name]]
    assert changed == ["spring_0001.json"]
    (few / "spring_0009.csv").write_bytes(b"")
    assert (earlier(source=few / "spring_0009.csv"), earlier()) == (0, 4)
    (few / "spring_0001.csv").write_bytes(b"")
    assert earlier() == 3
    assert not (models / "spring_0001.json").exists()  # it was that of other data
    assert earlier(TwoStageOptions(degrees=(2, 1))) == 0
    assert any("were identified with other options or another version; they are identified anew" in one for one in said)
    (few / "spring_0009.csv").unlink()
    (few / "spring_again.csv").write_bytes((few / "spring_0002.csv").read_bytes())
    (caution,) = (line for line in identify_many(few, models, workers=1).cautions if "that of another file" in line)
    assert "spring_again.csv" in caution


def test_a_damaged_journal_and_other_files_are_refused(few: Path) -> None:
    models, journal = few / "models", few / "models" / sources.JOURNAL

    def begin_again(*count: Any) -> None:
        if count[1] == 1:
            with pytest.raises(JobError, match=r"springs.journal.sqlite is in use by another run of the same command"):
                identify_many(few, models, workers=1, options=FAST)

    identify_many(few, models, workers=1, options=FAST, progress=begin_again)
    journal.write_bytes(b"my notes\n")
    with pytest.raises(JobError, match="is not the journal of a"):
        identify_many(few, models, workers=1, options=FAST)
    assert journal.read_bytes() == b"my notes\n"
    with pytest.raises(JobError, match="No scheduler answers"):
        identify_many(few, few / "new" / "nested", scheduler="nowhere")
    assert not (few / "new").exists()
    with pytest.raises(RecordError, match="`amplitude` must be finite and > 0"):
        identify_many(few, few / "models", amplitude=-1.0)


@pytest.mark.parametrize("dies_once", [False, True])
def test_a_worker_that_dies_costs_its_file_only(few: Path, dies_once: bool) -> None:
    write(few / "deadly.csv", measured(5, ROWS))
    if dies_once:
        (few / "once").touch()
    found, _ = find_springs([few], few / "models")
    summary = identify_batch(found, few / "models", DeadlyWork(FAST, Reading()), Workers(2))
    assert dict(summary.statuses) == ({"identified": 4} if dies_once else {"identified": 3, "failed": 1})
    if not dies_once:
        (problem,) = summary.problems
        assert Path(problem["file"]).name == "deadly.csv"
        assert problem["reason"].startswith("The process that identified it died")


def test_hostile_names_do_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, models = tmp_path / "-springs", tmp_path / "models"
    (folder / "more").mkdir(parents=True)
    names = [
        "=HYPERLINK(1).csv", "-c.csv", "@sum.csv", "+1.csv", "con.csv", "a\nb,c\".csv", "\x1b[31m.csv", "..csv",
        "Größe µ.csv", "x" * 240 + ".csv", "x" * 239 + "y.csv", "NA.csv", "$(id).csv", "12.csv", "CON.txt",
        "more/con.csv", os.fsdecode(b"\xff\xfe.csv"),
    ]  # fmt: skip
    for name in names:
        write(folder / name, measured(0, ROWS))
    monkeypatch.chdir(folder)
    many = identify_many([*names, "12.csv"], models, workers=1, options=FAST)
    assert not many.problem
    assert identify_many(names, models, workers=1, options=FAST).batch.earlier == len(names)
    assert many.notes[0] == "Files are given more than once. (1, first 12.csv)"
    written = many.to_frame()["model"]
    assert written.str.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}\.json").all()
    assert len({name.lower() for name in written}) == len(names)
    assert {path.name for path in models.glob("*.json")} == set(written)
    with many.batch.table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert not [row for row in rows if row["file"][0] in "=+-@" or not row["file"].isprintable()]
    assert rows[0]["file"] == "'=HYPERLINK(1).csv"
    assert "\x1b" not in many.summary()


def test_the_rule_flags_as_few_of_a_clean_batch_as_it_says() -> None:
    generator = np.random.default_rng(1)
    for size, share in ((8, 0.02), (15, 0.01), (30, 0.004), (100, 0.001), (1000, 0.0005)):
        figures = np.exp(0.05 * generator.standard_normal((100_000 // size, size)))
        flagged = np.mean([np.abs(modified_z(row)) > 3.5 for row in figures])
        # Some 40 to 2000 of 100 000 are flagged; in a batch they come together, which makes the scatter larger.
        assert 0.6 * share < flagged < 1.4 * share, size
    for values, outliers in (
        ([10.0] * 20 + [10.02], []),  # closer than any rig measures
        ([10.0] * 20 + [10.2], [20]),
        ([10.0] * 20 + [-3.0, 0.0], [20, 21]),
        ([10.0] * 20 + [np.nan], []),
        ([0.5] * 12 + [0.6, 0.7, 0.8, 0.9, 1.0] * 2, []),  # more than half at a bound
        ([10.0] * 6 + [20.0], []),  # too few
        ([-1.0] * 20, []),
    ):
        assert np.flatnonzero(np.abs(modified_z(np.array(values))) > 3.5).tolist() == outliers
