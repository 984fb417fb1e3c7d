"""Identify hysteretic springs from measured records and build FMUs of them.

Examples
--------
>>> from strandspring import Spring, identify, read_record                   # doctest: +SKIP
>>> identification = identify(read_record("record.csv"))                     # doctest: +SKIP
>>> Spring(identification.parameters).response([0.05, 0.06, 0.05])           # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._version import __version__
    from .conversions import ClassicBoucWen, NormalizedBoucWen
    from .core.parameters import SpringParameters
    from .errors import BuildError, ModelError, RecordError, StrandspringError
    from .identification.api import identify
    from .identification.outcomes import IdentificationError, Outcome
    from .identification.refined import RefinedOptions
    from .identification.result import Identification
    from .identification.scan import ScanOptions
    from .peers.limit_cycle import limit_cycle
    from .peers.ni_spring import NiOptions
    from .peers.two_stage_options import TwoStageOptions
    from .records.reading import read_record
    from .records.record import Record
    from .spring import Spring

__all__ = [
    "BuildError",
    "ClassicBoucWen",
    "Identification",
    "IdentificationError",
    "ModelError",
    "NiOptions",
    "NormalizedBoucWen",
    "Outcome",
    "Record",
    "RecordError",
    "RefinedOptions",
    "ScanOptions",
    "Spring",
    "SpringParameters",
    "StrandspringError",
    "TwoStageOptions",
    "__version__",
    "identify",
    "limit_cycle",
    "read_record",
]

# Where each name is defined: a module is loaded when the first of its names is asked for.
_MODULES = {
    "BuildError": "errors",
    "ClassicBoucWen": "conversions",
    "Identification": "identification.result",
    "IdentificationError": "identification.outcomes",
    "ModelError": "errors",
    "NiOptions": "peers.ni_spring",
    "NormalizedBoucWen": "conversions",
    "Outcome": "identification.outcomes",
    "Record": "records.record",
    "RecordError": "errors",
    "RefinedOptions": "identification.refined",
    "ScanOptions": "identification.scan",
    "Spring": "spring",
    "SpringParameters": "core.parameters",
    "StrandspringError": "errors",
    "TwoStageOptions": "peers.two_stage_options",
    "__version__": "_version",
    "identify": "identification.api",
    "limit_cycle": "peers.limit_cycle",
    "read_record": "records.reading",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
