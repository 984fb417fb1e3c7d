"""The variables and units of the FMU, declared once.

The Python slave, modelDescription.xml, the documentation page and the native back end are made from this table.
A variable's value reference is its place in the table.

The native FMU has a second form, with states: `omega` and `absorbed_energy` are continuous states of model exchange,
`velocity` is a second input, and the FMU remembers nothing else. Where `omega` starts is its own start value there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from .branch_variables import added_parameters, added_values, with_added
from .parameters import (
    ARRAYS,
    FORCE_RANGE,
    LARGEST_DISPLACEMENT,
    LARGEST_VELOCITY,
    N_RANGE,
    SCALARS,
    SIGMA_RANGE,
    SpringParameters,
)

INPUT_RESOLUTION = "input_resolution"


@dataclass(frozen=True)
class FmiUnit:
    """A unit in kg, m, s and rad, and the units it may be displayed in: displayed = factor * value."""

    name: str
    kg: int = 0
    m: int = 0
    s: int = 0
    rad: int = 0
    displayed: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Variable:
    """One FMI variable; `depends_on` holds while stepping, `starts_from` when initialization ends.

    `derivative_of` names the continuous state whose derivative it is.
    """

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
    derivative_of: str | None = None

    @property
    def kind(self) -> str:
        """The FMI type: only `extrapolating` has no unit."""
        return "Real" if self.unit else "Boolean"


@cache
def variables(
    elastic: int, amplifier: int, knots: int = 0, second: int = 0, branches: int = 0, with_states: bool = False
) -> tuple[Variable, ...]:
    """The table for a spring with so many coefficients kE and kA, knots of FE, coefficients kA of a second mechanism
    and Maxwell branches.
    """
    if second or branches:
        plain = variables(elastic, amplifier, knots, with_states=with_states)
        of_amplifier = [v for v in _coefficients(0, second, 0) if second]
        return with_added(plain, _SCALAR_PARAMETERS[:4], of_amplifier, branches, with_states)
    if with_states:
        return _variables_with_states(variables(elastic, amplifier, knots))
    coefficients = _coefficients(elastic, amplifier, knots)
    parameters = (*_SCALAR_PARAMETERS, *coefficients, *_OWN_OF_USUAL_FORM)
    point = ("displacement", "displacement_offset", "displacement_min", "displacement_max")
    of_force = (*point, *(c.name for c in coefficients), "kappa_omega", "omega_start")
    of_stiffness = (*of_force, "rho", "sigma", "n")
    return (
        Variable(
            "displacement", "input", "continuous",
            "Displacement of the spring, positive in the direction in which the force grows",
            "m", "mm", minimum=-LARGEST_DISPLACEMENT, maximum=LARGEST_DISPLACEMENT,
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
def units(
    elastic: int, amplifier: int, second: int = 0, branches: int = 0, with_states: bool = False
) -> tuple[FmiUnit, ...]:
    """The units that the table uses, with any number of knots."""
    amplifier = max(amplifier, second)
    elastic_units = [
        FmiUnit(_per_length("N", i), kg=1, m=1 - i, s=-2, displayed=_per_millimetre("N", i)) for i in range(2, elastic)
    ]
    amplifier_units = [
        FmiUnit(_per_length("1", i), m=-i, displayed=_per_millimetre("1", i)) for i in range(2, amplifier)
    ]
    of_time = (SECONDS,) if branches else ()
    return (*_UNITS, *(_UNITS_OF_RATES if with_states else ()), *elastic_units, *amplifier_units, *of_time)


def start_values(
    parameters: SpringParameters, with_states: bool = False, omegas: tuple[float, float] = (0.0, 0.0)
) -> dict[str, float]:
    """Start value of each input, parameter and state, by name; `omegas` are those of both mechanisms."""
    values = {"displacement": 0.0}
    values |= {f"{name}_{i}": value for name in ARRAYS for i, value in enumerate(getattr(parameters, name))}
    values |= {name: getattr(parameters, name) for name in SCALARS}
    values |= added_values(parameters, with_states, omegas[1])
    if with_states:
        return {**values, "omega": omegas[0], "absorbed_energy": 0.0, "velocity": 0.0}
    return {**values, "omega_start": omegas[0], INPUT_RESOLUTION: 0.0}


def spring_parameters(
    values: Mapping[str, float], elastic: int, amplifier: int, knots: int = 0, second: int = 0, branches: int = 0
) -> SpringParameters:
    """The spring with these values of the FMU's parameters.

    Raises
    ------
    ValueError   If it is not physically possible; the text names the variable and its value.
    """
    counts = {"kE": elastic, "kA": amplifier, "FE_knots": knots, "FE_forces": knots}
    given: dict[str, Any] = {name: values[name] for name in SCALARS}
    given |= {name: tuple(values[f"{name}_{i}"] for i in range(count)) for name, count in counts.items()}
    given |= added_parameters(values, second, branches)
    try:
        return SpringParameters(**given)
    except ValueError as problem:
        text = re.sub(r"`branches\[(\d+)\]\.(\w+)`", r"`branch_\1_\2`", str(problem))
        text = re.sub(r"`second\.(\w+)", r"`second_\1", text)
        raise ValueError(re.sub(r"`(\w+)\[(\d+)\]`", r"`\1_\2`", text)) from None


def _variables_with_states(usual: tuple[Variable, ...]) -> tuple[Variable, ...]:
    shared = [variable for variable in usual if variable not in _OWN_OF_USUAL_FORM]
    parameters = tuple(variable.name for variable in shared if variable.causality == "parameter")
    of_slope = ("rho", "sigma", "n")
    of_force = tuple(name for name in parameters if name not in of_slope)
    moving = ("displacement", "velocity", "omega")
    changes: dict[str, dict[str, Any]] = {
        "force": _calculated(("displacement", "omega"), of_force),
        "stiffness": {
            **_calculated(moving, parameters),
            "description": "Tangent stiffness in the direction of the velocity, of loading where it is 0",
        },
        "absorbed_energy": {
            "description": "Continuous state: integral of the force over the displacement",
            "initial": "exact", "depends_on": ("absorbed_energy",), "starts_from": (),
        },
        "omega": {
            "description": "Continuous state: normalized hysteretic variable, 1 saturated in loading, -1 in unloading",
            "initial": "exact", "minimum": None, "maximum": None,
        },
    }  # fmt: skip
    return (
        *(replace(variable, **changes.get(variable.name, {})) for variable in shared),
        Variable(
            "velocity",
            "input",
            "continuous",
            "Rate of the displacement; solvers that sample it need a tolerance of 1e-8 or a fixed step",
            "m/s",
            "mm/s",
            minimum=-LARGEST_VELOCITY,
            maximum=LARGEST_VELOCITY,
        ),
        _derivative("absorbed_energy", "Power of the force", "W", **_calculated(moving, of_force)),
        _derivative("omega", "Rate of omega", "1/s", **_calculated(("velocity", "omega"), of_slope)),
    )


def _calculated(depends_on: tuple[str, ...], parameters: tuple[str, ...]) -> dict[str, Any]:
    return {"depends_on": depends_on, "starts_from": (*depends_on, *parameters)}


def _derivative(state: str, description: str, unit: str, **dependencies: Any) -> Variable:
    return Variable(
        f"der({state})",
        "local",
        "continuous",
        description,
        unit,
        initial="calculated",
        derivative_of=state,
        **dependencies,
    )


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
        _fixed("kA_0", f"Amplifier FA: coefficient of power 0 {about}, always 1", "1", None, 1.0, 1.0),
        *(
            _parameter(
                f"kA_{i}",
                f"Amplifier FA: coefficient of power {i} {about}",
                _per_length("1", i),
                _per_length("1", i, "mm"),
            )
            for i in range(1, amplifier)
        ),
    )


def _per_length(over: str, power: int, length: str = "m") -> str:
    if power == 0:
        return over
    return f"{over}/{length}" if power == 1 else f"{over}/{length}^{power}"


def _per_millimetre(over: str, power: int) -> tuple[tuple[str, float], ...]:
    return ((_per_length(over, power, "mm"), float(f"1e{-3 * power}")),)


_SCALAR_PARAMETERS = (
    _parameter("kappa_omega", "Saturated hysteretic force at displacement_offset", "N", None, *FORCE_RANGE),
    _parameter("rho", "Slope of omega over displacement at its zero crossing", "1/m", "1/mm", minimum=0.0),
    _parameter("sigma", "Recovery of omega after a reversal", "1", None, *SIGMA_RANGE),
    _parameter("n", "Smoothness exponent of the transition to saturation", "1", None, *N_RANGE),
    _fixed("displacement_offset", "Displacement about which FE and FA are written", "m", "mm"),
    _fixed("displacement_min", "Lower end of the identified range", "m", "mm"),
    _fixed("displacement_max", "Upper end of the identified range", "m", "mm"),
)
_OWN_OF_USUAL_FORM = (
    _fixed("omega_start", "omega where the path starts", "1", None, -1.0, 1.0),
    _parameter(INPUT_RESOLUTION, "Resolution of a sensor of the displacement: friction follows no smaller reversals",
               "m", "mm", 0.0, LARGEST_DISPLACEMENT),
)  # fmt: skip

_UNITS = (
    FmiUnit("1"),
    FmiUnit("m", m=1, displayed=(("mm", 1e3),)),
    FmiUnit("1/m", m=-1, displayed=_per_millimetre("1", 1)),
    FmiUnit("N", kg=1, m=1, s=-2, displayed=(("kN", 1e-3),)),
    FmiUnit("N/m", kg=1, s=-2, displayed=_per_millimetre("N", 1)),
    FmiUnit("J", kg=1, m=2, s=-2, displayed=(("mJ", 1e3), ("kJ", 1e-3))),
)
SECONDS = FmiUnit("s", s=1)
_UNITS_OF_RATES = (
    FmiUnit("m/s", m=1, s=-1, displayed=(("mm/s", 1e3),)),
    FmiUnit("W", kg=1, m=2, s=-3),
    FmiUnit("1/s", s=-1),
)
