"""What FMUs say of themselves: model descriptions of both versions, pages, texts and identity.

`described.json` holds what all files of text in FMUs said when a person last read them, without what changes with each
build; `python tests/fmi/test_description.py` writes it anew.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.validation import validate_fmu

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in (".", "helpers")]

from fmu_tools import AWKWARD, CONSTANT, LONGEST, OTHER, SPRING
from forms import FORMS, rows
from pages import ROOT
from portable_host import run
from strandspring import BuildError, SpringParameters
from strandspring.core.variables import start_values
from strandspring.errors import StrandspringError
from strandspring.fmu.checks.check import described_spring, examine_fmu
from strandspring.fmu.description.fmi3_files import BUILD_DESCRIPTION, TERMINALS
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.python_backed import build_python_fmu, fmu_contents
from strandspring.model.modelfile import ModelFile

pytestmark = pytest.mark.long
MODEL = ModelFile("spring", SPRING)
INEXACT = replace(SPRING, kE=(0.1 + 0.2, 1.0 / 3.0, 5e-324, -3.7e19), rho=100.0 + 1e-13)
KEPT = Path(__file__).with_name("described.json")
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w.]*\w)")
DOCUMENTED = ModelFile(
    "documented", SPRING,
    fit={"outcomes": [{"name": "small_loops", "sentence": "The energy of small loops is left undecided."}],
         "records": [{"file": "<a>.csv", "rmse": 30.64, "rnl": 0.80751, "energy": 2.0, "predicted_energy": 1.13,
                      "omega_start": 0.5, "fitted": {"rmse": 3.5, "rnl": 0.97823, "energy": 2.0,
                                                     "predicted_energy": 1.99}}, {"file": "b.csv"}, 7]},
    uncertainty={"rho": 12.34, "sigma": None, "n": 3, "interval_95": {"rho": [90.0, None]}},
    provenance={"records": [{"file": "a.csv", "samples": 2336, "sha256": "e6" * 32}, 7]},
)  # fmt: skip


def described(contents: dict[str, bytes]) -> Any:
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as written:
        for name, content in contents.items():
            written.writestr(name, content)
    return fmpy.read_model_description(file)


# What was read


def texts_of(name: str) -> dict[str, str]:
    """Texts of an FMU without markup, versions, hashes and pictures, by file."""
    if name == "documented":
        contents = fmu_contents(DOCUMENTED, zero=0.0)
    else:
        folder = FORMS[name].library().folder
        contents = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    found = {}
    for path in sorted(contents):
        if path.endswith((".html", ".xml", "fmi-ls-ref.txt")):
            text = re.sub(r"<svg.*?</svg>|<style.*?</style>", "", contents[path].decode(), flags=re.S)
            text = re.sub(r"</?(?:p|td|tr|th|li|code|h\d|table|div|ul|sub|sup|b|pre)\b[^>]*>", " ", text)
            text = re.sub(r"\d+\.\d+\.\d+(\.dev\d+)?(\+[0-9a-f]{12})?|\{[0-9a-f-]{36}\}|[0-9a-f]{64}", "*", text)
            found[path] = " ".join(text.split())
    return found


ROWS = ["co-simulation", "fmi3 states", "table, python", "branches", "system", "documented"]


@pytest.mark.parametrize("name", ROWS)
def test_texts_are_those_that_were_read(name: str) -> None:
    found, kept = texts_of(name), json.loads(KEPT.read_text(encoding="utf-8"))[name]
    assert found.keys() == kept.keys()
    for path, text in found.items():
        assert NUMBER.sub("#", text) == NUMBER.sub("#", kept[path]), path
        numbers = [[float(number) for number in NUMBER.findall(one)] for one in (text, kept[path])]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-6, abs=1e-9), path  # of computed figures


def test_few_round_numbers_stand_beside_the_lines_of_the_drawn_loops() -> None:
    page = fmu_contents(DOCUMENTED, zero=0.0)["documentation/index.html"].decode()
    svg = ElementTree.fromstring(re.findall(r"<svg.*?</svg>", page, re.S)[0])
    texts, heights = svg.findall("text"), [float(line.get("y1", 0.0)) for line in svg.findall("line")]
    # The range is 49 mm.
    assert [text.text for text in texts if text.get("y") == "384.00"] == ["0", "10", "20", "30", "40", "50"]
    for text in (one for one in texts if one.get("text-anchor") == "end"):
        # The baseline is below the line by half of a letter.
        assert [height for height in heights if 0.0 < float(text.get("y", 0.0)) - height < 6.0]


@pytest.mark.parametrize("name", rows())
def test_it_is_valid_and_answers_as_the_model(name: str, tmp_path: Path) -> None:
    form = FORMS[name]
    fmu = form.build(tmp_path)
    assert validate_fmu(str(fmu)) == []
    assert described_spring(fmpy.read_model_description(str(fmu))) == form.spring
    report = examine_fmu(fmu)
    assert (report.problems, report.not_run) == ((), None)
    only = ("model exchange",) if form.has_states else ("co-simulation",)
    expected = only if form.has_states or form.python or form.spring.branches else (*only, "model exchange")
    assert report.interfaces == expected
    assert f"401 steps of {' and of '.join(expected)}" in report.summary
    assert report.force_difference < 1e-9  # of some 500 N


@pytest.mark.parametrize("spring", [CONSTANT, LONGEST, INEXACT], ids=["shortest", "longest", "inexact"])
def test_any_number_of_coefficients_keeps_every_bit(spring: SpringParameters, tmp_path: Path) -> None:
    model = ModelFile("spring", spring)
    native = [build_native_fmu(model, tmp_path, zero=0.0, fmi=fmi) for fmi in (2, 3)]
    for fmu in (*native, build_python_fmu(model, tmp_path, zero=0.0)):
        assert validate_fmu(str(fmu)) == []
        read = fmpy.read_model_description(str(fmu))
        assert described_spring(read) == spring
        starts = {v.name: float(v.start) for v in read.modelVariables if v.start is not None}
        assert starts == start_values(spring)
        assert spring == INEXACT or examine_fmu(fmu).problems == ()


@pytest.mark.parametrize("form", [{}, {"with_states": True}], ids=str)
def test_files_of_fmi_3_follow_its_schemas(form: dict[str, bool]) -> None:
    from lxml import etree

    contents = native_contents(MODEL, (), fmi=3, **form)
    for schema, path in (
        ("fmi3ModelDescription", "modelDescription.xml"), ("fmi3TerminalsAndIcons", TERMINALS),
        ("fmi3BuildDescription", BUILD_DESCRIPTION),
    ):  # fmt: skip
        checked = etree.XMLSchema(file=str(Path(str(files("fmpy"))) / "schema" / "fmi3" / f"{schema}.xsd"))
        assert checked.validate(etree.parse(BytesIO(contents[path]))), checked.error_log
    # Importers bring the headers of FMI.
    assert not [name for name in contents if name.startswith("sources/fmi3Func") or "PlatformTypes" in name]
    before = described(native_contents(MODEL, (), zero=0.0))
    assert before.guid != described(contents).guid


# Texts and identity


def test_awkward_texts_reach_neither_c_nor_paths_nor_the_page(tmp_path: Path) -> None:
    model = ModelFile(
        "awkward", SPRING, AWKWARD, fit={"outcomes": [{"sentence": "<i>rmse"}]},
        provenance={"records": [{"file": AWKWARD, "path": AWKWARD}], "author": '<Ä> & "Söhne" ]]>'},
    )  # fmt: skip
    plain = native_contents(ModelFile("awkward", SPRING), (), zero=0.0)
    contents = native_contents(model, (), zero=0.0)
    guids = [str(described(one).guid).encode() for one in (contents, plain)]
    for name, content in contents.items():
        if name.startswith("sources/"):
            assert content.replace(*guids) == plain[name], name
    assert not any(".." in name or name.startswith("/") for name in contents)
    for fmu in (*(build_native_fmu(model, tmp_path, fmi=fmi) for fmi in (2, 3)), build_python_fmu(model, tmp_path)):
        assert validate_fmu(str(fmu)) == []
        read = fmpy.read_model_description(str(fmu))
        assert (read.description.split(), read.author) == (AWKWARD.split(), '<Ä> & "Söhne" ]]>')
        assert examine_fmu(fmu).problems == ()
        with zipfile.ZipFile(fmu) as archive:
            page = archive.read("documentation/index.html").decode()
        assert not re.search("<b>bold|<i>rmse", page)
        assert "&lt;b&gt;bold" in page
        assert "{{ 7*7 }}" in page


BUILDERS: dict[str, Callable[[ModelFile], dict[str, bytes]]] = {
    "python": lambda model: fmu_contents(model, zero=0.0),
    **{str(fmi): lambda model, fmi=fmi: native_contents(model, (), zero=0.0, fmi=fmi) for fmi in (2, 3)},  # type: ignore[misc]
}


@pytest.mark.parametrize("builder", BUILDERS)
def test_the_guid_follows_the_content(builder: str) -> None:
    models = [
        MODEL, replace(MODEL, parameters=replace(SPRING, rho=SPRING.rho * (1 + 1e-15))), replace(MODEL, name="renamed"),
        replace(MODEL, description="described"), replace(MODEL, parameters=OTHER), MODEL,
    ]  # fmt: skip
    guids = [str(described(BUILDERS[builder](model)).guid) for model in models]
    assert (len(set(guids)), guids[0]) == (5, guids[-1])
    assert all(re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", guid) for guid in guids)


def test_same_bytes_in_other_processes_and_nothing_else(tmp_path: Path) -> None:
    found = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC{seed}"}
        command = [sys.executable, "-W", "error", "-m", "strandspring", "build", ROOT / "models/rubber_hinge.json"]
        run([*command, "--backend", "both", "-o", tmp_path / seed], env=environment)
        fmus = sorted((tmp_path / seed).iterdir())
        found.add(tuple(hashlib.sha256(fmu.read_bytes()).hexdigest() for fmu in fmus))
        for fmu in fmus:
            with zipfile.ZipFile(fmu) as archive:
                entries = archive.infolist()
            assert [entry.filename for entry in entries] == sorted(entry.filename for entry in entries)
            assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert len(found) == 1
    assert len(*found) == 2


LONGEST_NAMES = [({"with_states": True}, 57), ({"fmi": 3}, 59), ({"fmi": 3, "with_states": True}, 52)]


def test_names_leave_room_for_the_ending_and_may_be_keywords(tmp_path: Path) -> None:
    for form, longest in LONGEST_NAMES:
        contents = native_contents(replace(MODEL, name="a" * longest), (), **form)
        assert len(str(described(contents).modelName)) == 64
        with pytest.raises(BuildError, match=f"is too long for an FMU; give the model a name of at most {longest} "):
            native_contents(replace(MODEL, name="a" * (longest + 1)), (), **form)
    fmu = build_python_fmu(ModelFile("lambda", OTHER), tmp_path / "new")
    assert [p.name for p in tmp_path.rglob("*")] == ["new", "lambda_python.fmu"]
    assert examine_fmu(fmu).problems == ()
    with pytest.raises(StrandspringError, match="cannot be written"):
        build_python_fmu(MODEL, fmu)


if __name__ == "__main__":
    KEPT.write_text(json.dumps({name: texts_of(name) for name in ROWS}, indent=0) + "\n", encoding="utf-8")
