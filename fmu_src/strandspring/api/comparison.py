"""`compare`: two springs against each other and against the uncertainty of both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import IsolationError, OptionError, StrandspringError
from ..findings import Finding, Outcome
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.options import takes
from ..ground.result_columns import ResultColumn
from ..ground.strict_json import objects
from ..identification.figures import RecordFit, predict_record
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import PANELS, Loop, relaxed_branches, steady_loop
from ..loops.reading import Reading
from ..model.coordinates import chosen_zero, counted_from
from ..model.modelfile import ModelFile
from ..model.stated_cautions import stated_cautions
from ..records.record import Record
from ..vibration.one_mass.band import DEFAULT_BAND
from ..vibration.one_mass.options import Excitation, Mount
from ..vibration.one_mass.response import Resonance, frequency_response
from ..vibration.one_mass.system import IsolatedMass, static_equilibrium
from .common.given import effects_of, of_records, outside, records_of
from .common.model_source import ModelSource, model_of, source_of
from .common.result import PlottedResult, Table
from .differences import (
    DIFFERENCES,
    FIGURES,
    SHARE,
    ComparisonVerdict,
    HysteresisTest,
    SpringDifference,
    common_form,
    differences,
    form_of,
    form_words,
)
from .options import Comparing

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Pair = tuple[SpringParameters, SpringParameters]

_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the shared half range
_SLACK = 1e-3  # share of half the range by which an amplitude may pass it: cycles differ by as much
_AS_WELL = 0.05  # records are followed equally well if the errors differ by less
_LEAST_SHARED = 0.5  # of the narrower range; with less, ranges are to be aligned
_SHIFTED = 0.02  # distance of the middles, share of the range, from which a moved zero is suspected
_COLORS = ("C0", "C3")
_FOLLOWED = (
    ResultColumn("path", "", "record", "record"),
    ResultColumn("better", "", "followed better by", "followed better by"),
    ResultColumn("a", "N", "rms error of A", "rmse of A", "N"),
    ResultColumn("b", "N", "rms error of B", "rmse of B", "N"),
)
# Of a mass on either spring.
_LEVEL = 0.01  # amplitude of the base, share of the lesser free travel
_POINTS = 200
_FREQUENCY = 10.0  # Hz, where no mass rests in the middle of the range by its weight
_LEAST_WEIGHT = 0.02  # static load that is a weight, share of the range of forces


@dataclass(frozen=True)
class SharedMass:
    """Resonances of a mass on A and on B; NaN and None are unknown."""

    mass: float = math.nan  # [kg]
    load: float = math.nan  # [N]
    level: float = math.nan  # amplitude of the base [m]
    a: Resonance | None = None
    b: Resonance | None = None
    refusal: str = ""  # why there are none

    def __str__(self) -> str:
        if self.a is None or self.b is None:
            return f"Transmissibility was not compared: {self.refusal}"
        return (
            f"A mass of {self.mass:.4g} kg under {self.load:.4g} N, base moved by {1e3 * self.level:.3g} mm: "
            f"transmissibility {self.a.transmissibility:.4g} at {self.a.frequency:.4g} Hz on A, "
            f"{self.b.transmissibility:.4g} at {self.b.frequency:.4g} Hz on B."
        )


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(PlottedResult):
    """Two springs against each other.

    Attributes
    ----------
    sources : (str, str)            Path of each model file, or the model's name.
    models : (ModelFile, ModelFile)   A and B.
    comparing : Comparing           How they were compared.
    low, high : float               The range that both share, counted as that says [m].
    verdict : ComparisonVerdict
    unknown : str                   Why nothing can be judged, in words; else empty.
    parameters : tuple of SpringDifference   Of the hysteresis; kappa_omega in the middle of the shared range.
    test : HysteresisTest or None   Of these together.
    figures : tuple of SpringDifference   Of steady loops about the middle of the shared range.
    bands : ndarray or None         5 % and 95 % of the figures of A and of B, shape (2, 2, amplitudes, 4):
                                    secant stiffness, energy, loss factor, mean force.
    loops : (Loop, Loop)            Steady loops over the shared range.
    mass : SharedMass               Transmissibility of a mass on either spring.
    records : tuple of Record
    followed : tuple of (RecordFit, RecordFit)   How well A and B follow each record.
    findings : tuple of Finding
    """

    _size, _grid = (10.0, 8.0), (2, 2)

    sources: tuple[str, str]
    models: tuple[ModelFile, ModelFile]
    comparing: Comparing
    low: float
    high: float
    verdict: ComparisonVerdict
    unknown: str
    parameters: tuple[SpringDifference, ...]
    test: HysteresisTest | None
    figures: tuple[SpringDifference, ...]
    bands: FloatArray | None
    loops: tuple[Loop, Loop]
    mass: SharedMass
    records: tuple[Record, ...]
    followed: tuple[tuple[RecordFit, RecordFit], ...]
    findings: tuple[Finding, ...]

    @property
    def loop_difference(self) -> tuple[float, float]:
        """rms difference of force along the loops [N], and its share of their height."""
        return _apart(*self.loops)

    @property
    def sentence(self) -> str:
        """The verdict in words, with the clearest difference of each figure."""
        verdict = self.verdict.value
        if self.verdict in (ComparisonVerdict.IDENTICAL, ComparisonVerdict.UNKNOWN):
            return " ".join(filter(None, (f"{verdict}.", self.unknown)))
        if self.verdict is ComparisonVerdict.NOT_FOUND:
            ends = [*{one.quantity: one for one in self.figures if one.differs is not None}.values()]
            seen = ", ".join(f"{one.size(one.seen_from)} in {one.words}" for one in ends)
            return f"{verdict}; differences at {_mm(ends[-1])} smaller than {seen} could not have been seen."
        changes = []
        for _, group in groupby((one for one in self.figures if one.differs), lambda one: one.quantity):
            one = max(group, key=lambda one: abs(one.z))
            side = "higher" if one.change > 0.0 else "lower"
            changes.append(f"{one.words} at {_mm(one)} is {one.size(abs(one.change))} {side} in B")
        if self.test is not None and self.test.differs:
            most = max(self.parameters, key=lambda one: abs(np.nan_to_num(one.z)))
            changes.append(f"the parameters differ together, {most.quantity} most clearly")
        return f"{verdict}: {'; '.join(changes)}."

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """The verdict, the differences, and who follows the records better."""
        for label, model, source in zip("AB", self.models, self.sources, strict=True):
            yield f"{label}: {model.name} ({source})"
        yield self.sentence
        shown, title = [*self.parameters, *self.figures], ""
        if brief:
            shown = [one for one in self.figures if one.amplitude == self.figures[-1].amplitude]
            title = f"Loops of +-{_mm(shown[-1])}:"
        else:
            centring = "" if self.comparing.align == "record" else ", each counted from the middle of its own range"
            drawn = f"; {self.comparing.draws} springs drawn of each, seed {self.comparing.seed}"
            over = f"{1e3 * self.low:.6g} to {1e3 * self.high:.6g} mm{centring}"
            yield f"Compared over the shared range {over}{'' if self.bands is None else drawn}."
        yield Table(DIFFERENCES, [vars(one) | one.shown for one in shown], title, details=("amplitude", "z"))
        if not brief:
            if test := self.test:
                beyond = " (beyond the uncertainty)" if test.differs else ""
                yield (
                    f"{', '.join(test.parameters)} together: chi-square {test.chi_square:.3g} at "
                    f"{test.degrees_of_freedom} degrees of freedom, p = {test.p:.2g}{beyond}."
                )
            rms, share = self.loop_difference
            yield (
                f"Along the loop over the shared range forces differ by {rms:.3g} N (rms), {SHARE.text(share)} % of "
                "its height."
            )
            yield str(self.mass)
        yield Table(_FOLLOWED, [
            {"path": a.path, "better": _better(a, b) or "both alike", "a": a.rmse, "b": b.rmse}
            for a, b in self.followed
        ])  # fmt: skip

    def to_frame(self) -> pd.DataFrame:
        """A parameter, or a figure of one amplitude, in each row: fields of `SpringDifference`."""
        return self.table.frame().astype({"differs": "boolean"})

    def content(self) -> dict[str, Any]:
        """All of it."""
        rms, share = self.loop_difference
        return {
            "a": {"model": self.sources[0], "name": self.models[0].name},
            "b": {"model": self.sources[1], "name": self.models[1].name},
            "verdict": self.verdict.name.lower(),
            "sentence": self.sentence,
            "align": self.comparing.align,
            "range": [self.low, self.high],
            "draws": 0 if self.bands is None else self.comparing.draws,
            "seed": self.comparing.seed,
            "parameters": self.parameters,
            "hysteresis_test": self.test,
            "figures": self.figures,
            "loop": {"rms_difference": rms, "share_of_height": share},
            "transmissibility": self.mass,
            "records": [
                {"path": a.path, "a": a.figures, "b": b.figures, "better": _better(a, b)} for a, b in self.followed
            ],
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw loops, and stiffness, energy and loss factor with their 5 to 95 % bands; returns the four axes."""
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

    Functions are compared, not coefficients: stiffness, energy and mean force of loops over the range that both share.
    All judgements together are made at the 5 % level: of 150 pairs of records of one spring, 5 were found to differ.

    Parameters
    ----------
    a, b : Spring, ModelFile or path   Model files, or FMUs that hold one.
    *data : Source, or arrays   Records that both should follow, or arrays of displacement, force and time.
    comparing : Comparing       Loops, mass and draws; or its fields as keywords.
    reading : Reading           How records are read and cut; or its fields as keywords.

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
    as_recorded = (models[0].parameters, models[1].parameters)
    middles = [chosen_zero("middle", p) for p in as_recorded]
    from_middles = (counted_from(middles[0], as_recorded[0]), counted_from(middles[1], as_recorded[1]))
    springs = as_recorded if comparing.align == "record" else from_middles
    low, high = _shared_range(springs)
    narrower = min(p.displacement_max - p.displacement_min for p in springs)
    if comparing.align == "record" and high - low < _LEAST_SHARED * narrower:
        raise StrandspringError(
            "A was identified from {a:.6g mm} and B from {b:.6g mm}, which share less than half of the narrower "
            "range; if the zero was moved between the tests, align their middles ({to[align=middle]}), else identify "
            "both over one range.",
            a=[(springs[0].displacement_min, springs[0].displacement_max)],
            b=[(springs[1].displacement_min, springs[1].displacement_max)],
        )
    half = 0.5 * (high - low)
    given = comparing.amplitudes
    reaches = [share * half for share in _SHARES] if given is None else sorted(given)  # type: ignore[arg-type]
    if reaches[-1] > half * (1.0 + _SLACK):
        raise OptionError(
            f"An amplitude must be > 0 and at most {1e3 * half:.6g} mm, half of the shared range, got "
            f"{1e3 * reaches[-1]:.6g} mm."
        )
    records = records_of(data, reading)
    found = differences(models, springs, 0.5 * (low + high), reaches, comparing)
    loops, (of_a, of_b) = _loops(springs), map(PathSolver, as_recorded)
    followed = tuple((predict_record(of_a, record), predict_record(of_b, record)) for record in records)
    findings = [*of_records(records), *_of_models(models, records)]
    if found["verdict"] in (ComparisonVerdict.DIFFERENT, ComparisonVerdict.NOT_FOUND):
        findings.append(Finding(Outcome.SCATTER))
    distance = middles[1] - middles[0]
    if comparing.align == "record" and abs(distance) > _SHIFTED * np.ptp(_shared_range(from_middles)):
        shares = {"apart": _apart(*loops)[1], "aligned": _apart(*_loops(from_middles))[1]}
        findings.append(Finding(Outcome.ZERO_MOVED, {"distance": distance, **shares}))
    return Comparison(
        **found,
        sources=(source_of(a), source_of(b)),
        models=models,
        comparing=comparing,
        low=low,
        high=high,
        loops=loops,
        mass=_shared_mass(springs, comparing.mass),
        records=tuple(records),
        followed=followed,
        findings=tuple(findings),
    )


