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
    from ._version import __version__ as __version__
    from .conversions import ClassicBoucWen as ClassicBoucWen
    from .conversions import NormalizedBoucWen as NormalizedBoucWen
    from .core.parameters import SpringParameters as SpringParameters
    from .cosimulation.prescribed import simulate_fmu as simulate_fmu
    from .errors import BuildError as BuildError
    from .errors import ModelError as ModelError
    from .errors import RecordError as RecordError
    from .errors import StrandspringError as StrandspringError
    from .identification.api import identify as identify
    from .identification.outcomes import IdentificationError as IdentificationError
    from .identification.outcomes import Outcome as Outcome
    from .identification.refined import RefinedOptions as RefinedOptions
    from .identification.result import Identification as Identification
    from .identification.scan import ScanOptions as ScanOptions
    from .intake.description_file import read_campaign as read_campaign
    from .loops.selection import select as select
    from .peers.limit_cycle import limit_cycle as limit_cycle
    from .peers.ni_spring import NiOptions as NiOptions
    from .peers.two_stage_options import TwoStageOptions as TwoStageOptions
    from .records.reading import read_record as read_record
    from .records.record import Record as Record
    from .spring import Spring as Spring

# Where each name is defined.
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
    "read_campaign": "intake.description_file",
    "read_record": "records.reading",
    "select": "loops.selection",
    "simulate_fmu": "cosimulation.prescribed",
}


def load_lazily(content: dict[str, Any], modules: dict[str, str]) -> None:
    """Give a package, by its globals, names whose modules are loaded when the first of their names is asked for."""
    package = content["__name__"]

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        content[name] = getattr(import_module(f".{modules[name]}", package), name)
        return content[name]

    content |= {"__getattr__": load, "__dir__": lambda: sorted({*content, *modules}), "__all__": list(modules)}


load_lazily(globals(), _MODULES)
