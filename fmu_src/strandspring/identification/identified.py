"""What an identification gives: the spring, its figures and where it comes from; also as a model file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import PurePath
from typing import Any

from .._version import __version__
from ..core.parameters import SpringParameters
from ..model.certificate import ForceRange
from ..model.modelfile import ModelFile
from ..model.names import identifier
from ..model.outcomes import Finding, Outcome
from ..records.record import Record
from .certainty import Certainty
from .figures import LoopEnergy, RecordFit, began_at_rest, both_figures, overall_figures
from .verdict import Verdict


@dataclass(frozen=True, eq=False)
class IdentifiedModel:
    """An identified spring, its figures and its origin.

    Attributes
    ----------
    parameters : SpringParameters
    records : tuple of Record       As given.
    fits : tuple of RecordFit       Prediction of each record by the spring alone, driven by the displacement as
                                    recorded: what its FMU gives.
    fitted : tuple of RecordFit     The same with what the rig added to the records.
    findings : tuple of Finding     What is to be known of the records and the spring, the most harmful first.
    verdict : Verdict or None       Errors on held-out strokes beside those of plain models; of the refined method only.
    certainty : Certainty or None   Errors, intervals, ranges and the lack of fit, likewise.
    effects : dict                  Sizes of what the rig added, found or given, by name, in SI units; empty without
                                    any. `parameters` are those of the spring alone.
    recorded : tuple of LoopEnergy  Energies of the recorded loops, measured and of the saved spring, by amplitude.
    method : str
    options : dict                  The options and what the method settled beside them, for the provenance.
    certificate : ForceRange        Of the recorded force, which the spring keeps to.
    """

    parameters: SpringParameters
    records: tuple[Record, ...]
    fits: tuple[RecordFit, ...]
    fitted: tuple[RecordFit, ...]
    findings: tuple[Finding, ...]
    verdict: Verdict | None
    certainty: Certainty | None
    effects: dict[str, Any]
    recorded: tuple[LoopEnergy, ...]
    method: str
    options: dict[str, Any]
    certificate: ForceRange

    @property
    def record_name(self) -> str:
        """A name for the model, after the first record."""
        return identifier(PurePath(self.records[0].path).stem)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Kinds of the findings, each once."""
        return tuple(dict.fromkeys(finding.kind for finding in self.findings))

    @property
    def cautions(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return tuple(finding.sentence for finding in self.findings)

    @property
    def degrees(self) -> tuple[int | None, int]:
        """N of FE, None if it is a table, and M of FA."""
        return len(self.parameters.kE) - 1 if self.parameters.kE else None, len(self.parameters.kA) - 1

    @property
    def uncertainty(self) -> dict[str, Any]:
        """Content of the model file's field: standard errors, intervals, covariance; empty where unknown."""
        return {} if self.certainty is None else self.certainty.uncertainty

    @cached_property
    def figures(self) -> dict[str, float]:
        """rmse [N], rnl, energy and predicted_energy [J] of the spring alone over all records."""
        return overall_figures(self.fits)

    @cached_property
    def fitted_figures(self) -> dict[str, float]:
        """The same with what the rig added."""
        return overall_figures(self.fitted)

    @property
    def rmse(self) -> float:
        """Of the spring alone over all compared samples [N]."""
        return self.figures["rmse"]

    @property
    def rnl(self) -> float:
        """Likewise [-]."""
        return self.figures["rnl"]

    @property
    def judgement(self) -> dict[str, Any]:
        """What the model file and JSON hold of verdict, small loops and lack of fit; what is unknown is left out."""
        parts: dict[str, Any] = {}
        if self.verdict is not None:
            whole = self.verdict.whole
            errors = {} if whole is None else {"error": whole.error, "plain": dict(whole.plain)}
            parts["verdict"] = {"sentence": str(self.verdict), **errors}
        if self.certainty is not None:
            unrecorded = self.certainty.unrecorded
            names = ("amplitude", "energy", "low", "high")
            parts["small_loops"] = {name: getattr(unrecorded, name) for name in names}
            parts["lack_of_fit"] = asdict(self.certainty.lack)
        return parts

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
                **self.judgement,
                "outcomes": [_of_finding(finding) for finding in self.findings],
                **({"effects": self.effects} if self.effects else {}),
                "recorded_loops": [loop.as_json() for loop in self.recorded],
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


def _of_finding(finding: Finding) -> dict[str, Any]:
    """A finding as JSON; file names without folders."""
    where = PurePath(finding.where).name
    return {
        "name": finding.kind.name.lower(),
        "sentence": finding.sentence.replace(finding.where, where) if where else finding.sentence,
        "numbers": dict(finding.numbers),
        "where": where,
    }
