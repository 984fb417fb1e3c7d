"""`strandspring export`: SSP parameter values as other programs read them, and the command."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.ssp.ssd import ParameterSet, read_ssv

from fmu_tools import SPRING, built, instance, run_python, wandering_path
from springs import force_scale
from strandspring import Spring, SpringParameters
from strandspring.core.variables import spring_parameters, start_values, variables
from strandspring.exchange.modelica import record_text
from strandspring.fmu.description.ssv import parameter_values
from strandspring.model.coordinates import placed, zero_sentence
from strandspring.model.modelfile import ModelFile
from terminal import Terminal, unfolded

AWKWARD = "\"quoted\" 'single' <b>bold</b> &amp; ]]> <!-- \nnew line\ttab\rreturn äöü 弹簧 %s {{ 7*7 }}"
CONSTANT = SpringParameters((2.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
LONGEST = SpringParameters((0.0, 1e4, *[1e5] * 19), (1.0, *[1.0] * 8), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)


def parameter_set(folder: Path, parameters: SpringParameters, description: str = "") -> tuple[Path, ParameterSet]:
    """The SSV file of a spring, and what FMPy reads after checking it by the schema of SSP 1.0."""
    path = folder / "spring.ssv"
    path.write_text(parameter_values(ModelFile("spring", parameters, description)), encoding="utf-8", newline="\n")
    return path, read_ssv(str(path))


@pytest.mark.parametrize("parameters", [SPRING, CONSTANT, LONGEST], ids=["spring", "constant", "longest"])
def test_ssv_holds_all_that_can_be_set_with_every_bit(parameters: SpringParameters, tmp_path: Path) -> None:
    exact = replace(parameters, kE=(0.1 + 0.2, *parameters.kE[1:]), rho=100.0 + 1e-13)
    _, read = parameter_set(tmp_path, exact)
    table = [v for v in variables(len(exact.kE), len(exact.kA)) if v.causality in ("input", "parameter")]
    assert read.name == "spring"
    assert [(p.name, p.type, p.unit) for p in read.parameters] == [(v.name, "Real", v.unit) for v in table]
    values = {p.name: float(p.value) for p in read.parameters}
    assert values == start_values(exact)
    assert spring_parameters(values, len(exact.kE), len(exact.kA)) == exact


def test_ssv_applied_to_the_fmu_of_another_spring_makes_it_this_one(tmp_path: Path) -> None:
    other = SpringParameters((1.0, 2.0, 3.0, 4.0), (1.0, 0.0, 0.0), 1.0, 2.0, 0.6, 3.0, 0.0, -1.0, 1.0)
    _, read = parameter_set(tmp_path, SPRING)
    path = wandering_path(SPRING, 200, seed=4)
    with instance(built(tmp_path, other), tmp_path / "unpacked") as one:
        one.initialize(**{**{p.name: float(p.value) for p in read.parameters}, "displacement": path[0]})
        force = [one.step(x, "force")[0] for x in path]
    # The FMU and the vectorised path have one source and differ by rounding.
    assert force == pytest.approx(Spring(SPRING).response(path), abs=1e-12 * force_scale(SPRING, path))


def test_units_of_the_ssv_are_those_of_the_fmu(tmp_path: Path) -> None:
    path, read = parameter_set(tmp_path, SPRING)
    found = {}
    for unit in ElementTree.parse(path).getroot().iterfind("{*}Units/{*}Unit"):
        (base,) = unit
        found[unit.get("name")] = {symbol: int(power) for symbol, power in base.attrib.items()}
    assert set(found) == {p.unit for p in read.parameters}
    description = fmpy.read_model_description(str(built(tmp_path, SPRING)))
    of_fmu = {unit.name: unit.baseUnit for unit in description.unitDefinitions}
    for name, powers in found.items():
        for symbol in ("kg", "m", "s"):
            assert powers.get(symbol, 0) == getattr(of_fmu[name], symbol), name
        assert (of_fmu[name].factor, of_fmu[name].offset) == (1.0, 0.0)


def test_awkward_texts_reach_the_ssv_unchanged(tmp_path: Path) -> None:
    path, _ = parameter_set(tmp_path, SPRING, AWKWARD)
    assert ElementTree.parse(path).getroot().get("description") == AWKWARD


def test_same_model_same_text_in_other_processes() -> None:
    code = """
