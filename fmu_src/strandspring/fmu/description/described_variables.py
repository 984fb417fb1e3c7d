"""The variables of a spring's FMU as a version of FMI describes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ...core.parameters import SpringParameters
from ...core.variables import FmiUnit, Variable, start_values, units, variables
from .array_variables import StartValue, array_units, array_values, array_variables


class DescribedVariables(NamedTuple):
    """Variables in the order of their value references, the units that they use, and start values by name."""

    table: tuple[Variable, ...]
    units: tuple[FmiUnit, ...]
    start: Mapping[str, StartValue]


def described_variables(spring: SpringParameters, with_states: bool, fmi: int) -> DescribedVariables:
    """Those of the usual form or of the form with states, by a version of FMI, 2 or 3."""
    counts = spring.counts
    if fmi == 3:
        return DescribedVariables(
            array_variables(*counts, with_states=with_states),
            array_units(*counts, with_states=with_states),
            array_values(spring, with_states),
        )
    return DescribedVariables(
        variables(*counts, with_states=with_states),
        units(*counts[:2], with_states=with_states),
        start_values(spring, with_states),
    )
