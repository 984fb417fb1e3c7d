"""The transmissibility of a mass on the spring."""

from __future__ import annotations

import math

import numpy as np

from ...core.parameters import SpringParameters
from ...ground.gravity import STANDARD_GRAVITY
from ...vibration.one_mass.band import band_frequencies
from ...vibration.one_mass.response import FrequencyResponse, frequency_response
from ...vibration.one_mass.system import (
    DEFAULT_SHARES,
    Excitation,
    IsolatedMass,
    IsolationError,
    StaticEquilibrium,
    free_travel,
    static_equilibrium,
)
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import NUMBER, DisplayUnit, number, unit_of
from .evaluation import Evaluation

_POINTS = 150
_PLACES = (0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2)  # where in the range a mass is tried to rest, by preference
_ROLES = (Role.FIRST, Role.SECOND, Role.MODEL)


def transmissibility(evaluation: Evaluation, mass: float | None) -> Chart | str:
    """Absolute transmissibility under base motion of three levels; a sentence that says why, if it cannot be had."""
    spring = evaluation.identification.parameters
    try:
        system = _at_rest(spring) if mass is None else IsolatedMass(spring, mass)
        if system is None:
            return (
                "Transmissibility: no mass rests on this spring by its own weight within the identified range; give a "
                "mass and a load to `strandspring isolate`."
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
    return _chart(evaluation, system, equilibrium, responses, chosen=mass is None)


def _at_rest(spring: SpringParameters) -> IsolatedMass | None:
    """The mass whose weight rests near the middle of the range."""
    for place in _PLACES:
        x = spring.displacement_min + place * (spring.displacement_max - spring.displacement_min)
        mass = _weight(spring, x) / STANDARD_GRAVITY
        if mass > 0.0:
            # Two digits, as somebody would ask for.
            system = IsolatedMass(spring, float(f"{mass:.2g}"))
            try:
                static_equilibrium(system)
            except IsolationError:
                continue
            return system
    return None


def _weight(spring: SpringParameters, displacement: float) -> float:
    from ...kernel.path import PathSolver

    return float(PathSolver(spring).force_with_partials(np.array([displacement]), np.zeros(1))[0][0])


def _chart(
    evaluation: Evaluation, system: IsolatedMass, equilibrium: StaticEquilibrium, responses: list[FrequencyResponse],
    *, chosen: bool,
) -> Chart:  # fmt: skip
    traces = []
    for response, role in zip(responses, _ROLES, strict=True):
        frequency, values = response.column("frequency"), response.column("transmissibility")
        unstable, dotted = response.unstable, response.dotted
        travel = unit_of("length", response.level)
        name = f"base ±{number(response.level * travel.factor, 2)} {travel.name}"
        traces.append(Trace(name, frequency, np.where(unstable, np.nan, values), role))
        if unstable.any():
            traces.append(Trace("unstable", frequency, np.where(dotted, values, np.nan), role, ChartForm.DOTTED))
    mass = unit_of("mass", system.mass)
    peaks = [response.resonance for response in responses]
    isolates = peaks[-1].isolation_frequency
    sentence = (
        f"A mass of {number(system.mass * mass.factor)} {mass.name}"
        f"{', chosen so that it rests near mid-range,' if chosen else ''} on one spring: static equilibrium at "
        f"{number(equilibrium.displacement * evaluation.length.factor)} {evaluation.length.name}, natural "
        f"frequency of small motion {number(equilibrium.frequency, 3)} Hz. Resonance at "
        f"{number(peaks[0].frequency, 3)} Hz with a "
        f"transmissibility of {number(peaks[0].transmissibility, 3)} at the smallest base motion, and at "
        f"{number(peaks[-1].frequency, 3)} Hz with {number(peaks[-1].transmissibility, 3)} at the largest"
        f"{'' if math.isnan(isolates) else f'; isolation begins at {number(isolates, 3)} Hz there'}."
    )
    return Chart(
        "transmissibility", f"Transmissibility of {number(system.mass * mass.factor)} {mass.name}",
        Axis("frequency", DisplayUnit("Hz"), log=True), Axis("absolute transmissibility", NUMBER, log=True),
        tuple(traces), sentence, wide=True,
    )  # fmt: skip
