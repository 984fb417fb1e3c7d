"""The FMU as a file: description, units, documentation, reproducible bytes, and nothing left behind."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from fmu_tools import OTHER, SPRING, built, instance, run_python
from strandspring.core.parameters import SCALARS, SpringParameters
from strandspring.core.variables import spring_parameters, start_values, units, variables
from strandspring.errors import StrandspringError
from strandspring.fmu.documentation import loops_svg
from strandspring.fmu.python_backed import build_python_fmu, fmu_contents
from strandspring.fmu.related_files import slow_cycles
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

AWKWARD = "\"quoted\" 'single' <b>bold</b> &amp; ]]> <!-- \nnew line\ttab äöü 弹簧 %s %n {name} {{ 7*7 }}"


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return built(tmp_path_factory.mktemp("fmu"))


@pytest.fixture(scope="module")
def description(fmu):
    return fmpy.read_model_description(str(fmu))


def test_table_is_what_fmpy_reads(description):
    table = variables(len(SPRING.kE), len(SPRING.kA))
    start = start_values(SPRING)
    assert len(description.modelVariables) == len(table)
    for reference, (read, variable) in enumerate(zip(description.modelVariables, table, strict=True)):
        assert read.valueReference == reference
        assert (read.name, read.causality, read.variability, read.description) == (
            variable.name, variable.causality, variable.variability, variable.description,
        )  # fmt: skip
        assert (read.type, read.unit, read.displayUnit) == (variable.kind, variable.unit, variable.display_unit)
        assert read.description
        for text, value in ((read.min, variable.minimum), (read.max, variable.maximum)):
            assert (None if text is None else float(text)) == value
        assert (None if read.start is None else float(read.start)) == start.get(variable.name)


def test_names_of_the_design(description):
    of = {v.name: v for v in description.modelVariables}
    coefficients = [f"{k}_{i}" for k, values in (("kE", SPRING.kE), ("kA", SPRING.kA)) for i in range(len(values))]
    parameters = [*SCALARS, *coefficients, "omega_start", "input_resolution"]
    assert list(of) == [
        "displacement", "force", "stiffness", "absorbed_energy", "extrapolating", "omega", *parameters,
    ]  # fmt: skip
    assert {of[name].causality for name in parameters} == {"parameter"}
    assert of["extrapolating"].type == "Boolean"
    assert of["omega"].causality == "local"
    assert float(of["displacement"].start) == 0.0
    assert {v.name for v in of.values() if v.variability == "tunable"} == {
        *coefficients, "kappa_omega", "rho", "sigma", "n", "input_resolution"
    } - {"kA_0"}  # fmt: skip
    assert {v.type for v in of.values() if v.causality == "output"} == {"Real"}
    assert of["extrapolating"].causality == "local"


def test_nominal_values_are_of_the_size_of_what_happens(description):
    nominal = {v.name: float(v.nominal) for v in description.modelVariables if v.nominal is not None}
    assert {v.name for v in description.modelVariables} - nominal.keys() == {"extrapolating"}
    assert all(value > 0.0 for value in nominal.values())
    path = slow_cycles(SPRING)
    solver = PathSolver(SPRING)
    for name, values in (("force", solver.force(path)), ("stiffness", solver.stiffness(path)),
                         ("absorbed_energy", solver.absorbed_energy(path)), ("displacement", path)):  # fmt: skip
        assert 0.1 < nominal[name] / np.abs(values).max() < 2.0, name


def test_start_values_keep_every_bit(tmp_path):
    awkward = replace(SPRING, kE=(0.1 + 0.2, 1.0 / 3.0, 5e-324, -3.7e19), rho=100.0 + 1e-13)
    read = fmpy.read_model_description(str(built(tmp_path, awkward)))
    values = {v.name: float(v.start) for v in read.modelVariables if v.start is not None}
    assert values == start_values(awkward)
    assert spring_parameters(values, len(awkward.kE), len(awkward.kA)) == awkward


@pytest.mark.parametrize("counts", [(1, 1), (2, 1), (8, 6), (21, 9)])
def test_units_are_complete_and_consistent(counts):
    known = {unit.name: unit for unit in units(*counts)}
    used = {v.unit for v in variables(*counts) if v.unit}
    assert used <= set(known)
    for variable in variables(*counts):
        if variable.display_unit:
            assert variable.display_unit in dict(known[variable.unit].displayed)
    factors = {"m": 1.0, "mm": 1e3, "N": 1.0, "kN": 1e-3, "J": 1.0, "mJ": 1e3, "kJ": 1e-3, "1": 1.0}
    dimensions = {"1": (0, 0, 0), "m": (0, 1, 0), "N": (1, 1, -2), "J": (1, 2, -2)}
    for unit in known.values():
        over, _, under = unit.name.partition("/")
        power = int(under.partition("^")[2] or 1) if under else 0
        kg, m, s = dimensions[over]
        assert (unit.kg, unit.m, unit.s) == (kg, m - power, s), unit
        for name, factor in unit.displayed:
            top, _, length = name.partition("/")
            per = factors[length.partition("^")[0]] ** power if length else 1.0
            assert factor == pytest.approx(factors[top] / per, rel=1e-15), name


@pytest.mark.parametrize("degrees", [(1, 1), (21, 9)])
def test_every_number_of_coefficients_is_valid(degrees, tmp_path):
    spring = SpringParameters(
        (0.0, 1e4, *[0.0] * 19)[: degrees[0]], (1.0, *[0.0] * 20)[: degrees[1]],
        10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01,
    )  # fmt: skip
    path = built(tmp_path, spring)
    assert validate_fmu(str(path)) == []
    with instance(path, tmp_path / "unpacked") as one:
        one.initialize()
        assert one.step(0.005, "force")[0] > 0.0


def test_capabilities_and_identity(description):
    slave = description.coSimulation
    assert slave.modelIdentifier == description.modelName == "spring"
    assert not slave.needsExecutionTool
    assert slave.canHandleVariableCommunicationStepSize
    assert slave.canGetAndSetFMUstate
    assert slave.canSerializeFMUstate
    assert not slave.canInterpolateInputs
    assert not slave.canBeInstantiatedOnlyOncePerProcess
    assert not slave.providesDirectionalDerivative
    assert slave.maxOutputDerivativeOrder == 0
    assert description.modelExchange is None
    assert description.generationDateAndTime is None
    assert description.generationTool.startswith("strandspring ")
    assert description.defaultExperiment.stepSize == "0.001"


def test_dependencies(description):
    names = [v.name for v in description.modelVariables]
    for unknown in description.outputs:
        assert [v.name for v in unknown.dependencies] == ["displacement"]
        assert unknown.dependenciesKind == ["dependent"]
    initially = {u.variable.name: {v.name for v in u.dependencies} for u in description.initialUnknowns}
    assert set(initially) == {"force", "stiffness", "absorbed_energy"}
    parameters = {v.name for v in description.modelVariables if v.causality == "parameter"} - {"input_resolution"}
    assert initially["stiffness"] == {"displacement", *parameters}
    assert initially["force"] == {"displacement", *parameters} - {"rho", "sigma", "n"}
    assert initially["absorbed_energy"] == set()
    assert set().union(*initially.values()) <= set(names)


def test_same_model_same_bytes_in_other_processes(fmu, tmp_path):
    code = """
