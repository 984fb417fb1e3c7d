"""What a model description says, whatever the version of FMI, and what the XML files of an FMU have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element, indent, tostring

from ...core.variables import FmiUnit, Variable

# Of the categories that FMI names, those that a spring uses.
LOG_CATEGORIES = {
    "logStatusWarning": "The displacement left the identified range.",
    "logStatusError": "A displacement or a step was refused; the message names its value.",
    "logAll": "Every message.",
}

# Of co-simulation, where nothing happens between communication points that a host could take part in.
NO_EVENTS = {
    "providesIntermediateUpdate": "false",
    "mightReturnEarlyFromDoStep": "false",
    "canReturnEarlyAfterIntermediateUpdate": "false",
    "hasEventMode": "false",
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
    fmi : int                                               Version of FMI, 2 or 3.
    left_out : set of str                                   Variables that are not described; others keep their value
                                                            references.
    """

    co_simulation: Mapping[str, str] | None
    model_exchange: Mapping[str, str] | None = None
    sources: tuple[str, ...] = ()
    author: str = ""
    version: str = ""
    with_states: bool = False
    fmi: int = 2
    left_out: frozenset[str] = frozenset()


@dataclass(frozen=True)
class DescriptionContent:
    """What a model description says of the model itself.

    Attributes
    ----------
    name, about : str                 Identifier and description.
    table : tuple of Variable
    units : tuple of FmiUnit          Those that the table uses.
    start, nominal : mapping          Values by the name of a variable.
    log_categories : mapping          Description of each.
    step : float                      Of the default experiment [s].
    date : str                        When it was made, if that is stated: "2026-11-25".
    """

    name: str
    about: str
    table: tuple[Variable, ...]
    units: tuple[FmiUnit, ...]
    start: Mapping[str, float]
    nominal: Mapping[str, float] = field(default_factory=dict)
    log_categories: Mapping[str, str] = field(default_factory=lambda: LOG_CATEGORIES)
    step: float = 1e-3
    date: str = ""

    def listed(self, backend: Backend) -> dict[str, Variable]:
        """The variables that are described, by name."""
        return {variable.name: variable for variable in self.table if variable.name not in backend.left_out}

    @property
    def references(self) -> dict[str, str]:
        """Value reference of each variable, which is its place in the table."""
        return {variable.name: str(place) for place, variable in enumerate(self.table)}


def xml_file(root: Element) -> bytes:
    """The indented file of a root element in UTF-8."""
    indent(root)
    return bytes(tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def base_unit(unit: FmiUnit) -> dict[str, str]:
    """Attributes of the element BaseUnit: the exponents that are not 0."""
    exponents = {"kg": unit.kg, "m": unit.m, "s": unit.s, "rad": unit.rad}
    return {name: str(power) for name, power in exponents.items() if power}
