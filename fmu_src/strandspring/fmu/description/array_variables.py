"""The variables of FMI 3.0: the table of core/variables.py with its coefficients gathered into arrays.

A variable's value reference is its place in this table, too, counted from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import groupby
from typing import TypeAlias

from ...core.parameters import ARRAYS, SpringParameters
from ...core.variables import FmiUnit, Variable, start_values, units, variables

# One value, or those of an array.
StartValue: TypeAlias = float | tuple[float, ...]

REVERSAL_INDICATOR = "reversal_indicator"

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


_SECOND = FmiUnit("s", s=1)
_TIME = TypedVariable("time", "independent", "continuous", "Simulation time", "s")
_INDICATOR = TypedVariable(
    REVERSAL_INDICATOR, "local", "continuous",
    "Event indicator of model exchange: changes its sign where the displacement turns back", "1",
    initial="calculated", depends_on=("displacement", "displacement_min", "displacement_max", "time"),
)  # fmt: skip


@cache
def array_variables(
    elastic: int, amplifier: int, knots: int = 0, with_states: bool = False
) -> tuple[TypedVariable, ...]:
    """The table for a spring with so many coefficients kE and kA and knots of FE."""
    of_scalars = variables(elastic, amplifier, knots, with_states)
    groups = [(name, tuple(group)) for name, group in groupby(of_scalars, lambda variable: _array_of(variable.name))]
    table = [_gathered(name, group) if name in ARRAYS else _typed(group[0]) for name, group in groups]
    parameters = tuple(variable.name for variable in table if variable.causality == "parameter")
    # In FMI 3.0 outputs depend on parameters, too. The usual form reaches them through its path, the form with states
    # as when initialization ends.
    table = [
        replace(v, depends_on=_unique((*v.depends_on, *(v.starts_from if with_states else parameters))))
        if v.causality == "output" or v.derivative_of
        else v
        for v in table
    ]
    return (*table, _TIME) if with_states else (*table, _TIME, _INDICATOR)


def scalar_variables(table: Iterable[Variable]) -> tuple[TypedVariable, ...]:
    """A table without arrays as FMI 3.0 has it: outputs depend on all parameters, too, and the time is a variable."""
    typed = [_typed(variable) for variable in table]
    parameters = tuple(variable.name for variable in typed if variable.causality == "parameter")
    return (
        *(replace(v, depends_on=(*v.depends_on, *parameters)) if v.causality == "output" else v for v in typed),
        _TIME,
    )


@cache
def array_units(elastic: int, amplifier: int, knots: int = 0, with_states: bool = False) -> tuple[FmiUnit, ...]:
    """The units that the table uses: an array of coefficients, each of another unit, has none."""
    used = {variable.unit for variable in array_variables(elastic, amplifier, knots, with_states)}
    return tuple(unit for unit in (*units(elastic, amplifier, with_states), _SECOND) if unit.name in used)


def array_values(parameters: SpringParameters, with_states: bool = False) -> dict[str, StartValue]:
    """Start value of each input, parameter and state, by name."""
    scalars = start_values(parameters, with_states)
    return {
        _array_of(name): getattr(parameters, _array_of(name)) if _ELEMENT.fullmatch(name) else value
        for name, value in scalars.items()
    }


def _array_of(name: str) -> str:
    """The array that an element by this name belongs to, or the name of a scalar."""
    element = _ELEMENT.fullmatch(name)
    return name if element is None else element[1]


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(map(_array_of, names)))


def _typed(variable: Variable) -> TypedVariable:
    given = {field.name: getattr(variable, field.name) for field in fields(Variable)}
    names = {name: _unique(given[name]) for name in ("depends_on", "starts_from")}
    return TypedVariable(**{**given, **names})


def _gathered(name: str, elements: tuple[Variable, ...]) -> TypedVariable:
    typed, about = _typed(elements[0]), _ARRAYS_ABOUT[name]
    # Coefficients have a unit each, which the description lists instead.
    has_unit = "{}" not in about
    return replace(
        typed,
        name=name,
        description=about.format(", ".join(str(element.unit) for element in elements)),
        unit=typed.unit if has_unit else None,
        display_unit=typed.display_unit if has_unit else None,
        minimum=None,
        maximum=None,
        size=len(elements),
    )