import sys
from pathlib import Path
from fmu_tools import built
built(Path(sys.argv[1]))
"""
    found = {hashlib.sha256(fmu.read_bytes()).hexdigest()}
    for seed in ("1", "2"):
        folder = tmp_path / seed
        run_python(code, folder, environment={**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC{seed}"})
        found.add(hashlib.sha256((folder / "spring_python.fmu").read_bytes()).hexdigest())
    assert len(found) == 1


def test_guid_follows_the_content(fmu, tmp_path):
    guids = {
        fmpy.read_model_description(str(path)).guid
        for path in (
            fmu,
            built(tmp_path / "1", replace(SPRING, rho=SPRING.rho * (1 + 1e-15))),
            built(tmp_path / "2", SPRING, "renamed"),
            built(tmp_path / "3", SPRING, text="described"),
            built(tmp_path / "4", OTHER),
        )
    }
    assert len(guids) == 5
    assert all(len(guid) == 38 and guid[0] == "{" and guid[-1] == "}" for guid in guids)


def test_entries_of_the_archive(fmu):
    with zipfile.ZipFile(fmu) as archive:
        entries = archive.infolist()
    names = [entry.filename for entry in entries]
    assert names == sorted(names)
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert {
        "modelDescription.xml", "model.png", "documentation/index.html", "documentation/licenses/license.txt",
        "documentation/licenses/pythonfmu.txt", "binaries/linux64/spring.so", "binaries/win64/spring.dll",
        "resources/slavemodule.txt",
    } <= set(names)  # fmt: skip
    assert not any("__pycache__" in name or name.startswith(("/", "..")) for name in names)


def test_notice_of_fmi_comes_with_what_is_compiled_from_its_headers(fmu):
    with zipfile.ZipFile(fmu) as archive:
        notice = archive.read("documentation/licenses/fmi-headers.txt").decode()
    assert notice.startswith("Copyright (C)")
    assert "2-Clause BSD License" in notice
    assert notice.endswith("SUCH DAMAGE.\n")


def test_building_leaves_nothing_else(tmp_path):
    path, modules = list(sys.path), set(sys.modules)
    built(tmp_path / "new", OTHER, "lambda")
    assert [p.name for p in tmp_path.rglob("*")] == ["new", "lambda_python.fmu"]
    assert sys.path == path
    assert set(sys.modules) == modules


def test_a_folder_that_cannot_be_written_to(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StrandspringError, match="cannot be written"):
        built(tmp_path / "file")


def test_an_fmu_named_like_a_keyword_runs(tmp_path):
    with instance(built(tmp_path, SPRING, "lambda"), tmp_path / "unpacked") as one:
        assert one.initialize().step(0.03, "force")[0] > 0.0


def test_awkward_texts(tmp_path):
    model = ModelFile(
        "awkward",
        SPRING,
        AWKWARD,
        fit={"outcomes": [{"sentence": "<i>rmse"}]},
        provenance={"records": [{"file": AWKWARD}]},
    )
    path = build_python_fmu(model, tmp_path)
    assert validate_fmu(str(path)) == []
    assert fmpy.read_model_description(str(path)).description == AWKWARD
    page = fmu_contents(model)["documentation/index.html"].decode()
    assert "<b>bold" not in page
    assert "<i>rmse" not in page
    assert "&lt;b&gt;bold" in page
    assert "{{ 7*7 }}" in page
    with instance(path, tmp_path / "unpacked") as one:
        assert one.initialize().step(0.03, "force")[0] > 0.0


def test_documentation_tells_the_model():
    sentence = "The energy of small loops is left undecided by these records."
    model = ModelFile(
        "documented",
        SPRING,
        fit={"outcomes": [{"name": "small_loops", "sentence": sentence}]},
        uncertainty={"rho": 12.34, "sigma": None, "n": 3, "interval_95": {"rho": [90.0, None]}},
        provenance={"records": [{"file": "a.csv", "samples": 2336, "sha256": "e6" * 32}, 7]},
    )
    page = fmu_contents(model)["documentation/index.html"].decode()
    for variable in variables(len(SPRING.kE), len(SPRING.kA)):
        assert f"<td>{variable.name}</td>" in page
    # What to be careful with comes before all else.
    assert page.index(sentence) < page.index("<h2>")
    # What the records do not decide is not left out.
    for told in ("90 to open", ">12<", "<th>sigma</th>", ">unknown<", "<th>n</th>", "a.csv", ">2336<", "e6" * 32):
        assert told in page, told
    by_hand = fmu_contents(ModelFile("by_hand", SPRING))["documentation/index.html"].decode()
    for title in ("<b>Caution", "<h2>Uncertainty", "<h2>Records"):
        assert title not in by_hand
    svg = ElementTree.fromstring(page[page.index("<svg") : page.index("</svg>") + 6])
    assert len(svg.findall("polyline")) == 3
    assert [text.text for text in svg.findall("text")][-3:] == ["±24.5 mm", "±16.3 mm", "±8.17 mm"]


def test_documentation_shows_both_figures_of_each_record():
    alone = {"rmse": 30.64, "rnl": 0.80751, "energy": 2.0, "predicted_energy": 1.13, "omega_start": 0.5}
    fitted = {"rmse": 3.5, "rnl": 0.97823, "energy": 2.0, "predicted_energy": 1.99}
    records = [{"file": "<a>.csv", **alone, "fitted": fitted}, {"file": "b.csv"}, 7]
    page = fmu_contents(ModelFile("both", SPRING, fit={"records": records}))["documentation/index.html"].decode()
    section = page[page.index("<h2>How well it follows its records") : page.index("<h2>Reference experiment")]
    cells = re.findall(r"<td[^>]*>(.*)</td>", section)
    assert cells == ["&lt;a&gt;.csv", "30.64", "0.8075", "0.56", "0.9782", "0.99", "0.5"]
    by_hand = fmu_contents(ModelFile("by_hand", SPRING))
    assert "How well it follows" not in by_hand["documentation/index.html"].decode()


def test_the_reference_experiment_says_why_it_is_not_along_a_record():
    contents = fmu_contents(ModelFile("a", SPRING))
    for name in ("documentation/index.html", "documentation/fmi-ls-ref.txt"):
        text = " ".join(contents[name].decode().split())
        assert "made from its model file alone, which names its records and holds none of them" in text


@pytest.mark.parametrize("force", [0.0, 1e12, -1e-300])
def test_loops_of_no_height_are_drawn(force: float) -> None:
    svg = ElementTree.fromstring(loops_svg(replace(SPRING, kE=(force,), kappa_omega=1e-15)))
    assert len(svg.findall("polyline")) == 3
    assert "nan" not in ElementTree.tostring(svg, encoding="unicode")
