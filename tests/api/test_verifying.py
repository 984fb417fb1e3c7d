"""`verify` in Python."""

from __future__ import annotations

import zipfile
from functools import cache
from pathlib import Path

import pytest

from springs import MOUNT
from strandspring import ModelError, Spring, info, verify
from strandspring.fmu.python_backed import fmu_contents
from strandspring.fmu.related_files import HASHES, REFERENCE, STIMULI, sealed
from strandspring.model.modelfile import ModelFile


def test_a_good_fmu_and_a_changed_one(tmp_path: Path) -> None:
    fmu = Spring(MOUNT, "mount").build_fmu(tmp_path)
    good = verify(fmu)
    assert good.ok
    assert good.problems == ()
    assert good.to_frame()["about"].tolist() == ["files", "rules", "spring", "run"]
    assert good.summary().splitlines()[0] == str(fmu)
    with zipfile.ZipFile(fmu, "a") as archive:
        archive.writestr("added.txt", "x")
    bad = verify(str(fmu))
    assert not bad.ok
    assert [finding.text for finding in bad.problems][:1] == [
        "'added.txt' has been added: it is not in resources/strandspring/sha256.json."
    ]
    assert repr(bad).startswith(str(fmu))


def test_a_missing_file_is_a_finding(tmp_path: Path) -> None:
    missing = verify(tmp_path / "missing.fmu")
    assert not missing.ok
    assert "no such file" in missing.summary()


@cache
def contents() -> dict[str, bytes]:
    """Files of an FMU without binaries."""
    return fmu_contents(ModelFile("mount", MOUNT))


def written(path: Path, files: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    """An FMU of these files with hashes that fit."""
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, content in sealed({name: content for name, content in files.items() if name != HASHES}).items():
            archive.writestr(name, content)
    return path


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_other_methods_of_packing_are_refused(tmp_path: Path, method: int) -> None:
    fmu = written(tmp_path / "mount.fmu", contents(), method)
    assert "is compressed by a method other than deflate; copy it again" in verify(fmu).summary()
    with pytest.raises(ModelError, match="is compressed by a method other than deflate"):
        info(fmu)
    # Once the damage inside another method was a traceback.
    damaged = bytearray(fmu.read_bytes())
    damaged[200:260] = b"\0" * 60
    fmu.write_bytes(damaged)
    assert not verify(fmu).ok


@pytest.mark.parametrize(
    "head",
    ['<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]>', "<!DOCTYPE a [" + '<!ENTITY x "x">' * 9 + "]>"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_entities_in_a_description_are_not_read(tmp_path: Path, head: str, encoding: str) -> None:
    text = contents()["modelDescription.xml"].decode("utf-8").replace("?>", "?>" + head, 1)
    text = text.replace('description="', 'description="&x;', 1)
    fmu = written(tmp_path / "mount.fmu", contents() | {"modelDescription.xml": text.encode(encoding)})
    (finding,) = verify(fmu).problems
    assert finding.text == ("modelDescription.xml must be UTF-8 text without a document type; build the FMU again.")


@pytest.mark.parametrize("name", [STIMULI, REFERENCE])
@pytest.mark.parametrize("rows", [b"", b"0,nan,0,0\n0,1,0,0\n", b"0\n", b'"', b"a,b,c,d\n", b"x" * 200_000])
def test_a_reference_that_is_no_table_is_a_finding(tmp_path: Path, name: str, rows: bytes) -> None:
    table = b"time,displacement,force,absorbed_energy\n" + rows
    (finding,) = verify(written(tmp_path / "mount.fmu", contents() | {name: table})).problems
    assert "is not a table of finite numbers; build the FMU again" in finding.text


def test_what_an_archive_holds_does_not_reach_the_terminal(tmp_path: Path) -> None:
    fmu = written(tmp_path / "mount.fmu", contents())
    data = bytearray(fmu.read_bytes())
    place = data.find(b"PK\x01\x02")
    data[place + 28 : place + 30] = b"\xff\x01"  # length of the name: more of the directory is taken for it
    fmu.write_bytes(data)
    text = verify(fmu).problems[0].text
    assert text.isascii()
    assert text.isprintable()
    assert len(text) < 300
