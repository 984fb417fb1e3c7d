"""What the XML files of an FMU have in common."""

from __future__ import annotations

from xml.etree.ElementTree import Element, indent, tostring

from ...core.variables import FmiUnit


def xml_file(root: Element) -> bytes:
    """The indented file of a root element in UTF-8."""
    indent(root)
    return bytes(tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def base_unit(unit: FmiUnit) -> dict[str, str]:
    """Attributes of the element BaseUnit: the exponents that are not 0."""
    exponents = {"kg": unit.kg, "m": unit.m, "s": unit.s, "rad": unit.rad}
    return {name: str(power) for name, power in exponents.items() if power}
