"""The variables of the FMU that a second mechanism and Maxwell branches have; they follow all others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from .branches import TIME_CONSTANT_RANGE
from .parameters import FORCE_RANGE, OF_MECHANISM, SpringParameters

SECOND, BRANCH = "second_", "branch_{}_"
OF_BRANCH = ("stiffness", "time_constant")
STORED_ENERGY = "stored_energy"

Row = TypeVar("Row", bound=Any)


def with_added(
    plain: Sequence[Row], scalars: Sequence[Row], amplifier: Sequence[Row], branches: int, with_states: bool
) -> tuple[Row, ...]:
    """A table of variables with those of a second mechanism and of branches, on which outputs depend, too.

    Parameters
    ----------
    plain : sequence of Variable       The table of a spring without them.
    scalars : sequence of Variable     kappa_omega, rho, sigma and n of the first mechanism.
    amplifier : sequence of Variable   The coefficients of the second FA; none if there is no second mechanism.
    branches : int                     Number of Maxwell branches.
    with_states : bool                 Whether omega and the elongations are continuous states.
    """
    table = {variable.name: variable for variable in plain}
    added = _added(table["omega"], scalars, amplifier, branches, with_states)
    parameters = [v.name for v in added if v.causality == "parameter" and not v.name.endswith("_time_constant")]
    states = [v.derivative_of for v in added if v.derivative_of]
    of_force = [name for name in parameters if name not in (f"{SECOND}rho", f"{SECOND}sigma", f"{SECOND}n")]
    # The path begins without force in the branches.
    at_start = of_force if with_states else [name for name in of_force if not name.endswith("_stiffness")]
    of_omega = [state for state in states if state == f"{SECOND}omega"]
    more = {
        "force": (states, at_start),
        "stiffness": (of_omega, parameters),
        "der(absorbed_energy)": (states, of_force),
    }
    return (
        *(_depending(variable, *more.get(variable.name, ((), ()))) for variable in plain),
        *added,
    )


def _depending(variable: Row, states: Iterable[str], parameters: Iterable[str]) -> Row:
    """A variable that depends on more states, and on more parameters when initialization ends."""
    return replace(
        variable,
        depends_on=(*variable.depends_on, *states),
        starts_from=(*variable.starts_from, *states, *parameters),
    )


def _added(
    omega: Row, scalars: Sequence[Row], amplifier: Sequence[Row], branches: int, with_states: bool
) -> tuple[Row, ...]:
    """The variables that are added, in the order of their value references."""
    make = type(omega)
    elongation = (
        {"description": "Continuous state: elongation of the spring of the branch", "initial": "exact"}
        if with_states
        else {"description": "Elongation of the spring of the branch", "initial": "calculated"}
    )
    of_second = [
        replace(v, name=SECOND + v.name, description=f"Second mechanism: {v.description}")
        for v in (omega, *scalars, *amplifier)
        if amplifier
    ]
    if amplifier and not with_states:
        of_second.append(
            make(f"{SECOND}omega_start", "parameter", "fixed", "second_omega where the path starts", "1", None, "exact",
                 -1.0, 1.0)
        )  # fmt: skip
    of_branches = [
        variable
        for i in range(branches)
        for variable in (
            make(f"branch_{i}_stiffness", "parameter", "tunable", "Maxwell branch: stiffness against fast motion",
                 "N/m", "N/mm", "exact", 0.0, FORCE_RANGE[1]),
            make(f"branch_{i}_time_constant", "parameter", "tunable",
                 "Maxwell branch: time in which its force decays to 1/e at rest", "s", None, "exact",
                 *TIME_CONSTANT_RANGE),
            make(f"branch_{i}_elongation", "local", "continuous", unit="m", display_unit="mm", **elongation),
        )
    ]  # fmt: skip
    if branches:
        about = "The part of absorbed_energy that the springs of the Maxwell branches hold"
        of_branches.append(make(STORED_ENERGY, "local", "continuous", about, "J", initial="calculated"))
    rates = []
    if with_states and amplifier:
        slope = (f"{SECOND}omega", tuple(f"{SECOND}{name}" for name in ("rho", "sigma", "n")), "1/s")
        rates.append(_rate(make, *slope))
    if with_states:
        rates += [_rate(make, f"branch_{i}_elongation", (f"branch_{i}_time_constant",), "m/s") for i in range(branches)]
    return (*of_second, *of_branches, *rates)


def _rate(make: Callable[..., Row], state: str, parameters: tuple[str, ...], unit: str) -> Row:
    depends = ("velocity", state)
    return make(
        f"der({state})", "local", "continuous", f"Rate of {state}", unit, initial="calculated", derivative_of=state,
        depends_on=depends, starts_from=(*depends, *parameters),
    )  # fmt: skip


def added_values(p: SpringParameters, with_states: bool, omega: float) -> dict[str, float]:
    """Start value of each parameter and state of theirs, by name; `omega` is that of the second mechanism."""
    values: dict[str, float] = {}
    if p.second is not None:
        scalars = (name for name in OF_MECHANISM if name != "kA")
        values |= {f"{SECOND}{name}": getattr(p.second, name) for name in scalars}
        values |= {f"{SECOND}kA_{i}": value for i, value in enumerate(p.second.kA)}
        values[f"{SECOND}omega" if with_states else f"{SECOND}omega_start"] = omega
    for i, branch in enumerate(p.branches):
        values |= {BRANCH.format(i) + name: getattr(branch, name) for name in OF_BRANCH}
        if with_states:
            values[f"branch_{i}_elongation"] = 0.0
    return values


def added_parameters(values: Mapping[str, float], second: int, branches: int) -> dict[str, Any]:
    """The fields `second` and `branches` of the spring with these values; `second` is the number of its kA."""
    fields: dict[str, Any] = {}
    if second:
        scalars = {name: values[SECOND + name] for name in OF_MECHANISM if name != "kA"}
        fields["second"] = {**scalars, "kA": tuple(values[f"{SECOND}kA_{i}"] for i in range(second))}
    if branches:
        rows = (BRANCH.format(i) for i in range(branches))
        fields["branches"] = tuple({name: values[row + name] for name in OF_BRANCH} for row in rows)
    return fields
