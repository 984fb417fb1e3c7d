"""The plant of an exported SSP system, for PythonFMU: a mass above a shaking base, force in, displacement out.

Between communication points the force is constant, so the motion is a parabola and the step is exact.
"""

from __future__ import annotations

import math
from typing import Any

from pythonfmu.enums import Fmi2Causality, Fmi2Variability
from pythonfmu.fmi2slave import Fmi2Slave
from pythonfmu.variables import Real


class ShakenMass(Fmi2Slave):  # type: ignore[misc]
    """Mass above a base that vibrates; positions are zero at the start."""

    author = "strandspring"
    description = "Mass above a base that moves as a sine"

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.mass = 1.0
        self.load = 0.0
        self.amplitude = 0.0
        self.frequency = 1.0
        self.force = 0.0
        self.displacement = 0.0
        self.position = 0.0
        self.speed = 0.0
        for name in ("mass", "load", "amplitude", "frequency"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        for name in ("displacement", "position", "speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        acceleration = (self.load - self.force) / self.mass
        self.position += step_size * (self.speed + 0.5 * step_size * acceleration)
        self.speed += step_size * acceleration
        end = current_time + step_size
        self.displacement = self.position - self.amplitude * math.sin(2.0 * math.pi * self.frequency * end)
        return True
