"""Identification of the spring from records; knows the model and the records, nothing of FMI."""

from .api import Identification, Options, identify
from .limit_cycle import limit_cycle
from .ni_spring import NiOptions
from .outcomes import IdentificationError, Outcome
from .refined import RefinedOptions
from .scan import ScanOptions
from .two_stage import TwoStageOptions

__all__ = [
    "Identification",
    "IdentificationError",
    "NiOptions",
    "Options",
    "Outcome",
    "RefinedOptions",
    "ScanOptions",
    "TwoStageOptions",
    "identify",
    "limit_cycle",
]
