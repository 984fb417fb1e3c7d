"""Run a study of one mass."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, fields
from operator import attrgetter
from pathlib import Path
from typing import Any

from ...vibration.one_mass.system import IsolationError
from ..jobs.runners import Runner
from .definition import RunRow, Study
from .execution import run_all
from .journal import manifest_of
from .quantiles import Summaries

_LARGEST_BATCH = 32  # runs; the parent needs some 25 us for a run, of batches of 8 twice as much

# Of the fields of a row, with the unit of the level to be filled in.
_HEADINGS = (
    "run", "draw", "mass [kg]", "level [{}]", "stiffness factor [1]", "kappa_omega [N]", "rho [1/m]", "sigma [1]",
    "n [1]", "rest [m]", "sag [m]", "resonance frequency [Hz]", "transmissibility [1]", "amplitude [m]",
    "stiffness [N/m]", "loss factor [1]", "isolation frequency [Hz]", "resonance inside the band",
    "beyond the identified range", "outcome",
)  # fmt: skip
_cells = attrgetter(*(field.name for field in fields(RunRow)))


def run_study(
    study: Study,
    results: Path,
    runner: Runner,
    progress: Callable[[int], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> Summaries:
    """Execute what is left of a study and write its results; arguments as for `run_all`.

    Raises
    ------
    IsolationError           If the journal is that of another study, or the runs cannot be executed; finished ones are
                             kept.
    StrandspringError        If the journal cannot be removed; the results are written.
    """
    header = [heading.format(study.excitation.unit) for heading in _HEADINGS]
    return run_all(
        study, RunRow, manifest(study), results, header, _cells, lambda rows: Summaries(study, rows), runner,
        IsolationError, _LARGEST_BATCH, progress, notify,
    )  # fmt: skip


def manifest(study: Study) -> dict[str, Any]:
    """What makes a journal that of this study."""
    options = {
        field.name: getattr(study, field.name)
        for field in fields(study)
        if field.name not in ("spring", "spread", "excitation")
    }
    model = {"spring": study.spring.as_dict(), "spread": None if study.spread is None else asdict(study.spread)}
    sha256 = hashlib.sha256(json.dumps(model).encode("utf-8")).hexdigest()
    return manifest_of("model", sha256, {"excitation": study.excitation.value, **options})
