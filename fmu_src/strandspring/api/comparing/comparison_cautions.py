"""What to say besides the result of a comparison."""

from __future__ import annotations

from itertools import chain

from ...ground.quoting import printable
from ...kernel.path import PathSolver
from ...loops.loop import Loop, relaxed_branches, steady_loop
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_cautions
from ...records.record import Record
from ..common.caution_text import backwards_cautions, clipped_cautions, effects_of, outside_cautions
from .alignment import Align, aligned, apart, middle_of, shared_range
from .common_form import common_form, form_of, form_words
from .comparison_words import ComparisonVerdict, percent

_SHIFTED = 0.02  # distance of the middles, share of the shared range, from which a moved zero is mentioned
_SCATTER = (
    "The uncertainty is that of noise and misfit in the records of each model. What differs from test to test without "
    "any change of the spring (mounting, temperature, drift of the sensors) is not in it: repeat a test to see that."
)


def comparison_notes(models: tuple[ModelFile, ModelFile], verdict: ComparisonVerdict) -> list[str]:
    """What is good to know of the result: different forms, and what the uncertainty does not hold."""
    forms = [form_of(model.parameters) for model in models]
    notes = []
    if forms[0] != forms[1] and all(model.parameters.is_plain for model in models):
        common = common_form(models[0].parameters, models[1].parameters)
        notes.append(
            f"A has {form_words(forms[0])}, B {form_words(forms[1])}. Their coefficients cannot be compared one by "
            f"one, and a difference counts, with its z, only as far as it remains with {form_words(common)} in both; "
            "for more, identify both with the same degrees (`degrees=N,M`)."
        )
    return [*notes, _SCATTER] if verdict in (ComparisonVerdict.DIFFERENT, ComparisonVerdict.NOT_FOUND) else notes


def comparison_cautions(
    models: tuple[ModelFile, ModelFile],
    records: list[Record],
    align: Align,
    loops: tuple[Loop, Loop],
) -> list[str]:
    """What could make the result wrong: the records, the identifications, and a zero that was moved."""
    cautions = [*backwards_cautions(records), *chain.from_iterable(map(clipped_cautions, records))]
    cautions += [
        f"Model {label}, {sentence}"
        for record in records
        for label, model in zip("AB", models, strict=True)
        for sentence in outside_cautions(record.path, record.displacement, model.parameters)
    ]
    cautions += dict.fromkeys(chain.from_iterable(relaxed_branches(model.parameters) for model in models))
    for label, model in zip("AB", models, strict=True):
        cautions += [
            f"Of the identification of {label}: {printable(sentence)}" for _, sentence in stated_cautions(model)
        ]
    effects = [effects_of(model) or "nothing" for model in models]
    if effects[0] != effects[1]:
        cautions.append(
            f"As effects of the rig, {effects[0]} was removed from A's records and {effects[1]} from B's: a "
            "difference may be the rigs'."
        )
    digests = [_digests(model) for model in models]
    if digests[0] & digests[1]:
        cautions.append(
            "Both models were identified from the same record, so their errors are not independent, as the verdict "
            "assumes: only method or options differ."
        )
    if align == "middle":
        return cautions
    moved = aligned(models, "middle")
    low, high = shared_range(moved, "middle")
    distance = middle_of(models[1].parameters) - middle_of(models[0].parameters)
    if abs(distance) > _SHIFTED * (high - low):
        share = apart(*(steady_loop(PathSolver(p).slow, low, high) for p in moved))[1]
        cautions.append(
            f"The middle of B's range lies {1e3 * distance:.4g} mm from that of A's; if the zero of displacement "
            "was moved between the tests, align them by their middles with `align=middle`. (As recorded the loops "
            f"differ by {percent(apart(*loops)[1])} % of their height, and each counted from its own middle by "
            f"{percent(share)} %)"
        )
    return cautions


def _digests(model: ModelFile) -> set[str]:
    """SHA-256 of the records that a model was identified from; its provenance is free JSON."""
    records = model.provenance.get("records")
    entries = records if isinstance(records, list) else []
    return {str(entry["sha256"]) for entry in entries if isinstance(entry, dict) and entry.get("sha256")}
