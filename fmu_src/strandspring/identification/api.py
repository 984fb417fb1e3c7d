"""`identify`: records in, a physically possible spring with its figures out, or a named refusal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..model.parameters import SpringParameters
from ..model.path import PathSolver
from ..records.record import Record
from ..spring import Spring
from .export import identified_model
from .figures import RecordFit, overall, record_fit
from .loops import join
from .outcomes import Outcome
from .steady import SteadyRecord, find_steady_part
from .two_stage import TwoStageOptions, two_stage

_POOR_RNL = 0.9


@dataclass(frozen=True, eq=False)
class Identification:
    """An identified spring and how it was found.

    Attributes
    ----------
    parameters : SpringParameters
    records : tuple of Record
    fits : tuple of RecordFit       Prediction of each record over its steady part.
    rmse, rnl : float               Over all compared samples [N], [-].
    degrees : (int, int)            N of FE and M of FA.
    steady_share : float            Where the steady section was taken to begin, share of the longest stroke.
    outcomes : tuple of Outcome     Cautions worth telling the user.
    method : str
    options : dict                  The options, for the provenance.
    """

    parameters: SpringParameters
    records: tuple[Record, ...]
    fits: tuple[RecordFit, ...]
    rmse: float
    rnl: float
    degrees: tuple[int, int]
    steady_share: float
    outcomes: tuple[Outcome, ...]
    method: str
    options: dict[str, Any]

    def spring(self, name: str = "spring", description: str = "") -> Spring:
        """The spring with its figures and provenance, ready to respond, to save and to build an FMU from.

        Raises
        ------
        ModelError   If the name is not an identifier.
        """
        return Spring.of(identified_model(self, name, description))


def identify(records: Record | Sequence[Record], options: TwoStageOptions | None = None) -> Identification:
    """Identify one spring from one or more records by the paper's two-stage method.

    Parameters
    ----------
    records : Record or sequence of Record
    options : TwoStageOptions or None

    Returns
    -------
    Identification

    Raises
    ------
    IdentificationError   With an `Outcome`, if no physically possible spring can have made the records.
    ValueError            If no record is given.
    """
    options = options or TwoStageOptions()
    group = (records,) if isinstance(records, Record) else tuple(records)
    if not group:
        raise ValueError("`records` must hold at least one record, got none.")
    steady = [find_steady_part(record) for record in group]
    where = ", ".join(record.path for record in group)
    parameters, solution, cautions = two_stage(join([part.loops for part in steady]), options, where)
    solver = PathSolver(parameters)
    fits = tuple(_fit(solver, part) for part in steady)
    rmse, rnl = overall(fits)
    found = [caution for part in steady for caution in part.cautions] + cautions
    if rnl < _POOR_RNL:
        found.append(Outcome.POOR_FIT)
    return Identification(
        parameters=parameters,
        records=group,
        fits=fits,
        rmse=rmse,
        rnl=rnl,
        degrees=(solution.basis.elastic, solution.basis.amplifier),
        steady_share=solution.steady_share,
        outcomes=tuple(dict.fromkeys(found)),
        method="two-stage",
        options={
            "degrees": "auto" if options.degrees is None else list(options.degrees),
            "formulas": options.formulas,
            "smoothing": "auto" if options.smoothing is None else options.smoothing,
        },
    )


def _fit(solver: PathSolver, part: SteadyRecord) -> RecordFit:
    path = part.strokes.displacement
    first = part.first_sample
    if part.periodic:
        # One steady period ends with the memory it began with.
        omega_start = float(solver.omega(path, float(solver.omega(path)[-1]))[-1])
        compared = "the whole period, omega_start taken from its end"
    else:
        omega_start = 0.0
        compared = (
            f"steady part from sample {first + 1}; before it omega_start is unknown"
            if first
            else "all samples, omega_start 0"
        )
    return record_fit(part.record, solver.force(path, omega_start), first, omega_start, compared)
