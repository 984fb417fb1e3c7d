"""`build --fmi 3` and the flags of the real-time profile: what goes together, what is refused, what is inherited."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmu_tools import SPRING
from strandspring import Spring, build_fmu
from strandspring.api.common.model_source import built_with
from strandspring.api.fmus.building import BuildOptions
from strandspring.errors import BuildError
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.modelfile import ModelFile, save_model
from terminal import Terminal, unfolded

MODEL = ModelFile("spring", SPRING)

# Arguments of the command and of the function, and what the refusal says.
REFUSED: list[tuple[list[str], dict[str, Any], str]] = [
    (["--fmi", "3", "--backend", "python"], {"fmi": 3, "backend": "python"}, "FMI 3.0 is for the native FMU"),
    (["--real-time", "--backend", "python"], {"real_time": True, "backend": "python"}, "Real time is for the native"),
    (["--no-energy"], {"no_energy": True}, "Only an FMU for real time can leave out absorbed_energy"),
    (
        ["--no-energy", "--real-time", "--states"],
        {"no_energy": True, "real_time": True, "states": True},
        "absorbed_energy as a state",
    ),
]


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    """In a folder with spring.json and box.toml."""
    monkeypatch.chdir(tmp_path)
    save_model(Path("spring.json"), MODEL)
    Path("box.toml").write_text("[body]\n")
    return Terminal(capsys)


@pytest.mark.parametrize(("arguments", "options", "says"), REFUSED, ids=[" ".join(one[0]) for one in REFUSED])
def test_what_does_not_go_together_is_refused(
    arguments: list[str], options: dict[str, Any], says: str, terminal: Terminal
) -> None:
    terminal("build", "spring.json", *arguments, status=2)
    assert says in " ".join(terminal.err.split())
    with pytest.raises(BuildError, match=says):
        build_fmu(Spring(SPRING, "spring"), **options)
    assert not Path("dist").exists()


@pytest.mark.parametrize("option", ["--real-time", "--no-energy", "--states"])
def test_systems_have_no_other_forms(option: str, terminal: Terminal) -> None:
    terminal("build", "box.toml", "--fmi", "3", option, status=2)
    assert f"{option} can only be given with a model or records" in " ".join(terminal.err.split())


@pytest.mark.parametrize("option", ["real_time", "no_energy", "states"])
@pytest.mark.usefixtures("terminal")
def test_systems_have_no_other_forms_in_python_either(option: str) -> None:
    with pytest.raises(BuildError, match=f"^`{option}` cannot be given with a description of a system"):
        build_fmu("box.toml", fmi=3, **{option: True})


def test_other_versions_are_refused(terminal: Terminal) -> None:
    terminal("build", "spring.json", "--fmi", "1", status=2)
    assert "'1' is not one of '2', '3'" in terminal.err
    with pytest.raises(BuildError, match="The version of FMI must be 2 or 3, got 1"):
        build_fmu(Spring(SPRING, "spring"), fmi=1)  # type: ignore[arg-type]
    with pytest.raises(BuildError, match=r"The version of FMI must be 2 or 3, got 3\.0"):
        build_fmu(Spring(SPRING, "spring"), fmi=3.0)  # type: ignore[arg-type]


def test_settings_are_those_of_the_fmu_unless_others_are_asked_for(tmp_path: Path) -> None:
    fmu = build_native_fmu(MODEL, tmp_path, (), author="A", fmi=3, real_time=True, no_energy=True)
    same = BuildOptions(None).with_those_of(built_with(fmu))
    assert same == BuildOptions("native", "A", fmi=3, real_time=True, no_energy=True)
    changed = BuildOptions(None, "B", fmi=2).with_those_of(built_with(fmu))
    assert changed == BuildOptions("native", "B", False, 2, True, True)
    # Another back end takes the author only.
    for backend in ("python", "both"):
        other = BuildOptions(backend).with_those_of(built_with(fmu))
        assert other == BuildOptions(backend, "A")
        other.refuse_impossible(("python",))
    python = build_python_fmu(MODEL, tmp_path)
    with pytest.raises(BuildError, match="choose the native back end"):
        build_fmu(python, tmp_path / "dist", fmi=3)


def test_arrays_stay_as_long_as_the_version_has_them(tmp_path: Path) -> None:
    before = built_with(build_native_fmu(MODEL, tmp_path, (), fmi=3, arrays=True))
    assert BuildOptions().with_those_of(before) == BuildOptions("native", fmi=3, arrays=True)
    older = BuildOptions(fmi=2).with_those_of(before)
    assert older == BuildOptions("native", fmi=2)
    older.refuse_impossible(("native",))
    with pytest.raises(BuildError, match=r"^Arrays are for FMI 3\.0"):
        BuildOptions(fmi=2, arrays=True).with_those_of(before).refuse_impossible(("native",))


def test_an_fmu_of_before_has_the_settings_of_fmi_2(tmp_path: Path) -> None:
    fmu = build_native_fmu(MODEL, tmp_path, ())
    assert BuildOptions(None).with_those_of(built_with(fmu)) == BuildOptions("native", "", False, 2, False, False)


def test_what_was_built_says_that_it_is_for_real_time(terminal: Terminal) -> None:
    """The names of the files do not."""
    terminal("build", "spring.json", "--platform", "host", "--real-time")
    assert ", for real time)" in terminal.out
    terminal("build", "spring.json", "--platform", "host", "--real-time", "--no-energy", "--fmi", "3")
    assert ", FMI 3.0, for real time without absorbed_energy)" in unfolded(terminal.out)
    terminal("build", "spring.json", "--platform", "host", "--fmi", "3", "--json")
    (usual,) = json.loads(terminal.out)["fmus"]
    assert (usual["fmi"], usual["real_time"], usual["no_energy"]) == (3, False, False)


def test_flags_of_other_libraries_are_stored_as_ours(tmp_path: Path) -> None:
    flag: Any = np.True_
    fmu = build_fmu(Spring(SPRING, "spring"), tmp_path, real_time=flag, no_energy=flag, platforms="host")
    assert BuildOptions(None).with_those_of(built_with(fmu)) == BuildOptions("native", "", False, 2, True, True)
