"""Where displacement is counted from."""

from __future__ import annotations

import json
import math
import zipfile
from dataclasses import replace
from pathlib import Path

import click
import fmpy
import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, instance
from springs import TABLE
from strandspring.cli.shared.zero import given_zero
from strandspring.errors import StrandspringError
from strandspring.kernel.path import PathSolver
from strandspring.model.coordinates import chosen_zero, counted_from, sensible_zero
from strandspring.model.modelfile import ModelFile, save_model
from terminal import Terminal

MIDDLE = 0.5 * (SPRING.displacement_min + SPRING.displacement_max)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    save_model("mount.json", ModelFile("mount", SPRING))
    return Terminal(capsys)


def test_the_rig_s_zero_counts_if_it_lies_within_the_range() -> None:
    assert sensible_zero(OTHER) == 0.0
    assert sensible_zero(replace(SPRING, displacement_min=0.0)) == 0.0
    assert sensible_zero(SPRING) == MIDDLE


@pytest.mark.parametrize(("choice", "zero"), [(None, MIDDLE), ("rig", 0.0), ("middle", MIDDLE), (-0.0125, -0.0125)])
def test_choices(choice: str | float | None, zero: float) -> None:
    assert chosen_zero(choice, SPRING) == pytest.approx(zero, rel=1e-15)


@pytest.mark.parametrize(("text", "choice"), [("rig", "rig"), ("middle", "middle"), ("-12.5", -0.0125)])
def test_texts(text: str, choice: str | float) -> None:
    assert given_zero(None, None, text) == choice  # type: ignore[arg-type]


@pytest.mark.parametrize("choice", ["", "Rig", "nan", "inf", "1e13", "12 mm"])
def test_other_choices_are_refused(choice: str) -> None:
    with pytest.raises(click.BadParameter, match=r"--zero must be `rig`, `middle` or a displacement of the record"):
        given_zero(None, None, choice)  # type: ignore[arg-type]
    with pytest.raises(StrandspringError, match=r'`zero` must be "rig", "middle" or a displacement of the record'):
        chosen_zero(choice, SPRING)


@pytest.mark.parametrize("choice", [math.nan, math.inf, 1e10])
def test_numbers_that_are_no_displacement_are_refused(choice: float) -> None:
    with pytest.raises(StrandspringError, match=r'`zero` must be "rig", "middle" or a displacement of the record'):
        chosen_zero(choice, SPRING)


@pytest.mark.parametrize("spring", [SPRING, OTHER, TABLE])
@pytest.mark.parametrize("zero", [-0.3, 0.0123456789, 0.27])
def test_the_force_is_the_same(spring: object, zero: float) -> None:
    path = np.linspace(spring.displacement_min - 0.01, spring.displacement_max + 0.01, 50)
    path = np.concatenate([path, path[::-1]])
    expected = PathSolver(spring).force(path)
    found = PathSolver(counted_from(zero, spring)).force(path - zero)
    # Differences of the order of 0.3 m are rounded to 5e-17 m; the steepest spring has some 1e5 N/m.
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10)


def test_a_range_lost_in_rounding_is_refused() -> None:
    narrow = replace(SPRING, displacement_min=0.02 - 1e-9, displacement_max=0.02 + 1e-9)
    with pytest.raises(StrandspringError, match=r"Counted from 1e\+12 mm, .* is lost in rounding"):
        counted_from(1e9, narrow)


@pytest.mark.parametrize("backend", ["native", "python"])
def test_an_fmu_starts_at_the_zero_that_its_page_names(backend: str, terminal: Terminal, tmp_path: Path) -> None:
    said = terminal("build", "mount.json", "--backend", backend)
    assert "Displacement is counted from 25.5 mm of the record, as in the FMU." in said
    fmu = Path("dist/mount.fmu" if backend == "native" else "dist/mount_python.fmu")
    start = {v.name: v.start for v in fmpy.read_model_description(str(fmu)).modelVariables}
    assert float(start["displacement"]) == 0.0
    assert float(start["displacement_min"]) == pytest.approx(-0.0245, rel=1e-12)
    with instance(fmu, tmp_path / "unpacked") as one:
        assert "is 25.5 mm of the record" in (tmp_path / "unpacked/documentation/index.html").read_text()
        one.initialize(displacement=0.0)
        assert one.step(0.005, "force") == pytest.approx(
            PathSolver(SPRING).force(np.array([MIDDLE, MIDDLE + 0.005]))[-1:], rel=1e-12
        )


def test_the_page_adds_a_zero_below_that_of_the_record(terminal: Terminal) -> None:
    terminal("build", "mount.json", "--zero", "-20")
    with zipfile.ZipFile("dist/mount.fmu") as fmu:
        page = " ".join(fmu.read("documentation/index.html").decode().split())
    assert "is -20 mm of the record from which the spring was identified: FMU = record + 0.02" in page


def test_an_fmu_s_own_zero_is_kept(terminal: Terminal) -> None:
    terminal("build", "mount.json", "--zero", "10")
    for command in (["isolate", "dist/mount.fmu", "--mass", "20"], ["info", "dist/mount.fmu"]):
        assert json.loads(terminal(*command, "--json"))["zero"] == 0.01
        assert json.loads(terminal(*command, "--json", "--zero", "rig"))["zero"] == 0.0


def test_isolate_info_and_study_count_as_the_fmu_does(terminal: Terminal) -> None:
    for command in (["isolate", "mount.json", "--mass", "20"], ["info", "mount.json"]):
        shifted, own = (json.loads(terminal(*command, "--json", "--zero", zero)) for zero in ("middle", "rig"))
        assert (shifted["zero"], own["zero"]) == (pytest.approx(MIDDLE), 0.0)
        if "static_equilibrium" in own:
            assert shifted["static_equilibrium"]["displacement"] == pytest.approx(
                own["static_equilibrium"]["displacement"] - MIDDLE, abs=1e-12
            )
            assert shifted["static_equilibrium"]["frequency"] == pytest.approx(
                own["static_equilibrium"]["frequency"], rel=1e-9
            )
        else:
            assert shifted["loops"][0]["low"] == pytest.approx(own["loops"][0]["low"] - MIDDLE, abs=1e-12)
            assert shifted["loops"][0]["energy_per_cycle"] == pytest.approx(own["loops"][0]["energy_per_cycle"])
        assert "counted from 25.5 mm of the record" in terminal(*command)
    terminal("info", "mount.json", "--zero", "left", status=2)
    assert "--zero must be `rig`, `middle` or a displacement of the record in mm, got 'left'." in terminal.err
