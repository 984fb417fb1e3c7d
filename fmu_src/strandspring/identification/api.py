"""`identify`: records in, a physically possible spring with its figures out, or a named refusal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..errors import RecordError
from ..kernel.path import PathSolver
from ..peers.filtering import filtered_record
from ..peers.ni_spring import NiOptions, ni
from ..records.record import Record
from ..records.spikes import spikes_of
from .figures import RecordFit, overall, predict_record, record_fit
from .loops import join
from .outcomes import IdentificationError, Outcome
from .refined import RefinedOptions, bootstrap, linearised, refined
from .result import Identification
from .scan import ScanOptions, scan
from .spring_of_fit import Solution, finished
from .steady_part import SteadyRecord, find_steady_part
from .two_stage import TwoStageOptions, two_stage
from .uncertainty import PredictionBand, hides_recovery, is_sigma_free, uncertainty

_POOR_RNL = 0.9

Options = TwoStageOptions | ScanOptions | RefinedOptions | NiOptions
METHODS: dict[type, str] = {
    TwoStageOptions: "two-stage",
    ScanOptions: "scan",
    RefinedOptions: "refined",
    NiOptions: "ni",
}


def identify(records: Record | Sequence[Record], options: Options | None = None) -> Identification:
    """Identify one spring from one or more records.

    Parameters
    ----------
    records : Record or sequence of Record
    options : TwoStageOptions, ScanOptions, RefinedOptions, NiOptions or None
        The method is that of the options; the refined method with its defaults if None.

    Returns
    -------
    Identification

    Raises
    ------
    IdentificationError   With an `Outcome`, if no physically possible spring can have made the records.
    RecordError           If a record is given twice, or does not suit the method.
    ValueError            If no record is given.
    """
    options = options or RefinedOptions()
    group = (records,) if isinstance(records, Record) else tuple(records)
    if not group:
        raise ValueError("`records` must hold at least one record, got none.")
    _refuse_twins(group)
    spikes = [told for record in group if (told := _spikes(record))]
    try:
        found = _identified(group, options)
    except IdentificationError:
        if spikes:
            raise IdentificationError(Outcome.SPIKES_DECIDE, "; ".join(spikes)) from None
        raise
    if not spikes or (isinstance(options, RefinedOptions) and options.robust):
        return found
    return replace(found, outcomes=(*found.outcomes, Outcome.SPIKES))


def _refuse_twins(group: Sequence[Record]) -> None:
    """Refuse the same samples twice: their noise would count as if it had been measured twice."""
    for first, second in combinations(group, 2):
        columns = ((first.displacement, second.displacement), (first.force, second.force), (first.time, second.time))
        if all(a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in columns):
            raise RecordError(f"{second.path}: holds the same samples as {first.path}; give each record once.")


def _spikes(record: Record) -> str:
    """The samples of a record that stand alone, in words; empty without any."""
    columns = (("displacement", record.displacement, "m"), ("force", record.force, "N"))
    places = [
        f"sample {k + 1} ({name} {values[k]:.6g} {unit})"
        for (name, values, unit), spikes in zip(columns, spikes_of(record.displacement, record.force), strict=True)
        for k in spikes
    ]
    return f"{record.path}, {', '.join(places)}" if places else ""


def _identified(group: tuple[Record, ...], options: Options) -> Identification:
    """The identification without a look at the records' samples one by one."""
    kind = options.filter if isinstance(options, TwoStageOptions) else "moving-average"
    parts = [find_steady_part(filtered_record(record, kind)) for record in group]
    where = ", ".join(record.path for record in group)
    told: dict[str, Any] = {}
    band: PredictionBand | None = None
    starts = np.zeros(len(parts))
    if isinstance(options, RefinedOptions):
        parameters, fit, cautions = refined(parts, options, where)
        start, starts = fit.start, fit.refinement.omega_start
        sigma_is_hidden = not is_sigma_free(fit.refinement.hysteresis) and hides_recovery(
            fit.loops, fit.basis, fit.refinement
        )
        errors = uncertainty(fit.loops, fit.basis, fit.refinement)
        told = {**errors.as_json(), "indistinct": errors.indistinct(fit.refinement)}
        band = PredictionBand.of(fit.loops, fit.refinement, errors.force)
        if options.bootstrap:
            spread = bootstrap(fit, options.bootstrap, options.seed, where)
            told["bootstrap"] = {"repetitions": options.bootstrap, "seed": options.seed, **spread}
        if told["indistinct"]:
            cautions.append(Outcome.INDISTINCT)
    else:
        loops = join([part.loops for part in parts])
        extra: list[Outcome] = []
        solution: Solution | None
        if isinstance(options, NiOptions):
            if len(group) > 1:
                raise RecordError(f"{where}: Ni's method takes one periodic record; give one, or use another method.")
            solution, extra = ni(group[0], loops, options)
        else:
            solution = scan(loops, options) if isinstance(options, ScanOptions) else two_stage(loops, options)
        if solution is None:
            raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
        parameters, start, cautions = finished(loops, solution, where)
        cautions += extra
        sigma_is_hidden = not is_sigma_free(start.hysteresis) and hides_recovery(
            loops, start.basis, linearised(loops, start)
        )
    solver = PathSolver(parameters)
    if kind == "fourier":
        fits = tuple(predict_record(solver, record) for record in group)
    else:
        # A prediction is compared with what was measured, not with what was filtered.
        measured = (replace(part, record=record) for part, record in zip(parts, group, strict=True))
        fits = tuple(_fit(solver, part, float(omega)) for part, omega in zip(measured, starts, strict=True))
    rmse, rnl = overall(fits)
    found = [caution for part in parts for caution in part.cautions] + cautions
    if sigma_is_hidden:
        found.append(Outcome.SIGMA_AT_BOUND)
    if rnl < _POOR_RNL:
        found.append(Outcome.POOR_FIT)
    return Identification(
        parameters=parameters,
        records=group,
        fits=fits,
        rmse=rmse,
        rnl=rnl,
        degrees=(len(parameters.kE) - 1, len(parameters.kA) - 1),
        steady_share=start.steady_share,
        outcomes=tuple(dict.fromkeys(found)),
        uncertainty=told,
        band=band,
        method=METHODS[type(options)],
        options={name: "auto" if value is None else value for name, value in asdict(options).items()},
    )


def _fit(solver: PathSolver, part: SteadyRecord, omega_start: float) -> RecordFit:
    path = part.strokes.displacement
    first = part.first_sample
    if part.periodic:
        # One steady period ends with the memory it began with.
        omega_start = float(solver.omega(path, float(solver.omega(path)[-1]))[-1])
        compared = "the whole period, omega_start taken from its end"
    elif first:
        compared = f"steady part from sample {first + 1}; what lies before it sets the memory only"
    else:
        compared = "all samples"
    return record_fit(part.record, solver.force(path, omega_start), first, omega_start, compared)
