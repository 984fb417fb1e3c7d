"""Two springs in one form: the same degrees of FE and FA.

The degrees are chosen from noisy records, and another choice shifts the figures of one and the same spring by more than
its uncertainty says: a smaller loop, which no record holds, by 10 % and more. A model is put into a simpler form by
identifying the record that it gives itself.
"""

from __future__ import annotations

from ...core.parameters import SpringParameters
from ...errors import StrandspringError
from ...identification.identify import identify_records
from ...identification.options import RefinedOptions
from ...model.modelfile import ModelFile
from ...records.record import Record
from ..identifying.synthesis import synthesize

_CYCLES, _SAMPLES = 2, 500
_OF_TABLES = 5  # degree of FE where it is a table in both


def form_of(p: SpringParameters) -> tuple[int | None, int]:
    """Degrees of FE, None for a table, and of FA."""
    return None if p.FE_knots else len(p.kE) - 1, len(p.kA) - 1


def form_words(form: tuple[int | None, int]) -> str:
    """A form in words."""
    return f"{'FE as a table' if form[0] is None else f'FE of degree {form[0]}'} and FA of degree {form[1]}"


def class_of(p: SpringParameters) -> tuple[int, int]:
    """How many friction mechanisms and Maxwell branches a spring has."""
    return len(p.mechanisms), len(p.branches)


def common_form(a: SpringParameters, b: SpringParameters) -> tuple[int | None, int]:
    """The form that both can be put into: the lower degree of FE and of FA.

    Raises
    ------
    StrandspringError   If they differ in class, or are of a wider class and differ in form.
    """
    forms, classes = (form_of(a), form_of(b)), (class_of(a), class_of(b))
    if forms[0] == forms[1] and classes[0] == classes[1]:
        return forms[0]
    if not (a.is_plain and b.is_plain):
        both = [
            f"{form_words(form)}, {mechanisms} mechanism{'s' * (mechanisms > 1)} and {branches} Maxwell "
            f"branch{'es' * (branches != 1)}"
            for form, (mechanisms, branches) in zip(forms, classes, strict=True)
        ]
        raise StrandspringError(
            f"A has {both[0]}, B {both[1]}; identify both with the same `degrees`, `mechanisms` and `branches`."
        )
    degrees = [degree for degree, _ in forms if degree is not None]
    # The identification takes no FE of degree 0, which a model file may have.
    return max(min(degrees, default=_OF_TABLES), 1), min(degree for _, degree in forms)


def in_form(p: SpringParameters, form: tuple[int | None, int]) -> SpringParameters:
    """A spring as it would have been identified with these degrees, from a record over its whole range.

    Raises
    ------
    StrandspringError   If no physically possible spring of this form follows it.
    """
    degree, amplifier = form
    if form_of(p) == form or degree is None:
        return p
    record = synthesize(ModelFile("spring", p), cycles=_CYCLES, samples=_SAMPLES)
    # Without times, so that no delay is looked for.
    path_only = Record(record.displacement, record.force, path=record.path)
    return identify_records([path_only], RefinedOptions(degrees=(degree, amplifier))).parameters
