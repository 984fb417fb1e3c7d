"""What an identification gives: the spring, its figures and where it comes from; also as a model file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import PurePath
from typing import Any

from .._version import __version__
from ..core.parameters import SpringParameters
from ..model.certificate import ForceRange
from ..model.modelfile import ModelFile
from ..model.names import identifier
from ..model.outcomes import Outcome
from ..records.record import Record
from .certainty.figures import RecordFit, began_at_rest, both_figures, overall_figures
from .certainty.lack_of_fit import LackOfFit
from .certainty.prediction_interval import PredictionBand
from .certainty.saved_spring import LoopEnergy
from .classes.wider import Wider
from .points.steady_part import SteadyRecord
from .unrecorded.small_loops import SmallLoops


@dataclass(frozen=True, eq=False)
class IdentifiedModel:
    """An identified spring, its figures and its origin.

    Attributes
    ----------
    parameters : SpringParameters
    records : tuple of Record
    steady_parts : tuple of SteadyRecord   Steady parts of the records as they were fitted, without the rig's effects.
    fits : tuple of RecordFit       Prediction of each record over its steady part by the spring alone, driven by the
                                    displacement as recorded: what its FMU gives.
    fitted : tuple of RecordFit     The same with what was removed from the records: the rig's effects, and reversals
                                    of the displacement below its noise.
    rmse, rnl : float               Of `fits`, over all compared samples [N], [-].
    degrees : (int or None, int)    N of FE, None if it is a table, and M of FA.
    steady_share : float            Where the steady section was taken to begin, share of the longest stroke.
    findings : dict                 Cautions for the user: outcomes with their details, which may be empty, the most
                                    harmful first.
    uncertainty : dict              Content of the model file's field: standard errors, correlations, 95 % intervals,
                                    joint covariance, prediction interval; empty but for the refined method.
    prediction_band : PredictionBand or None   95 % confidence band and prediction interval on the last loop; of the
                                    refined method only.
    effects : dict                  Sizes of the rig's effects that were removed, found or given, by name, in SI
                                    units; empty without any. `parameters` are those of the spring alone.
    lack_of_fit : LackOfFit or None Misfit by what matters; of the refined method only.
    recorded : tuple of LoopEnergy  Energies of the recorded loops, measured and of the saved spring, by amplitude.
    small_loops : SmallLoops        Energy of loops smaller than the recorded ones, with the range it may have.
    method : str
    options : dict                  The options, for the provenance.
    certificate : ForceRange        Of the recorded force, which the spring keeps to.
    wider : Wider or None           What a search for a second mechanism and branches found; None if nothing promised.
    """

    parameters: SpringParameters
    records: tuple[Record, ...]
    steady_parts: tuple[SteadyRecord, ...]
    fits: tuple[RecordFit, ...]
    fitted: tuple[RecordFit, ...]
    rmse: float
    rnl: float
    degrees: tuple[int | None, int]
    steady_share: float
    findings: dict[Outcome, str]
    uncertainty: dict[str, Any]
    prediction_band: PredictionBand | None
    effects: dict[str, Any]
    lack_of_fit: LackOfFit | None
    recorded: tuple[LoopEnergy, ...]
    small_loops: SmallLoops
    method: str
    options: dict[str, Any]
    certificate: ForceRange
    wider: Wider | None = None

    @property
    def record_name(self) -> str:
        """A name for the model, after the first record."""
        return identifier(PurePath(self.records[0].path).stem)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Cautions for the user."""
        return tuple(self.findings)

    @property
    def cautions(self) -> tuple[str, ...]:
        """The outcomes as sentences, with what was found."""
        return tuple(f"{o.value} ({text})" if text else o.value for o, text in self.findings.items())

    @property
    def figures(self) -> dict[str, float]:
        """rmse [N], rnl, energy and predicted_energy [J] of the spring alone over all records."""
        return overall_figures(self.fits)

    @property
    def fitted_figures(self) -> dict[str, float]:
        """The same with what was removed from the records."""
        return overall_figures(self.fitted)

    def model_file(self, name: str = "spring", description: str = "") -> ModelFile:
        """The spring with its figures and provenance as the content of a model file.

        Raises
        ------
        ModelError   If the name is not an identifier.
        """
        from ..model.file_tables import Certificate, Start  # slow to import

        text = description or (
            f"Hysteretic spring identified from {', '.join(PurePath(record.path).name for record in self.records)}"
        )
        # File names without folders and no dates, so that bytes are stable.
        return ModelFile(
            name,
            self.parameters,
            text[:2000],
            fit={
                **self.figures,
                "fitted": self.fitted_figures,
                "degrees": list(self.degrees),
                "steady_share": self.steady_share,
                "outcomes": [
                    {"name": outcome.name.lower(), "sentence": sentence}
                    for outcome, sentence in zip(self.outcomes, self.cautions, strict=True)
                ],
                **({"effects": self.effects} if self.effects else {}),
                "recorded_loops": [loop.as_json() for loop in self.recorded],
                "small_loops": asdict(self.small_loops),
                **({"classes": self.wider.as_json()} if self.wider else {}),
                **({"lack_of_fit": asdict(self.lack_of_fit)} if self.lack_of_fit else {}),
                "records": [
                    {
                        "file": PurePath(fit.path).name,
                        "samples": fit.samples,
                        "first_sample": fit.first_sample,
                        **both_figures(fit, fitted),
                    }
                    for fit, fitted in zip(self.fits, self.fitted, strict=True)
                ],
            },
            uncertainty=self.uncertainty,
            provenance={
                "records": [
                    {
                        "file": PurePath(record.path).name,
                        "sha256": record.sha256,
                        "samples": int(record.force.size),
                        "notes": list(record.notes),
                    }
                    for record in self.records
                ],
                "method": self.method,
                "options": self.options,
                "version": __version__,
            },
            certificate=Certificate(**self.certificate._asdict()),
            start=Start(
                displacement=float(self.records[0].displacement[0]),
                omega=self.fits[0].omega_start,
                second_omega=None if self.parameters.second is None else self.fits[0].omega_start,
                branch_forces=[0.0] * len(self.parameters.branches),
                at_rest=began_at_rest(self.records[0]),
            ),
        )
