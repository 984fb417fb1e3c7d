"""Identify hysteretic springs from measured records and build FMUs of them.

Examples
--------
>>> from strandspring import Spring, identify, read_record                   # doctest: +SKIP
>>> identification = identify(read_record("record.csv"))                     # doctest: +SKIP
>>> Spring(identification.parameters).response([0.05, 0.06, 0.05])           # doctest: +SKIP
"""

from ._version import __version__
from .errors import BuildError, ModelError, RecordError, StrandspringError
from .identification import (
    Identification,
    IdentificationError,
    NiOptions,
    Outcome,
    RefinedOptions,
    ScanOptions,
    TwoStageOptions,
    identify,
    limit_cycle,
)
from .model.paper import ClassicBoucWen, NormalizedBoucWen
from .model.parameters import SpringParameters
from .records import Record, read_record
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
