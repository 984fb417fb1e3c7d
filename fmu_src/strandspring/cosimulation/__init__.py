"""Co-simulation of mechanical systems with spring FMUs through FMPy: plants and two masters."""

from .coupled_motion import Motion, simulate
from .fmu_spring import CosimulationError, FmuSpring, Response
from .masters import Iterative, Jacobi, Master
from .plants import Attachment, Plant, one_mass
from .prescribed import PrescribedMotion, simulate_fmu
from .statics import apply_static_load

__all__ = [
    "Attachment",
    "CosimulationError",
    "FmuSpring",
    "Iterative",
    "Jacobi",
    "Master",
    "Motion",
    "Plant",
    "PrescribedMotion",
    "Response",
    "apply_static_load",
    "one_mass",
    "simulate",
    "simulate_fmu",
]
