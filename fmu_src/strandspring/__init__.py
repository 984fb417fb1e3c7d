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
    from .api.comparing.comparison import Comparison as Comparison
    from .api.comparing.comparison import compare as compare
    from .api.fmus.building import build_fmu as build_fmu
    from .api.fmus.exporting import export as export
    from .api.fmus.system_information import SystemInformation as SystemInformation
    from .api.fmus.system_information import info_system as info_system
    from .api.fmus.verifying import Verification as Verification
    from .api.fmus.verifying import verify as verify
    from .api.identification import Identification as Identification
    from .api.identification import identify as identify
    from .api.identifying.information import Information as Information
    from .api.identifying.information import info as info
    from .api.identifying.many import ManyResult as ManyResult
    from .api.identifying.many import identify_many as identify_many
    from .api.identifying.prediction import Prediction as Prediction
    from .api.identifying.prediction import predict as predict
    from .api.identifying.synthesis import synthesize as synthesize
    from .api.identifying.synthesis import synthesize_ni as synthesize_ni
    from .api.planning import TestPlan as TestPlan
    from .api.planning import plan as plan
    from .api.responses import Responses as Responses
    from .api.responses import responses as responses
    from .api.showing import show as show
    from .api.spring import Spring as Spring
    from .api.studies.study_result import StudyResult as StudyResult
    from .api.studies.studying import study as study
    from .api.studies.system_studying import study_system as study_system
    from .api.vibration.isolation import Isolation as Isolation
    from .api.vibration.isolation import isolate as isolate
    from .api.vibration.simulating import Simulation as Simulation
    from .api.vibration.simulating import simulate as simulate
    from .api.vibration.system_isolation import SystemIsolation as SystemIsolation
    from .api.vibration.system_isolation import isolate_system as isolate_system
    from .campaigns.jobs.cluster import Cluster as Cluster
    from .core.parameters import SpringParameters as SpringParameters
    from .cosimulation.prescribed import simulate_fmu as simulate_fmu
    from .errors import BuildError as BuildError
    from .errors import ModelError as ModelError
    from .errors import RecordError as RecordError
    from .errors import StrandspringError as StrandspringError
    from .findings import Finding as Finding
    from .findings import IdentificationError as IdentificationError
    from .findings import Outcome as Outcome
    from .identification.refined import RefinedOptions as RefinedOptions
    from .loops.selection import read_campaign as read_campaign
    from .loops.selection import select as select
    from .model.conversions import ClassicBoucWen as ClassicBoucWen
    from .model.conversions import NormalizedBoucWen as NormalizedBoucWen
    from .model.modelfile import model_schema as model_schema
    from .peers.ni import NiOptions as NiOptions
    from .peers.paper import PaperOptions as PaperOptions
    from .peers.two_stage import TwoStageOptions as TwoStageOptions
    from .records.given import bundled_record as bundled_record
    from .records.reading import read_record as read_record
    from .records.record import Record as Record
    from .report.details import ReportDetails as ReportDetails

# The names that each module defines.
_NAMES = {
    "_version": ("__version__",),
    "api.comparing.comparison": ("Comparison", "compare"),
    "api.fmus.building": ("build_fmu",),
    "api.fmus.exporting": ("export",),
    "api.fmus.system_information": ("SystemInformation", "info_system"),
    "api.fmus.verifying": ("Verification", "verify"),
    "api.identification": ("Identification", "identify"),
    "api.identifying.information": ("Information", "info"),
    "api.identifying.many": ("ManyResult", "identify_many"),
    "api.identifying.prediction": ("Prediction", "predict"),
    "api.identifying.synthesis": ("synthesize", "synthesize_ni"),
    "api.planning": ("TestPlan", "plan"),
    "api.responses": ("Responses", "responses"),
    "api.showing": ("show",),
    "api.spring": ("Spring",),
    "api.studies.study_result": ("StudyResult",),
    "api.studies.studying": ("study",),
    "api.studies.system_studying": ("study_system",),
    "api.vibration.isolation": ("Isolation", "isolate"),
    "api.vibration.simulating": ("Simulation", "simulate"),
    "api.vibration.system_isolation": ("SystemIsolation", "isolate_system"),
    "campaigns.jobs.cluster": ("Cluster",),
    "core.parameters": ("SpringParameters",),
    "cosimulation.prescribed": ("simulate_fmu",),
    "errors": ("BuildError", "ModelError", "RecordError", "StrandspringError"),
    "findings": ("Finding", "IdentificationError", "Outcome"),
    "identification.refined": ("RefinedOptions",),
    "loops.selection": ("read_campaign", "select"),
    "model.conversions": ("ClassicBoucWen", "NormalizedBoucWen"),
    "model.modelfile": ("model_schema",),
    "peers.ni": ("NiOptions",),
    "peers.paper": ("PaperOptions",),
    "peers.two_stage": ("TwoStageOptions",),
    "records.given": ("bundled_record",),
    "records.reading": ("read_record",),
    "records.record": ("Record",),
    "report.details": ("ReportDetails",),
}

load_lazily(globals(), _NAMES)
