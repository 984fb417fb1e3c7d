"""Whether a spring is usable: its error on held-out strokes, beside those of plain models on the same.

A row counts where it is held out first, which is with a block of consecutive strokes, and where fitted strokes of the
same direction pass: beyond them the fit extrapolates, as at the largest amplitude. The error of the other folds, which
hold out all strokes of like amplitude, or a record, is a figure of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray, IndexArray
from ..loops.strokes import noise_level
from .samples import Samples

_USABLE = 0.15  # error of a usable spring: mounts of one type differ in stiffness by as much


@dataclass(frozen=True, eq=False)
class Part:
    """Root mean squares on some rows over the deviation of the force there."""

    spans: FloatArray  # middle half of the amplitudes [mm], frequencies [Hz] if timed, shape (1 or 2, 2)
    error: float  # of the spring
    of_spring: float  # what white noise of the force leaves of it
    plain: Mapping[str, float]  # errors of plain models


@dataclass(frozen=True)
class Verdict:
    """Errors on what was held out.

    Attributes
    ----------
    whole : Part or None           All rows that count; None if there are too few.
    parts : tuple of Part          By amplitude and frequency, the best first.
    unseen : float                 Error over the deviation of all the force where all strokes of like amplitude, or a
                                   record, are held out.
    loop : float                   Likewise what a curve of displacement without a loop leaves.
    in_parts : bool                Whether parts of strokes are held out, as there are few.
    """

    whole: Part | None
    parts: tuple[Part, ...]
    unseen: float
    loop: float
    in_parts: bool

    @classmethod
    def of(cls, samples: Samples, residuals: FloatArray, plain: Mapping[str, FloatArray]) -> Verdict:
        """The verdict by predicted minus measured force over its deviation, nan beside the fold, shape (F, P) each."""
        r, deviation = samples.r, float(np.std(samples.r)) or 1.0
        stroke, cycles = samples.stroke_of_row, samples.cycles
        held = ~np.isnan(residuals)
        first = held & (np.cumsum(held, axis=0) == 1)
        passed = _passed(samples, held)
        counts = (first & passed).any(axis=0)
        noise = float(np.mean([noise_level(record.force) for record in samples.records])) / deviation

        def rms(of: FloatArray, rows: BoolArray) -> float:
            return float(np.sqrt(np.mean(of[rows] ** 2))) if rows.any() else 0.0

        def part(rows: BoolArray) -> Part:
            scale = deviation / (float(np.std(r[rows])) or 1.0)
            error, *others = (scale * rms(of, first & rows) for of in (residuals, *plain.values()))
            spans = np.quantile(cycles[:, stroke[rows]], [0.25, 0.75], axis=1).T
            of_spring = math.sqrt(max(error**2 - (scale * noise) ** 2, 0.0))
            return Part(spans, error, of_spring, dict(zip(plain, others, strict=True)))

        # At least two cycles, and an error that is 15 % off by chance.
        labels = np.stack([groups(of)[stroke] for of in cycles])
        cells = [counts & np.all(labels == label[:, None], axis=0) for label in np.unique(labels, axis=1).T]
        large = [rows for rows in cells if rows.sum() >= 20 and np.unique(stroke[rows]).size >= 4]
        return cls(
            part(counts) if counts.sum() >= 20 else None,
            tuple(sorted(map(part, large), key=lambda part: part.error)),
            rms(residuals, held & ~first & passed),
            # `full`, since of few displacements more than one curve fits, of which numpy would warn.
            float(np.std(r - np.polynomial.Polynomial.fit(samples.x, r, 5, full=True)[0](samples.x))) / deviation,
            any(np.isin(stroke[fold], stroke[~fold]).any() for fold in held),
        )

    def _error(self, part: Part) -> str:
        best = f" (best plain model {digits(100.0 * min(part.plain.values()))} %)" if part.plain else ""
        return f"{digits(100.0 * part.error)} % on held-out {'parts of ' * self.in_parts}strokes{best}"

    @property
    def _limit(self) -> float:
        """Error of a usable spring; less where a plain model has half of it, as the loops repeat."""
        beaten = self.whole is not None and min(self.whole.plain.values(), default=math.inf) < 0.5 * self.whole.error
        return 0.10 if beaten else _USABLE

    @property
    def is_usable(self) -> bool | None:
        """Whether the spring is usable somewhere; None if it was not tested."""
        return None if self.whole is None else any(p.of_spring <= self._limit for p in self.parts or (self.whole,))

    def __str__(self) -> str:
        if self.whole is None:
            return "not tested: too few samples can be held out"
        limit = self._limit
        good, bad = ([part for part in self.parts if (part.of_spring <= limit) is usable] for usable in (True, False))
        unseen = f"; {digits(100.0 * self.unseen)} % at other amplitudes or records" if self.unseen > _USABLE else ""
        if self.whole.of_spring <= limit and not bad:
            if self.whole.of_spring > 0.5 * self.loop:  # nothing is known of damping
                loop = digits(100.0 * self.loop)
                return f"usable for stiffness only: {self._error(self.whole)}, {loop} % without a loop"
            return f"usable: {self._error(self.whole)}{unseen}"
        if not good:
            return f"not usable: {self._error(self.whole if self.whole.of_spring > limit else bad[-1])}"
        beside = f"; not at {_places(bad, good)}: {digits(100.0 * bad[-1].error)} %" if bad else ""
        return f"usable at {_places(good, bad)}: {self._error(good[-1])}{beside}{unseen}"


def _passed(samples: Samples, held: BoolArray) -> BoolArray:
    """Whether rows lie among those on strokes of their direction that a fold leaves, shape (F, P)."""
    x, (begins, ends) = samples.x, samples.displacement[samples.strokes].T
    rises, passed = (ends > begins)[samples.stroke_of_row], np.zeros(held.shape, bool)
    margin = 0.02 * float(np.ptp(samples.x))  # for noise and overshoot
    for same in (rises, ~rises):
        low = np.where(~held & same, x, np.inf).min(axis=1, keepdims=True)
        high = np.where(~held & same, x, -np.inf).max(axis=1, keepdims=True)
        passed |= same & (x >= low - margin) & (x <= high + margin)
    return passed


def groups(values: FloatArray) -> IndexArray:
    """Number of the group of each stroke, divided where none lies for a factor of 1.3.

    Programmes step by more from part to part, sweeps by less.
    """
    order = np.sort(np.maximum(values, 1e-300))
    return np.searchsorted(order[1:][np.diff(np.log(order)) >= math.log(1.3)], values, side="right")


def _places(parts: Sequence[Part], others: Sequence[Part]) -> str:
    """Where parts are, as one range if none of the others lies in it."""
    spans = np.array([part.spans for part in parts])
    low, high = spans[:, :, 0].min(axis=0), spans[:, :, 1].max(axis=0)
    is_one = not any(np.all(np.abs(2.0 * part.spans.mean(axis=1) - low - high) <= high - low) for part in others)
    places = [np.stack([low, high], axis=1)] if is_one else list(spans)
    texts = [[f"{digits(*ends)} {unit}" for ends, unit in zip(place, ("mm", "Hz"), strict=False)] for place in places]
    return " and ".join(map(", ".join, texts))


def digits(*values: float) -> str:
    return " to ".join(dict.fromkeys(f"{float(f'{value:.2g}'):g}" for value in values))
