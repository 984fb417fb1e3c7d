"""Files that FMUs of FMI 3.0 have beside the model description: the terminal, and how sources are compiled."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from .content import xml_file
from .icons import asset

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
BUILD_DESCRIPTION = "sources/buildDescription.xml"

_LANGUAGE = "C11"
# Where mathematical functions have a library of their own.
_WITH_LIBM = ("x86_64-linux", "aarch64-linux")
# The coordinates that FMI takes by default, and the size that they are drawn in.
_SQUARE = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
_FLANGE = {
    "defaultConnectionColor": "0 127 0", "defaultConnectionStrokeSize": "1", "iconBaseName": "flange",
    "x1": "-10", "y1": "80", "x2": "10", "y2": "100",
}  # fmt: skip
_SCALE = {"suggestedScalingFactorTo_mm": "0.1"}


def terminals() -> dict[str, bytes]:
    """terminalsAndIcons.xml and the icon of a terminal by path: one flange, as those of Modelica, on top of the spring.

    The equation of motion of a mass on the spring is m*a + force = load, so force is what the neighbour exerts on the
    spring in the direction of displacement: Modelica's flange.f, a flow into the component.
    """
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    graphics = SubElement(root, "GraphicalRepresentation")
    SubElement(graphics, "CoordinateSystem", {**_SQUARE, **_SCALE})
    SubElement(graphics, "Icon", _SQUARE)
    flange = SubElement(
        SubElement(root, "Terminals"),
        "Terminal",
        {
            "name": "flange",
            "matchingRule": "plug",
            "terminalKind": "Modelica.Mechanics.Translational.Interfaces.Flange_b",
            "description": "Moving end of the spring; the other end is fixed",
        },
    )
    for variable, member, kind in (("displacement", "s", "signal"), ("force", "f", "inflow")):
        attributes = {"variableName": variable, "memberName": member, "variableKind": kind}
        SubElement(flange, "TerminalMemberVariable", attributes)
    SubElement(flange, "TerminalGraphicalRepresentation", _FLANGE)
    icons = {f"terminalsAndIcons/flange.{kind}": asset(f"flange.{kind}") for kind in ("png", "svg")}
    return {TERMINALS: xml_file(root), **icons}


def build_description(identifier: str, sources: Sequence[str]) -> bytes:
    """buildDescription.xml of a model identifier and the C files to be compiled."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    # The first is for all other platforms.
    for platform in (None, *_WITH_LIBM):
        attributes = {"modelIdentifier": identifier}
        if platform is not None:
            attributes["platform"] = platform
        configuration = SubElement(root, "BuildConfiguration", attributes)
        files = SubElement(configuration, "SourceFileSet", {"language": _LANGUAGE})
        for name in sources:
            SubElement(files, "SourceFile", {"name": name})
        if platform is not None:
            library = {"name": "m", "external": "true", "description": "Mathematical functions of the C library"}
            SubElement(configuration, "Library", library)
    return xml_file(root)
