"""`identify_records`: records in, a physically possible spring with its figures out, or a named refusal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval

from ..core.parameters import SpringParameters
from ..errors import RecordError
from ..ground.one_thread import one_thread
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.left_out import BoolArray, clipped_samples
from ..loops.strokes import Strokes, find_strokes
from ..model.certificate import Driven, ForceRange, shortcoming
from ..model.outcomes import IdentificationError, Outcome, by_harm
from ..records.record import Record
from ..records.spikes import spikes_of
from .certainty.figures import (
    RecordFit,
    alone,
    along_smoothed,
    estimate_omega_start,
    omega_of_first_force,
    overall,
    periodic_start,
    record_fit,
)
from .certainty.prediction_interval import ForceInterval
from .certainty.saved_spring import differences, is_worse_than_a_line, recorded_energies
from .identified_model import IdentifiedModel
from .methods.fitted import Fitted
from .methods.method import Method, checked_method
from .methods.progress import Stage, begin
from .methods.refined import RefinedOptions
from .points.sample_points import SamplePoints, join
from .points.steady_part import SteadyRecord, find_steady_part
from .points.unit_check import refuse_differing_units
from .unrecorded.small_loops import small_loops

_POOR_RNL = 0.9
_SAME_RNL = 1e-4  # difference that four digits do not show
_LARGER = 1.02  # error of the spring alone in that of the fit from which it counts
_MANY_COMMON = 16  # samples; parts one after the other share one
_ENOUGH = 100.0  # samples per cycle from which only a change of the force is reported
_LOST = 0.001  # travel between samples at reversals that is reported, share of a stroke
# Changes of the force that are reported however many samples there are, share of its standard deviation. Of the change
# by estimated reversals a part is wrong: less than a tenth at corners or of a sine, half where corners are rounded.
_CHANGED = 0.01
_CHANGED_BY_ESTIMATES = 0.03
_FULL = 0.5  # length of strokes whose samples count, share of the longest


def identify_records(
    records: Sequence[Record], options: Method | None = None, save_anyway: bool = False
) -> IdentifiedModel:
    """Identify one spring from one or more records.

    The cautions of the result say what the records do not decide, and which effects of a rig were found in them.

    Parameters
    ----------
    records : sequence of Record
    options : RefinedOptions, TwoStageOptions, ScanOptions, PaperOptions, NiOptions or None
        The method with its options; the refined method with its defaults if None.
    save_anyway : bool    A spring that follows the records worse than a straight line is returned with a caution.

    Returns
    -------
    IdentifiedModel

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
    spikes = [sentence for record in group if (sentence := _spikes(record))]
    try:
        # For matrices as small as these more threads only cost, most of all on a busy computer.
        with one_thread():
            identification = _identified(group, method, save_anyway)
    except IdentificationError as problem:
        refusal = IdentificationError(Outcome.SPIKES_DECIDE, "; ".join(spikes)) if spikes else problem
        counts = {record.path: int(clipped_samples(record.force).sum()) for record in group}
        if clipped := "; ".join(f"{path}: {count} samples" for path, count in counts.items() if count):
            refusal.args = (f"{refusal} {Outcome.CLIPPED.value} ({clipped})",)
        raise refusal from None
    findings = dict(identification.findings)
    if spikes and not method.withstands_outliers:
        findings[Outcome.SPIKES] = "; ".join(spikes)
    return replace(identification, findings=by_harm(findings))


def _refuse_twins(group: Sequence[Record]) -> None:
    """Refuse the same samples twice: their noise would count as if it had been measured twice."""
    for first, second in combinations(group, 2):
        common = _common_samples(first, second)
        if common == len(first) == len(second):
            raise RecordError(f"{second.path}: holds the same samples as {first.path}; give each record once.")
        if common >= _MANY_COMMON:
            raise RecordError(
                f"{second.path}: shares {common} samples with the part of {first.path} that is given too; select parts "
                "that do not overlap."
            )


def _common_samples(first: Record, second: Record) -> int:
    """Number of samples to fit that two records have in common; 0 if they differ wherever they overlap."""
    begin = max(first.first_sample, second.first_sample)
    end = min(first.first_sample + len(first), second.first_sample + len(second))
    if begin >= end:
        return 0
    common, other = (slice(begin - record.first_sample, end - record.first_sample) for record in (first, second))
    columns = [(first.displacement, second.displacement), (first.force, second.force)]
    if (first.time is None) != (second.time is None):
        return 0
    if first.time is not None and second.time is not None:
        columns.append((first.time, second.time))
    if not all(np.array_equal(a[common], b[other]) for a, b in columns):
        return 0
    compared = np.ones(end - begin, dtype=bool)
    for record, part in ((first, common), (second, other)):
        if record.compared is not None:
            compared &= record.compared[part]
    return int(compared.sum())


def _spikes(record: Record) -> str:
    """The isolated outliers of a record, in words; empty without any."""
    columns = (("displacement", record.displacement, "m"), ("force", record.force, "N"))
    places = [
        f"sample {k + 1} ({name} {values[k]:.6g} {unit})"
        for (name, values, unit), spikes in zip(columns, spikes_of(record.displacement, record.force), strict=True)
        for k in spikes
    ]
    return f"{record.path}, {', '.join(places)}" if places else ""


