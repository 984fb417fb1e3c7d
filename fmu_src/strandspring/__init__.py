"""Identify hysteretic springs from measured records and build FMUs of them.

Examples
--------
>>> from strandspring import bundled_record, identify
>>> result = identify(bundled_record(), reverse="displacement")
>>> spring = result.spring("hinge")
>>> low, high = result.parameters.displacement_min, result.parameters.displacement_max
>>> force = spring.response([low, high, low])  # [N], along a displacement path [m]
>>> bool(force[0] < force[1])
True
"""

from typing import TYPE_CHECKING

from ._lazy import load_lazily

if TYPE_CHECKING:
    from ._version import __version__ as __version__
    from .api.identification import Identification as Identification
    from .api.identification import identify as identify
    from .api.information import Information as Information
    from .api.information import info as info
    from .api.prediction import Prediction as Prediction
    from .api.prediction import predict as predict
    from .api.records import bundled_record as bundled_record
    from .api.spring import Spring as Spring
    from .api.synthesis import synthesize as synthesize
    from .api.synthesis import synthesize_ni as synthesize_ni
    from .conversions import ClassicBoucWen as ClassicBoucWen
    from .conversions import NormalizedBoucWen as NormalizedBoucWen
    from .core.parameters import SpringParameters as SpringParameters
    from .cosimulation.prescribed import simulate_fmu as simulate_fmu
    from .errors import BuildError as BuildError
    from .errors import ModelError as ModelError
    from .errors import RecordError as RecordError
    from .errors import StrandspringError as StrandspringError
    from .identification.outcomes import IdentificationError as IdentificationError
    from .identification.outcomes import Outcome as Outcome
    from .identification.refined import RefinedOptions as RefinedOptions
    from .identification.scan import ScanOptions as ScanOptions
    from .modelfile import model_schema as model_schema
    from .peers.limit_cycle import limit_cycle as limit_cycle
    from .peers.ni_spring import NiOptions as NiOptions
    from .peers.two_stage_options import TwoStageOptions as TwoStageOptions
    from .records.reading import read_record as read_record
    from .records.record import Record as Record

# Where each name is defined.
_MODULES = {
    "BuildError": "errors",
    "ClassicBoucWen": "conversions",
    "Identification": "api.identification",
    "IdentificationError": "identification.outcomes",
    "Information": "api.information",
    "ModelError": "errors",
    "NiOptions": "peers.ni_spring",
    "NormalizedBoucWen": "conversions",
    "Outcome": "identification.outcomes",
    "Prediction": "api.prediction",
    "Record": "records.record",
    "RecordError": "errors",
    "RefinedOptions": "identification.refined",
    "ScanOptions": "identification.scan",
    "Spring": "api.spring",
    "SpringParameters": "core.parameters",
    "StrandspringError": "errors",
    "TwoStageOptions": "peers.two_stage_options",
    "__version__": "_version",
    "bundled_record": "api.records",
    "identify": "api.identification",
    "info": "api.information",
    "limit_cycle": "peers.limit_cycle",
    "model_schema": "modelfile",
    "predict": "api.prediction",
    "read_record": "records.reading",
    "simulate_fmu": "cosimulation.prescribed",
    "synthesize": "api.synthesis",
    "synthesize_ni": "api.synthesis",
}

load_lazily(globals(), _MODULES)
