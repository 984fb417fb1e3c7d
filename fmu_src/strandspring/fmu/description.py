"""modelDescription.xml of FMI 2.0, made from the variable table."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..core.variables import Unit, Variable, nominal_values, start_values, units, variables
from ..errors import BuildError
from ..modelfile import ModelFile

# Of the categories that FMI names, those that a spring uses.
LOG_CATEGORIES = {
    "logStatusWarning": "The displacement left the identified range.",
    "logStatusError": "A displacement or a step was refused; the message names its value.",
    "logAll": "Every message.",
}

# What the interfaces of both back ends can do.
_ABILITIES = {
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}


@dataclass(frozen=True)
class Backend:
    """That in which the descriptions of the back ends differ.

    Attributes
    ----------
    co_simulation, model_exchange : mapping of str to str   Attributes of the two interfaces; None if there is none.
    sources : tuple of str                                  The C files below ``sources/`` to be compiled.
    author, version : str                                   Of the FMU.
    with_states : bool                                      Whether it is the form with continuous states.
    """

    co_simulation: Mapping[str, str] | None
    model_exchange: Mapping[str, str] | None = None
    sources: tuple[str, ...] = ()
    author: str = ""
    version: str = ""
    with_states: bool = False


@dataclass(frozen=True)
class Content:
    """What a model description says of the model itself.

    Attributes
    ----------
    name, about : str                 Identifier and description.
    table : tuple of Variable
    units : tuple of Unit             Those that the table uses.
    start, nominal : mapping          Values by the name of a variable.
    log_categories : mapping          Description of each.
    step : float                      Of the default experiment [s].
    """

    name: str
    about: str
    table: tuple[Variable, ...]
    units: tuple[Unit, ...]
    start: Mapping[str, float]
    nominal: Mapping[str, float] = field(default_factory=dict)
    log_categories: Mapping[str, str] = field(default_factory=lambda: LOG_CATEGORIES)
    step: float = 1e-3


def model_description(model: ModelFile, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """The description of one spring as UTF-8 XML; the same arguments give the same bytes."""
    spring = model.parameters
    content = Content(
        model.name,
        model.description or "Hysteretic spring: displacement in, restoring force out",
        variables(*spring.counts, with_states=backend.with_states),
        units(*spring.counts[:2], with_states=backend.with_states),
        start_values(spring, backend.with_states),
        nominal_values(spring) if backend.with_states else {},
    )
    return described(content, guid, generation_tool, backend)


def described(content: Content, guid: str, generation_tool: str, backend: Backend) -> bytes:
    """A model description as UTF-8 XML; the same arguments give the same bytes."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": content.name,
            "guid": guid,
            "description": content.about,
            "author": backend.author or "strandspring",
            "version": backend.version,
            "copyright": "Model code: strandspring maintainers; see documentation/licenses",
            "license": "MIT",
            "generationTool": generation_tool,
            **_generation_date(),
            "variableNamingConvention": "flat",
        },
    )
    if backend.model_exchange is not None:
        root.set("numberOfEventIndicators", "0" if backend.with_states else "1")
        _append_interface(root, "ModelExchange", content.name, backend.model_exchange, backend.sources)
    if backend.co_simulation is not None:
        variable_steps = {"canHandleVariableCommunicationStepSize": "true"}
        _append_interface(
            root, "CoSimulation", content.name, {**variable_steps, **backend.co_simulation}, backend.sources
        )
    _append_units(SubElement(root, "UnitDefinitions"), content.units)
    categories = SubElement(root, "LogCategories")
    for name, text in content.log_categories.items():
        SubElement(categories, "Category", {"name": name, "description": text})
    SubElement(
        root,
        "DefaultExperiment",
        {"startTime": "0", "stopTime": "1", "tolerance": "1e-06", "stepSize": repr(content.step)},
    )
    _append_variables(SubElement(root, "ModelVariables"), content.table, content.start, content.nominal)
    _append_structure(SubElement(root, "ModelStructure"), content.table)
    indent(root)
    return bytes(tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def _generation_date() -> dict[str, str]:
    """The time that SOURCE_DATE_EPOCH gives, as builds that can be repeated do; without it none, for the same reason.

    Raises
    ------
    BuildError   If it is no time.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        return {}
    try:
        date = datetime.fromtimestamp(int(given), timezone.utc)
    except (ValueError, OverflowError, OSError):
        raise BuildError(f"SOURCE_DATE_EPOCH must be seconds since 1970, got {given[:40]!r}.") from None
    return {"generationDateAndTime": date.strftime("%Y-%m-%dT%H:%M:%SZ")}


def _append_interface(
    parent: Element, kind: str, identifier: str, abilities: Mapping[str, str], sources: tuple[str, ...]
) -> None:
    element = SubElement(parent, kind, {"modelIdentifier": identifier, **_ABILITIES, **abilities})
    if sources:
        listed = SubElement(element, "SourceFiles")
        for name in sources:
            SubElement(listed, "File", {"name": name})


def _append_units(parent: Element, all_units: tuple[Unit, ...]) -> None:
    for unit in all_units:
        element = SubElement(parent, "Unit", {"name": unit.name})
        exponents = {"kg": unit.kg, "m": unit.m, "s": unit.s}
        SubElement(element, "BaseUnit", {name: str(power) for name, power in exponents.items() if power})
        for name, factor in unit.displayed:
            SubElement(element, "DisplayUnit", {"name": name, "factor": repr(factor)})


def _append_variables(
    parent: Element, table: tuple[Variable, ...], start: Mapping[str, float], nominal: Mapping[str, float]
) -> None:
    index = _indices(table)
    for reference, variable in enumerate(table):
        attributes = {
            "name": variable.name,
            "valueReference": str(reference),
            "description": variable.description,
            "causality": variable.causality,
            "variability": variable.variability,
            "initial": variable.initial,
        }
        element = SubElement(parent, "ScalarVariable", _given(attributes))
        typed = {
            "unit": variable.unit,
            "displayUnit": variable.display_unit,
            "min": _text(variable.minimum),
            "max": _text(variable.maximum),
            "nominal": _text(nominal.get(variable.name)),
            "start": _text(start.get(variable.name)),
            "derivative": None if variable.derivative_of is None else index[variable.derivative_of],
        }
        SubElement(element, variable.kind, _given(typed))


def _append_structure(parent: Element, table: tuple[Variable, ...]) -> None:
    index = _indices(table)
    outputs = [variable for variable in table if variable.causality == "output"]
    derivatives = [variable for variable in table if variable.derivative_of]
    lists = {"Outputs": outputs, "Derivatives": derivatives}
    # Both continuous states have exact start values.
    lists["InitialUnknowns"] = [v for v in (*outputs, *derivatives) if v.initial == "calculated"]
    for title, unknowns in lists.items():
        if not unknowns:
            continue
        element = SubElement(parent, title)
        for variable in unknowns:
            names = variable.starts_from if title == "InitialUnknowns" else variable.depends_on
            SubElement(
                element,
                "Unknown",
                {
                    "index": index[variable.name],
                    "dependencies": " ".join(sorted((index[name] for name in names), key=int)),
                    "dependenciesKind": " ".join("dependent" for _ in names),
                },
            )


def _indices(table: tuple[Variable, ...]) -> dict[str, str]:
    """FMI counts variables from 1."""
    return {variable.name: str(place) for place, variable in enumerate(table, start=1)}


def _text(value: float | None) -> str | None:
    # repr gives back every bit of a float.
    return None if value is None else repr(value)


def _given(attributes: Mapping[str, str | None]) -> dict[str, str]:
    return {name: value for name, value in attributes.items() if value is not None}
