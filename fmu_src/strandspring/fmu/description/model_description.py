"""modelDescription.xml of FMI 2.0 and 3.0, made from the variable table."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import date, datetime, timezone
from xml.etree.ElementTree import Element, SubElement

from ...core.variables import FmiUnit, Variable
from ...errors import BuildError
from ...model.modelfile import ModelFile
from .content import Backend, DescriptionContent, base_unit, xml_file
from .described_variables import REVERSAL_INDICATOR, described_variables, nominal_values

# Names that the versions of FMI have for the same.
_TOKENS = {2: "guid", 3: "instantiationToken"}
_ABILITIES = {
    2: {
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    },
    3: {
        "needsExecutionTool": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
    },
}
_UNKNOWNS = {
    "Output": {2: "Outputs", 3: "Output"},
    "Derivative": {2: "Derivatives", 3: "ContinuousStateDerivative"},
    "InitialUnknown": {2: "InitialUnknowns", 3: "InitialUnknown"},
    "EventIndicator": {3: "EventIndicator"},
}


def model_description(model: ModelFile, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """The description of one spring as UTF-8 XML; the same arguments give the same bytes."""
    variables = described_variables(model, backend.with_states, backend.fmi)
    content = DescriptionContent(
        model.name,
        model.description or "Hysteretic spring: displacement in, restoring force out",
        *variables,
        nominal_values(model.parameters, variables.table),
        date=_stated(model, "date"),
    )
    backend = replace(backend, author=backend.author or _stated(model, "author"))
    return described(content, guid, generation_tool, backend)


def described(content: DescriptionContent, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """A model description as UTF-8 XML; the same arguments give the same bytes."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{backend.fmi}.0",
            "modelName": content.name,
            _TOKENS[backend.fmi]: guid,
            "description": content.about,
            **({"author": backend.author} if backend.author else {}),
            "version": backend.version,
            "copyright": "Model code: strandspring maintainers; see documentation/licenses",
            "license": "MIT",
            "generationTool": generation_tool,
            **_generation_date(content.date),
            "variableNamingConvention": "flat",
        },
    )
    _append_interfaces(root, content, backend)
    _append_units(SubElement(root, "UnitDefinitions"), content.units)
    categories = SubElement(root, "LogCategories")
    for name, text in content.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": text})
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": "1",
            "tolerance": "1e-08" if backend.with_states else "1e-06",
            "stepSize": repr(content.step),
        },
    )
    _append_variables(SubElement(root, "ModelVariables"), content, backend)
    _append_structure(SubElement(root, "ModelStructure"), content, backend)
    return xml_file(root)


def _append_interfaces(root: Element, content: DescriptionContent, backend: Backend) -> None:
    """Model exchange and co-simulation, with the sources of each; in FMI 3.0 these have a file of their own."""
    is_older = backend.fmi == 2
    if is_older and backend.model_exchange is not None:
        root.set("numberOfEventIndicators", "0" if backend.with_states else "1")
    steps = {"canHandleVariableCommunicationStepSize": "true"} if is_older else {}
    interfaces = {
        "ModelExchange": backend.model_exchange,
        "CoSimulation": backend.co_simulation and {**steps, **backend.co_simulation},
    }
    for kind, abilities in interfaces.items():
        if abilities is None:
            continue
        element = SubElement(root, kind, {"modelIdentifier": content.name, **_ABILITIES[backend.fmi], **abilities})
        if is_older and backend.sources:
            listed = SubElement(element, "SourceFiles")
            for name in backend.sources:
                SubElement(listed, "File", {"name": name})


