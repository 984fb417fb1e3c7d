"""What a comparison of two springs says: where they are compared, the verdict in words, tables, and findings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from enum import Enum
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import StrandspringError
from ...findings import Finding, Outcome
from ...ground.result_columns import ResultColumn
from ...kernel.path import PathSolver
from ...loops.loop import LOOP_FIGURES, Loop, relaxed_branches, steady_loop
from ...model.coordinates import counted_from
from ...model.joint import HYSTERETIC_PARAMETERS
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_cautions
from ...records.record import Record
from ..common.record_findings import effects_of, of_records, outside
from ..common.table import Table
from ..options import Align
from .differences import FIGURES, HysteresisTest, SpringDifference, common_form, form_of, form_words

_LEAST_SHARED = 0.5  # of the narrower range, below which ranges are not compared where they lie
_SHIFTED = 0.02  # distance of the middles, share of the shared range, from which a moved zero is mentioned
_LEAST_P = 1e-12  # beyond which a probability is no more than small
_COLUMNS = {column.key: column for column in (*HYSTERETIC_PARAMETERS, *LOOP_FIGURES)}
# Texts, since each row has a unit of its own.
_DIFFERENCES = (
    ResultColumn("amplitude", "m", "amplitude", "at", "mm", 1e3),
    ResultColumn("a", "1", "A", "A"),
    ResultColumn("b", "1", "B", "B"),
    ResultColumn("change", "1", "B - A", "B - A"),
    ResultColumn("interval", "1", "5 to 95 %", "5 to 95 %"),
    ResultColumn("z", "1", "z", "z"),
)


class ComparisonVerdict(Enum):
    """Whether two springs differ; the value begins the sentence for the user."""

    DIFFERENT = "The springs differ beyond their uncertainty"
    NOT_FOUND = "No difference beyond the uncertainty was found"
    UNKNOWN = "Whether the springs differ beyond their uncertainty cannot be said"
    IDENTICAL = "Both models are the same spring: all their parameters are equal"


def verdict_sentence(
    verdict: ComparisonVerdict,
    unknown: str,
    figures: Sequence[SpringDifference],
    parameters: Sequence[SpringDifference],
    test: HysteresisTest | None,
) -> str:
    """The verdict with what it is based on; `unknown` says why nothing can be judged."""
    if verdict is ComparisonVerdict.IDENTICAL:
        return f"{verdict.value}."
    if verdict is ComparisonVerdict.UNKNOWN:
        largest = [_largest(group) for group in _by_quantity(figures)]
        return f"{verdict.value}. {unknown} As identified, {'; '.join(map(_in_words, largest))}."
    if verdict is ComparisonVerdict.NOT_FOUND:
        ends = [group[-1] for group in _by_quantity(figures) if not math.isnan(group[-1].seen_from)]
        seen = [f"{_size(difference, difference.seen_from)} in {difference.words}" for difference in ends]
        at = f" at {_millimetres(ends[-1].amplitude)}" if ends else ""
        return f"{verdict.value}; differences smaller than {_listed(seen)}{at} could not have been seen."
    changes, same = [], []
    for group in _by_quantity(figures):
        beyond = [difference for difference in group if difference.differs]
        if beyond:
            changes.append(_in_words(max(beyond, key=lambda difference: abs(difference.z))))
        elif not math.isnan(group[-1].seen_from):
            within = max(
                max(abs(difference.low), abs(difference.high)) for difference in group if not math.isnan(difference.z)
            )
            same.append(f"{group[0].words} is the same within {_size(group[0], within)}")
    if test is not None and test.differs:
        most = max(
            (difference for difference in parameters if not math.isnan(difference.z)),
            key=lambda difference: abs(difference.z),
        )
        changes.append(
            f"the parameters differ together (chi-square {test.chi_square:.3g} at "
            f"{test.degrees_of_freedom} degrees of freedom), {most.quantity} most clearly (z = {most.z:.1f})"
        )
    return f"{verdict.value}: {'; '.join([*changes, *same])}."


def joint_sentence(test: HysteresisTest) -> str:
    """The joint test of the hysteresis parameters in words."""
    small = f"p < {_LEAST_P:g}" if test.p < _LEAST_P else f"p = {test.p:.2g}"
    return (
        f"{', '.join(test.parameters)} together: chi-square {test.chi_square:.3g} at {test.degrees_of_freedom} degrees "
        f"of freedom, {small}{' (beyond the uncertainty)' if test.differs else ''}."
    )


def difference_table(title: str, differences: Sequence[SpringDifference]) -> Table:
    """Parameters, or figures of loops, each in its own unit."""
    columns = (ResultColumn("quantity", "", title, title), *_DIFFERENCES)
    return Table(columns, [_difference_row(difference) for difference in differences])


def _difference_row(difference: SpringDifference) -> dict[str, Any]:
    column = _COLUMNS.get(difference.quantity) or ResultColumn(
        difference.quantity, difference.unit, difference.words, difference.quantity, difference.unit.removesuffix("1")
    )
    z = "-" if math.isnan(difference.z) else f"{difference.z:.2f}"
    return {
        "quantity": column.heading,
        "amplitude": difference.amplitude,
        "a": column.text(difference.a),
        "b": column.text(difference.b),
        "change": _signed(difference),
        "interval": _between(difference),
        "z": f"{z}*" if difference.differs else z,
    }


def percent(share: float) -> str:
    """A share in percent, to two digits but never as a power of ten."""
    return f"{100.0 * share:.2g}" if abs(share) < 0.995 else f"{100.0 * share:.0f}"


def _by_quantity(figures: Sequence[SpringDifference]) -> list[list[SpringDifference]]:
    """Differences of each figure that is judged, by rising amplitude."""
    return [
        [difference for difference in figures if difference.quantity == name]
        for name, is_judged in FIGURES.items()
        if is_judged
    ]


def _largest(differences: list[SpringDifference]) -> SpringDifference:
    return max(differences, key=lambda difference: 0.0 if math.isnan(difference.change) else abs(difference.change))


def _in_words(difference: SpringDifference) -> str:
    """Such as: energy per cycle at 20 mm is 12 % (8 to 16 %) lower in B."""
    ends = ""
    if not math.isnan(difference.low):
        pair = sorted((difference.low, difference.high), key=abs)
        crosses = difference.low * difference.high < 0.0
        shown = [difference.low, difference.high] if crosses else [abs(end) for end in pair]
        numbers = " to ".join(_size(difference, end, bare=True) for end in shown)
        ends = f" ({numbers} {'%' if difference.relative else difference.unit})"
    side = "higher" if difference.change > 0.0 else "lower"
    where = f" at {_millimetres(difference.amplitude)}"
    if difference.change == 0.0:
        return f"{difference.words}{where} is equal"
    return f"{difference.words}{where} is {_size(difference, abs(difference.change))}{ends} {side} in B"


def _size(difference: SpringDifference, value: float, bare: bool = False) -> str:
    number = percent(value) if difference.relative else f"{value:.2g}"
    return number if bare else f"{number} {'%' if difference.relative else difference.unit}"


def _signed(difference: SpringDifference) -> str:
    if math.isnan(difference.change):
        return "-"
    return f"{100.0 * difference.change:+.3g} %" if difference.relative else f"{difference.change:+.3g}"


def _between(difference: SpringDifference) -> str:
    if math.isnan(difference.low):
        return "-"
    factor, unit = (100.0, " %") if difference.relative else (1.0, "")
    return f"{factor * difference.low:+.3g} to {factor * difference.high:+.3g}{unit}"


def _millimetres(amplitude: float | None) -> str:
    return f"{1e3 * (amplitude or 0.0):.4g} mm"


def _listed(words: list[str]) -> str:
    return ", ".join(words[:-1]) + (" and " if len(words) > 1 else "") + "".join(words[-1:])


def aligned(models: tuple[ModelFile, ModelFile], align: Align) -> tuple[SpringParameters, SpringParameters]:
    """Both springs with their displacements counted as asked."""
    a, b = (model.parameters for model in models)
    return (a, b) if align == "record" else (counted_from(middle_of(a), a), counted_from(middle_of(b), b))


def shared_range(springs: tuple[SpringParameters, SpringParameters], align: Align) -> tuple[float, float]:
    """The displacements [m] that both springs were identified for.

    Raises
    ------
    StrandspringError   If that is less than half of the narrower range, where displacements are those of the records.
    """
    low = max(p.displacement_min for p in springs)
    high = min(p.displacement_max for p in springs)
    narrower = min(p.displacement_max - p.displacement_min for p in springs)
    if align == "record" and high - low < _LEAST_SHARED * narrower:
        ranges = [f"{1e3 * p.displacement_min:.6g} to {1e3 * p.displacement_max:.6g} mm" for p in springs]
        raise StrandspringError(
            "A was identified from {of_a} and B from {of_b}, which share less than half of the narrower range; if the "
            "zero of displacement was moved between the tests, align them by their middles ({to[align=middle]}), else "
            "identify both over one range.",
            of_a=ranges[0],
            of_b=ranges[1],
        )
    return low, high


def apart(a: Loop, b: Loop) -> tuple[float, float]:
    """rms difference of force between two loops of one range [N], and its share of their mean height."""
    squares = [
        np.mean((getattr(b, side).force - getattr(a, side).force) ** 2) for side in ("loading", "unloading")
    ]  # fmt: skip
    rms = float(np.sqrt(np.mean(squares)))
    return rms, rms / max(0.5 * (a.figures.height + b.figures.height), 1e-300)


def middle_of(p: SpringParameters) -> float:
    """The middle of the identified range [m]."""
    return 0.5 * (p.displacement_min + p.displacement_max)


def comparison_findings(
    models: tuple[ModelFile, ModelFile],
    records: Sequence[Record],
    align: Align,
    loops: tuple[Loop, Loop],
    verdict: ComparisonVerdict,
) -> Iterator[Finding]:
    """What could make the result wrong (the records, the identifications, a zero that was moved), different forms, and
    what the uncertainty does not hold.
    """
    yield from of_records(records)
    for label, model in zip("AB", models, strict=True):
        for record in records:
            yield from outside(f"Model {label}, {record.path}", record.displacement, model.parameters)
        yield from stated_cautions(model, f"Of the identification of {label}")
    yield from next(filter(None, (relaxed_branches(model.parameters) for model in models)), ())
    effects = [effects_of(model) or "nothing" for model in models]
    if effects[0] != effects[1]:
        yield Finding(Outcome.RIGS_DIFFER, {"of_a": effects[0], "of_b": effects[1]})
    digests = [_digests(model) for model in models]
    if digests[0] & digests[1]:
        yield Finding(Outcome.SAME_RECORD)
    if align != "middle":
        yield from _moved_zero(models, loops)
    forms = [form_of(model.parameters) for model in models]
    if forms[0] != forms[1] and all(model.parameters.is_plain for model in models):
        common = common_form(models[0].parameters, models[1].parameters)
        named = zip(("of_a", "of_b", "common"), map(form_words, (*forms, common)), strict=True)
        yield Finding(Outcome.FORMS_DIFFER, dict(named))
    if verdict in (ComparisonVerdict.DIFFERENT, ComparisonVerdict.NOT_FOUND):
        yield Finding(Outcome.SCATTER)


def _moved_zero(models: tuple[ModelFile, ModelFile], loops: tuple[Loop, Loop]) -> Iterator[Finding]:
    """Ranges whose middles are not the same."""
    moved = aligned(models, "middle")
    low, high = shared_range(moved, "middle")
    distance = middle_of(models[1].parameters) - middle_of(models[0].parameters)
    if abs(distance) > _SHIFTED * (high - low):
        from_middles = apart(*(steady_loop(PathSolver(p).slow, low, high) for p in moved))[1]
        yield Finding(Outcome.ZERO_MOVED, {"distance": distance, "apart": apart(*loops)[1], "aligned": from_middles})


def _digests(model: ModelFile) -> set[str]:
    """SHA-256 of the records that a model was identified from; its provenance is free JSON."""
    records = model.provenance.get("records")
    entries = records if isinstance(records, list) else []
    return {str(entry["sha256"]) for entry in entries if isinstance(entry, dict) and entry.get("sha256")}
