"""What FMUs carry about themselves, what `verify` finds in those that were changed, and where they start."""

from __future__ import annotations

import hashlib
import io
import json
import re
import subprocess
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, contents_of
from forms import FORMS
from native_tools import Library, Native
from strandspring import Record, Spring, SpringParameters, export, identify, verify
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.errors import ModelError
from strandspring.fmu.archive import write_archive
from strandspring.fmu.checks.check import examine_fmu
from strandspring.fmu.checks.verification import verify_fmu
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import host_folder
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.fmu.related_files import HASHES, REFERENCE, RELATED, STIMULI
from strandspring.kernel.path import PathSolver
from strandspring.model.coordinates import placed
from strandspring.model.file_tables import Start
from strandspring.model.modelfile import MODEL_IN_FMU, ModelFile, load_model, save_model
from terminal import Terminal
from tools import program

pytestmark = pytest.mark.long


TUNED = ["kE[0]", "kE[1]", "kE[2]", "kE[3]", "kA[1]", "kA[2]", "ln kappa_omega", "ln rho", "ln sigma", "ln n"]
JOINT = {"parameters": TUNED, "root": [[0.0] * k + [0.05] for k in range(10)]}
UNCERTAINTY = {
    "interval_95": {"kappa_omega": [20.0, 23.0], "rho": [280.0, None], "sigma": [None, None], "n": [0.2, 0.25]},
    "joint": JOINT,
}
NOTICE = "documentation/licenses/license.txt"
MOUNT = ModelFile("mount", SPRING, "a mount", uncertainty=UNCERTAINTY)


