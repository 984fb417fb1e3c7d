"""Records in binary formats: what the file holds is what a text would give, and what is no record is named."""

from __future__ import annotations

import hashlib
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomllib

from strandspring import RecordError, read_record
from strandspring.records import content
from strandspring.records.content import FileContent
from strandspring.records.formats import matlab, numpy_arrays, reader_process

pytestmark = pytest.mark.long

CASES = tomllib.loads(Path(__file__).with_name("formats.toml").read_text("utf-8"))
OF_PYTHON = {"mat", "mat_4", "mat_struct", "mat_timeseries", "mat_simulink", "npz", "gz", "bzip2", "xz", "zipped"}
OF_LIBRARIES = {
    "mat_73", "hdf5", "hdf5_compound", "xlsx", "xls", "ods", "tdms", "mdf_3", "mdf_4", "uff", "uff_binary",
    "parquet_file", "feather_file",
}  # fmt: skip


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    return sentence(caught.value, path)


def sentence(error: RecordError, path: Path) -> str:
    message = str(error)
    assert message.startswith(str(path))
    assert message.endswith((".", "?"))
    assert message.isprintable()
    assert "object at 0x" not in message
    return message


@pytest.mark.parametrize("name", sorted(OF_PYTHON | OF_LIBRARIES))
def test_each_format_gives_the_record_of_the_text_and_if_damaged_a_sentence(
    name: str, samples: Path, tmp_path: Path
) -> None:
    expected, record, data = read_record(samples / "plain.csv"), read_record(samples / name), samples / name
    # A data set of ASCII has 12 digits, and openpyxl writes 16; times of waveforms are made of a step.
    rtol = {"uff": 1e-11, "xlsx": 1e-15}.get(name, 0.0)
    np.testing.assert_allclose(record.displacement, expected.displacement, rtol=rtol)
    np.testing.assert_allclose(record.force, expected.force, rtol=rtol)
    np.testing.assert_allclose(record.time, expected.time, rtol=1e-12, atol=1e-12)
    assert any("The unit of the displacement is mm, found in the file" in note for note in record.notes)
    assert (record.path, record.sha256) == (str(data), hashlib.sha256(data.read_bytes()).hexdigest())
    whole, draw = data.read_bytes(), np.random.default_rng(7)
    spoiled = bytearray(whole)
    for place in draw.integers(0, len(whole), 8):
        spoiled[place] = draw.integers(256)
    for damaged in (whole[: max(12, len(whole) // 50)], whole[: len(whole) // 2], spoiled):
        (tmp_path / name).write_bytes(damaged)
        try:
            # TDMS, MDF and UFF can be read up to the end of the file.
            assert len(read_record(tmp_path / name)) <= len(expected)
        except RecordError as problem:
            sentence(problem, tmp_path / name)


@pytest.mark.parametrize(("file", "options", "part"), CASES["refused"])
def test_refusals_by_content(file: str, options: dict[str, Any], part: str, samples: Path, tmp_path: Path) -> None:
    path = samples / file
    if file.startswith("="):
        path = tmp_path / "a.dat"
        path.write_bytes(file[1:].encode("latin-1").ljust(0 if file.endswith(".") else 700, b"\0"))
    assert part in refusal(path, **options)


@pytest.mark.parametrize(("file", "options", "samples_read", "note"), CASES["parts"])
def test_parts_of_files(file: str, options: dict[str, Any], samples_read: int, note: str, samples: Path) -> None:
    record, plain = read_record(samples / file, **options), read_record(samples / "plain.csv")
    assert any(note in each for each in record.notes), record.notes
    assert file == "own.h5" or len(record) == samples_read
    if file == "rates.tdms":  # a chord misses (2 pi/80)^2/8 of the amplitude of 12.5 mm
        expected = 0.057 + 0.0125 * np.sin(2.0 * np.pi * np.arange(2000) * 1e-3), np.cos(np.arange(2000) * 1e-3)
        np.testing.assert_allclose(record.displacement, expected[0], atol=1e-5)
        np.testing.assert_array_equal(record.force, expected[1])
    elif file == "runs.xlsx":
        np.testing.assert_allclose(record.force, 2e3 * record.displacement, rtol=1e-14)
    elif file == "inch.xlsx":
        np.testing.assert_allclose(record.displacement, 0.0254 * np.array([1, 2, 4]), rtol=1e-15)
    elif file == "own.h5":  # the force began half a second later
        assert record.time is not None
        assert 0.506 <= record.time[0] < record.time[-1] <= 2.0
        late = np.interp(record.time, plain.time + 0.506, 1e3 * plain.displacement)
        np.testing.assert_allclose(record.force, late, rtol=1e-12)
    elif samples_read > 57:
        np.testing.assert_allclose(record.displacement, plain.displacement[:samples_read], rtol=1e-15)
        scale = 1e-3 if file.endswith("npz") else 1.0  # given as N
        np.testing.assert_allclose(record.force, scale * plain.force[:samples_read], rtol=1e-15)


def test_a_missing_library_is_named(samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader_process._stop_all()  # a process that has imported them already
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("h5py", "python_calamine", "xlrd", "nptdms", "asammdf", "pyuff", "pyarrow"):
        monkeypatch.delitem(sys.modules, name, raising=False)
        (tmp_path / f"{name}.py").write_text(f"raise ModuleNotFoundError(name={name!r})")
    assert all(len(read_record(samples / name)) == 161 for name in OF_PYTHON)
    for name in OF_LIBRARIES:
        assert refusal(samples / name).endswith('install it with pip install "strandspring[formats]".')
    reader_process._stop_all()


def test_what_unpacks_to_too_much_is_refused(samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    workbook = tmp_path / "workbook"
    workbook.write_bytes((samples / "xlsx").read_bytes())
    with (
        zipfile.ZipFile(workbook, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xl/sharedStrings.bin", "w") as member,
    ):
        for _ in range(content.MAX_UNPACKED_BYTES >> 20):
            member.write(bytes(1 << 20))
    assert "must unpack to at most 536870912 bytes, and holds more" in refusal(workbook)
    for module in (content, matlab):
        monkeypatch.setattr(module, "MAX_UNPACKED_BYTES", 2000)
    for name in ("gz", "bzip2", "xz", "zipped"):
        assert "must unpack to at most 2000 bytes, and holds more" in refusal(samples / name)
    for name, reader in (("mat", matlab), ("npz", numpy_arrays)):  # in another process, without the patch
        with pytest.raises(RecordError, match="must unpack to at most 2000 bytes, and holds more"):
            reader.read_tables(FileContent("a.dat", (samples / name).read_bytes(), ""))


@pytest.mark.parametrize("mark", ["PAR1", "RDX", "BZh", "ARROW1", "MDF", "PK", "BM"])
def test_a_name_like_the_mark_of_a_format_is_a_name(tmp_path: Path, mark: str) -> None:
    (tmp_path / "a.csv").write_text(f"{mark};Weg;Kraft\n" + "".join(f"{k};{k};{2 * k}\n" for k in range(9)))
    assert len(read_record(tmp_path / "a.csv")) == 9
