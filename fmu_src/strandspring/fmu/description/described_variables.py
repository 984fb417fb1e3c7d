"""The variables of a spring's FMU as a version of FMI describes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ...core.parameters import SpringParameters
from ...core.variables import FmiUnit, Variable, start_values, units, variables
from .array_variables import StartValue, array_values, known_units, spring_variables


class DescribedVariables(NamedTuple):
    """Variables in the order of their value references, the units that they use, and start values by name."""

    table: tuple[Variable, ...]
    units: tuple[FmiUnit, ...]
    start: Mapping[str, StartValue]


def described_variables(
    spring: SpringParameters, with_states: bool, fmi: int, arrays: bool = False
) -> DescribedVariables:
    """Those of the usual form or of the form with states, by a version of FMI, 2 or 3, which knows arrays."""
    counts, start = spring.counts, start_values(spring, with_states)
    if fmi == 2:
        known = units(*counts[:2], with_states=with_states)
        return DescribedVariables(variables(*counts, with_states=with_states), known, start)
    table = spring_variables(*counts, with_states=with_states, arrays=arrays)
    known = known_units(table, *counts[:2], with_states)
    return DescribedVariables(table, known, array_values(spring, start) if arrays else start)
