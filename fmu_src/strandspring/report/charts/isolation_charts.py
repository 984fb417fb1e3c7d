"""The transmissibility of a mass on the spring."""

from __future__ import annotations

import math

import numpy as np

from ...core.parameters import SpringParameters
from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.path import PathSolver
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.response import frequency_response
from ...vibration.one_mass.system import (
    DEFAULT_SHARES,
    Excitation,
    IsolatedMass,
    IsolationError,
    free_travel,
    static_equilibrium,
)
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import HZ, NUMBER, number, unit_of
from .evaluation import Evaluation

_POINTS = 150
_PLACES = (0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2)  # where in the range a mass is tried to rest, by preference
_ROLES = (Role.FIRST, Role.SECOND, Role.THIRD)


def transmissibility(evaluation: Evaluation, mass: float | None) -> Chart | str:
    """Absolute transmissibility under base motion of three levels; a sentence that says why, if it cannot be had."""
    spring = evaluation.identification.parameters
    try:
        system = _at_rest(evaluation.solver, spring) if mass is None else IsolatedMass(spring, mass)
        if system is None:
            return (
                "Transmissibility: no mass rests on this spring by its own weight within the identified range; give a "
                "mass and a load to strandspring isolate."
            )
        equilibrium = static_equilibrium(system)
        travel = free_travel(system, equilibrium)
        frequencies = band_frequencies(None, _POINTS, equilibrium)
        responses = [
            frequency_response(system, Excitation.BASE_DISPLACEMENT, share * travel, frequencies)
            for share in DEFAULT_SHARES
        ]
    except IsolationError as refusal:
        return f"Transmissibility: {refusal}"
    traces = []
    for response, role in zip(responses, _ROLES, strict=True):
        frequency, values = response.column("frequency"), response.column("transmissibility")
        unstable, dotted = response.unstable, response.dotted
        name = f"base ±{unit_of('length', response.level).text(response.level, 2)}"
        traces.append(Trace(name, frequency, np.where(unstable, np.nan, values), role))
        if unstable.any():
            traces.append(Trace("unstable", frequency, np.where(dotted, values, np.nan), role, ChartForm.DOTTED))
    weighed = unit_of("mass", system.mass).text(system.mass)
    peaks = [response.resonance for response in responses]
    isolates = peaks[-1].isolation_frequency
    sentence = (
        f"A mass of {weighed}"
        f"{', chosen so that it rests near mid-range,' if mass is None else ''} on one spring: static equilibrium at "
        f"{evaluation.length.text(equilibrium.displacement)}, natural "
        f"frequency of small motion {number(equilibrium.frequency, 3)} Hz. Resonance at "
        f"{number(peaks[0].frequency, 3)} Hz with a "
        f"transmissibility of {number(peaks[0].transmissibility, 3)} at the smallest base motion, and at "
        f"{number(peaks[-1].frequency, 3)} Hz with {number(peaks[-1].transmissibility, 3)} at the largest"
        f"{'' if math.isnan(isolates) else f'; isolation begins at {number(isolates, 3)} Hz there'}."
    )
    return Chart(
        "transmissibility", f"Transmissibility of {weighed}",
        Axis("frequency", HZ, log=True), Axis("absolute transmissibility", NUMBER, log=True),
        tuple(traces), sentence, wide=True,
    )  # fmt: skip


def _at_rest(solver: PathSolver, spring: SpringParameters) -> IsolatedMass | None:
    """The mass whose weight rests near the middle of the range."""
    for place in _PLACES:
        x = spring.displacement_min + place * (spring.displacement_max - spring.displacement_min)
        mass = solver.force_with_partials(np.array([x]), np.zeros(1))[0].item() / STANDARD_GRAVITY
        if mass > 0.0:
            # Two digits, as somebody would ask for.
            system = IsolatedMass(spring, float(f"{mass:.2g}"))
            try:
                static_equilibrium(system)
            except IsolationError:
                continue
            return system
    return None
