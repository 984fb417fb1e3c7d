"""An identification in words and as JSON."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import PurePath
from typing import Any

from .._version import __version__
from ..identification import Identification
from ..identification.figures import RecordFit
from ..model.parameters import SpringParameters
from ..modelfile import ModelFile, model_file


def identified_model(identification: Identification, name: str, description: str = "") -> ModelFile:
    """The model file of an identification: file names without folders and no dates, so that bytes are stable."""
    i = identification
    text = description or (
        f"Hysteretic spring identified from {', '.join(PurePath(record.path).name for record in i.records)}"
    )
    return model_file(
        name,
        i.parameters,
        text[:2000],
        fit={
            "rmse": i.rmse,
            "rnl": i.rnl,
            "degrees": list(i.degrees),
            "steady_share": i.steady_share,
            "outcomes": [{"name": o.name.lower(), "sentence": o.value} for o in i.outcomes],
            "records": [
                {
                    "file": PurePath(fit.path).name,
                    "samples": fit.samples,
                    "first_sample": fit.first_sample,
                    "rmse": fit.rmse,
                    "rnl": fit.rnl,
                    "omega_start": fit.omega_start,
                    "compared": fit.compared,
                }
                for fit in i.fits
            ],
        },
        provenance={
            "records": [
                {
                    "file": PurePath(record.path).name,
                    "sha256": record.sha256,
                    "samples": int(record.force.size),
                    "notes": list(record.notes),
                }
                for record in i.records
            ],
            "method": i.method,
            "options": i.options,
            "version": __version__,
        },
    )


def fit_json(fit: RecordFit) -> dict[str, Any]:
    """One entry of `records` in the JSON output."""
    return {
        "path": fit.path,
        "samples": fit.samples,
        "rmse": fit.rmse,
        "rnl": fit.rnl,
        "omega_start": fit.omega_start,
        "compared": fit.compared,
    }


def fit_lines(fits: tuple[RecordFit, ...]) -> list[str]:
    """One line for each record."""
    return [
        f"  {fit.path}: rmse {fit.rmse:.4g} N, RNL {fit.rnl:.4f} over {fit.samples} samples ({fit.compared})"
        for fit in fits
    ]


def parameter_lines(p: SpringParameters) -> list[str]:
    """The parameters in words and units that people read."""
    numbers = asdict(p)
    lines = [
        f"  {name:<12} {numbers[name]:<12.6g} {unit}"
        for name, unit in (("kappa_omega", "N"), ("rho", "1/m"), ("sigma", ""), ("n", ""))
    ]
    lines.append(f"  FE degree {len(p.kE) - 1}, kE: {', '.join(f'{c:.6g}' for c in p.kE)}  N/m^i")
    lines.append(f"  FA degree {len(p.kA) - 1}, kA: {', '.join(f'{c:.6g}' for c in p.kA)}  1/m^i")
    low, high, middle = (1e3 * v for v in (p.displacement_min, p.displacement_max, p.displacement_offset))
    lines.append(f"  identified from {low:.6g} to {high:.6g} mm, polynomials about {middle:.6g} mm")
    return [line.rstrip() for line in lines]
