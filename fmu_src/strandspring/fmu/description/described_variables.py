"""The variables of a spring's FMU as a version of FMI describes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ...core.parameters import SpringParameters
from ...core.variables import FmiUnit, Variable, start_values, units, variables
from ...kernel.path import PathSolver
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
    elastic, amplifier, _, second, branches = counts
    if fmi == 2:
        known = units(elastic, amplifier, second, branches, with_states)
        return DescribedVariables(variables(*counts, with_states=with_states), known, start)
    table = spring_variables(*counts, with_states=with_states, arrays=arrays)
    known = known_units(table, elastic, amplifier, second, with_states)
    return DescribedVariables(table, known, array_values(spring, start) if arrays else start)


def nominal_values(spring: SpringParameters, table: Iterable[Variable]) -> dict[str, float]:
    """Size of values by the name of a variable, as far as there is one.

    Displacements are of half the identified range, outputs of the way over it and back, parameters as they are.
    """
    low, high = spring.displacement_min, spring.displacement_max
    force = PathSolver(spring).slow.force(np.array([low, high, low]), -1.0)
    values = {name: abs(value) for name, value in start_values(spring).items()}
    values |= {variable.name: 0.5 * (high - low) for variable in table if variable.unit == "m"}
    values |= {"force": float(np.abs(force).max()), "stiffness": float(np.ptp(force)) / (high - low)}
    # As those of the states are in C.
    values |= {"absorbed_energy": spring.kappa_omega * (high - low), "omega": 1.0, "omega_start": 1.0}
    values |= {name: 1.0 for name in ("second_omega", "second_omega_start") if spring.second is not None}
    return {name: value for name, value in values.items() if value > 0.0}
