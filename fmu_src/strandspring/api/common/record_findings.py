"""Findings about records beside a model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...core.parameters import SpringParameters
from ...findings import Finding, Outcome
from ...ground.quoting import printable
from ...identification.refusals import Strokes, backwards, clipped_samples
from ...kernel.arrays import FloatArray
from ...loops.cycles import measured_loops
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_amplitudes, stated_effects
from ...records.record import Record

# Share of the identified range by which rounding may take a sample beyond its ends.
_ROUNDING = 1e-9
_ALIKE = 0.15  # logarithm of the ratio of two amplitudes up to which they are alike
_FEW = 0.05  # share of cycles that hardly counts


def of_records(records: Iterable[Record]) -> Iterator[Finding]:
    """Records whose loops run backwards, as if the sign of a column were wrong, and clipped forces."""
    for record in records:
        if (kind := backwards(Strokes(record))) is not None:
            yield Finding(kind, {}, record.path)
        if clipped := int(np.count_nonzero(clipped_samples(record.force))):
            yield Finding(Outcome.CLIPPED_BESIDE, {"count": clipped, "samples": len(record)}, record.path)


def unrecorded(source: str, model: ModelFile, record: Record) -> Iterator[Finding]:
    """Loops of a record, or all of it without a full cycle, of no amplitude that the model was identified from."""
    known = np.array(sorted(stated_amplitudes(model)))
    loops = [(loop.figures.amplitude, loop.cycles) for loop in measured_loops([record])]
    amplitudes, cycles = np.array(loops or [(0.5 * float(np.ptp(record.displacement)), 1)]).T
    if not known.size or not amplitudes.all():
        return
    alike = np.abs(np.log(amplitudes[:, None] / known)).min(axis=1) <= _ALIKE
    if cycles[~alike].sum() > _FEW * cycles.sum():
        ends = (float(amplitudes[~alike].min()), float(amplitudes[~alike].max()))
        numbers = {"model": source, "known": tuple(known.tolist()), "recorded": (ends,)}
        yield Finding(Outcome.OTHER_AMPLITUDES, numbers, record.path)


def outside(source: str, displacement: FloatArray, p: SpringParameters) -> Iterator[Finding]:
    """Displacements [m] outside the identified range."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    share = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    if share > 0.0:
        numbers = {"share": float(share), "range": ((p.displacement_min, p.displacement_max),)}
        yield Finding(Outcome.OUTSIDE_RANGE, numbers, source)


def effects_of(model: ModelFile) -> str:
    """The effects of the rig that were removed from a model's records, in words; empty if none was."""
    return printable(", ".join(stated_effects(model)).replace("_", " "))


def removed_effects(source: str, model: ModelFile) -> Iterator[Finding]:
    """Effects of the rig that records beside a model may hold, which were removed from its own."""
    if effects := effects_of(model):
        yield Finding(Outcome.RIG_REMOVED, {"effects": effects}, source)
