"""One mass on either of two springs: the transmissibility of both over one band."""

from __future__ import annotations

from dataclasses import asdict, dataclass
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

_APART = 100.0  # natural frequencies that differ by more are not swept through in one band
_LEVEL = 0.01  # amplitude of the base, share of the free travel of the spring that has less
_POINTS = 200
_FREQUENCY = 10.0  # Hz, where no mass rests in the middle of the range by its weight
_LEAST_WEIGHT = 0.02  # static load that is a weight, share of the range of forces


@dataclass(frozen=True, eq=False)
class SharedMass:
    """Transmissibility of a mass on spring A and on spring B.

    Attributes
    ----------
    mass, load, level : float                        [kg], [N], amplitude of the base [m]; NaN if unknown.
    responses : tuple of 2 FrequencyResponse, or ()  Of A and of B.
    refusal : str                                    Why there are none, in words; else empty.
    """

    mass: float
    load: float
    level: float
    responses: tuple[FrequencyResponse, ...]
    refusal: str

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
        a, b = [asdict(response.resonance) for response in self.responses] or (None, None)
        return {"mass": self.mass, "load": self.load, "level": self.level, "a": a, "b": b, "refusal": self.refusal}


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
        chosen, load = (mass, mass * STANDARD_GRAVITY) if mass is not None else _default(springs[0], low, high)
        systems = [IsolatedMass(spring, chosen, Mount(load)) for spring in springs]
        rest = [static_equilibrium(system) for system in systems]
        level = _LEVEL * min(
            min(equilibrium.displacement - low, high - equilibrium.displacement) for equilibrium in rest
        )
        if not level > 0.0:
            raise IsolationError(
                f"{chosen:.4g} kg rest at {1e3 * rest[0].displacement:.4g} mm on A and "
                f"{1e3 * rest[1].displacement:.4g} mm on B, outside the range that both share; use another mass."
            )
        frequencies = [equilibrium.frequency for equilibrium in rest]
        if not max(frequencies) <= _APART * min(frequencies) < np.inf:
            raise IsolationError(
                f"The natural frequencies of {frequencies[0]:.4g} Hz on A and {frequencies[1]:.4g} Hz on B are too far "
                "apart for one band; look at each spring with isolate."
            )
        band = np.geomspace(DEFAULT_BAND[0] * min(frequencies), DEFAULT_BAND[1] * max(frequencies), _POINTS)
        responses = tuple(frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band) for system in systems)
    except IsolationError as refusal:
        return SharedMass(np.nan, np.nan, np.nan, (), str(refusal))
    return SharedMass(chosen, load, level, responses, "")


def _default(spring: SpringParameters, low: float, high: float) -> tuple[float, float]:
    """Mass [kg] and static load [N] that let a spring rest in the middle of a range.

    Raises
    ------
    IsolationError   If its force does not rise there.
    """
    solver = PathSolver(spring)
    places = np.linspace(low, high, 101)
    force, stiffnesses = solver.small_motion(places)
    load, stiffness = float(force[50]), float(stiffnesses[50])
    if load > _LEAST_WEIGHT * float(np.ptp(force)):
        return load / STANDARD_GRAVITY, load
    if not stiffness > 0.0:
        raise IsolationError(
            f"The stiffness of A in the middle of the range that both share must be > 0 for a mass to rest there, got "
            f"{stiffness:.4g} N/m; give a mass that rests elsewhere."
        )
    return stiffness / (2.0 * np.pi * _FREQUENCY) ** 2, load
