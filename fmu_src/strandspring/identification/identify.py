"""`identify_records`: records in, a physically possible spring with its figures out, or a named refusal.

The way of the data: records, each without what is known of the rig, are checked and cut into strokes (`findings`,
`refusals`); `Samples` are the rows of them that are fitted, and the folds that are held out; a method makes springs of
these, the likeliest first, and the first that meets its certificate is saved with its figures along the records.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from itertools import combinations
from typing import Any

import numpy as np

from ..errors import RecordError
from ..findings import Finding, IdentificationError, Outcome, by_harm
from ..ground.one_thread import one_thread
from ..kernel.arrays import BoolArray
from ..kernel.path import PathSolver
from ..loops.cycles import MeasuredLoop
from ..model.certificate import Driven, ForceRange, shortcoming
from ..records.record import Record
from ..records.spikes import spikes_of
from .figures import (
    WITH_RIG,
    RecordFit,
    chosen_samples,
    figures_of,
    is_one_period,
    overall_figures,
    predict_record,
    recorded_loops,
    rmse,
    twice,
)
from .findings import check
from .identified import IdentifiedModel
from .method import Candidates, Fitted, Stage, begin
from .options import Method, RefinedOptions, checked_method
from .predictions import has_one_amplitude
from .rig import lagging, without_rig
from .samples import Samples


# For matrices as small as these more threads only cost, most of all on a busy computer.
@one_thread()
def identify_records(
    records: Sequence[Record], options: Method | None = None, save_anyway: bool = False
) -> IdentifiedModel:
    """Identify one spring from one or more records, by the refined method with its defaults if `options` are None.

    A spring that follows the records worse than a straight line is refused, or with `save_anyway` has a finding.

    Raises
    ------
    IdentificationError   With an `Outcome`, if no physically possible spring can have made the records, the spring
                          alone follows them worse than a straight line does, or no class meets its certificate
                          (`model/certificate.py`).
    RecordError           If a record is given twice, or does not suit the method.
    ValueError            If no record is given.
    TypeError             If the options are of no method.
    """
    method = RefinedOptions() if options is None else checked_method(options)
    group = tuple(records)
    if not group:
        raise ValueError("`records` must hold at least one record, got none.")
    _refuse_twins(group)
    begin(Stage.PREPARING)
    refined = method if isinstance(method, RefinedOptions) else RefinedOptions()
    prepared = [without_rig(record, refined) for record in group]
    usable, found, refusal = check(prepared, refined.state)
    # A record of one period is followed by itself, and fitted on its second pass.
    followed = [twice(record) if is_one_period(record) else record for record in prepared]
    rows = [np.pad(mask, (len(record) - mask.size, 0)) for record, mask in zip(followed, usable, strict=True)]
    samples = Samples.of(followed, 10_000, np.concatenate(rows), prepared)
    where = ", ".join(record.path for record in group)
    fitted, fits, failure = _certified(method, samples, group, usable, where)
    if refusal is not None and not fitted.delay:
        raise refusal
    begin(Stage.CHECKING)
    solver = PathSolver(fitted.parameters)
    with_rig = _with_rig(solver, fitted, group, prepared, fits)
    # A spring is not judged by what is the rig's.
    recorded = recorded_loops(group, with_rig)
    found += [*fitted.findings, *_of_saved(group, fits, with_rig, recorded)]
    explained = {Outcome.SPIKES} if refined.robust else set()
    if fitted.parameters.branches and all(finding.kind is not Outcome.LACK_OF_FIT for finding in found):
        explained |= {Outcome.RATE_DEPENDENT, Outcome.RECORDS_DIFFER}
    if fitted.certainty is None and has_one_amplitude(samples):
        found.append(Finding(Outcome.ONE_AMPLITUDE))
    if failure:
        found.append(Finding(Outcome.SIMPLER_CLASS, failure))
    if fitted.verdict is None and (of_all := overall_figures(fits)["rnl"]) < 0.9:
        found.append(Finding(Outcome.POOR_FIT, {"rnl": of_all}))
    if not save_anyway and any(finding.kind is Outcome.WORSE_THAN_LINE for finding in found):
        raise IdentificationError(Outcome.WORSE_THAN_LINE, where)
    return IdentifiedModel(
        parameters=fitted.parameters,
        records=group,
        fits=fits,
        fitted=with_rig,
        findings=by_harm(finding for finding in found if finding.kind not in explained),
        verdict=fitted.verdict,
        certainty=fitted.certainty,
        effects=fitted.effects,
        recorded=recorded,
        method=method.name,
        options={
            name: "auto" if value is None else "infinite" if value == math.inf else value  # JSON has no infinity
            for name, value in {**asdict(method), **fitted.choices}.items()
        },
        certificate=ForceRange.of(_driven(fits, group)),
    )


def _refuse_twins(group: Sequence[Record]) -> None:
    """Refuse the same samples twice: their noise would count as if it had been measured twice."""
    for first, second in combinations(group, 2):
        common = _common_samples(first, second)
        if common == len(first) == len(second):
            raise RecordError(f"{second.path}: holds the same samples as {first.path}; give each record once.")
        if common >= 16:  # parts one after the other share one
            raise RecordError(
                f"{second.path}: shares {common} samples with the part of {first.path} that is given too; select parts "
                "that do not overlap."
            )


def _common_samples(first: Record, second: Record) -> int:
    """Number of samples to fit that two records have in common; 0 if they differ wherever they overlap."""
    both = (first, second)
    begin, end = max(r.first_sample for r in both), min(r.first_sample + len(r) for r in both)
    a, b = (slice(begin - r.first_sample, end - r.first_sample) for r in both)
    if begin >= end or (first.time is None) != (second.time is None):
        return 0
    columns = ("displacement", "force", "time")[: 2 + (first.time is not None)]
    if not all(np.array_equal(getattr(first, name)[a], getattr(second, name)[b]) for name in columns):
        return 0
    kept = [True if r.compared is None else r.compared[part] for r, part in zip(both, (a, b), strict=True)]
    return int(np.sum(np.ones(end - begin, bool) & kept[0] & kept[1]))


def _certified(
    method: Method, samples: Samples, group: Sequence[Record], usable: Sequence[BoolArray], where: str
) -> tuple[Fitted, tuple[RecordFit, ...], Mapping[str, Any]]:
    """The first spring of a method that meets its certificate, the prediction of each record by it alone, and what
    spoke against the first one, see `shortcoming`.
    """
    failure: Mapping[str, Any] = {}
    firsts = []
    for k, mask in enumerate(usable):
        here = samples.rows[samples.record_of_row == k]
        firsts.append(int(here[0] - samples.begins[k + 1] + mask.size if here.size else np.argmax(mask)))
    try:
        candidates: Candidates = import_module(method.module).candidates
        for fitted in candidates(method, samples, where):
            solver = PathSolver(fitted.parameters)
            fits = tuple(predict_record(solver, *inputs) for inputs in zip(group, firsts, strict=True))
            driven = _driven(fits, group)
            problem = shortcoming(fitted.parameters, ForceRange.of(driven), driven)
            if not problem:
                return fitted, fits, failure
            failure = failure or problem
    except IdentificationError:
        if not failure:
            raise
    raise IdentificationError(Outcome.UNCERTIFIED, where, failure)


def _driven(fits: Sequence[RecordFit], group: Sequence[Record]) -> list[Driven]:
    """The records without isolated outliers, as the spring is driven along them."""
    driven = []
    for fit, record in zip(fits, group, strict=True):
        kept = np.ones(len(record), dtype=bool)
        for spikes in spikes_of(record.displacement, record.force):
            kept[spikes] = False
        time = record.rising_time
        time = None if time is None else time[kept]
        driven.append(Driven(record.displacement[kept], record.force[kept], time, fit.omega_start))
    return driven


def _with_rig(
    solver: PathSolver, fitted: Fitted, group: Sequence[Record], prepared: Sequence[Record], fits: tuple[RecordFit, ...]
) -> tuple[RecordFit, ...]:
    """The predictions with what the rig added to each record: known, or found."""
    if not fitted.effects:
        return fits
    found = []
    added = fitted.nuisance or [np.zeros(len(record)) for record in group]
    for record, known, fit, nuisance in zip(group, prepared, fits, added, strict=True):
        moved = lagging(known, fitted.delay)
        force = solver.force(moved.displacement, fit.omega_start, moved.rising_time)
        force = force + nuisance + record.force - known.force
        words = f"{fit.compared}, {WITH_RIG}"
        found.append(figures_of(solver, record, force, fit.first_sample, fit.omega_start, words))
    return tuple(found)


def _of_saved(
    group: Sequence[Record], fits: Sequence[RecordFit], with_rig: Sequence[RecordFit], recorded: Sequence[MeasuredLoop]
) -> Iterator[Finding]:
    """What the saved spring alone gives along the records, where it differs from these or from the fit."""
    columns = []
    for record, *predictions in zip(group, fits, with_rig, strict=True):
        rows = np.stack([record.displacement, record.force, *(each.predicted for each in predictions)])
        columns.append(rows[:, chosen_samples(record, predictions[0].first_sample)])
    x, force, *predicted = np.concatenate(columns, axis=1)
    predicted.append(np.polynomial.Polynomial.fit(x, force, 1)(x))
    alone, fitted, line = (rmse(force, each) / float(np.std(force)) for each in predicted)
    if fitted > line:
        yield Finding(Outcome.WORSE_THAN_LINE)
    if alone - fitted > 0.05:
        yield Finding(Outcome.SPRING_ALONE, {"alone": alone, "fitted": fitted})
    differences: dict[float, float] = {}
    unrecorded: list[float] = []
    for loop in reversed(recorded):
        if loop.predicted is None:
            continue
        energy, of_model = loop.figures.energy_per_cycle, loop.predicted.energy_per_cycle
        # A path that is not closed may take no energy at all, and JSON has no infinity.
        difference = math.inf if of_model > 0.0 else 0.0
        if known := energy > 0.0:
            difference = of_model / energy - 1.0
        # 2 % are named, if they are three standard errors.
        if abs(difference) > max(3.0 * loop.noise / max(energy, 1e-300), 0.02):
            if known:
                differences[loop.figures.amplitude] = difference
            else:
                unrecorded.append(loop.figures.amplitude)
    if differences or unrecorded:
        numbers = {"difference": tuple(differences.values()), "amplitude": tuple(differences)}
        yield Finding(Outcome.LOOP_ENERGY, {**numbers, "unrecorded": tuple(unrecorded)})
