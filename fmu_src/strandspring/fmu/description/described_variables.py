"""The variables of a spring's FMU as a version of FMI describes them.

Those of FMI 3.0 are the table of core/variables.py, whose coefficients may be gathered into arrays. A variable's value
reference is its place in this table, too, counted from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import groupby
from typing import NamedTuple, TypeAlias

import numpy as np

from ...core.parameters import ARRAYS, SpringParameters
from ...core.variables import SECONDS, FmiUnit, Variable, start_values, units, variables
from ...kernel.path import PathSolver
from ...model.modelfile import ModelFile

# One value, or those of an array.
StartValue: TypeAlias = float | tuple[float, ...]

REVERSAL_INDICATOR = "reversal_indicator"

_HERE = 0.01  # from the first sample, share of the identified range
_ELEMENT = re.compile(rf"({'|'.join(ARRAYS)})_\d+")
_OF_POWERS = "coefficients of the powers from 0 on of (displacement - displacement_offset)"
_ARRAYS_ABOUT = {
    "kE": f"Elastic force FE: {_OF_POWERS}, in {{}}",
    "FE_knots": "Elastic force FE: displacements at the knots of its spline",
    "FE_forces": "Elastic force FE at its knots",
    "kA": f"Amplifier FA: {_OF_POWERS}, in {{}}; the first is always 1",
}


@dataclass(frozen=True)
class TypedVariable(Variable):
    """A variable of FMI 3.0; `size` is the number of elements of an array, None that of a scalar."""

    size: int | None = None

    @property
    def kind(self) -> str:
        """The type by FMI 3.0."""
        return "Float64" if self.unit or self.size else "Boolean"


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


@cache
def spring_variables(
    elastic: int,
    amplifier: int,
    knots: int = 0,
    second: int = 0,
    branches: int = 0,
    with_states: bool = False,
    arrays: bool = False,
) -> tuple[TypedVariable, ...]:
    """The table for a spring with so many coefficients kE and kA and knots of FE, each a variable or in an array, and
    with so many coefficients kA of a second mechanism and Maxwell branches.
    """
    usual = variables(elastic, amplifier, knots, second, branches, with_states)
    table = [_typed(variable) for variable in usual]
    if arrays:
        groups = [(name, list(group)) for name, group in groupby(table, lambda variable: _array_of(variable.name))]
        table = [_in_arrays(_gathered(name, group) if name in ARRAYS else group[0]) for name, group in groups]
    described = _with_parameters(table, with_states)
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
    """The units that a table uses: an array of coefficients, each of another unit, has none."""
    used = {variable.unit for variable in table}
    known = (*units(elastic, amplifier, second, with_states=with_states), SECONDS)
    return tuple(unit for unit in known if unit.name in used)


def array_values(parameters: SpringParameters, scalars: Mapping[str, float]) -> dict[str, StartValue]:
    """Start value of each input, parameter and state, by name, of those of single coefficients."""
    return {
        _array_of(name): getattr(parameters, _array_of(name)) if _ELEMENT.fullmatch(name) else value
        for name, value in scalars.items()
    }


def _array_of(name: str) -> str:
    """The array that an element by this name belongs to, or the name of a scalar."""
    element = _ELEMENT.fullmatch(name)
    return name if element is None else element[1]


def _in_arrays(variable: TypedVariable) -> TypedVariable:
    """A variable that depends on arrays where it depended on their elements."""
    depends, starts = (
        tuple(dict.fromkeys(map(_array_of, names))) for names in (variable.depends_on, variable.starts_from)
    )
    return replace(variable, depends_on=depends, starts_from=starts)


def _typed(variable: Variable) -> TypedVariable:
    return TypedVariable(**{field.name: getattr(variable, field.name) for field in fields(Variable)})


def _gathered(name: str, elements: Sequence[TypedVariable]) -> TypedVariable:
    first, about = elements[0], _ARRAYS_ABOUT[name]
    # Coefficients have a unit each, which the description lists instead.
    has_unit = "{}" not in about
    return replace(
        first,
        name=name,
        variability=elements[-1].variability,  # kA_0 is fixed
        description=about.format(", ".join(str(element.unit) for element in elements)),
        unit=first.unit if has_unit else None,
        display_unit=first.display_unit if has_unit else None,
        minimum=None,
        maximum=None,
        size=len(elements),
    )
