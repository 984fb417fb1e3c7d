"""FMUs of FMI 3.0 as files: terminal, sources and build description, platforms, papers, reproducible bytes."""

from __future__ import annotations

import hashlib
import json
import os
import re
import zipfile
from dataclasses import replace
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import pytest
from lxml import etree

from fmu_tools import SPRING, run_python
from springs import TABLE
from strandspring.compiled.images import FMU
from strandspring.compiled.targets import LINUX_X86, MACOS_ARM, MACOS_X86
from strandspring.errors import BuildError, ModelError
from strandspring.fmu.description.fmi3_files import BUILD_DESCRIPTION, TERMINALS
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native import native_fmu, platforms
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.native.platforms import Platform, binaries, chosen_platforms, host_folder
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.fmu.related_files import BUILD, RELATED, BuildSettings, sealed
from strandspring.model.modelfile import ModelFile

MODEL = ModelFile("spring", SPRING)
# What a binary for macOS begins with.
IMAGE = bytes.fromhex("cffaedfe") + bytes(28)
SCHEMAS = Path(str(files("fmpy"))) / "schema" / "fmi3"


FORMS: dict[str, dict[str, bool]] = {"usual": {}, "states": {"with_states": True}, "arrays": {"arrays": True}}


@pytest.fixture(scope="module", params=FORMS)
def contents(request: pytest.FixtureRequest) -> dict[str, bytes]:
    return native_contents(MODEL, (), fmi=3, **FORMS[request.param])


def schema_errors(name: str, content: bytes) -> list[str]:
    schema = etree.XMLSchema(file=str(SCHEMAS / f"{name}.xsd"))
    schema.validate(etree.parse(BytesIO(content)))
    return [str(entry.message) for entry in schema.error_log]


@pytest.mark.parametrize(
    ("schema", "path"),
    [
        ("fmi3ModelDescription", "modelDescription.xml"),
        ("fmi3TerminalsAndIcons", TERMINALS),
        ("fmi3BuildDescription", BUILD_DESCRIPTION),
    ],
)
def test_schemas(schema: str, path: str, contents: dict[str, bytes]) -> None:
    assert schema_errors(schema, contents[path]) == []
    # What the schema is not of, it refuses.
    assert schema_errors("fmi3LayeredStandardManifest", contents[path])


def test_the_terminal_is_a_flange_of_variables_that_are_there(contents: dict[str, bytes]) -> None:
    description = fmpy.read_model_description(archive(contents))
    causalities = {v.name: v.causality for v in description.modelVariables}
    root = ElementTree.fromstring(contents[TERMINALS])
    # The standard asks for the version of the model description, and for icons beside the file.
    assert root.get("fmiVersion") == description.fmiVersion
    (terminal,) = root.iter("Terminal")
    assert terminal.get("name") == "flange"
    # By plug, members match by their names, which must be there and unique.
    assert terminal.get("matchingRule") == "plug"
    *members, graphics = terminal
    assert [(m.get("memberName"), m.get("variableName"), m.get("variableKind")) for m in members] == [
        ("s", "displacement", "signal"), ("f", "force", "inflow"),
    ]  # fmt: skip
    for name in ("icon", graphics.get("iconBaseName")):
        assert contents[f"terminalsAndIcons/{name}.png"].startswith(b"\x89PNG")
        assert ElementTree.fromstring(contents[f"terminalsAndIcons/{name}.svg"]).tag.endswith("}svg")
    # Both kinds are restricted to these causalities.
    assert {causalities[str(m.get("variableName"))] for m in members} <= {"input", "output", "parameter"}


def test_only_files_of_fmi_3(contents: dict[str, bytes]) -> None:
    allowed = {"documentation", "terminalsAndIcons", "sources", "binaries", "resources", "extra"}
    assert {name.split("/")[0] for name in contents} - {"modelDescription.xml"} <= allowed
    assert "documentation/index.html" in contents
    # Importers bring the headers of FMI.
    assert not [name for name in contents if name.startswith("sources/fmi3Func") or "PlatformTypes" in name]
    assert b"2-Clause BSD" in contents["documentation/licenses/fmi-headers.txt"]


def test_build_description_lists_what_is_there(contents: dict[str, bytes]) -> None:
    identifier = fmpy.read_model_description(archive(contents)).modelExchange.modelIdentifier
    root = ElementTree.fromstring(contents[BUILD_DESCRIPTION])
    platforms = [one.get("platform") for one in root]
    assert platforms == [None, "x86_64-linux", "aarch64-linux"]
    assert {one.get("modelIdentifier") for one in root} == {identifier}
    assert {one.get("name") for one in root.iter("SourceFile")} == {"fmi3_all.c"}
    assert {one.get("language") for one in root.iter("SourceFileSet")} == {"C11"}


