"""What FMUs carry about themselves, and what `strandspring verify` finds."""

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
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, instance
from strandspring.errors import ModelError
from strandspring.fmu.checks.verification import verify_fmu
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import host_folder
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.fmu.related_files import HASHES, REFERENCE, RELATED, STIMULI
from strandspring.kernel.path import PathSolver
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import MODEL_IN_FMU, ModelFile, load_model, save_model
from terminal import Terminal
from tools import program

JOINT = {
    "parameters": [
        "kE[0]", "kE[1]", "kE[2]", "kE[3]", "kA[1]", "kA[2]", "ln kappa_omega", "ln rho", "ln sigma", "ln n"
    ],
    "root": [[0.0] * k + [0.05] for k in range(10)],
}  # fmt: skip
UNCERTAINTY = {
    "interval_95": {"kappa_omega": [20.0, 23.0], "rho": [280.0, None], "sigma": [None, None], "n": [0.2, 0.25]},
    "joint": JOINT,
}
MODEL = ModelFile("mount", SPRING, "a mount", uncertainty=UNCERTAINTY)
BUILDERS: dict[str, Callable[..., Path]] = {"native": build_native_fmu, "python": build_python_fmu}


@pytest.fixture(scope="module", params=BUILDERS)
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return BUILDERS[request.param](MODEL, tmp_path_factory.mktemp("papers"), author="A. Engineer & Söhne")


def read(fmu: Path, name: str) -> bytes:
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(name)


def edited(fmu: Path, folder: Path, edit: Callable[[dict[str, bytes]], None]) -> Path:
    """A copy whose files are edited."""
    with zipfile.ZipFile(fmu) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    edit(contents)
    copy = folder / "edited.fmu"
    with zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return copy


def problems(fmu: Path) -> list[str]:
    return [finding.text for finding in verify_fmu(fmu) if finding.is_problem]


def table(content: bytes) -> np.ndarray:
    return np.genfromtxt(io.BytesIO(content), delimiter=",", names=True)


