"""The variables of a spring's FMU as a version of FMI describes them.

Those of FMI 3.0 are the table of core/variables.py with the time and the event indicator. There, too, a variable's
value reference is its place, counted from 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ...core.parameters import SpringParameters
from ...core.variables import SECONDS, FmiUnit, Variable, start_values, units, variables
from ...kernel.path import PathSolver
from ...model.modelfile import ModelFile

REVERSAL_INDICATOR = "reversal_indicator"

_HERE = 0.01  # from the first sample, share of the identified range


@dataclass(frozen=True)
class TypedVariable(Variable):
    """A variable of FMI 3.0."""

    @property
    def kind(self) -> str:
        """The type by FMI 3.0."""
        return "Float64" if self.unit else "Boolean"


_TIME = TypedVariable("time", "independent", "continuous", "Simulation time", "s")
_INDICATOR = TypedVariable(
    REVERSAL_INDICATOR, "local", "continuous",
    "Event indicator of model exchange: changes its sign where the displacement turns back", "1",
    initial="calculated", depends_on=("displacement", "displacement_min", "displacement_max", "time"),
)  # fmt: skip


class DescribedVariables(NamedTuple):
    """Variables in the order of their value references, the units that they use, and start values by name."""

    table: tuple[Variable, ...]
    units: tuple[FmiUnit, ...]
    start: Mapping[str, float]


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


def described_variables(model: ModelFile, with_states: bool, fmi: int) -> DescribedVariables:
    """Those of the usual form or of the form with states, by a version of FMI, 2 or 3."""
    spring = model.parameters
    counts, start = spring.counts, start_values(spring, with_states, start_omegas(model))
    elastic, amplifier, _, second, branches = counts
    if fmi == 2:
        known = units(elastic, amplifier, second, branches, with_states)
        return DescribedVariables(variables(*counts, with_states=with_states), known, start)
    table = spring_variables(*counts, with_states=with_states)
    known = known_units(table, elastic, amplifier, second, with_states)
    return DescribedVariables(table, known, start)


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


@cache
def spring_variables(
    elastic: int,
    amplifier: int,
    knots: int = 0,
    second: int = 0,
    branches: int = 0,
    with_states: bool = False,
) -> tuple[TypedVariable, ...]:
    """The table for a spring with so many coefficients kE and kA and knots of FE, coefficients kA of a second mechanism
    and Maxwell branches.
    """
    usual = variables(elastic, amplifier, knots, second, branches, with_states)
    described = _with_parameters([_typed(variable) for variable in usual], with_states)
    return described if with_states else (*described, _INDICATOR)


def scalar_variables(table: Iterable[Variable]) -> tuple[TypedVariable, ...]:
    """A table of another FMU as FMI 3.0 has it."""
    return _with_parameters([_typed(variable) for variable in table])


def _with_parameters(table: Sequence[TypedVariable], with_states: bool = False) -> tuple[TypedVariable, ...]:
    """A table and the time; in FMI 3.0 outputs depend on parameters, too.

    The usual form reaches them through its path, the form with states as when initialization ends.
    """
    parameters = tuple(variable.name for variable in table if variable.causality == "parameter")
    return (
        *(
            replace(
                v, depends_on=tuple(dict.fromkeys((*v.depends_on, *(v.starts_from if with_states else parameters))))
            )
            if v.causality == "output" or v.derivative_of
            else v
            for v in table
        ),
        _TIME,
    )


def known_units(
    table: Iterable[Variable], elastic: int, amplifier: int, second: int, with_states: bool
) -> tuple[FmiUnit, ...]:
    """The units that a table uses."""
    used = {variable.unit for variable in table}
    known = (*units(elastic, amplifier, second, with_states=with_states), SECONDS)
    return tuple(unit for unit in known if unit.name in used)


def _typed(variable: Variable) -> TypedVariable:
    return TypedVariable(**{field.name: getattr(variable, field.name) for field in fields(Variable)})
