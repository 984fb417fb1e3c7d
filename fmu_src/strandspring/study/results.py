"""The results of a study as a table: one line for each run, in their order."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple
from pathlib import Path

from ..files import write_csv
from ..isolation.system import Excitation
from .definition import RunRow


def write_results(path: Path, rows: Iterable[RunRow], excitation: Excitation) -> None:
    """Write rows as CSV, every number with all its digits; the same rows give the same bytes."""
    heading = {
        "run": "run",
        "draw": "draw",
        "mass": "mass [kg]",
        "level": f"level [{excitation.unit}]",
        "stiffness_factor": "stiffness factor [1]",
        "kappa_omega": "kappa_omega [N]",
        "rho": "rho [1/m]",
        "sigma": "sigma [1]",
        "n": "n [1]",
        "rest": "rest [m]",
        "sag": "sag [m]",
        "frequency": "resonance frequency [Hz]",
        "transmissibility": "transmissibility [1]",
        "amplitude": "amplitude [m]",
        "stiffness": "stiffness [N/m]",
        "loss_factor": "loss factor [1]",
        "isolation_frequency": "isolation frequency [Hz]",
        "inside": "resonance inside the band",
        "extrapolating": "beyond the identified range",
        "outcome": "outcome",
    }
    write_csv(path, (heading[name] for name in RunRow.__dataclass_fields__), map(astuple, rows))
