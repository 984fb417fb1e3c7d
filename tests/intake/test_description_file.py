"""Description files of campaigns: they are followed, options go before them, mistakes are named by file and field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomllib

from strandspring import RecordError, read_campaign, read_record
from strandspring.loops import reading
from strandspring.loops.reading import Reading, entries

CASES = tomllib.loads(Path(__file__).with_name("mistakes.toml").read_text("utf-8"))
TIME = np.linspace(0.0, 5.0, 1001)
PATH = 20.0 * np.sin(2.0 * np.pi * TIME)  # [mm]
FORCE = 3.0 * PATH + 40.0 * np.cos(2.0 * np.pi * TIME)  # [N]
FOLLOWED = """
displacement = "Weg"
force = 3
force_unit = "kN"
force_offset = 1.5
reverse = "displacement"

[[record]]
file = "lot A/*.csv"
cycles = "2:3"
label = "lot A"

[[record]]
file = "other.csv"
displacement_unit = "cm"
reverse = "force"
force_offset = 0.0
force_scale = 0.5
time_window = "1:4"
displacement_range = "-150:"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lot A").mkdir()
    for name, scale in (("lot A/b.csv", 2.0), ("lot A/a.csv", 1.0), ("other.csv", 3.0)):
        table = np.column_stack([TIME, PATH, scale * FORCE]).tolist()
        rows = "\n".join(";".join(map(repr, row)) for row in table)
        (tmp_path / name).write_text(f"Zeit;Weg;Kraft\n{rows}\n")
    return tmp_path


def described(folder: Path, text: str) -> Path:
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_a_description_says_is_done(folder: Path) -> None:
    first, second, third = read_campaign(described(folder, FOLLOWED))
    assert [Path(record.path).name for record in (first, second, third)] == ["a.csv", "b.csv", "other.csv"]
    assert [record.label for record in (first, second, third)] == ["lot A", "lot A", ""]
    np.testing.assert_allclose(first.force.max(), 1e3 * (FORCE.max() - 1.5), rtol=1e-3)
    assert "1.5 is subtracted from the force, as given." in first.notes
    assert first.notes[-1].startswith("Selected, as given: cycles 2 to 3 of ")
    assert third.time is not None
    assert (third.time[0], third.time[-1]) == (1.0, 4.0)
    np.testing.assert_array_equal(third.compared, third.displacement >= -0.15)
    whole = read_record(folder / "other.csv", displacement_unit="cm", force=3, force_unit="kN", reverse="force")
    np.testing.assert_allclose(third.force, 0.5 * whole.force[200:801], rtol=1e-14)


def test_options_go_before_a_description(folder: Path) -> None:
    path = described(folder, 'force_unit = "kN"\ncycles = 2\n[[record]]\nfile = "other.csv"\ncycles = "1:2"\n')
    assert read_campaign(path)[0].notes[-1].startswith("Selected, as given: cycles 1 to 2 of")
    (record,) = read_campaign(path, Reading(cycles="3:", force_unit="N"))
    assert record.notes[-1].startswith("Selected, as given: cycles 3 to ")
    assert any("The unit of the force is N, as given" in note for note in record.notes)
    both = [wanted.read(path) for path, wanted in entries([folder / "lot A" / "a.csv", path], Reading(reverse="force"))]
    assert [Path(each.path).name for each in both] == ["a.csv", "other.csv"]
    assert all("The force is negated, as given." in each.notes for each in both)
    # Absolute paths and those out of the folder are read.
    other = f"[[record]]\nfile = \"../other.csv\"\n[[record]]\nfile = '{folder / 'other.csv'}'\n"
    assert [len(record) for record in read_campaign(described(folder / "lot A", other))] == [1001, 1001]
    # Bad lines are left out where the description says so, unless an option forbids it.
    text = (folder / "other.csv").read_text().splitlines()
    (folder / "other.csv").write_text("\n".join([*text[:30], "0.1;ERR;1", *text[31:]]))
    path = described(folder, 'skip_bad_lines = true\n[[record]]\nfile = "other.csv"\n')
    assert len(read_campaign(path)[0]) == 1000
    with pytest.raises(RecordError, match="line 31"):
        read_campaign(path, Reading(skip_bad_lines=False))


@pytest.mark.parametrize(("text", "expected"), CASES["mistakes"])
def test_mistakes_are_named_by_file_and_field(
    folder: Path, text: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "_MAX_FILES", 2)
    with pytest.raises(RecordError) as caught:
        read_campaign(described(folder, text.replace("MANY", "[" * 5000)))
    message = str(caught.value)
    assert message.startswith(str(folder))
    assert expected in message
    assert message.endswith(".")
