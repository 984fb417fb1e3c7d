"""One mass on either of two springs: the transmissibility of both over one band."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import IsolationError
from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.path import PathSolver
from ...vibration.one_mass.band import DEFAULT_BAND
from ...vibration.one_mass.options import Excitation, Mount
from ...vibration.one_mass.response import FrequencyResponse, frequency_response
from ...vibration.one_mass.system import IsolatedMass, static_equilibrium
from ..common.result import picked

_APART = 100.0  # natural frequencies that differ by more are not swept through in one band
_LEVEL = 0.01  # amplitude of the base, share of the free travel of the spring that has less
_POINTS = 200
_FREQUENCY = 10.0  # Hz, where no mass rests in the middle of the range by its weight
_LEAST_WEIGHT = 0.02  # static load that is a weight, share of the range of forces


@dataclass(frozen=True, eq=False)
class SharedMass:
    """Transmissibility of a mass on spring A and on spring B."""

    mass: float = math.nan  # [kg], like the others NaN where it is unknown
    load: float = math.nan  # [N]
    level: float = math.nan  # amplitude of the base [m]
    responses: tuple[FrequencyResponse, ...] = ()  # of A and of B, if there are any
    refusal: str = ""  # why there are none

    def lines(self) -> list[str]:
        """The peaks in words."""
        if self.refusal:
            return [f"Transmissibility was not compared: {self.refusal}"]
        a, b = (response.resonance for response in self.responses)
        return [
            f"A mass of {self.mass:.4g} kg under a load of {self.load:.4g} N, base moved by {1e3 * self.level:.3g} mm: "
            f"transmissibility {a.transmissibility:.4g} at {a.frequency:.4g} Hz on A, {b.transmissibility:.4g} at "
            f"{b.frequency:.4g} Hz on B."
        ]

    def as_json(self) -> dict[str, Any]:
        """The peaks as JSON."""
        a, b = [vars(response.resonance) for response in self.responses] or (None, None)
        return {**picked(self, "mass", "load", "level", "refusal"), "a": a, "b": b}


def shared_mass(
    springs: tuple[SpringParameters, SpringParameters], low: float, high: float, mass: float | None
) -> SharedMass:
    """The transmissibility of both springs, or why there is none.

    Parameters
    ----------
    springs : (SpringParameters, SpringParameters)
    low, high : float      The range that both share [m].
    mass : float or None   Loads the springs by its weight [kg]; if None the mass whose weight A holds in the middle of
                           the range, or where A does not carry one there, a mass for 10 Hz of small motion.
    """
    try:
        chosen, load = _default(springs[0], low, high) if mass is None else (mass, mass * STANDARD_GRAVITY)
        systems = [IsolatedMass(spring, chosen, Mount(load)) for spring in springs]
        rest = [static_equilibrium(system) for system in systems]
        places = [equilibrium.displacement for equilibrium in rest]
        level = _LEVEL * min(min(places) - low, high - max(places))
        if not level > 0.0:
            at = " and ".join(f"{1e3 * place:.4g} mm on {name}" for name, place in zip("AB", places, strict=True))
            raise IsolationError(f"{chosen:.4g} kg rest at {at}, outside the range that both share; use another mass.")
        lowest, highest = sorted(equilibrium.frequency for equilibrium in rest)
        if not highest <= _APART * lowest < math.inf:
            raise IsolationError(
                f"The natural frequencies of {lowest:.4g} and {highest:.4g} Hz are too far apart for one band; look at "
                "each spring with isolate."
            )
        band = np.geomspace(DEFAULT_BAND[0] * lowest, DEFAULT_BAND[1] * highest, _POINTS)
        responses = tuple(frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band) for system in systems)
    except IsolationError as refusal:
        return SharedMass(refusal=str(refusal))
    return SharedMass(chosen, load, level, responses)


def _default(spring: SpringParameters, low: float, high: float) -> tuple[float, float]:
    """Mass [kg] and static load [N] that let a spring rest in the middle of a range, if its force rises there."""
    forces, stiffnesses = PathSolver(spring).small_motion(np.linspace(low, high, 101))
    load, stiffness = float(forces[50]), float(stiffnesses[50])
    if load > _LEAST_WEIGHT * float(np.ptp(forces)):
        return load / STANDARD_GRAVITY, load
    if not stiffness > 0.0:
        raise IsolationError(
            f"The stiffness of A in the middle of the range that both share must be > 0 for a mass to rest there, got "
            f"{stiffness:.4g} N/m; give a mass that rests elsewhere."
        )
    return stiffness / (2.0 * math.pi * _FREQUENCY) ** 2, load
