"""What FMUs say of themselves: model descriptions of both versions, pages, texts, and where a path starts."""

from __future__ import annotations

import hashlib
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
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_tools import OTHER, SPRING, run_python
from forms import FORMS, Form, rows
from native_tools import OK
from pages import TEXTS
from springs import TABLE
from strandspring import BuildError, SpringParameters
from strandspring.core.parameters import SCALARS
from strandspring.core.variables import start_values, units, variables
from strandspring.errors import StrandspringError
from strandspring.fmu.checks.check import described_spring, examine_fmu
from strandspring.fmu.description.fmi3_files import BUILD_DESCRIPTION, TERMINALS
from strandspring.fmu.documentation import loops_svg
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.python_backed import build_python_fmu, fmu_contents
from strandspring.fmu.related_files import slow_cycles
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

AWKWARD = (
    "\"quoted\" 'single' <b>bold</b> &amp; ]]> <!-- --> \n#error newline\t*/ int evil = 1; /* \\ \\\n ?/ %s %n "
    "../../up {name} {{ 7*7 }} äöü 弹簧"
)
pytestmark = pytest.mark.long
MODEL = ModelFile("spring", SPRING)
CONSTANT = SpringParameters((5.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
INEXACT = replace(SPRING, kE=(0.1 + 0.2, 1.0 / 3.0, 5e-324, -3.7e19), rho=100.0 + 1e-13)
LONGEST = replace(CONSTANT, kE=(0.0, 1e4, *[0.0] * 19), kA=(1.0, *[0.0] * 8))


def described(contents: dict[str, bytes]) -> Any:
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as written:
        for name, content in contents.items():
            written.writestr(name, content)
    file.seek(0)
    return fmpy.read_model_description(file)


@pytest.mark.parametrize("name", rows())
def test_it_is_valid_and_answers_as_the_model(name: str, tmp_path: Path) -> None:
    form = FORMS[name]
    fmu = form.build(tmp_path)
    assert validate_fmu(str(fmu)) == []
    description = fmpy.read_model_description(str(fmu))
    assert described_spring(description) == form.spring
    report = examine_fmu(fmu)
    assert (report.problems, report.not_run) == ((), None)
    only = ("model exchange",) if form.has_states else ("co-simulation",)
    expected = only if form.has_states or form.python or form.spring.branches else (*only, "model exchange")
    assert report.interfaces == expected
    assert f"401 steps of {' and of '.join(expected)}" in report.summary
    assert report.force_difference < 1e-9  # of some 500 N
    names = {v.name for v in description.modelVariables}
    assert ("absorbed_energy" in names) == ("no_energy" not in form.options)
    assert (description.modelName, description.generationDateAndTime) == (fmu.stem.removesuffix("_python"), None)


@pytest.mark.parametrize("spring", [CONSTANT, LONGEST, INEXACT])
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


# FMI 2.0


def test_variables_of_the_design() -> None:
    read = described(native_contents(MODEL, (), zero=0.0))
    of_python = described(fmu_contents(MODEL, zero=0.0))
    for part in ("modelVariables", "unitDefinitions", "outputs", "initialUnknowns"):
        assert repr(getattr(read, part)) == repr(getattr(of_python, part)), part
    of, table = {v.name: v for v in read.modelVariables}, variables(len(SPRING.kE), len(SPRING.kA))
    for reference, (found, wanted) in enumerate(zip(read.modelVariables, table, strict=True)):
        assert found.valueReference == reference
        for attribute in ("name", "causality", "variability", "description", "unit"):
            assert getattr(found, attribute) == getattr(wanted, attribute)
        limits = [None if text is None else float(text) for text in (found.min, found.max)]
        assert limits == [wanted.minimum, wanted.maximum]
        assert (found.nominal is None) == (found.name == "extrapolating")
    coefficients = [f"{k}_{i}" for k, values in (("kE", SPRING.kE), ("kA", SPRING.kA)) for i in range(len(values))]
    parameters = [*SCALARS, *coefficients, "omega_start", "input_resolution"]
    outputs = ["force", "stiffness", "absorbed_energy"]
    assert list(of) == ["displacement", *outputs, "extrapolating", "omega", *parameters]
    assert {name for name, v in of.items() if v.causality == "parameter"} == set(parameters)
    assert {name for name, v in of.items() if v.causality == "output"} == set(outputs)
    tunable = {*coefficients, "kappa_omega", "rho", "sigma", "n", "input_resolution"} - {"kA_0"}
    assert {name for name, v in of.items() if v.variability == "tunable"} == tunable
    assert [v.name for v in of.values() if v.type != "Real"] == ["extrapolating"]
    for unknown in read.outputs:
        assert ([v.name for v in unknown.dependencies], unknown.dependenciesKind) == (["displacement"], ["dependent"])
    initially = {u.variable.name: {v.name for v in u.dependencies} for u in read.initialUnknowns}
    all_of_them = {"displacement", *parameters} - {"input_resolution"}
    assert initially == {
        "stiffness": all_of_them, "force": all_of_them - {"rho", "sigma", "n"}, "absorbed_energy": set()
    }  # fmt: skip
    path, solver = slow_cycles(SPRING), PathSolver(SPRING)
    for name, values in (
        ("force", solver.force(path)), ("stiffness", solver.stiffness(path)), ("displacement", path),
        ("absorbed_energy", solver.absorbed_energy(path)),
    ):  # fmt: skip
        assert 0.1 < float(of[name].nominal) / np.abs(values).max() < 2.0, name


@pytest.mark.parametrize("counts", [(1, 1), (2, 1), (8, 6), (21, 9)])
def test_units_are_complete_and_consistent(counts: tuple[int, int]) -> None:
    known = {unit.name: unit for unit in units(*counts)}
    for variable in variables(*counts):
        if variable.display_unit:
            assert variable.display_unit in dict(known[str(variable.unit)].displayed)
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


BOTH2 = {
    "needsExecutionTool": False, "canGetAndSetFMUstate": True, "canSerializeFMUstate": True,
    "canBeInstantiatedOnlyOncePerProcess": False,
}  # fmt: skip
BOTH3 = {
    "needsExecutionTool": "false", "canBeInstantiatedOnlyOncePerProcess": "false", "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true", "providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true",
}  # fmt: skip


@pytest.mark.parametrize("name", ["co-simulation", "python", "states", "branches"])
def test_capabilities_of_fmi_2(name: str) -> None:
    form = FORMS[name]
    read = fmpy.read_model_description(str(form.library().folder))
    slave, model = read.coSimulation, read.modelExchange
    for kind in filter(None, (slave, model)):
        assert {key: getattr(kind, key) for key in BOTH2} == BOTH2
        assert kind.providesDirectionalDerivative != form.python
    assert (slave is None, model is None) == (form.has_states, form.python or name == "branches")
    if slave:
        assert slave.canHandleVariableCommunicationStepSize
        assert slave.canInterpolateInputs == (name == "co-simulation")
        assert slave.maxOutputDerivativeOrder == (not form.python)
    if model:
        assert model.needsCompletedIntegratorStep
        assert (read.numberOfContinuousStates, read.numberOfEventIndicators) == ((2, 0) if form.has_states else (0, 1))
    assert {c.name for c in read.logCategories} >= {"logStatusWarning", "logStatusError"}
    assert [u.variable.derivative.name for u in read.derivatives] == ["absorbed_energy", "omega"] * form.has_states


# FMI 3.0


def folded(name: str, after: Any) -> str:
    """The name in FMI 3.0, with or without arrays, of a variable of FMI 2.0."""
    array = re.sub(r"^(kE|kA|FE_knots|FE_forces)_\d+$", r"\1", name)
    return array if any(v.name == array for v in after.modelVariables) else name


@pytest.mark.parametrize("arrays", [False, True], ids=["scalars", "arrays"])
@pytest.mark.parametrize("states", [False, True], ids=["usual", "states"])
@pytest.mark.parametrize("spring", [SPRING, TABLE, CONSTANT], ids=["polynomial", "table", "constant"])
def test_fmi_3_describes_what_fmi_2_describes(spring: SpringParameters, states: bool, arrays: bool) -> None:
    model, form = ModelFile("spring", spring), {"zero": 0.0, "with_states": states}
    before = described(native_contents(model, (), **form))
    after = described(native_contents(model, (), **form, fmi=3, arrays=arrays))
    new = {v.name: v for v in after.modelVariables}
    own = {"time"} | ({"reversal_indicator"} if not states else set())
    assert [v.valueReference for v in after.modelVariables] == list(range(1, len(new) + 1))
    assert {folded(v.name, after) for v in before.modelVariables} == new.keys() - own
    assert (new["time"].causality, new["time"].unit, new["time"].start) == ("independent", "s", None)
    for old in before.modelVariables:
        if (one := new[folded(old.name, after)]).dimensions:
            continue
        same = "name description causality variability initial unit displayUnit min max nominal start"
        for attribute in same.split():
            assert getattr(old, attribute) == getattr(one, attribute), (old.name, attribute)
    for array in (v for v in new.values() if v.dimensions):
        elements = [v for v in before.modelVariables if folded(v.name, after) == array.name]
        assert [int(d.start) for d in array.dimensions] == [len(elements)]
        assert [float(text) for text in array.start.split()] == [float(v.start) for v in elements]
        assert (array.causality, array.variability) == (
            elements[-1].causality,
            elements[-1].variability,
        )  # kA_0 is fixed
        listed = [v.unit for v in elements]
        if array.name.startswith("FE_"):
            assert {array.unit} == set(listed)
        else:  # a unit each
            assert re.search(r"in ([^;]*)", array.description)[1].split(", ") == listed  # type: ignore[index]
    assert described_spring(after) == described_spring(before) == spring
    known, used = ({unit.name: repr(unit) for unit in one.unitDefinitions} for one in (before, after))
    assert used.keys() == {v.unit for v in new.values() if v.unit}
    assert used.items() - known.items() == {("s", used["s"])}
    parameters = {v.name for v in new.values() if v.causality == "parameter"}
    for title in ("outputs", "derivatives", "initialUnknowns"):
        old, one = ({u.variable.name: {folded(v.name, after) for v in u.dependencies} for u in getattr(d, title)}
                    for d in (before, after))  # fmt: skip
        assert list(old) == list(one)
        if title == "initialUnknowns":
            assert one == old
        elif not states:  # what the path was depends on all parameters
            assert one == {name: found | parameters for name, found in old.items()}
        else:  # a function of states and inputs
            assert all(found >= old[name] for name, found in one.items())
    indicators = {u.variable.name: {v.name for v in u.dependencies} for u in after.eventIndicators}
    depends = {"displacement", "time", "displacement_min", "displacement_max"}
    assert indicators == ({} if states else {"reversal_indicator": depends})
    for attribute in ("logCategories", "defaultExperiment", "author", "version", "copyright", "license", "description"):
        assert repr(getattr(before, attribute)) == repr(getattr(after, attribute)), attribute
    assert before.guid != after.guid


@pytest.mark.parametrize("form", [{}, {"with_states": True}, {"arrays": True}])
def test_files_of_fmi_3(form: dict[str, bool]) -> None:
    contents = native_contents(MODEL, (), fmi=3, **form)
    root = ElementTree.fromstring(contents["modelDescription.xml"])
    identifier = "spring_fmi3_states" if "with_states" in form else "spring_fmi3"
    assert (root.get("fmiVersion"), root.get("modelName")) == ("3.0", identifier)
    assert re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", str(root.get("instantiationToken")))
    abilities = {"modelIdentifier": identifier, **BOTH3}
    of_slave = {
        "canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "1", "hasEventMode": "false",
        "providesIntermediateUpdate": "false", "mightReturnEarlyFromDoStep": "false",
        "canReturnEarlyAfterIntermediateUpdate": "false",
    }  # fmt: skip
    of_model = {"needsCompletedIntegratorStep": "true", "providesEvaluateDiscreteStates": "false"}
    expected = {"ModelExchange": abilities | of_model}
    expected |= {} if "with_states" in form else {"CoSimulation": abilities | of_slave}
    assert {one.tag: one.attrib for one in root if "modelIdentifier" in one.attrib} == expected
    for schema, path in (
        ("fmi3ModelDescription", "modelDescription.xml"), ("fmi3TerminalsAndIcons", TERMINALS),
        ("fmi3BuildDescription", BUILD_DESCRIPTION),
    ):  # fmt: skip
        checked = etree.XMLSchema(file=str(Path(str(files("fmpy"))) / "schema" / "fmi3" / f"{schema}.xsd"))
        assert checked.validate(etree.parse(BytesIO(contents[path]))), checked.error_log
    (terminal,) = ElementTree.fromstring(contents[TERMINALS]).iter("Terminal")
    assert (terminal.get("name"), terminal.get("matchingRule")) == ("flange", "plug")
    *members, graphics = terminal
    assert [(m.get("memberName"), m.get("variableName"), m.get("variableKind")) for m in members] == [
        ("s", "displacement", "signal"), ("f", "force", "inflow"),
    ]  # fmt: skip
    for icon in ("icon", graphics.get("iconBaseName")):
        assert contents[f"terminalsAndIcons/{icon}.png"].startswith(b"\x89PNG")
        assert ElementTree.fromstring(contents[f"terminalsAndIcons/{icon}.svg"]).tag.endswith("}svg")
    built = ElementTree.fromstring(contents[BUILD_DESCRIPTION])
    assert [one.get("platform") for one in built] == [None, "x86_64-linux", "aarch64-linux"]
    assert {one.get("modelIdentifier") for one in built} == {identifier}
    assert {one.get("name") for one in built.iter("SourceFile")} == {"fmi3_all.c"}
    allowed = {
        "documentation",
        "terminalsAndIcons",
        "sources",
        "binaries",
        "resources",
        "extra",
        "modelDescription.xml",
    }
    assert {name.split("/")[0] for name in contents} <= allowed
    # Importers bring the headers of FMI.
    assert not [name for name in contents if name.startswith("sources/fmi3Func") or "PlatformTypes" in name]


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
        replace(MODEL, description="described"), replace(MODEL, parameters=OTHER),
    ]  # fmt: skip
    guids = {str(described(BUILDERS[builder](model)).guid) for model in models}
    assert len(guids) == 5
    assert str(described(BUILDERS[builder](MODEL)).guid) in guids
    assert all(len(guid) == 38 and guid[0] == "{" and guid[-1] == "}" for guid in guids)


def test_same_bytes_in_other_processes(tmp_path: Path) -> None:
    code = """
import sys
from pathlib import Path
from fmu_tools import SPRING, built
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.modelfile import ModelFile
built(Path(sys.argv[1]))
for form in ({}, {"with_states": True}, {"fmi": 3}):
    build_native_fmu(ModelFile("spring", SPRING), Path(sys.argv[1]), (), **form)
"""
    found = set()
    for seed in ("1", "2"):
        run_python(code, tmp_path / seed, environment={**os.environ, "PYTHONHASHSEED": seed, "TZ": f"UTC{seed}"})
        fmus = sorted((tmp_path / seed).iterdir())
        found.add(tuple(hashlib.sha256(fmu.read_bytes()).hexdigest() for fmu in fmus))
        for fmu in fmus:
            with zipfile.ZipFile(fmu) as archive:
                entries = archive.infolist()
            assert [entry.filename for entry in entries] == sorted(entry.filename for entry in entries)
            assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    assert len(found) == 1
    assert len(*found) == 4


LONGEST_NAMES = [({"with_states": True}, 57), ({"fmi": 3}, 59), ({"fmi": 3, "with_states": True}, 52)]


@pytest.mark.parametrize(("form", "longest"), LONGEST_NAMES)
def test_names_leave_room_for_the_ending(form: dict[str, Any], longest: int) -> None:
    contents = native_contents(replace(MODEL, name="a" * longest), (), **form)
    assert len(str(described(contents).modelName)) == 64
    with pytest.raises(BuildError, match=f"is too long for an FMU; give the model a name of at most {longest} char"):
        native_contents(replace(MODEL, name="a" * (longest + 1)), (), **form)


# The page


def page_of(form: Form, model: ModelFile | None = None) -> str:
    given = model or ModelFile("spring", form.spring)
    contents = fmu_contents(given) if form.python else native_contents(given, (), **form.options)
    return " ".join(contents["documentation/index.html"].decode().split())


@pytest.mark.parametrize("name", rows())
def test_the_page_says_what_the_form_is_and_can_do(name: str) -> None:
    form = FORMS[name]
    page, p = page_of(form), form.spring
    is_real_time = "real_time" in form.options
    told = {
        "Model exchange": not form.python, "LD_PRELOAD": form.python, "-ffp-contract=off": not form.python,
        "flange": form.fmi == 3, "<h2>Arrays</h2>": "arrays" in form.options, "fmi2": form.fmi == 2,
        "cubic spline through FE_forces": bool(p.FE_knots), "kE_i": not p.FE_knots,
        "second_kappa_omega · second_omega · FA₂(x)": bool(p.second), "Σ r_j": bool(p.branches),
        "<td>velocity</td>": form.has_states, "<h2>Real time</h2>": is_real_time,
        "<td>absorbed_energy</td>": "no_energy" not in form.options,
        "no output <code>absorbed_energy</code>": "no_energy" in form.options,
        "warning is logged": not is_real_time, "one step late": True,
        "orders 1 and 2": form.fmi == 2 and not (form.python or p.branches or form.has_states),
        "with respect to parameters it is refused": not (form.python or form.has_states or "no_energy" in form.options),
    }  # fmt: skip
    assert {text: text in page for text in told} == told
    figures = re.findall(r"[\d.]+ (?:us|ms|MB)", page.partition("<h2>Real time</h2>")[2].partition("<h2>")[0])
    assert len(figures) == 3 * is_real_time
    assert all(figure in TEXTS["real-time"] for figure in figures)
    if not form.python:
        own = fmpy.read_model_description(str(form.library().folder)).modelName
        assert set(re.findall(r"[\w.]+(?=\.fmu\b)", page)) >= {own}
        assert re.findall(r"-o ([\w.]+)\.so\b", page) == [own]


def test_the_page_tells_the_model() -> None:
    sentence = "The energy of small loops is left undecided by these records."
    alone = {"rmse": 30.64, "rnl": 0.80751, "energy": 2.0, "predicted_energy": 1.13, "omega_start": 0.5}
    fitted = {"rmse": 3.5, "rnl": 0.97823, "energy": 2.0, "predicted_energy": 1.99}
    model = ModelFile(
        "documented", SPRING,
        fit={"outcomes": [{"name": "small_loops", "sentence": sentence}],
             "records": [{"file": "<a>.csv", **alone, "fitted": fitted}, {"file": "b.csv"}, 7]},
        uncertainty={"rho": 12.34, "sigma": None, "n": 3, "interval_95": {"rho": [90.0, None]}},
        provenance={"records": [{"file": "a.csv", "samples": 2336, "sha256": "e6" * 32}, 7]},
    )  # fmt: skip
    page = fmu_contents(model)["documentation/index.html"].decode()
    for variable in variables(len(SPRING.kE), len(SPRING.kA)):
        assert f"<td>{variable.name}</td>" in page
    assert page.index(sentence) < page.index("<h2>")  # what to be careful with comes before all else
    for told in ("90 to open", ">12<", "<th>sigma</th>", ">unknown<", "<th>n</th>", "a.csv", ">2336<", "e6" * 32):
        assert told in page, told
    section = page[page.index("<h2>How well it follows its records") : page.index("<h2>Reference experiment")]
    cells = ["&lt;a&gt;.csv", "30.64", "0.8075", "0.56", "0.9782", "0.99", "0.5"]
    assert re.findall(r"<td[^>]*>(.*)</td>", section) == cells
    svg = ElementTree.fromstring(page[page.index("<svg") : page.index("</svg>") + 6])
    assert [text.text for text in svg.findall("text")][-3:] == ["±24.5 mm", "±16.3 mm", "±8.17 mm"]
    by_hand = fmu_contents(ModelFile("by_hand", SPRING))
    for title in ("<b>Caution", "<h2>Uncertainty", "<h2>Records", "How well it follows"):
        assert title not in by_hand["documentation/index.html"].decode()
    for file in ("documentation/index.html", "documentation/fmi-ls-ref.txt"):
        assert "which names its records and holds none of them" in " ".join(by_hand[file].decode().split())
    for force in (0.0, 1e12, -1e-300):  # loops of no height are drawn
        svg = ElementTree.fromstring(loops_svg(replace(SPRING, kE=(force,), kappa_omega=1e-15)))
        assert len(svg.findall("polyline")) == 3
        assert "nan" not in ElementTree.tostring(svg, encoding="unicode")


@pytest.mark.parametrize("name", ["real time", "no energy", "co-simulation"])
def test_the_page_names_the_derivatives_that_are_refused(name: str) -> None:
    form = FORMS[name]
    known = ("displacement", "omega_start", "rho", "sigma", "n", "kappa_omega")
    with form.instance() as one:
        one.enter_initialization()
        assert one.set(displacement=0.02) == OK
        assert all(one.directional(["force"], {parameter: 1.0}) == OK for parameter in known)
        assert one.ExitInitializationMode() == OK
        refused = {parameter for parameter in known if one.directional(["force"], {parameter: 1.0}) != OK}
    said = re.search(r"derivatives with respect to ([\w, ]+) are refused", page_of(form))
    assert set(re.split(", | and ", said[1]) if said else ()) == refused
    assert bool(refused) == ("real_time" in form.options)


def test_building_leaves_nothing_else_and_may_be_named_like_a_keyword(tmp_path: Path) -> None:
    path, modules = list(sys.path), set(sys.modules)
    fmu = build_python_fmu(ModelFile("lambda", OTHER), tmp_path / "new")
    assert [p.name for p in tmp_path.rglob("*")] == ["new", "lambda_python.fmu"]
    assert (sys.path, set(sys.modules)) == (path, modules)
    assert examine_fmu(fmu).problems == ()
    with pytest.raises(StrandspringError, match="cannot be written"):
        build_python_fmu(MODEL, fmu)
