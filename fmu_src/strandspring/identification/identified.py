"""What an identification gives: the spring, its figures, notes and where it comes from; also as a model file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import PurePath
from typing import Any

import numpy as np

from .._version import __version__
from ..core.parameters import SpringParameters
from ..errors import Reader
from ..findings import Finding, Outcome, gathered
from ..loops.cycles import MeasuredLoop
from ..model.certificate import ForceRange
from ..model.modelfile import ModelFile
from ..model.names import identifier
from ..records.record import Record
from .certainty import Certainty
from .figures import Followed, RecordFit, began_at_rest, overall_figures
from .options import RefinedOptions
from .refusals import Strokes
from .rig import unknown_effects
from .verdict import Verdict

# What rigs measure, and springs carry [m], [N], [N/m]. Sensors and fixtures yield by the first displacement, no rig
# reaches the second, and the forces are those of load cells. A softer spring sags by 10 m under 1 kg, and no frame of a
# rig is stiffer than the last.
_USUAL = {"amplitude": (1e-6, 0.5), "force": (1e-3, 1e7), "stiffness": (1.0, 1e9)}
# Units that are mistaken, and what makes displacement and force right then.
_MISTAKEN = {
    "m read as mm": (1e3, 1.0),
    "mm read as m": (1e-3, 1.0),
    "kN read as N": (1.0, 1e3),
    "N read as kN": (1.0, 1e-3),
}


@dataclass(frozen=True, eq=False, repr=False)
class IdentifiedModel(Followed):
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
    recorded : tuple of MeasuredLoop   The recorded loops by amplitude, with those of the saved spring.
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
    recorded: tuple[MeasuredLoop, ...]
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
    def degrees(self) -> tuple[int | None, int]:
        """N of FE, None if it is a table, and M of FA."""
        return len(self.parameters.kE) - 1 if self.parameters.kE else None, len(self.parameters.kA) - 1

    @property
    def uncertainty(self) -> dict[str, Any]:
        """Content of the model file's field: standard errors, intervals, covariance; empty where unknown."""
        return {} if self.certainty is None else self.certainty.uncertainty

    @cached_property
    def fitted_figures(self) -> dict[str, float]:
        """`figures` with what the rig added."""
        return overall_figures(self.fitted)

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

    @cached_property
    def record_findings(self) -> tuple[Finding, ...]:
        """What is good to know of the records besides, but says nothing of the spring."""
        effects = unknown_effects(self.records, self.effects)
        return (*self._unusual_sizes(), *effects, *self._left_out(), *self._next_test())

    def _unusual_sizes(self) -> Iterator[Finding]:
        """Sizes that no rig measures, with the mistake in a unit that would explain them."""
        sizes = [0.5 * max(float(np.ptp(getattr(r, name))) for r in self.records) for name in ("displacement", "force")]

        def unusual(of_x: float = 1.0, of_r: float = 1.0) -> dict[str, Any]:
            amplitude, force = of_x * sizes[0], of_r * sizes[1]
            values = zip(_USUAL.items(), (amplitude, force, force / amplitude), strict=True)
            beyond = {name: (value, ends) for (name, ends), value in values if not ends[0] <= value <= ends[1]}
            usual = {f"usual_{name}": (ends,) for name, (_, ends) in beyond.items()}
            return {**{name: value for name, (value, _) in beyond.items()}, **usual}

        if numbers := unusual():
            mistakes = [name for name, factors in _MISTAKEN.items() if not unusual(*factors)]
            yield Finding(Outcome.UNUSUAL_SIZES, {**numbers, "mistakes": " or ".join(mistakes)})

    def _left_out(self) -> Iterator[Finding]:
        """Records whose displacement rests, and those whose times repeat or fall back."""
        for record in self.records:
            if count := sum(end - first for first, end in Strokes(record).dwells):
                yield Finding(Outcome.RESTS_LEFT_OUT, {"count": count, "samples": len(record)}, record.path)
        for record in self.records if self.method == RefinedOptions.name else ():
            if record.time is not None and record.rising_time is None:
                count = int(np.sum(np.diff(record.time) <= 0.0))
                yield Finding(Outcome.TIME_RESTS, {"count": count, "steps": len(record) - 1}, record.path)

    def _next_test(self) -> Iterator[Finding]:
        """What another test would settle; nothing for a spring of a wider class."""
        settled = [outcome.name.lower() for outcome in self.outcomes if outcome.is_settled_by_a_test]
        if settled and self.parameters.is_plain:
            yield Finding(Outcome.NEXT_TEST, {"open": tuple(name.replace("_", " ") for name in settled)})

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
                "outcomes": [finding.in_folder.as_json() for finding in self.findings],
                **({"effects": self.effects} if self.effects else {}),
                "recorded_loops": [_loop_json(loop) for loop in self.recorded],
                "records": [
                    {"file": PurePath(fit.path).name, "first_sample": fit.first_sample, **fit.as_json(fitted)}
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
                        "notes": list(gathered(record.findings, Reader.FILE)),
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


def _loop_json(loop: MeasuredLoop) -> dict[str, Any]:
    """A recorded loop beside the model's, as model files hold it; null where a figure has no value."""
    measured, predicted = loop.figures, loop.predicted
    content = {"amplitude": measured.amplitude, "frequency": loop.frequency, "cycles": loop.cycles}
    for key, name in (("secant_stiffness", "secant_stiffness"), ("energy", "energy_per_cycle")):
        content[key] = getattr(measured, name)
        content[f"predicted_{key}"] = None if predicted is None else getattr(predicted, name)
    return {key: None if value is None or math.isnan(value) else value for key, value in content.items()}