def _append_variables(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """The variables; FMI 3.0 has one element for each."""
    places = _places(content, backend)
    for variable in content.listed(backend).values():
        typed = _typed_attributes(variable, content, places)
        if backend.fmi == 2:
            common = _common_attributes(variable, content.references[variable.name])
            SubElement(SubElement(parent, "ScalarVariable", common), variable.kind, typed)
            continue
        SubElement(parent, variable.kind, _common_attributes(variable, places[variable.name]) | typed)


def _append_structure(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """Outputs, derivatives of states, initial unknowns and event indicators, with what they depend on."""
    places = _places(content, backend)
    for kind, unknowns in _unknowns_of(content.listed(backend)).items():
        title = _UNKNOWNS[kind].get(backend.fmi)
        if not unknowns or title is None:
            continue
        # FMI 2.0 has lists of them.
        element, name = (SubElement(parent, title), "Unknown") if backend.fmi == 2 else (parent, title)
        for variable in unknowns:
            names = variable.starts_from if kind == "InitialUnknown" else variable.depends_on
            place = {"index" if backend.fmi == 2 else "valueReference": places[variable.name]}
            SubElement(element, name, {**place, **_dependencies(names, places)})


def _places(content: DescriptionContent, backend: Backend) -> dict[str, str]:
    """What variables are referred to by: in FMI 2.0 their places among those described, in FMI 3.0 value references,
    their places in the table; both are counted from 1.

    FMI 3.0 would allow 0, but OMSimulator up to 3.0.0.post198 reads dependencies as FMI 2.0 counts them.
    """
    names = content.listed(backend) if backend.fmi == 2 else [variable.name for variable in content.table]
    return {name: str(place) for place, name in enumerate(names, start=1)}


def _unknowns_of(listed: Mapping[str, Variable]) -> dict[str, list[Variable]]:
    """The unknowns of the model structure: outputs, derivatives, those when initialization ends, event indicators."""
    outputs = [variable for variable in listed.values() if variable.causality == "output"]
    derivatives = [variable for variable in listed.values() if variable.derivative_of]
    # Both continuous states have exact start values.
    initial = [v for v in (*outputs, *derivatives) if v.initial == "calculated"]
    indicators = [listed[REVERSAL_INDICATOR]] if REVERSAL_INDICATOR in listed else []
    return {"Output": outputs, "Derivative": derivatives, "InitialUnknown": initial, "EventIndicator": indicators}


def _dependencies(names: tuple[str, ...], places: Mapping[str, str]) -> dict[str, str]:
    """Attributes that say on which variables an unknown depends; `places` is how these are referred to."""
    return {
        "dependencies": " ".join(sorted((places[name] for name in names), key=int)),
        "dependenciesKind": " ".join("dependent" for _ in names),
    }


def _common_attributes(variable: Variable, reference: str) -> dict[str, str]:
    """Attributes that all variables have."""
    return _given(
        {
            "name": variable.name,
            "valueReference": reference,
            "description": variable.description,
            "causality": variable.causality,
            "variability": variable.variability,
            "initial": variable.initial,
        }
    )


def _typed_attributes(variable: Variable, content: DescriptionContent, places: Mapping[str, str]) -> dict[str, str]:
    """Attributes that depend on the type."""
    return _given(
        {
            "unit": variable.unit,
            "displayUnit": variable.display_unit,
            "min": _text(variable.minimum),
            "max": _text(variable.maximum),
            "nominal": _text(content.nominal.get(variable.name)),
            "start": _text(content.start.get(variable.name)),
            "derivative": None if variable.derivative_of is None else places[variable.derivative_of],
        }
    )


def _given(attributes: Mapping[str, str | None]) -> dict[str, str]:
    """Attributes that have a value."""
    return {name: value for name, value in attributes.items() if value is not None}


def _text(value: float | None) -> str | None:
    # repr gives back every bit of a float.
    return None if value is None else repr(value)


def _stated(model: ModelFile, name: str) -> str:
    """A printable text of the provenance by its name, else none."""
    text = model.provenance.get(name)
    return text if isinstance(text, str) and text.isprintable() else ""


def _generation_date(stated: str) -> dict[str, str]:
    """The time that SOURCE_DATE_EPOCH gives, as builds that can be repeated do, else the date that the model states.

    Without either there is none, so that the same model gives the same bytes.

    Raises
    ------
    BuildError   If it is no time.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        with suppress(ValueError):
            return {"generationDateAndTime": f"{date.fromisoformat(stated)}T00:00:00Z"}
        return {}
    try:
        time = datetime.fromtimestamp(int(given), timezone.utc)
    except (ValueError, OverflowError, OSError):
        raise BuildError(f"SOURCE_DATE_EPOCH must be seconds since 1970, got {given[:40]!r}.") from None
    return {"generationDateAndTime": time.strftime("%Y-%m-%dT%H:%M:%SZ")}


def _append_units(parent: Element, all_units: tuple[FmiUnit, ...]) -> None:
    for unit in all_units:
        element = SubElement(parent, "Unit", {"name": unit.name})
        SubElement(element, "BaseUnit", base_unit(unit))
        for name, factor in unit.displayed:
            SubElement(element, "DisplayUnit", {"name": name, "factor": repr(factor)})