def _identified(group: tuple[Record, ...], method: Method, save_anyway: bool) -> IdentifiedModel:
    """The identification, isolated outliers left aside."""
    begin(Stage.PREPARING)
    parts = [_steady_part(record, method) for record in group]
    refuse_differing_units(parts)
    where = ", ".join(record.path for record in group)
    method, result, fits, failure = _certified(parts, group, method, where)
    begin(Stage.CHECKING)
    solver = PathSolver(result.parameters)
    measured = [_as_recorded(part, record) for part, record in zip(parts, group, strict=True)]
    smoothed = tuple(
        along_smoothed(solver, part.record, part.strokes, fit) for part, fit in zip(measured, fits, strict=True)
    )
    fitted = smoothed
    if result.predicted:
        what = "with what was removed" if result.effects else "with reversals between the samples"
        fitted = tuple(
            record_fit(solver, record, part.strokes.displacement, predicted, fit.first_sample, fit.omega_start,
                       f"{fit.compared}, {what}")
            for part, record, predicted, fit in zip(parts, group, result.predicted, fits, strict=True)
        )  # fmt: skip
    rmse, rnl = overall(fits)
    findings = _merged([*((part.record.path, part.cautions) for part in parts), ("", result.cautions)])
    findings |= turns_between_samples(parts, result.turning, result.parameters)
    if failure:
        findings[Outcome.SIMPLER_CLASS] = failure
        findings.pop(Outcome.AMPLIFIER_REDUCED, None)  # nobody asked for the degrees of a simpler spring
    # A spring is not judged by what the user knows to be the rig's.
    is_known = method.known_delay or any(part.record is not record for part, record in zip(parts, group, strict=True))
    if is_worse_than_a_line(measured, fitted if is_known else fits):
        if not save_anyway:
            raise IdentificationError(Outcome.WORSE_THAN_LINE, where)
        findings[Outcome.WORSE_THAN_LINE] = ""
    recorded = recorded_energies(solver, measured, fits)
    findings |= differences(measured, recorded, fits, smoothed, fitted)
    loops = join([part.loops for part in parts])
    small = small_loops(result.parameters, result.uncertainty, recorded, result.other_energies, parts[0].cycle_time)
    if loops.has_one_amplitude and Outcome.SMALL_LOOPS not in findings:
        findings[Outcome.ONE_AMPLITUDE] = small.sentence
    if gaps := _gaps(loops):
        findings[Outcome.RANGE_WITH_GAPS] = gaps
    if result.lack_of_fit is None and rnl < _POOR_RNL:
        findings[Outcome.POOR_FIT] = ""
    return IdentifiedModel(
        parameters=result.parameters,
        records=group,
        steady_parts=result.alone or tuple(parts),
        fits=fits,
        fitted=fitted,
        rmse=rmse,
        rnl=rnl,
        degrees=(len(result.parameters.kE) - 1 if result.parameters.kE else None, len(result.parameters.kA) - 1),
        steady_share=result.steady_share,
        findings=findings,
        uncertainty=_of_saved_spring(result.uncertainty, rmse, overall(fitted)[0]),
        prediction_band=result.band,
        effects=result.effects,
        lack_of_fit=result.lack_of_fit,
        recorded=recorded,
        small_loops=small,
        method=method.name,
        certificate=ForceRange.of(_driven(fits, group)),
        options={
            name: "auto" if value is None else "infinite" if value == math.inf else value  # JSON has no infinity
            for name, value in {**asdict(method), **result.choices}.items()
        },
        wider=result.wider,
    )


def _certified(
    parts: Sequence[SteadyRecord], group: Sequence[Record], method: Method, where: str
) -> tuple[Method, Fitted, tuple[RecordFit, ...], str]:
    """The first of the method and simpler ones whose spring meets its certificate: that method, its result, the
    prediction of each record by the spring alone, and what spoke against the first, in words.
    """
    failure = ""
    for tried in (method, *method.simpler):
        try:
            result = tried.fit(parts, where)
        except IdentificationError:
            if failure:
                continue
            raise
        solver = PathSolver(result.parameters)
        starts = result.omega_start or (0.0,) * len(group)
        fits = tuple(_alone(solver, *inputs) for inputs in zip(parts, group, starts, strict=True))
        driven = _driven(fits, group)
        problem = shortcoming(result.parameters, ForceRange.of(driven), driven)
        if not problem:
            return tried, result, fits, failure
        failure = failure or problem
    raise IdentificationError(Outcome.UNCERTIFIED, where, f" ({failure})")


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


def _steady_part(record: Record, method: Method) -> SteadyRecord:
    return find_steady_part(method.prepare(record), method.known_delay, method.seeks_delay)