from fmu_tools import SPRING
from strandspring.exchange.modelica import record_text
from strandspring.fmu.description.ssv import parameter_values
from strandspring.model.modelfile import ModelFile
from terminal import Terminal
model = ModelFile("spring", SPRING, "described")
print(parameter_values(model), record_text(model, "spring", ""))
"""
    model = ModelFile("spring", SPRING, "described")
    expected = f"{parameter_values(model)} {record_text(model, 'spring', '')}\n"
    for seed in ("1", "2"):
        assert run_python(code, environment={**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC{seed}"}) == expected


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    """The command line in a folder with two model files."""
    monkeypatch.chdir(tmp_path)
    Spring(SPRING, "mount", "a mount").save("mount.json")
    Spring(SPRING, "model").save("model.json")
    return Terminal(capsys)


def files() -> set[str]:
    """Everything below the working folder but the model files."""
    found = {path.as_posix() for path in Path().rglob("*") if path.is_file()}
    return found - {"mount.json", "model.json"}


# Of the Modelica library; what else it holds is looked into by test_export_modelica.py.
RECORD = "StrandSpring/Records/mount.mo"


def test_files_go_to_dist_and_hold_what_was_made(terminal: Terminal) -> None:
    said = terminal("export", "mount.json", "--ssv", "--modelica")
    assert said == (
        "Displacement is counted from 25.5 mm of the record, as in the FMU.\n"
        f"SSP parameter values: {Path('dist/mount.ssv')}\n"
        f"Modelica library: {Path('dist/StrandSpring')}, record StrandSpring.Records.mount\n"
    )
    assert terminal.err == ""
    assert {"dist/mount.ssv", f"dist/{RECORD}", "dist/StrandSpring/package.mo"} < files()
    model, zero = placed(ModelFile("mount", SPRING, "a mount"), None)
    assert Path("dist/mount.ssv").read_bytes() == parameter_values(model).encode()
    assert Path(f"dist/{RECORD}").read_bytes() == record_text(model, "mount", zero_sentence(zero)).encode()


def test_displacement_is_counted_as_asked(terminal: Terminal) -> None:
    terminal("export", "mount.json", "--ssv", "--modelica", "--zero", "rig")
    assert "as in the record and in the FMU" in Path(f"dist/{RECORD}").read_text(encoding="utf-8")
    assert Path("dist/mount.ssv").read_bytes() == parameter_values(ModelFile("mount", SPRING, "a mount")).encode()


@pytest.mark.parametrize(
    ("arguments", "written"),
    [
        (["--ssv", "-o", "a/b.ssv"], {"a/b.ssv"}),
        (["--ssp", "--mass", "2", "-o", "a/b.ssp"], {"a/b.ssp"}),
        (["--ssv", "-o", "a.b/../new"], {"new/mount.ssv"}),
        (["--modelica", "-o", "lib"], {f"lib/{RECORD}"}),
        (["--modelica", "-o", "a.b"], {f"a.b/{RECORD}"}),
        (["--modelica", "--ssv", "-o", "."], {RECORD, "mount.ssv"}),
    ],
)
def test_the_output_is_a_folder_or_a_file(terminal: Terminal, arguments: list[str], written: set[str]) -> None:
    Path("a.b").mkdir()
    terminal("export", "mount.json", *arguments)
    before = {name: Path(name).read_bytes() for name in files()}
    assert written <= set(before)
    assert all(name in written or "StrandSpring/" in name for name in before)
    terminal("export", "mount.json", *arguments)
    assert {name: Path(name).read_bytes() for name in files()} == before


def test_another_spring_is_added_to_the_library(terminal: Terminal) -> None:
    terminal("export", "mount.json", "--modelica")
    before = {name: Path(name).read_bytes() for name in files()}
    terminal("export", "model.json", "--modelica")
    order = "dist/StrandSpring/Records/package.order"
    assert files() == {*before, "dist/StrandSpring/Records/_model.mo"}
    assert {name for name, content in before.items() if Path(name).read_bytes() != content} == {order}
    assert Path(order).read_text(encoding="utf-8").split() == ["SpringData", "StrandedWireMount", "_model", "mount"]


def test_c_sources_go_to_a_folder_of_their_own(terminal: Terminal) -> None:
    said = unfolded(terminal("export", "mount.json", "--c", "-o", "firmware"))
    law = Path("firmware/strandspring_c/mount_law.c")
    assert re.search(rf"\nC sources: {re.escape(str(law))} and what it needs; \d+ kB of constants\n$", said), said
    assert {str(law), str(law.with_name("strandspring.h")), str(law.with_name("mount_example.c"))} <= files()
    answer = json.loads(terminal("export", "mount.json", "--c", "--json"))
    assert answer["c"] == str(Path("dist/strandspring_c/mount_law.c"))
    terminal("export", "mount.json", "--c", "-o", "mount.c", status=2)
    assert "The C sources are a folder; -o must be a folder, got mount.c." in terminal.err


def test_json_lists_the_files_written(terminal: Terminal) -> None:
    answer = json.loads(terminal("export", "mount.json", "--ssv", "--json"))
    written = {"ssv": str(Path("dist/mount.ssv")), "ssp": None, "modelica": None, "c": None}
    assert answer == {"model": "mount.json", "name": "mount", "zero": 0.5 * (0.001 + 0.05), **written}
    answer = json.loads(terminal("export", "mount.json", "--modelica", "--json"))
    assert answer["modelica"] == str(Path("dist") / RECORD)


def test_a_record_name_that_differs_from_the_model_is_reported(terminal: Terminal) -> None:
    terminal("export", "model.json", "--modelica")
    assert "named _model, because model is taken in Modelica" in terminal.err


def test_another_package_of_that_name_is_left_alone(terminal: Terminal) -> None:
    Path("dist/StrandSpring").mkdir(parents=True)
    Path("dist/StrandSpring/package.mo").write_text("within ;\npackage Other\nend Other;\n", encoding="utf-8")
    assert terminal("export", "mount.json", "--ssv", "--modelica", status=1) == ""
    assert "is not a library that strandspring has written" in terminal.err
    assert files() == {"dist/StrandSpring/package.mo"}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ([], "--ssv"),
        (["--ssv", "-o", "values.xml"], ".ssv"),
        (["--ssv", "-o", "mount.json"], ".ssv"),
        (["--modelica", "-o", "mount.mo"], "must be a folder, got mount.mo"),
        (["--modelica", "--ssv", "-o", "mount.ssv"], "must be a folder, got mount.ssv"),
        (["--modelica", "-o", "library"], "library is a Modelica package; give the folder that holds the library"),
        (["--ssp"], "--ssp and --mass KG go together"),
        (["--ssp", "--mass", "-2"], "'--mass': must be a finite number > 0 [kg], got -2."),
        (["--ssv", "--mass", "2"], "--ssp and --mass KG go together"),
        (["--ssp", "--mass", "2", "-o", "mount.ssv"], "ending in .ssp, got mount.ssv"),
        (["--fmi"], "--fmi"),
    ],
)
def test_wrong_usage_writes_nothing(terminal: Terminal, arguments: list[str], expected: str) -> None:
    model = Path("mount.json").read_bytes()
    Path("library").mkdir()
    Path("library/package.mo").touch()
    assert terminal("export", "mount.json", *arguments, status=2) == ""
    assert expected in " ".join(terminal.err.split())
    assert files() == {"library/package.mo"}
    assert Path("mount.json").read_bytes() == model


def test_bad_input_gets_one_sentence(terminal: Terminal) -> None:
    Path("bad.json").write_text("{}", encoding="utf-8")
    Path("plain").write_text("", encoding="utf-8")
    os.mkfifo("pipe.ssv")  # which `files` leaves out
    for arguments, expected in (
        (["bad.json", "--ssv"], "bad.json"),
        (["missing.json", "--modelica"], "missing.json"),
        (["mount.json", "--ssp", "--mass", "2", "--zero", "rig"], "outside the identified range from 1 to 50 mm"),
        (["mount.json", "--ssv", "-o", "plain/folder"], "cannot be written"),
        (["mount.json", "--ssv", "-o", f"{'x' * 300}.ssv"], "cannot be written"),
        (["mount.json", "--ssv", "-o", "pipe.ssv"], "pipe.ssv cannot be written: it is a folder or a device"),
    ):
        assert terminal("export", *arguments, status=1) == ""
        (refusal,) = terminal.err.strip().splitlines()
        assert refusal.startswith("strandspring: ")
        assert expected in refusal
    assert files() == {"bad.json", "plain"}


def test_help_has_examples(terminal: Terminal) -> None:
    assert "strandspring export spring.json --ssv --modelica -o dist" in terminal("export", "--help")
