"""An identification as a model file, with its figures and where it comes from."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

from .._version import __version__
from ..modelfile import ModelFile, model_file

if TYPE_CHECKING:
    from .api import Identification


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
        uncertainty=i.uncertainty,
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