def _gaps(loops: SamplePoints) -> str:
    """Displacements between those of the records, in words; empty if there are none."""
    points = [loops.displacement[part] for _, part in loops.by_record if part.start < part.stop]
    ranges = sorted((float(part.min()), float(part.max())) for part in points)
    reached, gaps = ranges[0][1], []
    for low, high in ranges[1:]:
        if low > reached:
            gaps.append(f"{1e3 * reached:.4g} to {1e3 * low:.4g} mm")
        reached = max(reached, high)
    return "; ".join(gaps)


def _of_saved_spring(uncertainty: dict[str, Any], rmse: float, fitted: float) -> dict[str, Any]:
    """Content of the model file's field, with the prediction interval of the spring alone, whose error is larger."""
    interval = ForceInterval.from_uncertainty(uncertainty)
    if interval is None or rmse <= _LARGER * fitted:
        return uncertainty
    widened = interval.widened(math.sqrt(rmse**2 - fitted**2))
    return {**uncertainty, "prediction_interval": widened.as_json()}


def _merged(cautions: Sequence[tuple[str, dict[Outcome, str]]]) -> dict[Outcome, str]:
    """Outcomes with the details of every record that has them."""
    merged: dict[Outcome, str] = {}
    for path, details in cautions:
        for outcome, text in details.items():
            sentence = f"{path}: {text}" if path and text else text
            merged[outcome] = "; ".join(filter(None, (merged.get(outcome, ""), sentence)))
    return merged


def _as_recorded(part: SteadyRecord, record: Record) -> SteadyRecord:
    """The steady part of a record without what is known of the rig, which may be on another path."""
    is_same = np.array_equal(part.record.displacement, record.displacement)
    return replace(part, record=record, strokes=part.strokes if is_same else find_strokes(record.displacement))


def _alone(solver: PathSolver, part: SteadyRecord, measured: Record, omega_start: float) -> RecordFit:
    """Prediction of a record by the spring alone, driven by the displacement as recorded."""
    first = part.first_sample
    if part.periodic:
        omega_start = periodic_start(solver, measured.displacement)
        return alone(solver, measured, first, omega_start, "the whole period, omega_start taken from its end")
    if not np.array_equal(part.record.displacement, measured.displacement):
        strokes = find_strokes(measured.displacement)
        omega_start = estimate_omega_start(solver, strokes, measured, measured.compared)
    if not first:
        return alone(solver, measured, first, omega_start, "all samples")
    compared = f"from sample {first + 1}; earlier samples only initialise the hysteresis state"
    starts = (omega_start, omega_of_first_force(solver, measured))
    fit, begun = (alone(solver, measured, first, start, compared) for start in starts)
    # What is compared may not depend on the start, or hardly: then the first sample shows it better.
    return begun if begun.rnl >= fit.rnl - _SAME_RNL else fit


def samples_per_cycle(strokes: Strokes, used: BoolArray) -> float:
    """Median number of samples in two strokes, short strokes and samples that are not used left aside."""
    counts = np.bincount(strokes.of_sample[used], minlength=strokes.count)[: strokes.count]
    full = strokes.length >= _FULL * float(strokes.length.max())
    # The ends of a record cut its first and its last stroke.
    if full[1:-1].any():
        full[[0, -1]] = False
    return 2.0 * float(np.median(counts[full]))


def turns_between_samples(
    parts: Sequence[SteadyRecord], estimated: Sequence[SteadyRecord], spring: SpringParameters
) -> dict[Outcome, str]:
    """The caution about reversals between the samples with its detail, if they may be wrong by what matters.

    Parameters
    ----------
    parts : sequence of SteadyRecord       With reversals at samples.
    estimated : sequence of SteadyRecord   With those that the spring was identified with; empty if that was at samples.
    spring : SpringParameters
    """
    outcome, limit = Outcome.TURNS_RESTORED, _CHANGED_BY_ESTIMATES
    if not estimated:
        outcome, limit = Outcome.TURNS_BETWEEN_SAMPLES, _CHANGED
        parts = [part for part in parts if part.strokes.lost_at_reversals > _LOST]
        estimated = [part.turning_between_samples(corners=False) for part in parts]
    details = []
    for part, other in zip(parts, estimated, strict=True):
        count = samples_per_cycle(part.strokes, part.used)
        changed = _change(part, other, spring)
        if count < _ENOUGH or changed > limit:
            details.append(f"{part.record.path}: {count:.0f} samples per cycle, {100.0 * changed:.2g} % of the force")
    return {outcome: "; ".join(details)} if details else {}


def _change(part: SteadyRecord, turning: SteadyRecord, spring: SpringParameters) -> float:
    """rms difference between the forces with reversals at samples and between them, share of the force's deviation."""
    at_samples, between = (_hysteretic_force(record, spring) for record in (part, turning))
    return float(np.sqrt(np.mean((between - at_samples)[part.used] ** 2)) / np.std(part.record.force))


def _hysteretic_force(part: SteadyRecord, spring: SpringParameters) -> FloatArray:
    """Hysteretic force at every sample [N]."""
    loops = part.all_samples()
    FA = polyval(loops.displacement - spring.displacement_offset, spring.kA)
    return np.asarray(spring.kappa_omega * FA * loops.omega(spring.rho, spring.sigma, spring.n))
