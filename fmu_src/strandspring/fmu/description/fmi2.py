"""The parts of modelDescription.xml that FMI 2.0 writes in its own way."""

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

VERSION, TOKEN = "2.0", "guid"

# What the interfaces of both back ends can do.
_ABILITIES = {
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}
_TITLES = {"Output": "Outputs", "Derivative": "Derivatives", "InitialUnknown": "InitialUnknowns"}


def append_interfaces(root: Element, content: DescriptionContent, backend: Backend) -> None:
    """Model exchange and co-simulation, with the sources of each."""
    interfaces = {}
    if backend.model_exchange is not None:
        root.set("numberOfEventIndicators", "0" if backend.with_states else "1")
        interfaces["ModelExchange"] = backend.model_exchange
    if backend.co_simulation is not None:
        interfaces["CoSimulation"] = {"canHandleVariableCommunicationStepSize": "true", **backend.co_simulation}
    for kind, abilities in interfaces.items():
        element = SubElement(root, kind, {"modelIdentifier": content.name, **_ABILITIES, **abilities})
        if backend.sources:
            listed = SubElement(element, "SourceFiles")
            for name in backend.sources:
                SubElement(listed, "File", {"name": name})


def append_variables(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """Variables, which the rest of the description refers to by their place among them."""
    listed, references = content.listed(backend), content.references
    places = _places(content, backend)
    for variable in listed.values():
        attributes = common_attributes(variable, references[variable.name])
        element = SubElement(parent, "ScalarVariable", given(attributes))
        SubElement(element, variable.kind, given(typed_attributes(variable, content, places)))


def append_structure(parent: Element, content: DescriptionContent, backend: Backend) -> None:
    """Outputs, derivatives of states and initial unknowns, with what they depend on."""
    places = _places(content, backend)
    for kind, unknowns in unknowns_of(content.listed(backend)).items():
        if not unknowns:
            continue
        element = SubElement(parent, _TITLES[kind])
        for variable in unknowns:
            names = variable.starts_from if kind == "InitialUnknown" else variable.depends_on
            SubElement(element, "Unknown", {"index": places[variable.name], **dependencies(names, places)})


def _places(content: DescriptionContent, backend: Backend) -> dict[str, str]:
    """FMI counts variables from 1."""
    return {name: str(place) for place, name in enumerate(content.listed(backend), start=1)}
