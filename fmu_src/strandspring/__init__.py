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
    from .api.common.given import bundled_record as bundled_record
    from .api.comparison import Comparison as Comparison
    from .api.comparison import compare as compare
    from .api.fmus.build import Verification as Verification
    from .api.fmus.build import build_fmu as build_fmu
    from .api.fmus.build import export as export
    from .api.fmus.build import verify as verify
    from .api.fmus.options import BuildOptions as BuildOptions
    from .api.fmus.system_fmu import SystemInformation as SystemInformation
    from .api.identification import Identification as Identification
    from .api.identification import ManyResult as ManyResult
    from .api.identification import identify as identify
    from .api.identification import identify_many as identify_many
    from .api.information import Information as Information
    from .api.information import Prediction as Prediction
    from .api.information import info as info
    from .api.information import predict as predict
    from .api.options import Comparing as Comparing
    from .api.options import Fitting as Fitting
    from .api.options import Sampling as Sampling
    from .api.planning import TestPlan as TestPlan
    from .api.planning import plan as plan
    from .api.records import show as show
    from .api.records import synthesize as synthesize
    from .api.spring import Computing as Computing
    from .api.spring import Responses as Responses
    from .api.spring import Spring as Spring
    from .api.spring import responses as responses
    from .api.vibration.isolation import Isolation as Isolation
    from .api.vibration.studies import StudyResult as StudyResult
    from .api.vibration.studies import isolate as isolate
    from .api.vibration.studies import study as study
    from .api.vibration.systems import Simulation as Simulation
    from .api.vibration.systems import SystemIsolation as SystemIsolation
    from .api.vibration.systems import simulate as simulate
    from .campaigns.jobs.options import Cluster as Cluster
    from .campaigns.jobs.options import Workers as Workers
    from .campaigns.planning.limits import Limits as Limits
    from .core.parameters import SpringParameters as SpringParameters
    from .cosimulation.prescribed import simulate_fmu as simulate_fmu
    from .errors import BuildError as BuildError
    from .errors import ModelError as ModelError
    from .errors import OptionError as OptionError
    from .errors import RecordError as RecordError
    from .errors import StrandspringError as StrandspringError
    from .findings import Finding as Finding
    from .findings import IdentificationError as IdentificationError
    from .findings import Outcome as Outcome
    from .identification.options import RefinedOptions as RefinedOptions
    from .loops.reading import Reading as Reading
    from .loops.reading import read_campaign as read_campaign
    from .loops.reading import read_record as read_record
    from .loops.selection import select as select
    from .model.conversions import ClassicBoucWen as ClassicBoucWen
    from .model.conversions import NormalizedBoucWen as NormalizedBoucWen
    from .model.modelfile import model_schema as model_schema
    from .peers.options import NiOptions as NiOptions
    from .peers.options import PaperOptions as PaperOptions
    from .peers.options import TwoStageOptions as TwoStageOptions
    from .records.record import Record as Record
    from .report import ReportDetails as ReportDetails
    from .vibration.one_mass.options import Curve as Curve
    from .vibration.one_mass.options import Levels as Levels
    from .vibration.one_mass.options import Mount as Mount
    from .vibration.options import Part as Part
    from .vibration.options import Run as Run
    from .vibration.options import StudyRun as StudyRun

# The names that each module defines.
_NAMES = {
    "_version": ("__version__",),
    "api.common.given": ("bundled_record",),
    "api.comparison": ("Comparison", "compare"),
    "api.fmus.build": ("Verification", "build_fmu", "export", "verify"),
    "api.fmus.options": ("BuildOptions",),
    "api.fmus.system_fmu": ("SystemInformation",),
    "api.identification": ("Identification", "ManyResult", "identify", "identify_many"),
    "api.information": ("Information", "Prediction", "info", "predict"),
    "api.records": ("show", "synthesize"),
    "api.options": ("Comparing", "Fitting", "Sampling"),
    "api.planning": ("TestPlan", "plan"),
    "api.spring": ("Computing", "Responses", "Spring", "responses"),
    "api.vibration.isolation": ("Isolation",),
    "api.vibration.studies": ("StudyResult", "isolate", "study"),
    "api.vibration.systems": ("Simulation", "SystemIsolation", "simulate"),
    "campaigns.jobs.options": ("Cluster", "Workers"),
    "campaigns.planning.limits": ("Limits",),
    "core.parameters": ("SpringParameters",),
    "cosimulation.prescribed": ("simulate_fmu",),
    "errors": ("BuildError", "ModelError", "OptionError", "RecordError", "StrandspringError"),
    "findings": ("Finding", "IdentificationError", "Outcome"),
    "identification.options": ("RefinedOptions",),
    "loops.reading": ("Reading", "read_campaign", "read_record"),
    "loops.selection": ("select",),
    "model.conversions": ("ClassicBoucWen", "NormalizedBoucWen"),
    "model.modelfile": ("model_schema",),
    "peers.options": ("NiOptions", "PaperOptions", "TwoStageOptions"),
    "records.record": ("Record",),
    "report": ("ReportDetails",),
    "vibration.options": ("Part", "Run", "StudyRun"),
    "vibration.one_mass.options": ("Curve", "Levels", "Mount"),
}

load_lazily(globals(), _NAMES)
