"""What a mass on hysteretic springs does: rest, steady vibration, transmissibility; knows the model only."""

from .response import FrequencyResponse, Resonance, ResponsePoint, frequency_response
from .system import Excitation, IsolatedMass, IsolationError, StaticPoint, static_point

__all__ = [
    "Excitation",
    "FrequencyResponse",
    "IsolatedMass",
    "IsolationError",
    "Resonance",
    "ResponsePoint",
    "StaticPoint",
    "frequency_response",
    "static_point",
]
