"""The plant of an exported SSP system, for PythonFMU: a mass above a shaking base, force in, displacement out.

Between communication points the force is constant, so the motion is a parabola and the step is exact. Through the
first step the mass rests: some tools have not passed on the force of the spring by then.
"""

from __future__ import annotations

import math
import sys
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Causality, Fmi2Variability
from pythonfmu.fmi2slave import Fmi2Slave
from pythonfmu.variables import Real

# Forces that are held over longer steps give another motion altogether.
_FEWEST_STEPS_A_PERIOD = 50


class ShakenMass(Fmi2Slave):  # type: ignore[misc]
    """Mass above a base that vibrates; positions are zero at the start."""

    author = "strandspring"
    description = "Mass above a base that moves as a sine"
    values: ClassVar = {"mass": 1.0, "load": 0.0, "amplitude": 0.0, "frequency": 1.0}

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.force = 0.0
        self.displacement = 0.0
        self.position = 0.0
        self.speed = 0.0
        self.is_at_rest = True
        for name, value in self.values.items():
            setattr(self, name, value)
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("force", causality=Fmi2Causality.input))
        for name in ("displacement", "position", "speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        if step_size * self.frequency * _FEWEST_STEPS_A_PERIOD > 1.0:
            longest = 1.0 / (_FEWEST_STEPS_A_PERIOD * self.frequency)
            problem = (
                f"Steps of {1e3 * step_size:.4g} ms are too long for forces that are held over them; take "
                f"{1e3 * longest:.4g} ms at most, and halve that to see the error."
            )
            # PythonFMU passes it on only where the host has turned logging on.
            print(problem, file=sys.stderr)
            raise ValueError(problem)
        acceleration = 0.0 if self.is_at_rest else (self.load - self.force) / self.mass
        self.is_at_rest = False
        self.position += step_size * (self.speed + 0.5 * step_size * acceleration)
        self.speed += step_size * acceleration
        end = current_time + step_size
        self.displacement = self.position - self.amplitude * math.sin(2.0 * math.pi * self.frequency * end)
        return True