@pytest.fixture(scope="module", params=["native", "fmi3", "python"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, author = tmp_path_factory.mktemp("papers"), "A. Engineer & Söhne"
    if request.param == "python":
        return build_python_fmu(MOUNT, folder, author=author)
    return build_native_fmu(MOUNT, folder, author=author, fmi=3 if request.param == "fmi3" else 2)


def edited(fmu: Path, folder: Path, edit: Callable[[dict[str, bytes]], object]) -> Path:
    """A copy whose files are edited."""
    contents = contents_of(fmu)
    edit(contents)
    write_archive(folder / "edited.fmu", contents)
    return folder / "edited.fmu"


def problems(fmu: Path) -> list[str]:
    return [finding.text for finding in verify_fmu(fmu) if finding.is_problem]


def test_the_papers_are_those_of_the_model(fmu: Path, tmp_path: Path) -> None:
    contents, description = contents_of(fmu), fmpy.read_model_description(str(fmu))
    assert (description.author, description.license) == ("A. Engineer & Söhne", "MIT")
    assert re.fullmatch(r"\d+\.\d+\.\d+\+[0-9a-f]{12}", description.version)
    assert (description.generationDateAndTime, float(description.defaultExperiment.tolerance)) == (None, 1e-6)
    related = list(ElementTree.fromstring(contents[f"{RELATED}/fmi-ls-manifest.xml"]).iter("Related"))
    assert {frozenset(one.attrib) for one in related} == {frozenset(("type", "source", "role", "description"))}
    sources, there = {one.get("source") for one in related}, {name for name in contents if name.startswith(RELATED)}
    assert {f"{RELATED}/{name}" for name in sources if name != f"../../{MODEL_IN_FMU}"} == there - {
        f"{RELATED}/fmi-ls-manifest.xml"
    }
    stimuli, reference = (
        np.genfromtxt(io.BytesIO(contents[name]), delimiter=",", names=True) for name in (STIMULI, REFERENCE)
    )
    spring, path = placed(MOUNT, None)[0].parameters, stimuli["displacement"]
    for name in ("force", "stiffness", "absorbed_energy"):
        assert reference[name] == pytest.approx(getattr(PathSolver(spring), name)(path), rel=1e-12, abs=1e-12)
    assert (path.min(), path.max()) == pytest.approx((spring.displacement_min, spring.displacement_max))
    ends: dict[str, dict[str, float]] = {"lower": {"kappa_omega": 20.0, "rho": 280.0, "n": 0.2}, "nominal": {}}
    ends["upper"] = {"kappa_omega": 23.0, "n": 0.25}
    for name, values in ends.items():
        table = ElementTree.fromstring(contents[f"{RELATED}/{name}.ssv"])
        given = {p.get("name"): float(p[0].get("value")) for p in table.iterfind("{*}Parameters/{*}Parameter")}  # type: ignore[arg-type]
        assert {key: given[key] for key in values} == values
        if description.fmiVersion == "2.0":
            with Native(Library(Path(fmpy.extract(str(fmu), unzipdir=str(tmp_path / name))))) as one:
                one.initialize(**given).advance(0.01)  # type: ignore[arg-type]
                found = one.get("force")
            expected = PathSolver(replace(spring, **values)).force(np.array([0.0, 0.01]))[-1]
            assert found == [pytest.approx(expected, rel=1e-12)]
        units = {one.get("name") for one in table.iterfind("{*}Units/{*}Unit")}
        assert units == {one.get("unit") for one in table.iter() if one.get("unit")}
    assert len({contents[f"{RELATED}/drawn_{k}.ssv"] for k in (1, 2, 3)}) == 3
    assert json.loads(contents[f"{RELATED}/uncertainty.json"]) == UNCERTAINTY
    assert load_model(fmu) == MOUNT
    save_model(tmp_path / "model.json", load_model(fmu))
    assert (tmp_path / "model.json").read_bytes() == contents[MODEL_IN_FMU]
    for provenance, stated in (
        ({"author": "B. Tester", "date": "2026-11-25"}, ("B. Tester", "2026-11-25T00:00:00Z")),
        ({"author": ["B"], "date": "last spring"}, (None, None)),
    ):
        dated = fmpy.read_model_description(str(build_native_fmu(replace(MOUNT, provenance=provenance), tmp_path)))
        assert (dated.author, dated.generationDateAndTime) == stated
    with pytest.raises(ModelError, match="its lower ends are no spring: `n` must be within"):
        build_native_fmu(replace(MOUNT, uncertainty={"interval_95": {"n": [-1.0, 2]}}), tmp_path)


def test_verify_finds_good_what_is_good_and_any_change(fmu: Path, tmp_path: Path) -> None:
    found = verify_fmu(fmu)
    assert [finding.about for finding in found] == ["files", "rules", "spring", "run"]
    assert not any(finding.is_problem for finding in found)
    assert "The reference run is reproduced" in found[3].text
    names = [name for name in contents_of(fmu) if name != HASHES]
    kinds = ["modelDescription.xml", REFERENCE, STIMULI, "resources/", "documentation/index"]
    for kind in (*kinds, "sources/" if any(name.startswith("sources/") for name in names) else "binaries/"):
        name = next(name for name in names if name.startswith(kind))

        def flip(contents: dict[str, bytes], name: str = name) -> None:
            content = bytearray(contents[name])
            content[len(content) // 2] ^= 1
            contents[name] = bytes(content)

        said = verify_fmu(edited(fmu, tmp_path, flip))
        assert f"{name!a} has been changed, or its hash in {HASHES}." in [f.text for f in said if f.is_problem]
        assert "It was not run." in [f.text for f in said]
    assert problems(edited(fmu, tmp_path, lambda c: c.pop(NOTICE))) == [f"'{NOTICE}' is missing."]
    for content, says in (
        ({"resources/x.txt": b"x"}, f"'resources/x.txt' has been added: it is not in {HASHES}."),
        ({HASHES: b"["}, f"{HASHES} has been changed: it is no list of hashes."),
    ):
        assert problems(edited(fmu, tmp_path, lambda c, content=content: c.update(content))) == [says]  # type: ignore[misc]
    content = bytearray(fmu.read_bytes())
    with zipfile.ZipFile(fmu) as archive:
        entry = archive.getinfo("modelDescription.xml")
    content[entry.header_offset + 80 + entry.compress_size // 2] ^= 1
    (tmp_path / "damaged.fmu").write_bytes(content)
    assert len(problems(tmp_path / "damaged.fmu")) == 1
    for bad, says in ((b"", "It is not an FMU"), (b"PK\x03\x04junk", "It cannot be unpacked")):
        (tmp_path / "bad.fmu").write_bytes(bad)
        assert problems(tmp_path / "bad.fmu")[0].startswith(says)
        with pytest.raises(ModelError, match="cannot be read as an FMU"):
            load_model(tmp_path / "bad.fmu")


def test_binaries_from_the_sources_are_named_and_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program("cc", package="gcc libc6-dev")
    fmu = build_native_fmu(MOUNT, tmp_path)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path / "unpacked")
    # As the page of the FMU says.
    command = "cc -std=c11 -O2 -ffp-contract=off -fvisibility=hidden -fPIC -shared {} -lm -o {}"

    def compiled(source: str) -> bytes:
        subprocess.run(command.format(source, tmp_path / "x.so").split(), cwd=tmp_path / "unpacked", check=True)
        return (tmp_path / "x.so").read_bytes()

    (tmp_path / "abort.c").write_text("#include <stdlib.h>\n__attribute__((constructor)) void end(void) { abort(); }")
    here, ends = f"binaries/{host_folder()}/mount.so", "Its binary for this computer ends the process that runs it; "
    for content, said in (
        (compiled("sources/fmi2_all.c"), ""), (compiled("../abort.c"), ends), (b"no library", "It cannot be run: ")
    ):  # fmt: skip
        found = verify_fmu(edited(fmu, tmp_path, lambda c, content=content: c.update({here: content})))  # type: ignore[misc]
        assert found[0].text.startswith(
            f"'{here}' is not of this build: it has been compiled elsewhere, or is damaged;"
        )
        assert [f.text[: len(said)] for f in found if f.is_problem] == [said] * bool(said)
        assert ("The reference run is reproduced" in found[-1].text) == (not said)
    added = verify_fmu(edited(fmu, tmp_path, lambda c: c.update({"binaries/riscv64-linux/mount.so": b"x"})))
    assert not any(finding.is_problem for finding in added)
    assert "it is not run on this computer, so verify it on its own." in added[0].text
    # Nobody loads another one; a changed law is condemned whatever the binary.
    stray, law = here.replace("mount", "other"), "modelDescription.xml"
    assert problems(edited(fmu, tmp_path, lambda c: c.update({stray: b"x"})))[0].startswith(
        f"'{stray}' has been added:"
    )
    found = problems(edited(fmu, tmp_path, lambda c: c.update({here: b"x", law: c[law] + b" "})))
    assert found == [f"'{law}' has been changed, or its hash in {HASHES}."]
    # So is Python code that ends the process, even if the list of hashes has been made to fit.
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))

    def edit(contents: dict[str, bytes]) -> None:
        (slave,) = [name for name in contents if name.endswith("_slave.py")]
        contents[slave] = b"import os\nos.abort()\n"
        hashes = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items() if name != HASHES}
        contents[HASHES] = json.dumps(hashes).encode()

    assert problems(edited(build_python_fmu(MOUNT, tmp_path), tmp_path, edit)) == [f"{ends}build or compile it again."]
    assert list((tmp_path / "temporary").iterdir()) == []