def archive(contents: dict[str, bytes]) -> Any:
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as written:
        for name, content in contents.items():
            written.writestr(name, content)
    file.seek(0)
    return file


def test_documentation_is_that_of_fmi_3(contents: dict[str, bytes]) -> None:
    page = contents["documentation/index.html"].decode()
    assert "FMI 3.0 FMU" in page
    assert "fmi2" not in page
    assert "darwin64" not in page
    for told in ("flange", "fmpy compile spring_fmi3", "buildDescription.xml", "kE", "sources/fmi3_all.c"):
        assert told in page, told
    has_arrays = "<td>3, 11000, -20000, 1000000</td>" in page.replace(' class="number"', "")
    assert has_arrays == ("<h2>Arrays</h2>" in page) == json.loads(contents[BUILD])["arrays"]
    table = native_contents(ModelFile("table", TABLE), (), fmi=3, arrays=True)["documentation/index.html"].decode()
    assert "FE_knots and FE_forces" in table
    less = native_contents(MODEL, (), fmi=3, real_time=True, no_energy=True)["documentation/index.html"].decode()
    assert "<td>absorbed_energy</td>" in page
    assert "<td>absorbed_energy</td>" not in less


@pytest.mark.parametrize("fmi", [2, 3])
def test_documentation_tells_that_derivatives_of_the_energy_are_refused(fmi: int) -> None:
    told = "absorbed_energy with respect to displacement is the force; with respect to parameters it is refused"
    pages = [
        " ".join(native_contents(MODEL, (), fmi=fmi, **form)["documentation/index.html"].decode().split())
        for form in ({}, {"real_time": True, "no_energy": True}, {"with_states": True})
    ]
    assert [told in page for page in pages] == [True, False, False]


def test_documentation_names_the_folders_of_binaries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms, "contents", lambda _unit, targets: dict.fromkeys(targets, IMAGE))
    monkeypatch.setattr(native_fmu, "filled", lambda image, *_: image)
    contents = native_contents(MODEL, chosen_platforms("darwin64,win64"), fmi=3)
    page = contents["documentation/index.html"].decode()
    assert "binaries for aarch64-darwin, x86_64-darwin, x86_64-windows." in page
    assert sorted(name for name in contents if name.startswith("binaries/")) == [
        "binaries/aarch64-darwin/spring_fmi3.dylib", "binaries/x86_64-darwin/spring_fmi3.dylib",
        "binaries/x86_64-windows/spring_fmi3.dll",
    ]  # fmt: skip


def test_folders_of_platforms() -> None:
    everything = chosen_platforms("all")
    folders = [folder for platform in everything for folder in platform.folders(3)]
    assert sorted(set(folders)) == [
        "aarch64-darwin", "aarch64-linux", "x86_64-darwin", "x86_64-linux", "x86_64-windows",
    ]  # fmt: skip
    assert all(len(targets) == 1 for platform in everything for targets in platform.folders(3).values())
    assert host_folder(3) == fmpy.platform_tuple
    assert host_folder() in {platform.name for platform in everything}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("x86_64-linux", [Platform("linux64", (LINUX_X86,))]),
        ("linux64,x86_64-linux", [Platform("linux64", (LINUX_X86,))]),
        ("x86_64-darwin", [Platform("darwin64", (MACOS_X86,))]),
        ("darwin64,x86_64-darwin", [Platform("darwin64", (MACOS_X86, MACOS_ARM))]),
        ("x86_64-darwin,darwin64", [Platform("darwin64", (MACOS_X86, MACOS_ARM))]),
    ],
)
def test_names_of_platforms_by_fmi_3(given: str, expected: list[Platform]) -> None:
    assert list(chosen_platforms(given)) == expected


def test_unknown_platforms_are_refused() -> None:
    with pytest.raises(BuildError, match="must be `host`, `all` or one of linux64"):
        chosen_platforms("x86_64-macos")


def test_parameter_sets_are_of_ssp_2(contents: dict[str, bytes]) -> None:
    root = ElementTree.fromstring(contents[f"{RELATED}/nominal.ssv"])
    assert root.get("version") == "2.0"
    found = {}
    for parameter in root.iterfind("{*}Parameters/{*}Parameter"):
        value = parameter.find("{*}Float64")
        dimension = parameter.find("{*}Dimension")
        numbers = [float(text) for text in str(value.get("value")).split()]
        assert dimension is None or int(str(dimension.get("size"))) == len(numbers)
        found[parameter.get("name")] = numbers
    for name in ("kE", "kA"):
        singly = [number for key, (number, *_) in found.items() if key.startswith(f"{name}_")]
        assert found.get(name, singly) == list(getattr(SPRING, name))
    assert found["rho"] == [SPRING.rho]
    description = fmpy.read_model_description(archive(contents))
    assert found.keys() == {v.name for v in description.modelVariables if v.start is not None}
    units = {one.get("name") for one in root.iterfind("{*}Units/{*}Unit")}
    assert units == {one.get("unit") for one in root.iter() if one.get("unit")}
    assert "Real" in parameter_values(MODEL)


