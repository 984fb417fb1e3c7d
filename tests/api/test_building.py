"""`build_fmu` in Python: from what it builds, and that nothing comes in place before it is checked."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import strandspring.api.fmus.building as building
from springs import MOUNT
from strandspring import BuildError, ModelError, Spring, SpringParameters, StrandspringError, build_fmu, identify
from strandspring.fmu.checks.check import CheckReport
from strandspring.fmu.related_files import BuildSettings
from terminal import Terminal

TINY = SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(MOUNT, "mount").save("mount.json")
    return Terminal(capsys)


def _loop() -> tuple[np.ndarray, np.ndarray]:
    """Displacement and force of one amplitude, which earns a caution."""
    path = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 900))
    return path, Spring(TINY).response(path)


def test_a_spring_in_memory_gives_the_bytes_of_the_command(terminal: Terminal) -> None:
    told = json.loads(terminal("build", "mount.json", "-o", "command", "--author", "A", "--zero", "45", "--json"))
    assert "valid; 401 steps" in told["fmus"][0]["check"]
    fmu = build_fmu(Spring.load("mount.json"), "python", author="A", zero=0.045)
    assert fmu == Path("python/mount.fmu")
    assert fmu.read_bytes() == Path("command/mount.fmu").read_bytes()
    # From the FMU, with its settings.
    assert build_fmu(fmu, "again").read_bytes() == fmu.read_bytes()
    assert sorted(path.name for path in Path().iterdir()) == ["again", "command", "mount.json", "python"]


def test_the_kinds(tmp_path: Path) -> None:
    states = build_fmu(Spring(TINY, "tiny"), tmp_path, states=True)
    assert states.name == "tiny_states.fmu"
    again = build_fmu(states, tmp_path / "again")
    assert (again.name, again.read_bytes()) == (states.name, states.read_bytes())
    python = build_fmu(Spring(TINY, "tiny"), tmp_path, backend="python", needs_execution_tool=True, name="other")
    assert python.name == "other_python.fmu"
    assert BuildSettings.of_fmu(python).needs_execution_tool


def test_records_are_identified_and_their_cautions_are_warnings(tmp_path: Path) -> None:
    displacement, force = _loop()
    path = tmp_path / "a loop.csv"
    np.savetxt(path, np.column_stack([1e3 * displacement, force]), delimiter=",", header="x [mm],F [N]", comments="")
    result = identify(path)
    built = build_fmu(result, tmp_path / "one")
    assert built.name == "a_loop.fmu"
    assert result.cautions
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        fmu = build_fmu(path, tmp_path / "two")
    assert [str(one.message) for one in said] == list(result.cautions)
    assert fmu.read_bytes() == built.read_bytes()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"backend": "cobol"}, '`backend` must be "native" or "python"'),
        ({"backend": "python", "states": True}, '`backend` must be "native" or "python", and "native" with `states`'),
        ({"needs_execution_tool": True}, "is for the Python-backed FMU"),
        ({"platforms": "amiga"}, "'amiga'"),
        ({"zero": "left"}, "`zero` must be"),
        ({"author": "a\n"}, "must be printable text of at most 200"),
        ({"name": "../up"}, "name must be"),
        ({"folder": "file"}, "file cannot be written: it is a file; give a folder"),
        ({"folder": "file/dist"}, "file/dist cannot be written: file is not a folder"),
    ],
)
def test_options_are_checked_before_records_are_identified(
    options: dict[str, object], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("kept")
    # A record that cannot even be read.
    with pytest.raises(StrandspringError, match=told):
        build_fmu("missing.csv", **options)  # type: ignore[arg-type]
    assert [path.name for path in Path().iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (["--zero", "left"], 2, "--zero must be `rig`, `middle` or a displacement of the record in mm, got 'left'."),
        (["--models", "file"], 1, "file cannot be written: it is a file; give a folder"),
        (["-o", "file"], 1, "file cannot be written: it is a file; give a folder"),
        (["-o", "file/dist"], 1, "file/dist cannot be written: file is not a folder"),
        (["--author", "a\nb"], 2, "must be printable text"),
    ],
)
def test_the_command_checks_before_it_reads(arguments: list[str], status: int, told: str, terminal: Terminal) -> None:
    Path("file").write_text("kept")
    terminal("build", "missing.csv", *arguments, status=status)
    assert told in terminal.err
    assert sorted(path.name for path in Path().iterdir()) == ["file", "mount.json"]


def test_an_fmu_that_fails_its_check_is_not_put_in_place(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    build_fmu("mount.json")
    kept = Path("dist/mount.fmu").read_bytes()

    def fail(path: Path) -> CheckReport:
        return CheckReport(path, ("It answers nonsense.",))

    monkeypatch.setattr(building, "examine_fmu", fail)
    with pytest.raises(BuildError, match=r"dist/mount\.fmu was not written, because the FMU failed its check: It ans"):
        build_fmu(replace(Spring.load("mount.json").model, description="another"))
    terminal("build", "mount.json", "--backend", "both", "-o", "new", status=1)
    assert "new/mount.fmu was not written, because the FMU failed its check: It answers nonsense." in terminal.err
    assert Path("dist/mount.fmu").read_bytes() == kept
    assert [path.name for path in Path("dist").iterdir()] == ["mount.fmu"]
    assert sorted(path.name for path in Path().iterdir()) == ["dist", "mount.json"]


def test_nothing_is_put_in_place_unless_all_are_good(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    examine = building.examine_fmu
    monkeypatch.setattr(
        building, "examine_fmu",
        lambda path: CheckReport(path, ("Bad.",)) if "python" in path.name else examine(path),
    )  # fmt: skip
    terminal("build", "mount.json", "--backend", "both", status=1)
    assert not Path("dist").exists()


def test_what_is_neither_model_nor_record_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="Records must be a path, a Record, a DataFrame or a list of these"):
        build_fmu(3.0, tmp_path)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match=r"missing\.json: no such file"):
        build_fmu(tmp_path / "missing.json", tmp_path)
