"""`export` in Python: the files of the command."""

from __future__ import annotations

from pathlib import Path

import pytest

from springs import MOUNT
from strandspring import Spring, StrandspringError, export
from terminal import Terminal


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(MOUNT, "mount").save("mount.json")
    return Terminal(capsys)


def test_the_files_are_those_of_the_command(terminal: Terminal) -> None:
    terminal("export", "mount.json", "--ssv", "--modelica", "--ssp", "--mass", "5", "-o", "command")
    written = export(Spring.load("mount.json"), "python", ssv=True, modelica=True, ssp_mass=5.0)
    assert written == [Path("python", name) for name in ("mount.ssv", "mount.ssp", "StrandSpring/Records/mount.mo")]
    for path in Path("command").rglob("*"):
        if path.is_file():
            assert (Path("python") / path.relative_to("command")).read_bytes() == path.read_bytes()
    assert export("mount.json", "some", ssv=True, zero="rig") == [Path("some/mount.ssv")]
    assert Path("some/mount.ssv").read_bytes() != Path("python/mount.ssv").read_bytes()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({}, "Nothing to write"),
        ({"ssp_mass": -1.0}, r"`ssp_mass` must be finite and > 0 \[kg\], got -1.0"),
        ({"ssv": True, "zero": "left"}, "`zero` must be"),
        ({"ssv": True, "folder": "mount.json"}, "mount.json cannot be written: it is a file; give a folder"),
        ({"modelica": True, "folder": "package"}, "package is a Modelica package"),
    ],
)
def test_options_are_checked_before_anything_is_written(
    options: dict[str, object], told: str, terminal: Terminal
) -> None:
    Path("package").mkdir()
    Path("package/package.mo").write_text("")
    before = sorted(map(str, Path().rglob("*")))
    with pytest.raises(StrandspringError, match=told):
        export("mount.json", **options)  # type: ignore[arg-type]
    assert sorted(map(str, Path().rglob("*"))) == before
    assert terminal.err == ""
