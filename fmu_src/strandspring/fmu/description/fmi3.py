"""The parts of modelDescription.xml that FMI 3.0 writes in its own way."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from .content import (
    Backend,
    DescriptionContent,
    common_attributes,
    dependencies,
    given,
    typed_attributes,
    unknowns_of,
)
from .described_variables import REVERSAL_INDICATOR, TypedVariable

VERSION, TOKEN = "3.0", "instantiationToken"

_ABILITIES = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
}
# Of co-simulation, where nothing happens between communication points that a host could take part in.
NO_EVENTS = {
    "providesIntermediateUpdate": "false",
    "mightReturnEarlyFromDoStep": "false",
    "canReturnEarlyAfterIntermediateUpdate": "false",
    "hasEventMode": "false",
}
_TITLES = {"Output": "Output", "Derivative": "ContinuousStateDerivative", "InitialUnknown": "InitialUnknown"}


def append_interfaces(root: Element, content: DescriptionContent, backend: Backend) -> None:
    """Model exchange and co-simulation; sources have a file of their own."""
    for kind, abilities in {"ModelExchange": backend.model_exchange, "CoSimulation": backend.co_simulation}.items():
        if abilities is not None:
            SubElement(root, kind, {"modelIdentifier": content.name, **_ABILITIES, **abilities})


def append_variables(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """Variables, which the rest of the description refers to by their value references."""
    references = _references(content)
    for variable in content.listed(backend).values():
        attributes = common_attributes(variable, references[variable.name])
        attributes |= typed_attributes(variable, content, references)
        element = SubElement(parent, variable.kind, given(attributes))
        if isinstance(variable, TypedVariable) and variable.size is not None:
            SubElement(element, "Dimension", {"start": str(variable.size)})


def append_structure(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """Outputs, derivatives of states, initial unknowns and event indicators, with what they depend on."""
    listed, references = content.listed(backend), _references(content)
    indicators = [listed[REVERSAL_INDICATOR]] if REVERSAL_INDICATOR in listed else []
    unknowns = {_TITLES[kind]: listed_variables for kind, listed_variables in unknowns_of(listed).items()}
    for title, listed_variables in {**unknowns, "EventIndicator": indicators}.items():
        for variable in listed_variables:
            names = variable.starts_from if title == "InitialUnknown" else variable.depends_on
            reference = references[variable.name]
            SubElement(parent, title, {"valueReference": reference, **dependencies(names, references)})


def _references(content: DescriptionContent) -> dict[str, str]:
    """Value reference of each variable: its place in the table, counted from 1.

    FMI 3.0 would allow 0, but OMSimulator up to 3.0.0.post198 reads dependencies as FMI 2.0 counts them.
    """
    return {variable.name: str(place) for place, variable in enumerate(content.table, 1)}
