"""Units that were mistaken: records of one spring that differ by a factor between units, and implausible sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray
from ...model.outcomes import IdentificationError, Outcome
from .steady_part import MeanLoop, SteadyRecord, mean_loop

_THOUSAND = 1000.0
# What a unit becomes when it is taken for another one: factor that corrects the column, and the units.
_FORCES = {
    _THOUSAND: "kN read as N",
    1.0 / _THOUSAND: "N read as kN",
    STANDARD_GRAVITY: "kgf read as N",
    1.0 / STANDARD_GRAVITY: "N read as kgf",
    4.4482216: "lbf read as N",
    1.0 / 4.4482216: "N read as lbf",
}
_DISPLACEMENTS = {
    _THOUSAND: "m read as mm",
    1.0 / _THOUSAND: "mm read as m",
    25.4: "inches read as mm",
    1.0 / 25.4: "mm read as inches",
}
_AGREE = math.log(1.15)  # difference in stiffness and height of loops that agree, logarithm of their ratio
# Nothing but a unit makes a factor of 1000; loops of other amplitudes may differ much otherwise.
_AGREE_BY_THOUSAND = math.log(4.0)
_ALIKE = 1.25  # ratio of amplitudes up to which the heights of loops are compared
_SAME_RANGE = 1.05  # ratio of amplitudes up to which the zeros of the displacement may differ
_OVERLAP = 0.5  # of the displacements compared, share of the smaller range
_PLACES = 50  # at which slopes are compared
_INSIDE = 0.9  # share of the smaller stroke over which the force is compared after a reversal

# What rigs measure, and springs carry [m], [N], [N/m]. Sensors and fixtures yield by the first displacement, no rig
# reaches the second, and the forces are those of load cells. A softer spring sags by 10 m under 1 kg, and no frame of a
# rig is stiffer than the last.
_USUAL = {"amplitude": (1e-6, 0.5, "m"), "force amplitude": (1e-3, 1e7, "N"), "stiffness": (1.0, 1e9, "N/m")}


@dataclass(frozen=True)
class _Factor:
    """What a column is multiplied by; `units` names the mistake."""

    column: str
    value: float
    units: str

    def corrected(self, loop: MeanLoop) -> MeanLoop:
        if self.column == "force":
            return MeanLoop(loop.displacement, self.value * loop.loading, self.value * loop.unloading)
        return MeanLoop(self.value * loop.displacement, loop.loading, loop.unloading)

    @property
    def is_thousand(self) -> bool:
        return self.value in (_THOUSAND, 1.0 / _THOUSAND)


_FACTORS = [
    *(_Factor("displacement", value, units) for value, units in _DISPLACEMENTS.items()),
    *(_Factor("force", value, units) for value, units in _FORCES.items()),
]


def refuse_differing_units(parts: Sequence[SteadyRecord]) -> None:
    """Refuse records of which one agrees with the others only after a factor between units.

    Raises
    ------
    IdentificationError   With the record, the column and the factor.
    """
    loops = [mean_loop(part.loops) for part in parts]
    # A record with another unit differs from its neighbours by amplitude: only such records are compared with all.
    order = sorted(range(len(loops)), key=lambda k: float(np.ptp(loops[k].displacement)))
    suspects = {k for pair in pairwise(order) if not _agree(*(loops[k] for k in pair)) for k in pair}
    mistaken = {
        (k, other): factor
        for k in suspects
        for other in range(len(loops))
        if k != other and (factor := _factor_between(loops[k], loops[other])) is not None
    }
    if not mistaken:
        return
    # The one that differs from most of the others; of two, the second.
    k = max(range(len(parts)), key=lambda k: (sum(record == k for record, _ in mistaken), k))
    other, factor = next((other, factor) for (record, other), factor in mistaken.items() if record == k)
    raise IdentificationError(
        Outcome.UNITS_DIFFER,
        parts[k].record.path,
        f" Its {factor.column} times {factor.value:.6g} agrees with {parts[other].record.path} ({factor.units}): set "
        f"its {factor.column}_unit.",
    )


def _factor_between(loop: MeanLoop, other: MeanLoop) -> _Factor | None:
    """The factor without which a loop does not agree with another one at all; None if there is none."""
    if _agree(loop, other):
        return None
    fitting = []
    for factor in _FACTORS:
        corrected = factor.corrected(loop)
        largest = max(map(abs, _differences(corrected, other)))
        if factor.is_thousand:
            agrees = largest < _AGREE_BY_THOUSAND
        else:
            agrees = largest < _AGREE and _common_place(corrected, other) is not None
        if agrees:
            apart = abs(math.log(np.ptp(corrected.displacement) / np.ptp(other.displacement)))
            fitting.append((apart + largest, factor))
    return min(fitting, key=lambda fit: fit[0])[1] if fitting else None


def _agree(loop: MeanLoop, other: MeanLoop) -> bool:
    """Whether two loops agree in stiffness or height, to a factor of 2."""
    return abs(min(_differences(loop, other), key=abs)) < math.log(2.0)


def _differences(loop: MeanLoop, other: MeanLoop) -> list[float]:
    """Logarithms of the ratios of the stiffness and, of amplitudes alike, of the heights of two loops.

    Loops that saturate less are stiffer, and any are softer or stiffer by their place: the force after a reversal
    hardly depends on the first, and the slope at one place not on the second. Units change both.
    """
    stroke = _INSIDE * min(float(np.ptp(line.displacement)) for line in (loop, other))
    pairs = [(_after_reversals(loop, stroke), _after_reversals(other, stroke))]
    if (places := _common_place(loop, other)) is not None:
        slopes = [
            np.polyfit(place, np.interp(place, line.displacement, 0.5 * (line.loading + line.unloading)), 1)[0]
            for line, place in zip((loop, other), places, strict=True)
        ]
        pairs.append((float(slopes[0]), float(slopes[1])))
    if _ratio_of_ranges(loop, other) <= _ALIKE:
        pairs.append((loop.half_height, other.half_height))
    return [
        math.log(slope / other_slope) if slope > 0.0 and other_slope > 0.0 else math.inf for slope, other_slope in pairs
    ]


def _common_place(loop: MeanLoop, other: MeanLoop) -> tuple[FloatArray, FloatArray] | None:
    """Displacements of each loop that are the same place [m]; None if they have too little in common."""
    shift = 0.0
    if _ratio_of_ranges(loop, other) <= _SAME_RANGE:
        shift = float(np.mean(other.displacement) - np.mean(loop.displacement))
    at, other_at = loop.displacement + shift, other.displacement
    low, high = max(at[0], other_at[0]), min(at[-1], other_at[-1])
    if high - low < _OVERLAP * min(np.ptp(at), np.ptp(other_at)):
        return None
    place = np.linspace(low, high, _PLACES)
    return place - shift, place


def _ratio_of_ranges(loop: MeanLoop, other: MeanLoop) -> float:
    """Range of displacement of the larger loop in that of the smaller."""
    ranges = sorted(float(np.ptp(branches.displacement)) for branches in (loop, other))
    return ranges[1] / ranges[0]


def _after_reversals(loop: MeanLoop, stroke: float) -> float:
    """Mean change of the force over a stroke [m] after the reversals of a loop [N]."""
    x = loop.displacement
    up = np.interp(x[0] + stroke, x, loop.loading) - loop.loading[0]
    down = loop.unloading[-1] - np.interp(x[-1] - stroke, x, loop.unloading)
    return float(0.5 * (up + down))


def implausible_sizes(parts: Sequence[SteadyRecord]) -> tuple[str, ...]:
    """A note on sizes that no rig measures, with the mistake in a unit that would explain them."""
    loops = [mean_loop(part.loops) for part in parts]
    amplitude = 0.5 * max(float(np.ptp(loop.displacement)) for loop in loops)
    force = 0.5 * max(float(np.ptp([loop.loading, loop.unloading])) for loop in loops)
    unusual = [
        f"{name} {value:.3g} {_USUAL[name][2]}, usual are {_USUAL[name][0]:g} to {_USUAL[name][1]:g}"
        for name, value in _sizes(amplitude, force)
        if not _is_usual(name, value)
    ]
    if not unusual:
        return ()
    explanations = [
        factor.units
        for factor in _FACTORS
        if factor.is_thousand
        and all(
            _is_usual(name, value)
            for name, value in _sizes(
                amplitude * (factor.value if factor.column == "displacement" else 1.0),
                force * (factor.value if factor.column == "force" else 1.0),
            )
        )
    ]
    cause = f"; {' or '.join(explanations)} would explain it" if explanations else ""
    return (f"Check the units of displacement and force: {'; '.join(unusual)}{cause}.",)


def _sizes(amplitude: float, force: float) -> Iterator[tuple[str, float]]:
    yield from (("amplitude", amplitude), ("force amplitude", force), ("stiffness", force / amplitude))


def _is_usual(name: str, value: float) -> bool:
    low, high, _ = _USUAL[name]
    return low <= value <= high
