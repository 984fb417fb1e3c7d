"""Run a study of a SYSTEM.toml."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...errors import MountedSystemError
from ..jobs.runners import Runner
from .execution import run_all
from .journal import manifest_of
from .system_study import SystemRow, SystemStudy
from .system_summaries import SystemSummaries

_LARGEST_BATCH = 8  # runs; a shock takes some 15 ms, random vibration seconds

# Of the fields of a row after the accelerations.
_FIGURES = {
    "sway": "sway [m]",
    "tilt": "tilt [rad]",
    "stroke": "stroke [1]",
    "mount": "mount of the stroke",
    "force": "force [N]",
    "rms_acceleration": "rms acceleration [m/s^2]",
    "rms_sway": "rms sway [m]",
    "error": "numerical error [1]",
    "acceleration_margin": "margin of acceleration [1]",
    "sway_margin": "margin of sway [1]",
    "tilt_margin": "margin of tilt [1]",
    "stroke_margin": "margin of stroke [1]",
    "governing": "least margin",
    "verdict": "verdict",
    "outcome": "outcome",
}


def run_system_study(
    study: SystemStudy,
    results: Path,
    runner: Runner,
    progress: Callable[[int], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> SystemSummaries:
    """Execute what is left of a study and write its results; arguments as for `run_all`.

    Raises
    ------
    MountedSystemError       If the journal is that of another study, or the runs cannot be executed; finished ones are
                             kept.
    StrandspringError        If the journal cannot be removed; the results are written.
    """

    def cells(row: SystemRow) -> list[object]:
        place = study.place(row.run)
        accelerations = row.accelerations or (None,) * len(study.points)
        return [
            row.run, *study.values(place.point), place.draw if study.draws else None,
            study.candidates[place.candidate][1], study.cases[place.case][1], *accelerations,
            *(getattr(row, name) for name in _FIGURES),
        ]  # fmt: skip

    return run_all(
        study, SystemRow, _manifest(study), results, headings(study), cells, lambda rows: SystemSummaries(study, rows),
        runner, MountedSystemError, _LARGEST_BATCH, progress, notify,
    )  # fmt: skip


def headings(study: SystemStudy) -> list[str]:
    """Of the columns of the results, with their units."""
    return [
        "run", *(one.heading for one in study.varied), "draw", "candidate", "case",
        *(f"acceleration of {name} [m/s^2]" for name in study.points), *_FIGURES.values(),
    ]  # fmt: skip


def _manifest(study: SystemStudy) -> dict[str, Any]:
    content = {"system": study.content, "files": study.files.digests()}
    options = {
        "vary": [asdict(one) for one in study.varied],
        "candidates": study.candidates,
        "cases": study.cases,
        "draws": study.draws,
        "seed": study.seed,
        "step": study.step,
    }
    return manifest_of("system", hashlib.sha256(json.dumps(content).encode("utf-8")).hexdigest(), options)