def test_the_check_finds_other_rates_of_states_and_says_why_it_does_not_run(tmp_path: Path, monkeypatch: Any) -> None:
    """A description of another sigma than the binary's."""
    fmu = FORMS["states"].build(tmp_path)
    change = {"modelDescription.xml": contents_of(fmu)["modelDescription.xml"].replace(b'start="1.3"', b'start="1.4"')}
    (problem,) = examine_fmu(edited(fmu, tmp_path, lambda c: c.update(change))).problems
    assert "der(omega) differ" in problem
    assert verify(fmu).ok
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    report = examine_fmu(fmu)
    assert "riscv64" in str(report.not_run)
    assert (report.steps, report.summary) == (0, f"valid, but not run. {report.not_run}")


# Where a path starts

RUBBER = SpringParameters((1.4, 50.0), (1.0,), 0.9, 250.0, 0.8, 0.9, 0.01, 0.0, 0.02)
TIME = np.linspace(0.0, 3.0, 601)
STATE = Start(displacement=0.0, omega=-0.75, second_omega=0.25, branch_forces=[0.0], at_rest=False)
SECOND = Mechanism(kA=(1.0,), kappa_omega=9.0, rho=2500.0, sigma=0.8, n=1.7)
WHOLE = ModelFile("whole", replace(RUBBER, second=SECOND, branches=(MaxwellBranch(700.0, 0.03),)), start=STATE)


@pytest.mark.parametrize("name", ["co-simulation", "states", "fmi3", "python"])
def test_the_whole_recorded_state_starts_in_all_forms_and_exports(name: str, tmp_path: Path) -> None:
    form = FORMS[name]
    fmu = build_python_fmu(WHOLE, tmp_path) if form.python else build_native_fmu(WHOLE, tmp_path, **form.options)
    start = {v.name: v.start for v in fmpy.read_model_description(str(fmu)).modelVariables}
    names = ("omega", "second_omega") if form.has_states else ("omega_start", "second_omega_start")
    assert [float(start[one]) for one in names] == [-0.75, 0.25]
    assert examine_fmu(fmu).problems == ()  # binary and description begin alike
    if name == "co-simulation":
        ssv, modelica = export(Spring.from_model(WHOLE), tmp_path, ssv=True, modelica=True)
        for one, value in (("omega_start", "-0.75"), ("second_omega_start", "0.25")):
            text = ssv.read_text(encoding="utf-8").split(f'name="{one}"')[1].split("</ssv:Parameter>")[0]
            assert f'value="{value}"' in text
            assert f"    {one}={value}" in modelica.read_text(encoding="utf-8")


def test_the_command_checks_the_fmu_along_its_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    terminal, swing = Terminal(capsys), 0.01 - 0.01 * np.cos(2.0 * np.pi * TIME)
    Record(swing, Spring(RUBBER).response(swing, omega_start=-0.4), TIME).save("rubber.csv")
    model = identify("rubber.csv").model_file("rubber")
    save_model("rubber.json", model)
    told = terminal("build", "rubber.json", "--record", "rubber.csv", "--backend", "both", "-o", "model")
    assert " ".join(told.split()).count("RNL as stated along rubber.csv") == 2
    content = json.loads(model.to_json())
    content["fit"]["records"][0]["rnl"] -= 2e-6
    Path("other.json").write_text(json.dumps(content), encoding="utf-8")
    terminal("build", "other.json", "--record", "rubber.csv", "-o", "other", status=1)
    assert "RNL along rubber.csv must be " in terminal.err
    assert not Path("other").exists()
