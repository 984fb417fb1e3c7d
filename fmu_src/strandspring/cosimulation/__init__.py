"""Spring FMUs coupled to mechanical systems through FMPy: plants, masters, energy balance, stability."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

# Where each name is defined: a module is loaded when the first of its names is asked for.
_MODULES = {
    "Attachment": "plants",
    "CosimulationError": "unit",
    "Course": "masters",
    "EnergyBalance": "energy",
    "First": "masters",
    "GaussSeidel": "masters",
    "Iterative": "iterative",
    "Jacobi": "masters",
    "Master": "coupling",
    "MeanForce": "iterative",
    "Motion": "simulation",
    "Plant": "plants",
    "Response": "unit",
    "Slope": "iterative",
    "SpringUnit": "unit",
    "Trial": "iterative",
    "Verlet": "masters",
    "energy_balance": "energy",
    "growth": "stability",
    "largest_stable_step": "stability",
    "loaded_slowly": "statics",
    "one_mass": "plants",
    "simulate": "simulation",
    "spring_unit": "unit",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