def _mm(one: SpringDifference) -> str:
    return f"{1e3 * (one.amplitude or 0.0):.4g} mm"


def _better(a: RecordFit, b: RecordFit) -> str | None:
    """Which spring follows a record better, by errors that differ by more than 5 %."""
    least = 1.0 - _AS_WELL
    return "A" if a.rmse < least * b.rmse else "B" if b.rmse < least * a.rmse else None


def _shared_range(springs: Pair) -> tuple[float, float]:
    """The displacements [m] that both springs were identified for."""
    return max(p.displacement_min for p in springs), min(p.displacement_max for p in springs)


def _loops(springs: Pair) -> tuple[Loop, Loop]:
    """Steady loops over the shared range."""
    a, b = (steady_loop(PathSolver(p), *_shared_range(springs)) for p in springs)
    return a, b


def _apart(a: Loop, b: Loop) -> tuple[float, float]:
    """rms difference of force between two loops [N], and its share of their mean height."""
    forces = [np.concatenate([loop.loading.force, loop.unloading.force]) for loop in (a, b)]
    rms = float(np.sqrt(np.mean((forces[1] - forces[0]) ** 2)))
    return rms, rms / max(0.5 * (a.figures.height + b.figures.height), 1e-300)


def _of_models(models: tuple[ModelFile, ModelFile], records: Sequence[Record]) -> Iterator[Finding]:
    """What could make the result wrong."""
    a, b = (model.parameters for model in models)
    for label, model in zip("AB", models, strict=True):
        for record in records:
            yield from outside(f"Model {label}, {record.path}", record.displacement, model.parameters)
        yield from stated_cautions(model, f"Of the identification of {label}")
    yield from relaxed_branches(a) or relaxed_branches(b)
    of_a, of_b = (effects_of(model) or "nothing" for model in models)
    if of_a != of_b:
        yield Finding(Outcome.RIGS_DIFFER, {"of_a": of_a, "of_b": of_b})
    files = [[entry.get("sha256") for entry in objects(model.provenance.get("records"))] for model in models]
    if {*map(str, filter(None, files[0]))} & {*map(str, filter(None, files[1]))}:
        yield Finding(Outcome.SAME_RECORD)
    forms = form_of(a), form_of(b)
    if forms[0] != forms[1] and a.is_plain and b.is_plain:
        named = map(form_words, (*forms, common_form(a, b)))
        yield Finding(Outcome.FORMS_DIFFER, dict(zip(("of_a", "of_b", "common"), named, strict=True)))