def test_settings_are_stored_and_come_back(contents: dict[str, bytes], tmp_path: Path) -> None:
    assert json.loads(contents[BUILD])["fmi"] == 3
    fmu = build_native_fmu(MODEL, tmp_path, (), zero=0.0, author="A", fmi=3, real_time=True, no_energy=True)
    settings = BuildSettings.of_fmu(fmu)
    assert settings == BuildSettings("native", 0.0, "A", fmi=3, real_time=True, no_energy=True)


@pytest.mark.parametrize("wrong", [{"fmi": 4}, {"fmi": True}, {"fmi": "3"}, {"real_time": 1}, {"no_energy": None}])
def test_damaged_settings_are_refused(wrong: dict[str, Any], tmp_path: Path) -> None:
    contents = native_contents(MODEL, (), fmi=3)
    contents[BUILD] = json.dumps({**json.loads(contents[BUILD]), **wrong}).encode()
    path = tmp_path / "damaged.fmu"
    path.write_bytes(archive(sealed(contents)).read())
    with pytest.raises(ModelError, match="is damaged; build the FMU from its model file again"):
        BuildSettings.of_fmu(path)


def test_same_bytes_in_other_processes(tmp_path: Path) -> None:
    code = """
import sys
from pathlib import Path
from fmu_tools import SPRING
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.modelfile import ModelFile
for states in (False, True):
    build_native_fmu(ModelFile("spring", SPRING), Path(sys.argv[1]), (), with_states=states, fmi=3)
"""
    found = set()
    for seed in ("1", "2"):
        folder = tmp_path / seed
        run_python(code, folder, environment={**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC{seed}"})
        names = ("spring_fmi3.fmu", "spring_fmi3_states.fmu")
        found.add(tuple(hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names))
    assert len(found) == 1


def test_forms_and_versions_have_identifiers_of_their_own(tmp_path: Path) -> None:
    paths = [build_native_fmu(MODEL, tmp_path, (), with_states=s, fmi=fmi) for s in (False, True) for fmi in (2, 3)]
    paths.append(build_python_fmu(MODEL, tmp_path))
    descriptions = [fmpy.read_model_description(str(path)) for path in paths]
    assert len({d.guid for d in descriptions}) == len({d.modelName for d in descriptions[:4]}) + 1 == 5
    assert {path.stem for path in paths[:4]} == {d.modelName for d in descriptions[:4]}


def test_binaries_lie_where_each_version_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms, "contents", lambda _unit, targets: dict.fromkeys(targets, IMAGE))
    chosen = chosen_platforms("darwin64,win64")
    assert sorted(binaries("x", chosen, FMU)) == ["binaries/darwin64/x.dylib", "binaries/win64/x.dll"]
    assert sorted(binaries("x", chosen, FMU, fmi=3)) == [
        "binaries/aarch64-darwin/x.dylib", "binaries/x86_64-darwin/x.dylib", "binaries/x86_64-windows/x.dll",
    ]  # fmt: skip


@pytest.mark.parametrize(("fmi", "with_states", "longest"), [(2, True, 57), (3, False, 59), (3, True, 52)])
def test_names_leave_room_for_the_ending(fmi: int, with_states: bool, longest: int) -> None:
    native_contents(replace(MODEL, name="a" * longest), (), with_states=with_states, fmi=fmi)
    with pytest.raises(BuildError, match=f"is too long for an FMU; give the model a name of at most {longest} char"):
        native_contents(replace(MODEL, name="a" * (longest + 1)), (), with_states=with_states, fmi=fmi)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("with_states", [False, True])
def test_the_page_calls_the_fmus_by_the_names_of_their_files(with_states: bool, fmi: int, tmp_path: Path) -> None:
    page = native_contents(MODEL, (), with_states=with_states, fmi=fmi)["documentation/index.html"].decode()
    own, other = (
        build_native_fmu(MODEL, tmp_path, (), zero=0.0, with_states=states, fmi=fmi).stem
        for states in (with_states, not with_states)
    )
    assert set(re.findall(r"[\w.]+(?=\.fmu\b)", page)) == ({own} if with_states else {own, other})
    assert re.findall(r"-o ([\w.]+)\.so\b", page) == [own]
