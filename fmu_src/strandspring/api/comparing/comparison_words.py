"""Two springs compared, in words and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

from ...loops.loop import LOOP_FIGURE
from .differences import FIGURES, Difference, HysteresisTest

_LEAST_P = 1e-12  # beyond which a probability is no more than small


class Verdict(Enum):
    """Whether two springs differ; the value begins the sentence for the user."""

    DIFFERENT = "The springs differ beyond their uncertainty"
    NOT_FOUND = "No difference beyond the uncertainty was found"
    UNKNOWN = "Whether the springs differ beyond their uncertainty cannot be said"
    IDENTICAL = "Both models are the same spring: all their parameters are equal"


def verdict_sentence(
    verdict: Verdict,
    unknown: str,
    figures: Sequence[Difference],
    parameters: Sequence[Difference],
    test: HysteresisTest | None,
) -> str:
    """The verdict with what it is based on; `unknown` says why nothing can be judged."""
    if verdict is Verdict.IDENTICAL:
        return f"{verdict.value}."
    if verdict is Verdict.UNKNOWN:
        largest = [_largest(own) for own in _by_quantity(figures)]
        return f"{verdict.value}: {unknown}. As identified, {'; '.join(map(_in_words, largest))}."
    if verdict is Verdict.NOT_FOUND:
        ends = [own[-1] for own in _by_quantity(figures) if not math.isnan(own[-1].seen_from)]
        seen = [f"{_size(one, one.seen_from)} in {one.words}" for one in ends]
        at = f" at {_millimetres(ends[-1].amplitude)}" if ends else ""
        return f"{verdict.value}; differences smaller than {_listed(seen)}{at} could not have been seen."
    found, same = [], []
    for own in _by_quantity(figures):
        beyond = [one for one in own if one.differs]
        if beyond:
            found.append(_in_words(max(beyond, key=lambda one: abs(one.z))))
        elif not math.isnan(own[-1].seen_from):
            within = max(max(abs(one.low), abs(one.high)) for one in own if not math.isnan(one.z))
            same.append(f"{own[0].words} is the same within {_size(own[0], within)}")
    if test is not None and test.differs:
        most = max((one for one in parameters if not math.isnan(one.z)), key=lambda one: abs(one.z))
        found.append(
            f"the hysteresis parameters differ together (chi-square {test.chi_square:.3g} at "
            f"{test.degrees_of_freedom} degrees of freedom), {most.quantity} most clearly (z = {most.z:.1f})"
        )
    return f"{verdict.value}: {'; '.join([*found, *same])}."


def joint_sentence(test: HysteresisTest) -> str:
    """The joint test of the hysteresis parameters in words."""
    small = f"p < {_LEAST_P:g}" if test.p < _LEAST_P else f"p = {test.p:.2g}"
    return (
        f"{', '.join(test.parameters)} together: chi-square {test.chi_square:.3g} at {test.degrees_of_freedom} degrees "
        f"of freedom, {small}{' (beyond the uncertainty)' if test.differs else ''}."
    )


def parameter_table(parameters: Sequence[Difference]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the hysteresis parameters."""
    rows = [
        [
            f"{one.quantity} [{one.unit}]" if one.unit != "1" else one.quantity,
            f"{one.a:.4g}",
            f"{one.b:.4g}",
            _signed(one),
            _between(one),
            "-" if math.isnan(one.z) else f"{one.z:.2f}",
        ]
        for one in parameters
    ]
    return ["parameter", "A", "B", "B - A", "5 to 95 %", "z"], rows


def figure_table(figures: Sequence[Difference]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the loops' figures."""
    rows = []
    for one in figures:
        column = LOOP_FIGURE[one.quantity]
        rows.append(
            [
                column.heading,
                f"{1e3 * (one.amplitude or 0.0):.4g}",
                *map(column.text, (one.a, one.b)),
                _signed(one),
                _between(one),
                ("-" if math.isnan(one.z) else f"{one.z:.2f}") + ("*" if one.differs else ""),
            ]
        )
    return ["figure", "at mm", "A", "B", "B - A", "5 to 95 %", "z"], rows


def percent(share: float) -> str:
    """A share in percent, to two digits but never as a power of ten."""
    return f"{100.0 * share:.2g}" if abs(share) < 0.995 else f"{100.0 * share:.0f}"


def _by_quantity(figures: Sequence[Difference]) -> list[list[Difference]]:
    """Differences of each figure that is judged, by rising amplitude."""
    return [[one for one in figures if one.quantity == name] for name, is_judged in FIGURES.items() if is_judged]


def _largest(differences: list[Difference]) -> Difference:
    return max(differences, key=lambda one: 0.0 if math.isnan(one.change) else abs(one.change))


def _in_words(one: Difference) -> str:
    """Such as: energy per cycle at 20 mm is 12 % (8 to 16 %) lower in B."""
    ends = ""
    if not math.isnan(one.low):
        pair = sorted((one.low, one.high), key=abs)
        crosses = one.low * one.high < 0.0
        shown = [one.low, one.high] if crosses else [abs(end) for end in pair]
        numbers = " to ".join(_size(one, end, bare=True) for end in shown)
        ends = f" ({numbers} {'%' if one.relative else one.unit})"
    side = "higher" if one.change > 0.0 else "lower"
    where = f" at {_millimetres(one.amplitude)}"
    if one.change == 0.0:
        return f"{one.words}{where} is equal"
    return f"{one.words}{where} is {_size(one, abs(one.change))}{ends} {side} in B"


def _size(one: Difference, value: float, bare: bool = False) -> str:
    number = percent(value) if one.relative else f"{value:.2g}"
    return number if bare else f"{number} {'%' if one.relative else one.unit}"


def _signed(one: Difference) -> str:
    return "-" if math.isnan(one.change) else f"{100.0 * one.change:+.3g} %" if one.relative else f"{one.change:+.3g}"


def _between(one: Difference) -> str:
    if math.isnan(one.low):
        return "-"
    factor, unit = (100.0, " %") if one.relative else (1.0, "")
    return f"{factor * one.low:+.3g} to {factor * one.high:+.3g}{unit}"


def _millimetres(amplitude: float | None) -> str:
    return f"{1e3 * (amplitude or 0.0):.4g} mm"


def _listed(words: list[str]) -> str:
    return ", ".join(words[:-1]) + (" and " if len(words) > 1 else "") + "".join(words[-1:])
