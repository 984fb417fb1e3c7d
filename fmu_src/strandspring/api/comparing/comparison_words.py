"""Two springs compared, in words and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum

from ...ground.result_columns import ResultColumn
from ...loops.loop import LOOP_FIGURES
from ...model.joint import HYSTERETIC_PARAMETERS
from .differences import FIGURES, HysteresisTest, SpringDifference

_COLUMNS = {column.key: column for column in (*HYSTERETIC_PARAMETERS, *LOOP_FIGURES)}
_LEAST_P = 1e-12  # beyond which a probability is no more than small


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


def difference_table(title: str, differences: Sequence[SpringDifference]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of parameters, or of figures of loops."""
    rows = []
    for difference in differences:
        column = _COLUMNS.get(difference.quantity) or _column_of(difference)
        at = [] if difference.amplitude is None else [f"{1e3 * difference.amplitude:.4g}"]
        z = "-" if math.isnan(difference.z) else f"{difference.z:.2f}"
        rows.append(
            [
                column.heading,
                *at,
                *map(column.text, (difference.a, difference.b)),
                _signed(difference),
                _between(difference),
                f"{z}*" if difference.differs else z,
            ]
        )
    at = ["at mm"] if differences[0].amplitude is not None else []
    return [title, *at, "A", "B", "B - A", "5 to 95 %", "z"], rows


def _column_of(difference: SpringDifference) -> ResultColumn:
    """That of a parameter which only wider classes have."""
    unit = difference.unit.removesuffix("1") if difference.unit == "1" else difference.unit
    return ResultColumn(difference.quantity, difference.unit, difference.words, difference.quantity, unit)


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
