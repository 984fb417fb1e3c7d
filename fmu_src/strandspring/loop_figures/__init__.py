"""What engineers read off a hysteresis loop, from a record and from the model; knows nothing of identification."""

from .cycles import Cycle, find_cycles
from .loop import Branch, Loop, LoopFigures, alike_loops
from .measured import FigureSpread, MeasuredLoop, measured_loops
from .modelled import model_curve, model_loop, steady_omega

__all__ = [
    "Branch",
    "Cycle",
    "FigureSpread",
    "Loop",
    "LoopFigures",
    "MeasuredLoop",
    "alike_loops",
    "find_cycles",
    "measured_loops",
    "model_curve",
    "model_loop",
    "steady_omega",
]
