"""Parameter values of SSP (System Structure Parameter Values, SSV), named as the FMU's parameters.

Tools for systems of FMUs apply such a file to a spring FMU with the same number of coefficients, so another
identification of the same mount needs no new FMU. Displacement is counted from the same zero as in the FMU. For FMI 2.0
they are those of SSP 1.0, for FMI 3.0 of SSP 2.0.
"""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..._version import __version__
from ...core.variables import FmiUnit
from ...model.modelfile import ModelFile
from .content import base_unit
from .described_variables import described_variables

_NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructure"

# Name, description, unit and value of a parameter.
Row = tuple[str, str, str | None, float]

# The version of SSP by that of FMI, and the element of a value by that of SSP.
_SSP = {2: 1, 3: 2}
_REAL = {1: "Real", 2: "Float64"}


def parameter_values(model: ModelFile, with_states: bool = False, fmi: int = 2) -> str:
    """XML of an SSV file with every settable variable of the model's FMU; the same model gives the same text."""
    rows, known = parameter_rows(model, with_states, fmi)
    return parameter_set(model.name, model.description, rows, known, _SSP[fmi])


def parameter_rows(model: ModelFile, with_states: bool = False, fmi: int = 2) -> tuple[list[Row], tuple[FmiUnit, ...]]:
    """Every settable variable of the model's FMU, and the units that they may have."""
    table, known, start = described_variables(model, with_states, fmi)
    return [(v.name, v.description, v.unit, start[v.name]) for v in table if v.name in start], known


def parameter_set(name: str, about: str, rows: Iterable[Row], known: Iterable[FmiUnit], ssp: int = 1) -> str:
    """XML of an SSV file with these parameters, whose units are among those known, by a version of SSP."""
    root = Element(
        "ssv:ParameterSet",
        {
            "xmlns:ssv": f"{_NAMESPACE}ParameterValues",
            "xmlns:ssc": f"{_NAMESPACE}Common",
            "version": f"{ssp}.0",
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
        attributes = {"value": repr(value), **({} if unit is None else {"unit": unit})}
        SubElement(parameter, f"ssv:{_REAL[ssp]}", attributes)
        used.add(unit)
    definitions = SubElement(root, "ssv:Units")
    for symbol in known:
        if symbol.name in used:
            definition = SubElement(definitions, "ssc:Unit", {"name": symbol.name})
            SubElement(definition, "ssc:BaseUnit", base_unit(symbol))
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
