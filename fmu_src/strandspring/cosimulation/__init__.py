"""Co-simulation of mechanical systems with spring FMUs through FMPy: plants, masters, energy balance, stability."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .coupling import Master
    from .energy import EnergyBalance, energy_balance
    from .fmu_spring import CosimulationError, FmuSpring, Response
    from .iterative import Iterative, MeanForce, TangentSource, TrialMethod
    from .masters import GaussSeidel, InputPath, Jacobi, Subsystem, Verlet
    from .plants import Attachment, Plant, one_mass
    from .simulation import Motion, simulate
    from .stability import growth_factor, largest_stable_step
    from .statics import apply_static_load

__all__ = [
    "Attachment",
    "CosimulationError",
    "EnergyBalance",
    "FmuSpring",
    "GaussSeidel",
    "InputPath",
    "Iterative",
    "Jacobi",
    "Master",
    "MeanForce",
    "Motion",
    "Plant",
    "Response",
    "Subsystem",
    "TangentSource",
    "TrialMethod",
    "Verlet",
    "apply_static_load",
    "energy_balance",
    "growth_factor",
    "largest_stable_step",
    "one_mass",
    "simulate",
]

# Module of each name; it is loaded when the first of its names is used.
_MODULES = {
    "Attachment": "plants",
    "CosimulationError": "fmu_spring",
    "EnergyBalance": "energy",
    "FmuSpring": "fmu_spring",
    "GaussSeidel": "masters",
    "InputPath": "masters",
    "Iterative": "iterative",
    "Jacobi": "masters",
    "Master": "coupling",
    "MeanForce": "iterative",
    "Motion": "simulation",
    "Plant": "plants",
    "Response": "fmu_spring",
    "Subsystem": "masters",
    "TangentSource": "iterative",
    "TrialMethod": "iterative",
    "Verlet": "masters",
    "apply_static_load": "statics",
    "energy_balance": "energy",
    "growth_factor": "stability",
    "largest_stable_step": "stability",
    "one_mass": "plants",
    "simulate": "simulation",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