def _shared_mass(springs: Pair, mass: float | None) -> SharedMass:
    """The transmissibility of a mass [kg] whose weight loads the springs, or why there is none.

    None is one that A holds in the middle of the shared range, or where it carries none, one for 10 Hz.
    """
    low, high = _shared_range(springs)
    try:
        load = (mass or 0.0) * STANDARD_GRAVITY
        if mass is None:
            forces, stiffnesses = PathSolver(springs[0]).small_motion(np.linspace(low, high, 101))
            load, stiffness = float(forces[50]), abs(float(stiffnesses[50]))
            is_weight = load > _LEAST_WEIGHT * float(np.ptp(forces))
            mass = load / STANDARD_GRAVITY if is_weight else stiffness / (2.0 * math.pi * _FREQUENCY) ** 2
        systems = [IsolatedMass(spring, mass, Mount(load)) for spring in springs]
        rest = [static_equilibrium(system) for system in systems]
        places = [equilibrium.displacement for equilibrium in rest]
        level = _LEVEL * min(min(places) - low, high - max(places))
        if not level > 0.0:
            at = " and ".join(f"{1e3 * place:.4g} mm on {name}" for name, place in zip("AB", places, strict=True))
            raise IsolationError(f"{mass:.4g} kg rest at {at}, outside the shared range; use another mass.")
        lowest, highest = sorted(equilibrium.frequency for equilibrium in rest)
        band = np.geomspace(DEFAULT_BAND[0] * lowest, DEFAULT_BAND[1] * highest, _POINTS)
        a, b = (frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band).resonance for system in systems)
    except IsolationError as refusal:
        return SharedMass(refusal=str(refusal))
    return SharedMass(mass, load, level, a, b)
