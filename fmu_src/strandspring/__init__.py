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

import sys

# `python -m strandspring` has the current folder first on its path, unless with -P: what lies there is not imported.
if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].removeprefix("-m").partition(".")[0] == __name__
    and not getattr(sys.flags, "safe_path", sys.flags.isolated)
):
    del sys.path[0]

from typing import TYPE_CHECKING

from ._lazy import load_lazily

if TYPE_CHECKING:
    from ._version import __version__ as __version__
    from .api.building import build_fmu as build_fmu
    from .api.comparison import Comparison as Comparison
    from .api.comparison import compare as compare
    from .api.exporting import export as export
    from .api.identification import Identification as Identification
    from .api.identification import identify as identify
    from .api.information import Information as Information
    from .api.information import info as info
    from .api.isolation import Isolation as Isolation
    from .api.isolation import isolate as isolate
    from .api.many import ManyResult as ManyResult
    from .api.many import identify_many as identify_many
    from .api.prediction import Prediction as Prediction
    from .api.prediction import predict as predict
    from .api.records import bundled_record as bundled_record
    from .api.showing import show as show
    from .api.simulating import Simulation as Simulation
    from .api.simulating import simulate as simulate
    from .api.spring import Spring as Spring
    from .api.studying import StudyResult as StudyResult
    from .api.studying import study as study
    from .api.synthesis import synthesize as synthesize
    from .api.synthesis import synthesize_ni as synthesize_ni
    from .api.system_isolation import SystemIsolation as SystemIsolation
    from .api.system_isolation import isolate_system as isolate_system
    from .api.system_studying import SystemStudyResult as SystemStudyResult
    from .api.system_studying import study_system as study_system
    from .api.verifying import Verification as Verification
    from .api.verifying import verify as verify
    from .core.parameters import SpringParameters as SpringParameters
    from .cosimulation.prescribed import simulate_fmu as simulate_fmu
    from .errors import BuildError as BuildError
    from .errors import ModelError as ModelError
    from .errors import RecordError as RecordError
    from .errors import StrandspringError as StrandspringError
    from .identification.outcomes import IdentificationError as IdentificationError
    from .identification.outcomes import Outcome as Outcome
    from .identification.refined import RefinedOptions as RefinedOptions
    from .identification.search.scan import ScanOptions as ScanOptions
    from .intake.description_file import read_campaign as read_campaign
    from .jobs.cluster import Cluster as Cluster
    from .loops.selection import select as select
    from .model.conversions import ClassicBoucWen as ClassicBoucWen
    from .model.conversions import NormalizedBoucWen as NormalizedBoucWen
    from .model.modelfile import model_schema as model_schema
    from .peers.limit_cycle import limit_cycle as limit_cycle
    from .peers.ni_spring import NiOptions as NiOptions
    from .peers.two_stage_options import TwoStageOptions as TwoStageOptions
    from .records.reading import read_record as read_record
    from .records.record import Record as Record
    from .report.details import ReportDetails as ReportDetails

# Where each name is defined.
_MODULES = {
    "BuildError": "errors",
    "ClassicBoucWen": "model.conversions",
    "Cluster": "jobs.cluster",
    "Comparison": "api.comparison",
    "Identification": "api.identification",
    "IdentificationError": "identification.outcomes",
    "Information": "api.information",
    "Isolation": "api.isolation",
    "ManyResult": "api.many",
    "ModelError": "errors",
    "NiOptions": "peers.ni_spring",
    "NormalizedBoucWen": "model.conversions",
    "Outcome": "identification.outcomes",
    "Prediction": "api.prediction",
    "Record": "records.record",
    "RecordError": "errors",
    "RefinedOptions": "identification.refined",
    "ScanOptions": "identification.search.scan",
    "ReportDetails": "report.details",
    "Simulation": "api.simulating",
    "Spring": "api.spring",
    "SpringParameters": "core.parameters",
    "SystemIsolation": "api.system_isolation",
    "StrandspringError": "errors",
    "StudyResult": "api.studying",
    "SystemStudyResult": "api.system_studying",
    "TwoStageOptions": "peers.two_stage_options",
    "Verification": "api.verifying",
    "__version__": "_version",
    "build_fmu": "api.building",
    "bundled_record": "api.records",
    "compare": "api.comparison",
    "export": "api.exporting",
    "identify": "api.identification",
    "info": "api.information",
    "isolate": "api.isolation",
    "isolate_system": "api.system_isolation",
    "identify_many": "api.many",
    "limit_cycle": "peers.limit_cycle",
    "model_schema": "model.modelfile",
    "predict": "api.prediction",
    "read_campaign": "intake.description_file",
    "read_record": "records.reading",
    "select": "loops.selection",
    "show": "api.showing",
    "simulate": "api.simulating",
    "simulate_fmu": "cosimulation.prescribed",
    "synthesize": "api.synthesis",
    "synthesize_ni": "api.synthesis",
    "study": "api.studying",
    "study_system": "api.system_studying",
    "verify": "api.verifying",
}

load_lazily(globals(), _MODULES)
