"""modelDescription.xml of FMI 3.0: variables, units and structure, held against the design and against FMI 2.0."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.validation import validate_fmu

from fmu_tools import OTHER, SPRING
from springs import TABLE
from strandspring.core.parameters import SpringParameters
from strandspring.core.variables import start_values
from strandspring.fmu.checks.check import described_spring
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.modelfile import ModelFile

AWKWARD = "\"quoted\" 'single' <b>bold</b> &amp; ]]> <!-- \nnew line\ttab äöü 弹簧 %s %n {name} {{ 7*7 }}"
ONE = SpringParameters((5.0,), (1.0,), 10.0, 200.0, 1.0, 0.5, 0.0, -0.01, 0.01)
MANY = replace(ONE, kE=(0.0, 1e4, *[0.0] * 19), kA=(1.0, *[0.0] * 8))
SPRINGS = {"polynomial": SPRING, "table": TABLE, "other": OTHER, "one": ONE, "many": MANY}
FORMS = {"usual": False, "states": True}


def described(folder: Path, spring: SpringParameters, with_states: bool = False, fmi: int = 3, **options: Any) -> Any:
    """The model description, of an FMU without binaries, that FMPy has validated."""
    model = ModelFile("spring", spring, options.pop("text", ""))
    fmu = build_native_fmu(model, folder, (), zero=0.0, with_states=with_states, fmi=fmi, **options)
    assert validate_fmu(str(fmu)) == []
    return fmpy.read_model_description(str(fmu))


CASES = [(spring, form, kind) for spring in SPRINGS for form in FORMS for kind in ("scalars", "arrays")]


@pytest.fixture(scope="module", params=CASES, ids="-".join)
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, Any, bool]:
    """The spring, its descriptions by FMI 2.0 and FMI 3.0, and whether they are those of the form with states."""
    spring, with_states, arrays = SPRINGS[request.param[0]], FORMS[request.param[1]], request.param[2] == "arrays"
    folder = tmp_path_factory.mktemp("fmi3")
    before, after = described(folder, spring, with_states, 2), described(folder, spring, with_states, arrays=arrays)
    assert any(v.dimensions for v in after.modelVariables) == arrays
    return spring, before, after, with_states


def folded(name: str, after: Any) -> str:
    """The name in FMI 3.0, with or without arrays, of a variable of FMI 2.0."""
    array = re.sub(r"^(kE|kA|FE_knots|FE_forces)_\d+$", r"\1", name)
    return array if any(v.name == array for v in after.modelVariables) else name


def test_variables_of_the_design(pair: tuple[Any, Any, Any, bool]) -> None:
    spring, before, description, with_states = pair
    coefficients = [v.name for v in before.modelVariables if re.match(r"(kE|kA|FE_knots|FE_forces)_\d", v.name)]
    names = list(dict.fromkeys(folded(name, description) for name in coefficients))
    own = ["velocity", "der(absorbed_energy)", "der(omega)"] if with_states else ["omega_start", "input_resolution"]
    expected = [
        "displacement", "force", "stiffness", "absorbed_energy", "extrapolating", "omega",
        "kappa_omega", "rho", "sigma", "n", "displacement_offset", "displacement_min", "displacement_max",
        *names, *own, "time",
        *([] if with_states else ["reversal_indicator"]),
    ]  # fmt: skip
    assert [(v.name, v.valueReference) for v in description.modelVariables] == list(
        zip(expected, range(1, len(expected) + 1), strict=True)
    )
    of = {v.name: v for v in description.modelVariables}
    assert {v.type for v in of.values()} - {"Float64"} == {of["extrapolating"].type} == {"Boolean"}
    arrays = {
        name: len(getattr(spring, name)) for name in ("kE", "kA", "FE_knots", "FE_forces") if name in of
    }  # none of scalars
    assert {v.name: [int(d.start) for d in v.dimensions] for v in of.values() if v.dimensions} == {
        name: [size] for name, size in arrays.items()
    }
    assert (of["time"].causality, of["time"].unit, of["time"].start) == ("independent", "s", None)
    assert {v.name for v in of.values() if v.causality == "input"} == {"displacement", *(own[:1] * with_states)}


def test_scalars_are_those_of_fmi_2(pair: tuple[Any, Any, Any, bool]) -> None:
    _, before, after, _ = pair
    scalars = {v.name: v for v in after.modelVariables if not v.dimensions}
    shared = [v for v in before.modelVariables if folded(v.name, after) == v.name]
    assert {v.name for v in shared} == scalars.keys() - {"time", "reversal_indicator"}
    for old in shared:
        new = scalars[old.name]
        for attribute in ("description", "causality", "variability", "initial", "unit", "displayUnit", "min", "max",
                          "nominal", "start"):  # fmt: skip
            assert getattr(old, attribute) == getattr(new, attribute), (old.name, attribute)
        state = (None if v.derivative is None else v.derivative.name for v in (old, new))
        assert len(set(state)) == 1


def test_arrays_gather_the_scalars_of_fmi_2(pair: tuple[Any, Any, Any, bool]) -> None:
    spring, before, after, with_states = pair
    for array in (v for v in after.modelVariables if v.dimensions):
        elements = [v for v in before.modelVariables if folded(v.name, after) == array.name]
        assert [float(text) for text in array.start.split()] == [float(v.start) for v in elements]
        last = elements[-1]  # kA_0 is fixed
        assert (array.causality, array.variability, array.initial) == (last.causality, last.variability, last.initial)
        units = [v.unit for v in elements]
        if array.name.startswith("FE_"):
            assert {array.unit} == set(units)
        else:  # a unit each
            assert array.unit is None
            assert re.search(r"in ([^;]*)", array.description)[1].split(", ") == units
    assert described_spring(after) == described_spring(before) == spring
    scalars = {v.name: float(v.start) for v in after.modelVariables if v.start and not v.dimensions}
    assert scalars.items() <= start_values(spring, with_states).items()


def test_units_are_those_of_fmi_2(pair: tuple[Any, Any, Any, bool]) -> None:
    _, before, after, _ = pair
    known = {unit.name: repr(unit) for unit in before.unitDefinitions}
    new = {unit.name: repr(unit) for unit in after.unitDefinitions}
    used = {v.unit for v in after.modelVariables if v.unit}
    assert new.keys() == used
    assert new.keys() - known.keys() == {"s"}
    assert all(new[name] == known[name] for name in new.keys() & known.keys())
    (second,) = (unit for unit in after.unitDefinitions if unit.name == "s")
    assert int(second.baseUnit.s) == 1


def test_structure(pair: tuple[Any, Any, Any, bool]) -> None:
    _, before, after, with_states = pair
    parameters = {v.name for v in after.modelVariables if v.causality == "parameter"}
    for title in ("outputs", "derivatives", "initialUnknowns"):
        old, new = ({u.variable.name: u for u in getattr(one, title)} for one in (before, after))
        assert list(old) == list(new)
        for name, unknown in new.items():
            found = {v.name for v in unknown.dependencies}
            expected = {folded(v.name, after) for v in old[name].dependencies}
            assert set(unknown.dependenciesKind) <= {"dependent"}
            if title == "initialUnknowns":
                assert found == expected
            elif not with_states:  # what the path was depends on all parameters
                assert found == expected | parameters
            elif name != "absorbed_energy":  # a function of states and inputs
                (start,) = (u for u in after.initialUnknowns if u.variable.name == name)
                assert found == {v.name for v in start.dependencies} >= expected
            else:
                assert found == expected == {"absorbed_energy"}
    indicators = {u.variable.name: {v.name for v in u.dependencies} for u in after.eventIndicators}
    assert indicators == (
        {} if with_states else {"reversal_indicator": {"displacement", "time", "displacement_min", "displacement_max"}}
    )


@pytest.mark.parametrize("form", FORMS)
def test_capabilities(form: str, tmp_path: Path) -> None:
    fmu = build_native_fmu(ModelFile("spring", SPRING), tmp_path, (), with_states=FORMS[form], fmi=3)
    identifier = "spring_fmi3_states" if FORMS[form] else "spring_fmi3"
    assert fmu.name == f"{identifier}.fmu"
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert (root.get("fmiVersion"), root.get("modelName")) == ("3.0", identifier)
    assert re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", str(root.get("instantiationToken")))
    abilities = {
        "modelIdentifier": identifier, "needsExecutionTool": "false", "canBeInstantiatedOnlyOncePerProcess": "false",
        "canGetAndSetFMUState": "true", "canSerializeFMUState": "true", "providesDirectionalDerivatives": "true",
        "providesAdjointDerivatives": "true",
    }  # fmt: skip
    of_model = {"needsCompletedIntegratorStep": "true", "providesEvaluateDiscreteStates": "false"}
    of_slave = {
        "canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "1", "hasEventMode": "false",
        "providesIntermediateUpdate": "false", "mightReturnEarlyFromDoStep": "false",
        "canReturnEarlyAfterIntermediateUpdate": "false",
    }  # fmt: skip
    expected = {"ModelExchange": abilities | of_model}
    if not FORMS[form]:
        expected["CoSimulation"] = abilities | of_slave
    assert {one.tag: one.attrib for one in root if "modelIdentifier" in one.attrib} == expected


def test_log_categories_and_identity_are_those_of_fmi_2(pair: tuple[Any, Any, Any, bool]) -> None:
    _, before, after, _ = pair
    for attribute in ("logCategories", "defaultExperiment", "author", "version", "copyright", "license", "description"):
        assert repr(getattr(before, attribute)) == repr(getattr(after, attribute)), attribute
    assert before.guid != after.guid


def test_start_values_keep_every_bit(tmp_path: Path) -> None:
    awkward = replace(SPRING, kE=(0.1 + 0.2, 1.0 / 3.0, 5e-324, -3.7e19), rho=100.0 + 1e-13)
    assert described_spring(described(tmp_path, awkward)) == awkward


def test_hostile_texts(tmp_path: Path) -> None:
    description = described(tmp_path, SPRING, text=AWKWARD, author='<Ä> & "Söhne" ]]>')
    assert description.description == AWKWARD
    assert description.author == '<Ä> & "Söhne" ]]>'


def test_without_energy_other_references_stay(tmp_path: Path) -> None:
    for fmi in (2, 3):
        whole = described(tmp_path / "whole", SPRING, fmi=fmi, real_time=True)
        less = described(tmp_path / "less", SPRING, fmi=fmi, real_time=True, no_energy=True)
        references = {v.name: v.valueReference for v in whole.modelVariables}
        assert references.pop("absorbed_energy") == (3 if fmi == 2 else 4)
        assert {v.name: v.valueReference for v in less.modelVariables} == references
        for title in ("outputs", "initialUnknowns", "eventIndicators"):
            old, new = ({u.variable.name: [v.name for v in u.dependencies] for u in getattr(one, title)}
                        for one in (whole, less))  # fmt: skip
            old.pop("absorbed_energy", None)
            assert new == old
        assert less.guid != whole.guid


def test_the_token_follows_the_content(tmp_path: Path) -> None:
    springs = (SPRING, replace(SPRING, rho=SPRING.rho * (1 + 1e-15)), OTHER)
    tokens = {described(tmp_path / str(k), spring).guid for k, spring in enumerate(springs)}
    assert len(tokens) == 3
