"""`verify` in Python."""

from __future__ import annotations

import zipfile
from pathlib import Path

from springs import MOUNT
from strandspring import Spring, verify


def test_a_good_fmu_and_a_changed_one(tmp_path: Path) -> None:
    fmu = Spring(MOUNT, "mount").build_fmu(tmp_path)
    good = verify(fmu)
    assert good.ok
    assert good.problems == ()
    assert good.to_frame()["about"].tolist() == ["files", "rules", "run"]
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
