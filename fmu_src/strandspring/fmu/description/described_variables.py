"""The variables of a spring's FMU as a version of FMI describes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ...core.parameters import SpringParameters
from ...core.variables import FmiUnit, Variable, start_values, units, variables
from ...kernel.path import PathSolver
from ...model.modelfile import ModelFile
from .array_variables import StartValue, array_values, known_units, spring_variables

_HERE = 0.01  # from the first sample, share of the identified range


class DescribedVariables(NamedTuple):
    """Variables in the order of their value references, the units that they use, and start values by name."""

    table: tuple[Variable, ...]
    units: tuple[FmiUnit, ...]
    start: Mapping[str, StartValue]


def start_omegas(model: ModelFile) -> tuple[float, float]:
    """omega of both mechanisms where the path of a model's FMU starts by default: at displacement 0 of the model.

    The recorded ones if the first record began there, within 1 % of the identified range, or at rest. Else midway
    between loading and unloading of the settled loop over that range: the force lies between those of its branches. 0
    if the model does not say where its record began.
    """
    p, start = model.parameters, model.start
    if start is None:
        return 0.0, 0.0
    low, high = p.displacement_min, p.displacement_max
    if start.at_rest or abs(start.displacement) <= _HERE * (high - low):
        return start.omega, start.second_omega or 0.0
    loop = np.array([low, high, low, high, min(max(0.0, low), high)])
    solver = PathSolver(p)
    between = 0.5 * (solver.omegas(loop)[:, -1] + solver.omegas(loop[[0, 1, 2, 4]])[:, -1])
    return float(between[0]), float(between[1:].sum())


def described_variables(model: ModelFile, with_states: bool, fmi: int, arrays: bool = False) -> DescribedVariables:
    """Those of the usual form or of the form with states, by a version of FMI, 2 or 3, which knows arrays."""
    spring = model.parameters
    counts, start = spring.counts, start_values(spring, with_states, start_omegas(model))
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
