"""Parameter studies of a mass on a mount: grids, springs drawn from their uncertainty, many cores, resumption."""

from .cluster import Cluster
from .definition import DONE, STIFFNESS_FACTORS, GridPoint, RunRow, Study
from .journal import journal_path
from .run import run_study
from .runners import InProcess, LocalProcesses, Runner
from .spread import Spread
from .summary import FIGURES, GridPointSummary, Quantiles, summarize

__all__ = [
    "DONE",
    "FIGURES",
    "STIFFNESS_FACTORS",
    "Cluster",
    "GridPoint",
    "GridPointSummary",
    "InProcess",
    "LocalProcesses",
    "Quantiles",
    "RunRow",
    "Runner",
    "Spread",
    "Study",
    "journal_path",
    "run_study",
    "summarize",
]
