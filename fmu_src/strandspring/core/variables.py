"""The variables and units of the FMU, declared once.

The Python slave, modelDescription.xml, the documentation page and the native back end are made from this table.
A variable's value reference is its place in the table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from .parameters import ARRAYS, N_RANGE, SCALARS, SIGMA_RANGE, SpringParameters


@dataclass(frozen=True)
class Unit:
    """A unit in kg, m and s, and the units it may be displayed in: displayed = factor * value."""

    name: str
    kg: int = 0
    m: int = 0
    s: int = 0
    displayed: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Variable:
    """One FMI variable; `depends_on` holds while stepping, `starts_from` when initialization ends."""

    name: str
    causality: str
    variability: str
    description: str
    unit: str | None = None
    display_unit: str | None = None
    initial: str | None = None
    minimum: float | None = None
    maximum: float | None = None
    depends_on: tuple[str, ...] = ()
    starts_from: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """The FMI type: only `extrapolating` has no unit."""
        return "Real" if self.unit else "Boolean"


@cache
def variables(elastic: int, amplifier: int, knots: int = 0) -> tuple[Variable, ...]:
    """The table for a spring with so many coefficients kE and kA and knots of FE."""
    coefficients = _coefficients(elastic, amplifier, knots)
    parameters = (*coefficients, *_SCALAR_PARAMETERS)
    point = ("displacement", "displacement_offset", "displacement_min", "displacement_max")
    of_force = (*point, *(c.name for c in coefficients), "kappa_omega", "omega_start")
    of_stiffness = (*of_force, "rho", "sigma", "n")
    return (
        Variable(
            "displacement", "input", "continuous",
            "Displacement of the spring, positive in the direction in which the force grows",
            "m", "mm",
        ),
        _output("force", "Restoring force of the spring; the equation of motion is m*a + force = load",
                "N", None, of_force),
        _output("stiffness", "Tangent stiffness in the direction of the last motion, of loading before the first",
                "N/m", "N/mm", of_stiffness),
        _output("absorbed_energy", "Integral of the force over the displacement since initialization",
                "J", None, ()),
        Variable(
            "extrapolating", "local", "discrete",
            "True while the displacement lies outside the identified range, where the force is extrapolated",
            initial="calculated",
        ),
        Variable(
            "omega", "local", "continuous",
            "Normalized hysteretic variable: 1 when saturated in loading, -1 in unloading",
            "1", initial="calculated", minimum=-1.0, maximum=1.0,
        ),
        *parameters,
    )  # fmt: skip


@cache
def units(elastic: int, amplifier: int) -> tuple[Unit, ...]:
    """The units that `variables(elastic, amplifier)` uses, with any number of knots."""
    elastic_units = [
        Unit(_per_length("N", i), kg=1, m=1 - i, s=-2, displayed=_per_millimetre("N", i)) for i in range(2, elastic)
    ]
    amplifier_units = [Unit(_per_length("1", i), m=-i, displayed=_per_millimetre("1", i)) for i in range(2, amplifier)]
    return (*_UNITS, *elastic_units, *amplifier_units)


def start_values(parameters: SpringParameters) -> dict[str, float]:
    """Start value of the input and of each parameter, by name and in the order of the table."""
    values = {"displacement": 0.0}
    values |= {f"{name}_{i}": value for name in ARRAYS for i, value in enumerate(getattr(parameters, name))}
    values |= {name: getattr(parameters, name) for name in SCALARS}
    return {**values, "omega_start": 0.0}


def spring_parameters(values: Mapping[str, float], elastic: int, amplifier: int, knots: int = 0) -> SpringParameters:
    """The spring with these values of the FMU's parameters.

    Raises
    ------
    ValueError   If it is not physically possible; the text names the variable and its value.
    """
    counts = {"kE": elastic, "kA": amplifier, "FE_knots": knots, "FE_forces": knots}
    given: dict[str, Any] = {name: values[name] for name in SCALARS}
    given |= {name: tuple(values[f"{name}_{i}"] for i in range(count)) for name, count in counts.items()}
    try:
        return SpringParameters(**given)
    except ValueError as problem:
        raise ValueError(re.sub(r"`(\w+)\[(\d+)\]`", r"`\1_\2`", str(problem))) from None


def _output(name: str, description: str, unit: str, display_unit: str | None, starts_from: tuple[str, ...]) -> Variable:
    return Variable(
        name, "output", "continuous", description, unit, display_unit, "calculated",
        depends_on=("displacement",), starts_from=starts_from,
    )  # fmt: skip


def _parameter(
    name: str,
    description: str,
    unit: str,
    display_unit: str | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    variability: str = "tunable",
) -> Variable:
    return Variable(
        name, "parameter", variability, description, unit, display_unit, "exact", minimum, maximum
    )  # fmt: skip


_fixed = partial(_parameter, variability="fixed")


def _coefficients(elastic: int, amplifier: int, knots: int) -> tuple[Variable, ...]:
    about = "of (displacement - displacement_offset)"
    return (
        *(
            _parameter(
                f"kE_{i}",
                f"Elastic force FE: coefficient of power {i} {about}",
                _per_length("N", i),
                _per_length("N", i, "mm") if i else None,
            )
            for i in range(elastic)
        ),
        *(
            _fixed(f"FE_knots_{i}", f"Elastic force FE: displacement at knot {i} of its spline", "m", "mm")
            for i in range(knots)
        ),
        *(_parameter(f"FE_forces_{i}", f"Elastic force FE at knot {i}", "N") for i in range(knots)),
        *(
            _parameter(
                f"kA_{i}",
                f"Amplifier FA: coefficient of power {i} {about}" + ("" if i else ", always 1"),
                _per_length("1", i),
                _per_length("1", i, "mm") if i else None,
                minimum=None if i else 1.0,
                maximum=None if i else 1.0,
            )
            for i in range(amplifier)
        ),
    )


def _per_length(over: str, power: int, length: str = "m") -> str:
    if power == 0:
        return over
    return f"{over}/{length}" if power == 1 else f"{over}/{length}^{power}"


def _per_millimetre(over: str, power: int) -> tuple[tuple[str, float], ...]:
    return ((_per_length(over, power, "mm"), float(f"1e{-3 * power}")),)


_SCALAR_PARAMETERS = (
    _parameter("kappa_omega", "Saturated hysteretic force at displacement_offset", "N", minimum=0.0),
    _parameter("rho", "Slope of omega over displacement at its zero crossing", "1/m", "1/mm", minimum=0.0),
    _parameter("sigma", "Recovery of omega after a reversal", "1", None, *SIGMA_RANGE),
    _parameter("n", "Smoothness exponent of the transition to saturation", "1", None, *N_RANGE),
    _fixed("displacement_offset", "Displacement about which FE and FA are written", "m", "mm"),
    _fixed("displacement_min", "Lower end of the identified range", "m", "mm"),
    _fixed("displacement_max", "Upper end of the identified range", "m", "mm"),
    _fixed("omega_start", "omega where the path starts", "1", None, -1.0, 1.0),
)

_UNITS = (
    Unit("1"),
    Unit("m", m=1, displayed=(("mm", 1e3),)),
    Unit("1/m", m=-1, displayed=_per_millimetre("1", 1)),
    Unit("N", kg=1, m=1, s=-2, displayed=(("kN", 1e-3),)),
    Unit("N/m", kg=1, s=-2, displayed=_per_millimetre("N", 1)),
    Unit("J", kg=1, m=2, s=-2, displayed=(("mJ", 1e3), ("kJ", 1e-3))),
)
