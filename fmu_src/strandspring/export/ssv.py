"""Parameter values of SSP 1.0 (System Structure Parameter Values, SSV), named as the FMU's parameters.

Tools for systems of FMUs apply such a file to a spring FMU with the same number of coefficients, so another
identification of the same mount needs no new FMU. Displacement is counted from the same zero as in the FMU.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .._version import __version__
from ..core.variables import start_values, units, variables
from ..modelfile import ModelFile

_NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"


def parameter_values(model: ModelFile) -> str:
    """XML of an SSV file with every settable variable of the model's FMU; the same model gives the same text."""
    spring = model.parameters
    start = start_values(spring)
    table = [variable for variable in variables(*spring.counts) if variable.name in start]
    root = Element(
        "ssv:ParameterSet",
        {
            "xmlns:ssv": f"{_NAMESPACE}ParameterValues",
            "xmlns:ssc": f"{_NAMESPACE}Common",
            "version": "1.0",
            "name": model.name,
            **({"description": model.description} if model.description else {}),
            "generationTool": f"strandspring {__version__}",
        },
    )
    parameters = SubElement(root, "ssv:Parameters")
    for variable in table:
        parameter = SubElement(
            parameters, "ssv:Parameter", {"name": variable.name, "description": variable.description}
        )
        # repr represents every float exactly.
        SubElement(parameter, "ssv:Real", {"value": repr(start[variable.name]), "unit": str(variable.unit)})
    used = {variable.unit for variable in table}
    definitions = SubElement(root, "ssv:Units")
    for unit in units(*spring.counts[:2]):
        if unit.name in used:
            exponents = {"kg": unit.kg, "m": unit.m, "s": unit.s}
            definition = SubElement(definitions, "ssc:Unit", {"name": unit.name})
            SubElement(definition, "ssc:BaseUnit", {name: str(power) for name, power in exponents.items() if power})
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