def test_the_description_names_author_version_and_tolerance(
    fmu: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    description = fmpy.read_model_description(str(fmu))
    assert description.author == "A. Engineer & Söhne"
    assert re.fullmatch(r"0\.1\.0\+[0-9a-f]{12}", description.version)
    assert description.license == "MIT"
    assert description.copyright
    assert description.generationDateAndTime is None
    assert float(description.defaultExperiment.tolerance) == 1e-6
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    dated = fmpy.read_model_description(str(build_native_fmu(MODEL, tmp_path)))
    assert (dated.generationDateAndTime, dated.author) == ("1970-01-02T00:00:00Z", None)


def test_the_model_file_may_state_author_and_date(tmp_path: Path) -> None:
    stated = replace(MODEL, provenance={"author": "B. Tester", "date": "2026-11-25"})
    description = fmpy.read_model_description(str(build_native_fmu(stated, tmp_path)))
    assert (description.author, description.generationDateAndTime) == ("B. Tester", "2026-11-25T00:00:00Z")
    unfit = replace(MODEL, provenance={"author": ["B"], "date": "last spring"})
    description = fmpy.read_model_description(str(build_native_fmu(unfit, tmp_path)))
    assert (description.author, description.generationDateAndTime) == (None, None)


def test_every_related_file_is_in_the_manifest_and_there(fmu: Path) -> None:
    manifest = ElementTree.fromstring(read(fmu, f"{RELATED}/fmi-ls-manifest.xml"))
    namespace = "{http://fmi-standard.org/fmi-ls-manifest}"
    assert manifest.get(f"{namespace}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    sources = {one.get("source") for one in manifest.iter("Related")}
    with zipfile.ZipFile(fmu) as archive:
        there = {name.removeprefix(f"{RELATED}/") for name in archive.namelist() if name.startswith(RELATED)}
    assert sources - {f"../../{MODEL_IN_FMU}"} == there - {"fmi-ls-manifest.xml"}
    experiment = ElementTree.fromstring(read(fmu, f"{RELATED}/experiments.exp")).find("Experiment")
    assert [element.get("source") for element in experiment] == ["stimuli.csv", "reference.csv"]


def test_the_reference_is_the_response_of_the_model(fmu: Path) -> None:
    stimuli, reference = table(read(fmu, STIMULI)), table(read(fmu, REFERENCE))
    spring = placed(MODEL, None)[0].parameters
    np.testing.assert_array_equal(reference["time"], stimuli["time"])
    for name, law in (("force", "force"), ("stiffness", "stiffness"), ("absorbed_energy", "absorbed_energy")):
        expected = getattr(PathSolver(spring), law)(stimuli["displacement"])
        np.testing.assert_allclose(reference[name], expected, rtol=1e-12, atol=1e-12)
    reach = stimuli["displacement"].min(), stimuli["displacement"].max()
    assert reach == pytest.approx((spring.displacement_min, spring.displacement_max))


def test_parameter_sets_make_the_springs_that_they_name(fmu: Path, tmp_path: Path) -> None:
    spring = placed(MODEL, None)[0].parameters
    nominal = {
        "lower": {"kappa_omega": 20.0, "rho": 280.0, "n": 0.2}, "upper": {"kappa_omega": 23.0, "n": 0.25}, "nominal": {}
    }  # fmt: skip
    for name, values in nominal.items():
        read_back = ElementTree.fromstring(read(fmu, f"{RELATED}/{name}.ssv"))
        given = {p.get("name"): float(p[0].get("value")) for p in read_back.iterfind("{*}Parameters/{*}Parameter")}
        with instance(fmu, tmp_path / "unpacked") as one:
            one.initialize(**given)
            found = one.step(0.01, "force")
        expected = PathSolver(replace(spring, **values)).force(np.array([0.0, 0.01]))[-1]
        assert found == [pytest.approx(expected, rel=1e-12)]
    drawn = [read(fmu, f"{RELATED}/drawn_{k}.ssv") for k in (1, 2, 3)]
    assert len(set(drawn)) == 3
    assert json.loads(read(fmu, f"{RELATED}/uncertainty.json")) == UNCERTAINTY


def test_the_model_file_comes_back(fmu: Path, tmp_path: Path) -> None:
    assert load_model(fmu) == MODEL
    save_model(tmp_path / "model.json", load_model(fmu))
    assert (tmp_path / "model.json").read_bytes() == read(fmu, MODEL_IN_FMU)


def test_ends_of_intervals_that_are_no_spring_are_refused(tmp_path: Path) -> None:
    model = replace(MODEL, uncertainty={"interval_95": {"n": [-1.0, 2]}})
    with pytest.raises(ModelError, match="its lower ends are no spring: `n` must be within"):
        build_native_fmu(model, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04junk", b"no archive"])
def test_a_file_that_is_no_archive_is_refused(content: bytes, tmp_path: Path) -> None:
    bad = tmp_path / "bad.fmu"
    bad.write_bytes(content)
    with pytest.raises(ModelError, match="cannot be read as an FMU"):
        load_model(bad)
    (said,) = problems(bad)
    assert said.startswith("It cannot be unpacked" if content.startswith(b"PK") else "It is not an FMU")


def test_a_good_fmu_is_found_good(fmu: Path) -> None:
    found = verify_fmu(fmu)
    assert [finding.about for finding in found] == ["files", "rules", "spring", "run"]
    assert not any(finding.is_problem for finding in found)
    assert "The reference comes out of co-simulation" in found[3].text


def test_one_changed_byte_is_found_in_any_file(fmu: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        names = [name for name in archive.namelist() if name != HASHES]
    is_native = any(name.startswith("sources/") for name in names)
    kinds = (
        "sources/" if is_native else "binaries/",
        "modelDescription.xml",
        REFERENCE,
        STIMULI,
        "resources/",
        "documentation/index",
    )
    for kind in kinds:
        name = next(name for name in names if name.startswith(kind))

        def flip(contents: dict[str, bytes], name: str = name) -> None:
            content = bytearray(contents[name])
            content[len(content) // 2] ^= 1
            contents[name] = bytes(content)

        found = verify_fmu(edited(fmu, tmp_path, flip))
        assert f"{name!a} has been changed, or its hash in {HASHES}." in [f.text for f in found if f.is_problem]
        assert "It was not run." in [f.text for f in found]


def test_binaries_from_the_sources_are_named_and_run(tmp_path: Path) -> None:
    program("cc", package="gcc libc6-dev")
    fmu = build_native_fmu(MODEL, tmp_path)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path / "unpacked")
    # As the page of the FMU says.
    command = "cc -std=c11 -O2 -ffp-contract=off -fvisibility=hidden -fPIC -shared {} -lm -o {}"

    def compiled(source: str) -> bytes:
        subprocess.run(command.format(source, tmp_path / "x.so").split(), cwd=tmp_path / "unpacked", check=True)
        return (tmp_path / "x.so").read_bytes()

    (tmp_path / "abort.c").write_text("#include <stdlib.h>\n__attribute__((constructor)) void end(void) { abort(); }")
    here = f"binaries/{host_folder()}/mount.so"
    for content, said in (
        (compiled("sources/fmi2_all.c"), None),
        (
            compiled("../abort.c"),
            "Its binary for this computer ends the process that runs it; build or compile it again.",
        ),
        (b"no library", "It cannot be run: "),
    ):
        found = verify_fmu(edited(fmu, tmp_path, lambda c, content=content: c.update({here: content})))
        assert (
            f"'{here}' is not of this build: it has been compiled elsewhere, or is damaged; the run below decides."
            == found[0].text
        )
        bad = [finding.text for finding in found if finding.is_problem]
        assert [text[: len(said or "")] for text in bad] == ([said] if said else [])
        assert ("The reference comes out of co-simulation" in found[-1].text) == (said is None)
    added = verify_fmu(edited(fmu, tmp_path, lambda c: c.update({"binaries/riscv64-linux/mount.so": b"x"})))
    assert not any(finding.is_problem for finding in added)
    assert "it is not run on this computer, so verify it on its own." in added[0].text
    assert "The reference comes out of co-simulation" in added[-1].text
    # Nobody loads it.
    stray = here.replace("mount", "other")
    assert problems(edited(fmu, tmp_path, lambda c: c.update({stray: b"x"}))) == [
        f"'{stray}' has been added: it is not in {HASHES}."
    ]
    # A changed law is condemned whatever the binary.
    law = edited(
        fmu, tmp_path, lambda c: c.update({here: b"x", "modelDescription.xml": c["modelDescription.xml"] + b" "})
    )
    assert problems(law) == [f"'modelDescription.xml' has been changed, or its hash in {HASHES}."]


def test_python_code_that_ends_the_process_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even if the list of hashes has been made to fit."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))

    def edit(contents: dict[str, bytes]) -> None:
        (slave,) = [name for name in contents if name.endswith("_slave.py")]
        contents[slave] = b"import os\nos.abort()\n"
        hashes = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items() if name != HASHES}
        contents[HASHES] = json.dumps(hashes).encode()

    bad = problems(edited(build_python_fmu(MODEL, tmp_path), tmp_path, edit))
    assert bad == ["Its binary for this computer ends the process that runs it; build or compile it again."]
    assert list((tmp_path / "temporary").iterdir()) == []


def test_missing_added_and_unlisted_files_are_found(fmu: Path, tmp_path: Path) -> None:
    assert problems(edited(fmu, tmp_path, lambda c: c.pop("model.png"))) == ["'model.png' is missing."]
    added = edited(fmu, tmp_path, lambda c: c.update({"resources/x.txt": b"x"}))
    assert problems(added) == [f"'resources/x.txt' has been added: it is not in {HASHES}."]
    (said,) = problems(edited(fmu, tmp_path, lambda c: c.pop(HASHES)))
    assert said.startswith("It has no list of hashes")
    (said,) = problems(edited(fmu, tmp_path, lambda c: c.update({HASHES: b"["})))
    assert said == f"{HASHES} has been changed: it is no list of hashes."


def test_a_flipped_byte_of_the_archive_is_found(fmu: Path, tmp_path: Path) -> None:
    content = bytearray(fmu.read_bytes())
    with zipfile.ZipFile(fmu) as archive:
        entry = archive.getinfo("modelDescription.xml")
    content[entry.header_offset + 80 + entry.compress_size // 2] ^= 1
    damaged = tmp_path / "damaged.fmu"
    damaged.write_bytes(content)
    assert len(problems(damaged)) == 1


def test_the_command(
    fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Terminal(capsys)
    monkeypatch.chdir(tmp_path)
    said = terminal("verify", str(fmu))
    assert "files as they were built" not in terminal.err
    assert "The reference comes out of co-simulation" in said
    bad = edited(fmu, tmp_path, lambda c: c.update({"model.png": b""}))
    findings = json.loads(terminal("verify", str(bad), str(fmu), "--json", status=1))["fmus"]
    assert [any(f["is_problem"] for f in one["findings"]) for one in findings] == [True, False]
    assert "edited.fmu must not be used: 'model.png' has been changed" in terminal.err
    worse = edited(fmu, tmp_path, lambda c: c.update({"model.png": b"", "extra\x1b": b""}))
    terminal("verify", str(worse), status=1)
    assert terminal.err.splitlines()[-1].endswith(". It has 1 more problem.")
    terminal("verify", "none\x1b.fmu", status=1)
    assert "\x1b" not in terminal.err
    terminal("info", str(fmu), "--save", "back.json")
    assert load_model("back.json") == MODEL
    terminal("build", str(fmu), "-o", str(fmu.parent), status=2)
    assert "would overwrite the input" in terminal.err
    terminal("build", str(fmu), "-o", "again")
    assert (tmp_path / "again" / fmu.name).read_bytes() == fmu.read_bytes()
