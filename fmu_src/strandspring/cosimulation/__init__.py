"""Spring FMUs coupled to mechanical systems through FMPy: plants, masters, energy balance, stability."""

from .coupling import Master
from .energy import EnergyBalance, energy_balance
from .iterative import Iterative, MeanForce, Slope, Trial
from .masters import Course, First, GaussSeidel, Jacobi, Verlet
from .plants import Attachment, Plant, one_mass
from .simulation import Motion, simulate
from .stability import growth, largest_stable_step
from .statics import loaded_slowly
from .unit import CosimulationError, Response, SpringUnit, spring_unit

__all__ = [
    "Attachment",
    "CosimulationError",
    "Course",
    "EnergyBalance",
    "First",
    "GaussSeidel",
    "Iterative",
    "Jacobi",
    "Master",
    "MeanForce",
    "Motion",
    "Plant",
    "Response",
    "Slope",
    "SpringUnit",
    "Trial",
    "Verlet",
    "energy_balance",
    "growth",
    "largest_stable_step",
    "loaded_slowly",
    "one_mass",
    "simulate",
    "spring_unit",
]
