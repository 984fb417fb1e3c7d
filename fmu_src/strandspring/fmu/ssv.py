"""Parameter values of SSP 1.0 (System Structure Parameter Values, SSV), named as the FMU's parameters.

Tools for systems of FMUs apply such a file to a spring FMU with the same number of coefficients, so another
identification of the same mount needs no new FMU. Displacement is counted from the same zero as in the FMU.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .._version import __version__
from ..core.variables import Unit, start_values, units, variables
from ..modelfile import ModelFile

_NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"

# Name, description, unit and value of a parameter.
Row = tuple[str, str, str, float]


def parameter_values(model: ModelFile, with_states: bool = False) -> str:
    """XML of an SSV file with every settable variable of the model's FMU; the same model gives the same text."""
    spring = model.parameters
    start = start_values(spring, with_states)
    table = variables(*spring.counts, with_states=with_states)
    rows = [(v.name, v.description, str(v.unit), start[v.name]) for v in table if v.name in start]
    return parameter_set(model.name, model.description, rows, units(*spring.counts[:2], with_states=with_states))


def parameter_set(name: str, about: str, rows: Iterable[Row], known: Iterable[Unit]) -> str:
    """XML of an SSV file with these parameters, whose units are among those known."""
    root = Element(
        "ssv:ParameterSet",
        {
            "xmlns:ssv": f"{_NAMESPACE}ParameterValues",
            "xmlns:ssc": f"{_NAMESPACE}Common",
            "version": "1.0",
            "name": name,
            **({"description": about} if about else {}),
            "generationTool": f"strandspring {__version__}",
        },
    )
    parameters = SubElement(root, "ssv:Parameters")
    used = set()
    for variable, description, unit, value in rows:
        parameter = SubElement(parameters, "ssv:Parameter", {"name": variable, "description": description})
        # repr represents every float exactly.
        SubElement(parameter, "ssv:Real", {"value": repr(value), "unit": unit})
        used.add(unit)
    definitions = SubElement(root, "ssv:Units")
    for symbol in known:
        if symbol.name in used:
            exponents = {"kg": symbol.kg, "m": symbol.m, "s": symbol.s}
            definition = SubElement(definitions, "ssc:Unit", {"name": symbol.name})
            SubElement(definition, "ssc:BaseUnit", {name: str(power) for name, power in exponents.items() if power})
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
