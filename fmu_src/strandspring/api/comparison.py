"""`compare`: two springs against each other and against the uncertainty of both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import OptionError, StrandspringError
from ..findings import Finding, Outcome
from ..ground.options import takes
from ..ground.result_columns import ResultColumn
from ..ground.strict_json import objects
from ..identification.figures import RecordFit, predict_record
from ..kernel.path import PathSolver
from ..loops.loop import PANELS, Loop, relaxed_branches, steady_loop
from ..loops.reading import Reading
from ..model.coordinates import counted_from
from ..model.modelfile import ModelFile
from ..model.stated_cautions import stated_cautions
from ..records.record import Record
from .common.given import effects_of, of_records, outside, records_of
from .common.model_source import ModelSource, model_of, source_of
from .common.result import PlottedResult
from .common.table import Table
from .differences import (
    FIGURES,
    ComparisonVerdict,
    Differences,
    SpringDifference,
    common_form,
    differences,
    form_of,
    form_words,
)
from .options import Align, Comparing
from .vibration.isolation import SharedMass, shared_mass

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the shared half range
_SLACK = 1e-3  # share of the shared range by which an amplitude may pass it, as cycles differ by as much
_AS_WELL = 0.05  # records are followed equally well if the errors differ by less
_LEAST_SHARED = 0.5  # of the narrower range, below which ranges are not compared where they lie
_SHIFTED = 0.02  # distance of the middles, share of the shared range, from which a moved zero is mentioned
_COLORS = ("C0", "C3")
_DIFFERENCES = (
    ResultColumn("quantity", "", "quantity"),
    ResultColumn("words", "", "", "quantity"),
    ResultColumn("unit", "", "unit", "unit"),
    ResultColumn("amplitude", "m", "amplitude", "at", "mm", 1e3),
    ResultColumn("a", "", "A", "A"),
    ResultColumn("b", "", "B", "B"),
    ResultColumn("relative", "", "changes are shares of A"),
    ResultColumn("change", "", "change"),
    ResultColumn("low", "", "5 % of the change"),
    ResultColumn("high", "", "95 % of the change"),
    ResultColumn("shown_change", "1", "", "B - A"),
    ResultColumn("shown_ends", "1", "", "5 to 95 %"),
    ResultColumn("z", "1", "z", "z", digits=3),
    ResultColumn("p", "1", "p"),
    ResultColumn("seen_from", "", "change that could have been seen"),
    ResultColumn("differs", "", "beyond the uncertainty"),
    ResultColumn("judged", "", "", "differs"),
    ResultColumn("reason", "", "why z is unknown"),
)
_FOLLOWED = (
    ResultColumn("path", "", "record", "record"),
    ResultColumn("better", "", "followed better by", "followed better by"),
    ResultColumn("a", "N", "rms error of A", "rmse of A", "N"),
    ResultColumn("b", "N", "rms error of B", "rmse of B", "N"),
)
_IN_WORDS = {True: "yes", False: "no", None: None}
_SHARE, _FORCE = ResultColumn("share", "1", "", "", "%", 100.0, 2), ResultColumn("force", "N", "", "", "N", digits=2)


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Differences, PlottedResult):
    """Two springs against each other.

    Attributes
    ----------
    sources : (str, str)                   Path of each model file, or the model's name.
    models : (ModelFile, ModelFile)        A and B.
    align : "record" or "middle"           Where both count displacement from: as their records do, or each from the
                                           middle of its own range.
    low, high : float                      The range that both share, so counted [m].
    verdict : ComparisonVerdict
    unknown : str                          Why nothing can be judged, in words; else empty.
    draws, seed : int                      Springs drawn of each model, and the seed.
    parameters : tuple of SpringDifference   Of kappa_omega in the middle of the shared range, rho, sigma and n, and of
                                           those of a second mechanism and branches if both springs have as many.
    test : HysteresisTest or None          Of these together.
    figures : tuple of SpringDifference    Of steady loops about the middle of the shared range.
    bands : ndarray or None                5 % and 95 % of the figures of A and of B, shape (2, 2, amplitudes, 4):
                                           secant stiffness, energy, loss factor, mean force.
    loops : (Loop, Loop)                   Steady loops over the shared range.
    mass : SharedMass                      Transmissibility of a mass on either spring.
    records : tuple of Record
    followed : tuple of (RecordFit, RecordFit)   How well A and B follow each record.
    findings : tuple of Finding
    """

    _size, _grid = (10.0, 8.0), (2, 2)

    sources: tuple[str, str]
    models: tuple[ModelFile, ModelFile]
    align: Align
    low: float
    high: float
    draws: int
    seed: int
    loops: tuple[Loop, Loop]
    mass: SharedMass
    records: tuple[Record, ...]
    followed: tuple[tuple[RecordFit, RecordFit], ...]
    findings: tuple[Finding, ...]

    @property
    def loop_difference(self) -> tuple[float, float]:
        """rms difference of force along the loop over the shared range [N], and its share of the loop's height."""
        return _apart(*self.loops)

    @property
    def sentence(self) -> str:
        """The verdict in words, with the clearest difference of each figure that is judged."""
        verdict = self.verdict.value
        groups = [[one for one in self.figures if one.quantity == name and one.differs is not None] for name in FIGURES]
        if self.verdict in (ComparisonVerdict.IDENTICAL, ComparisonVerdict.UNKNOWN):
            return f"{verdict}. {self.unknown}".rstrip()
        if self.verdict is ComparisonVerdict.NOT_FOUND:
            ends = [group[-1] for group in groups if group]
            seen = ", ".join(f"{_size(one, one.seen_from)} in {one.words}" for one in ends)
            return f"{verdict}; differences at {_mm(ends[-1])} smaller than {seen} could not have been seen."
        beyond = [[one for one in group if one.differs] for group in groups]
        changes = [_in_words(max(group, key=lambda one: abs(one.z))) for group in beyond if group]
        if self.test is not None and self.test.differs:
            most = max(self.parameters, key=lambda one: abs(np.nan_to_num(one.z)))
            changes.append(f"the parameters differ together, {most.quantity} most clearly")
        return f"{verdict}: {'; '.join(changes)}."

    @property
    def table(self) -> Table:
        """A parameter, or a figure of one amplitude, in each row: fields of `SpringDifference`."""
        return _table((*self.parameters, *self.figures))

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """The verdict, the differences (if brief at the largest amplitude), and who follows the records better."""
        for label, model, source in zip("AB", self.models, self.sources, strict=True):
            yield f"{label}: {model.name} ({source})"
        yield self.sentence
        if brief:
            largest = max(one.amplitude or 0.0 for one in self.figures)
            yield _table(
                [one for one in self.figures if one.amplitude == largest], f"Loops of +-{1e3 * largest:.4g} mm:"
            )
        else:
            centring = "" if self.align == "record" else ", each counted from the middle of its own range"
            drawn = "" if self.bands is None else f"; {self.draws} springs drawn of each, seed {self.seed}"
            yield f"Compared over the shared range {1e3 * self.low:.6g} to {1e3 * self.high:.6g} mm{centring}{drawn}."
            yield self.table
            if test := self.test:
                beyond = " (beyond the uncertainty)" if test.differs else ""
                yield (
                    f"{', '.join(test.parameters)} together: chi-square {test.chi_square:.3g} at "
                    f"{test.degrees_of_freedom} degrees of freedom, p = {test.p:.2g}{beyond}."
                )
            rms, share = self.loop_difference
            yield (
                f"Along the loop over the shared range the forces differ by {rms:.3g} N (rms), {_SHARE.text(share)} % "
                "of the loop's height."
            )
            yield from self.mass.lines()
        yield Table(_FOLLOWED, [
            {**row, "better": row["better"] or "both alike", **{side: row[side]["rmse"] for side in "ab"}}
            for row in self._followed
        ])  # fmt: skip

    @property
    def _followed(self) -> list[dict[str, Any]]:
        """Figures along each record, and which spring follows it better, by errors that differ by more than 5 %."""
        least = 1.0 - _AS_WELL
        return [
            {
                "path": a.path,
                "a": a.figures,
                "b": b.figures,
                "better": "A" if a.rmse < least * b.rmse else "B" if b.rmse < least * a.rmse else None,
            }
            for a, b in self.followed
        ]

    def to_frame(self) -> pd.DataFrame:
        """A parameter, or a figure of one amplitude, in each row, in SI units: fields of `SpringDifference`."""
        return self.table.frame().astype({"differs": "boolean"})

    def content(self) -> dict[str, Any]:
        """All of it."""
        rms, share = self.loop_difference
        a, b = ({"model": source, "name": model.name} for source, model in zip(self.sources, self.models, strict=True))
        return {
            "a": a,
            "b": b,
            "verdict": self.verdict.name.lower(),
            "sentence": self.sentence,
            "align": self.align,
            "range": [self.low, self.high],
            "draws": 0 if self.bands is None else self.draws,
            "seed": self.seed,
            "parameters": self.parameters,
            "hysteresis_test": self.test,
            "figures": self.figures,
            "loop": {"rms_difference": rms, "share_of_height": share},
            "transmissibility": self.mass.as_json(),
            "records": self._followed,
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw loops, and secant stiffness, energy and loss factor over the amplitude with their 5 to 95 % bands;
        returns the four axes, those of a new figure if None.
        """
        loops, *others = panels = self._axes(ax)
        for label, color, loop in zip("AB", _COLORS, self.loops, strict=True):
            for branch, name in ((loop.loading, label), (loop.unloading, None)):
                loops.plot(1e3 * branch.displacement, branch.force, color, label=name)
        loops.set(xlabel="displacement [mm]", ylabel="force [N]", title="steady loops over the shared range")
        loops.legend()
        for axis, column in zip(others, PANELS, strict=True):
            rows = [one for one in self.figures if one.quantity == column.key]
            amplitudes = [1e3 * (one.amplitude or 0.0) for one in rows]
            for k, (side, color) in enumerate(zip("ab", _COLORS, strict=True)):
                axis.plot(amplitudes, [column.factor * getattr(one, side) for one in rows], f"{color}o-", ms=4)
                if self.bands is not None:
                    low, high = column.factor * self.bands[k, :, :, [*FIGURES].index(column.key)]
                    axis.fill_between(amplitudes, low, high, color=color, alpha=0.2, lw=0.0)
            axis.set(xlabel="amplitude [mm]", ylabel=column.label)
        return panels


@takes(comparing=Comparing, reading=Reading)
def compare(
    a: ModelSource,
    b: ModelSource,
    *data: Any,
    comparing: Comparing,
    reading: Reading,
) -> Comparison:
    """Compare two springs, such as two lots, or one spring before and after fatigue.

    Functions are compared, not coefficients: stiffness, energy and mean force of loops over the range that both share,
    also of a table against a polynomial. All judgements together are made at the 5 % level, as far as the uncertainty
    of the model files holds: of 150 pairs of records of one spring, 5 were found to differ.

    Parameters
    ----------
    a, b : Spring, ModelFile or path   Model files, or FMUs that hold one.
    *data : Source, or arrays          Records that both should follow; or arrays of displacement and force, and time.
    comparing : Comparing              Loops, mass and draws; or its fields as keywords.
    reading : Reading                   How records are read, and what of them is used; or its fields as keywords.

    Returns
    -------
    Comparison

    Raises
    ------
    ModelError          If a model is not a physically possible spring.
    RecordError         If the data are no records.
    StrandspringError   If the springs share too little of their ranges.
    ValueError          If a number is not possible.

    Examples
    --------
    >>> from strandspring import compare, identify, Spring, SpringParameters, synthesize
    >>> new = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> worn = Spring(SpringParameters((0.0, 2000.0), (1.0,), 9.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> tests = [synthesize(new, noise=0.01, seed=1), synthesize(worn, noise=0.01, seed=2)]
    >>> before, after = (identify(test).spring() for test in tests)
    >>> comparison = compare(before, after)
    >>> comparison.verdict.name
    'DIFFERENT'
    >>> frame = comparison.to_frame()
    >>> frame[(frame["quantity"] == "energy_per_cycle") & frame["differs"]]["change"].round(2).tolist()
    [-0.1, -0.1, -0.1, -0.1]
    """
    models = (model_of(a), model_of(b))
    springs = _aligned(models, comparing.align)
    low, high = _shared_range(springs, comparing.align)
    half = 0.5 * (high - low)
    given = comparing.amplitudes
    reaches = [share * half for share in _SHARES] if given is None else sorted(given)  # type: ignore[arg-type]
    if reaches[-1] > half * (1.0 + _SLACK):
        raise OptionError(
            f"An amplitude must be > 0 and at most {1e3 * half:.6g} mm, half of the range that both springs share, got "
            f"{1e3 * reaches[-1]:.6g} mm."
        )
    records = records_of(data, reading)
    found = differences(models, springs, 0.5 * (low + high), reaches, comparing.draws, comparing.seed)
    loops = (steady_loop(PathSolver(springs[0]).slow, low, high), steady_loop(PathSolver(springs[1]).slow, low, high))
    solvers = [PathSolver(model.parameters) for model in models]  # each in the coordinates of its own records
    followed = tuple((predict_record(solvers[0], record), predict_record(solvers[1], record)) for record in records)
    findings = [*_of_models(models, records, found.verdict)]
    if comparing.align != "middle":
        findings += _moved_zero(models, loops)
    return Comparison(
        **vars(found), sources=(source_of(a), source_of(b)), models=models, align=comparing.align, low=low, high=high,
        draws=comparing.draws, seed=comparing.seed, loops=loops, mass=shared_mass(springs, low, high, comparing.mass),
        records=tuple(records), followed=followed, findings=tuple(findings),
    )  # fmt: skip


def _table(rows: Sequence[SpringDifference], title: str = "") -> Table:
    """Differences, whose changes are a share or a force."""
    return Table(_DIFFERENCES, [
        {
            **vars(one),
            "shown_change": "-" if math.isnan(one.change) else _size(one, one.change),
            "shown_ends": "-" if math.isnan(one.low) else _size(one, one.low, one.high),
            "judged": _IN_WORDS[one.differs],
        }
        for one in rows
    ], title, details=("amplitude", "z"))  # fmt: skip


def _size(difference: SpringDifference, *values: float) -> str:
    """A change, or its ends, in percent or with its unit."""
    column = _SHARE if difference.relative else _FORCE
    return f"{' to '.join(map(column.text, values))} {column.shown}"


def _in_words(difference: SpringDifference) -> str:
    """Such as: energy per cycle at 20 mm is 12 % lower in B."""
    side = "higher" if difference.change > 0.0 else "lower"
    return f"{difference.words} at {_mm(difference)} is {_size(difference, abs(difference.change))} {side} in B"


def _mm(difference: SpringDifference) -> str:
    return f"{1e3 * (difference.amplitude or 0.0):.4g} mm"


def _middle_of(p: SpringParameters) -> float:
    return 0.5 * (p.displacement_min + p.displacement_max)


def _aligned(models: tuple[ModelFile, ModelFile], align: Align) -> tuple[SpringParameters, SpringParameters]:
    """Both springs with their displacements counted as asked."""
    a, b = (model.parameters for model in models)
    return (a, b) if align == "record" else (counted_from(_middle_of(a), a), counted_from(_middle_of(b), b))


def _shared_range(springs: Sequence[SpringParameters], align: Align) -> tuple[float, float]:
    """The displacements [m] that both springs were identified for; raises StrandspringError if they are too few."""
    low = max(p.displacement_min for p in springs)
    high = min(p.displacement_max for p in springs)
    narrower = min(p.displacement_max - p.displacement_min for p in springs)
    if align == "record" and high - low < _LEAST_SHARED * narrower:
        of_a, of_b = (f"{1e3 * p.displacement_min:.6g} to {1e3 * p.displacement_max:.6g} mm" for p in springs)
        raise StrandspringError(
            "A was identified from {of_a} and B from {of_b}, which share less than half of the narrower range; if the "
            "zero of displacement was moved between the tests, align them by their middles ({to[align=middle]}), else "
            "identify both over one range.",
            of_a=of_a,
            of_b=of_b,
        )
    return low, high


def _apart(a: Loop, b: Loop) -> tuple[float, float]:
    """rms difference of force between two loops of one range [N], and its share of their mean height."""
    forces = [np.concatenate([loop.loading.force, loop.unloading.force]) for loop in (a, b)]
    rms = float(np.sqrt(np.mean((forces[1] - forces[0]) ** 2)))
    return rms, rms / max(0.5 * (a.figures.height + b.figures.height), 1e-300)


def _of_models(
    models: tuple[ModelFile, ModelFile], records: Sequence[Record], verdict: ComparisonVerdict
) -> Iterator[Finding]:
    """What could make the result wrong, different forms, and what the uncertainty does not hold."""
    yield from of_records(records)
    for label, model in zip("AB", models, strict=True):
        for record in records:
            yield from outside(f"Model {label}, {record.path}", record.displacement, model.parameters)
        yield from stated_cautions(model, f"Of the identification of {label}")
    yield from relaxed_branches(models[0].parameters) or relaxed_branches(models[1].parameters)
    effects = {key: effects_of(model) or "nothing" for key, model in zip(("of_a", "of_b"), models, strict=True)}
    if len({*effects.values()}) > 1:
        yield Finding(Outcome.RIGS_DIFFER, effects)
    of_a, of_b = (
        {str(entry["sha256"]) for entry in objects(model.provenance.get("records")) if entry.get("sha256")}
        for model in models
    )
    if of_a & of_b:
        yield Finding(Outcome.SAME_RECORD)
    a, b = (model.parameters for model in models)
    if form_of(a) != form_of(b) and a.is_plain and b.is_plain:
        named = zip(
            ("of_a", "of_b", "common"), map(form_words, (form_of(a), form_of(b), common_form(a, b))), strict=True
        )
        yield Finding(Outcome.FORMS_DIFFER, dict(named))
    if verdict in (ComparisonVerdict.DIFFERENT, ComparisonVerdict.NOT_FOUND):
        yield Finding(Outcome.SCATTER)


def _moved_zero(models: tuple[ModelFile, ModelFile], loops: tuple[Loop, Loop]) -> Iterator[Finding]:
    """Ranges whose middles are not the same."""
    moved = _aligned(models, "middle")
    low, high = _shared_range(moved, "middle")
    distance = _middle_of(models[1].parameters) - _middle_of(models[0].parameters)
    if abs(distance) > _SHIFTED * (high - low):
        _, from_middles = _apart(*(steady_loop(PathSolver(p).slow, low, high) for p in moved))
        yield Finding(Outcome.ZERO_MOVED, {"distance": distance, "apart": _apart(*loops)[1], "aligned": from_middles})
