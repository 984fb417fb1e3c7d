"""What to say besides the result of a comparison."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...findings import Finding, Outcome
from ...kernel.path import PathSolver
from ...loops.loop import Loop, relaxed_branches, steady_loop
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_cautions
from ...records.record import Record
from ..common.record_findings import effects_of, of_records, outside
from ..options import Align
from .alignment import aligned, apart, middle_of, shared_range
from .common_form import common_form, form_of, form_words
from .comparison_words import ComparisonVerdict

_SHIFTED = 0.02  # distance of the middles, share of the shared range, from which a moved zero is mentioned


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
