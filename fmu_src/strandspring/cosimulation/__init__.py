"""Co-simulation of mechanical systems with spring FMUs through FMPy: plants, masters, energy balance, stability."""

from typing import TYPE_CHECKING

from .._lazy import load_lazily

if TYPE_CHECKING:
    from .coupled_motion import Motion as Motion
    from .coupled_motion import simulate as simulate
    from .coupling import Master as Master
    from .energy import EnergyBalance as EnergyBalance
    from .energy import energy_balance as energy_balance
    from .fmu_spring import CosimulationError as CosimulationError
    from .fmu_spring import FmuSpring as FmuSpring
    from .fmu_spring import Response as Response
    from .iterative import Iterative as Iterative
    from .iterative import MeanForce as MeanForce
    from .iterative import TangentSource as TangentSource
    from .iterative import TrialMethod as TrialMethod
    from .masters import GaussSeidel as GaussSeidel
    from .masters import InputPath as InputPath
    from .masters import Jacobi as Jacobi
    from .masters import Subsystem as Subsystem
    from .masters import Verlet as Verlet
    from .plants import Attachment as Attachment
    from .plants import Plant as Plant
    from .plants import one_mass as one_mass
    from .prescribed import PrescribedMotion as PrescribedMotion
    from .prescribed import simulate_fmu as simulate_fmu
    from .stability import growth_factor as growth_factor
    from .stability import largest_stable_step as largest_stable_step
    from .statics import apply_static_load as apply_static_load

# Where each name is defined.
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
    "Motion": "coupled_motion",
    "Plant": "plants",
    "PrescribedMotion": "prescribed",
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
    "simulate": "coupled_motion",
    "simulate_fmu": "prescribed",
}

load_lazily(globals(), _MODULES)
