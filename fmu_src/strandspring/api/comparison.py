"""`compare`: two springs against each other and against the uncertainty of both.

Figures of steady loops are judged by draws from the joint covariance of each model: z is the difference over its
standard deviation. The hysteresis parameters are judged together: d'*C^-1*d, with the differences d of their logarithms
and the sum C of their covariances, is chi-square distributed for one spring identified twice. kappa_omega counts as
kappa_omega*FA at one displacement, because two models place their offsets differently.

Where the forms of the models differ, only what remains in a common form counts, with the same degrees of FE and FA:
these are chosen from noisy records, and another choice shifts figures by more than their uncertainty. A model is put
into a simpler form by identifying the record that it gives. Of wider classes nothing is judged.

All judgements together have an error of 5 %, by Holm's procedure, whatever their dependence.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import IsolationError, ModelError, OptionError, Reader, StrandspringError, worded
from ..findings import Finding, Outcome
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.options import takes
from ..ground.result_columns import ResultColumn, columns_of, figure
from ..ground.strict_json import objects
from ..identification.figures import RecordFit, predict_record
from ..identification.identify import identify_records
from ..identification.options import RefinedOptions
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import LOOP_FIGURE, PANELS, Loop, relaxed_branches, steady_loop
from ..loops.reading import Reading
from ..model.coordinates import chosen_zero, counted_from
from ..model.joint import HYSTERETIC_PARAMETERS, JointCovariance, further_columns
from ..model.modelfile import ModelFile
from ..model.stated_cautions import stated_cautions
from ..records.record import Record
from ..vibration.one_mass.band import DEFAULT_BAND
from ..vibration.one_mass.options import Excitation, Mount
from ..vibration.one_mass.response import frequency_response
from ..vibration.one_mass.system import IsolatedMass, static_equilibrium
from .common.given import effects_of, of_records, outside, records_of
from .common.model_source import ModelSource, model_of, source_of
from .common.result import PlottedResult, Table
from .common.text import parameter_table, part_with
from .options import Comparing
from .records import synthesize

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Springs = Sequence[SpringParameters]  # A and B

LEVEL = 0.05  # error of all judgements together
# Figures of loops, and whether a difference is judged; the loss factor follows from the two before.
FIGURES = {"secant_stiffness": True, "energy_per_cycle": True, "loss_factor": False, "mean_force": True}
_ENDS, _NORMAL_90 = (0.05, 0.95), NormalDist().inv_cdf(0.95)
# On standard deviations: what the choice of degrees and starts adds. Without it z of pairs of records of one spring
# passed 1.96 in 9 of 100 cases.
_OF_CHOICE = 1.15
_MOST_LOG = 700.0  # whose exponential is still a number
_OF_TABLES = 5  # degree of FE where it is a table in both
_RANK = 1e-9  # eigenvalue of the correlation of the logarithms up to which it counts as 0
SHARE = ResultColumn("share", "1", "", "", "%", 100.0, 2)
_FORCE = ResultColumn("force", "N", "", "", "N", digits=2)
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
_ON_EITHER = (
    "A mass of {mass:.4g} kg under {load:.4g} N, base moved by {level:.3g mm}: transmissibility "
    "{a.transmissibility:.4g} at {a.frequency:.4g} Hz on A, {b.transmissibility:.4g} at {b.frequency:.4g} Hz on B."
)
_ON_NEITHER = "Transmissibility was not compared: {refusal}"


class ComparisonVerdict(Enum):
    """Whether two springs differ; the value begins the sentence for the user."""

    DIFFERENT = "The springs differ beyond their uncertainty"
    NOT_FOUND = "No difference beyond the uncertainty was found"
    UNKNOWN = "Whether the springs differ beyond their uncertainty cannot be said"
    IDENTICAL = "Both models are the same spring: all their parameters are equal"


@dataclass(frozen=True)
class SpringDifference:
    """Of one quantity of two springs, in SI units; NaN stands for what is unknown."""

    quantity: str = figure("", "quantity")
    unit: str = figure("", "unit", "unit")
    words: str = figure("", "quantity in words")
    amplitude: float | None = figure("m", "amplitude", "at", "mm", 1e3)  # of the loop; None for a parameter
    relative: bool = figure("", "changes are shares of A")  # rather than differences
    reason: str = figure("", "why z is unknown")
    differs: bool | None = figure("", "beyond the uncertainty")  # None of what is not judged
    a: float = figure("", "A", "A")
    b: float = figure("", "B", "B")
    change: float = figure("", "change")  # from A to B
    low: float = figure("", "5 % of the change")
    high: float = figure("", "95 % of the change")
    z: float = figure("1", "z")  # change over its standard deviation
    # That would be judged beyond the uncertainty in 95 of 100 cases.
    seen_from: float = figure("", "change that could have been seen")
    p: float = figure("1", "p")  # probability of a z as far from 0 for one spring

    def size(self, *values: float) -> str:
        """A change, or its ends, in percent or with its unit."""
        column = SHARE if self.relative else _FORCE
        return "-" if math.isnan(values[0]) else f"{' to '.join(map(column.text, values))} {column.shown}"

    @property
    def shown(self) -> dict[str, Any]:
        """What a table for people has besides."""
        judged = {True: "yes", False: "no", None: None}[self.differs]
        ends = self.size(self.low, self.high)
        return {"shown": self.size(self.change), "ends": ends, "judged": judged}


DIFFERENCES = (
    ResultColumn("words", "", "", "quantity"),
    *columns_of(SpringDifference),
    ResultColumn("shown", "1", "", "B - A"),
    ResultColumn("ends", "1", "", "5 to 95 %"),
    ResultColumn("z", "1", "", "z", digits=3),
    ResultColumn("judged", "", "", "differs"),
)


@dataclass(frozen=True)
class HysteresisTest:
    """Joint test of kappa_omega, rho, sigma and n, and of those that wider classes have."""

    parameters: tuple[str, ...]  # that could be tested
    chi_square: float
    degrees_of_freedom: int
    p: float  # probability of as large a chi-square for one spring
    differs: bool | None = None  # beyond the uncertainty; None if no springs were drawn


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
    mass : mapping                  `mass` [kg], `load` [N], `level` of the base [m], and the `Resonance` on `a` and on
                                    `b`; None where a `refusal` says why.
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
    mass: Mapping[str, Any]
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
            yield worded(_ON_NEITHER if self.mass["refusal"] else _ON_EITHER, self.mass, Reader.PYTHON)
        yield Table(_FOLLOWED, [
            {"path": a.path, "better": _better(a, b) or "both alike", "a": a.rmse, "b": b.rmse}
            for a, b in self.followed
        ])  # fmt: skip

    def to_frame(self) -> pd.DataFrame:
        """A parameter, or a figure of one amplitude, in each row: fields of `SpringDifference`."""
        return self.table.frame().astype({"differs": "boolean"})

    def content(self) -> dict[str, Any]:
        """All of it."""
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
            "loop": dict(zip(("rms_difference", "share_of_height"), self.loop_difference, strict=True)),
            "transmissibility": self.mass,
            "records": [
                {"path": a.path, "a": a.figures, "b": b.figures, "better": _better(a, b)} for a, b in self.followed
            ],
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw loops, and stiffness, energy and loss factor with their 5 to 95 % bands; returns the four axes."""
        loops, *others = panels = self._axes(ax)
        frame = self.to_frame()
        for k, (side, color, loop) in enumerate(zip("ab", _COLORS, self.loops, strict=True)):
            for branch, label in ((loop.loading, side.upper()), (loop.unloading, None)):
                loops.plot(1e3 * branch.displacement, branch.force, color, label=label)
            for axis, column in zip(others, PANELS, strict=True):
                rows = frame[frame["quantity"] == column.key]
                amplitudes = 1e3 * rows["amplitude"]
                axis.plot(amplitudes, column.factor * rows[side], f"{color}o-", ms=4)
                if self.bands is not None:
                    low, high = column.factor * self.bands[k, :, :, [*FIGURES].index(column.key)]
                    axis.fill_between(amplitudes, low, high, color=color, alpha=0.2, lw=0.0)
                axis.set(xlabel="amplitude [mm]", ylabel=column.label)
        loops.set(xlabel="displacement [mm]", ylabel="force [N]", title="steady loops over the shared range")
        loops.legend()
        return panels


@takes(comparing=Comparing, reading=Reading)
def compare(a: ModelSource, b: ModelSource, *data: Any, comparing: Comparing, reading: Reading) -> Comparison:
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
    as_recorded = [model.parameters for model in models]
    middles = [chosen_zero("middle", p) for p in as_recorded]
    from_middles = [*map(counted_from, middles, as_recorded)]
    springs = as_recorded if comparing.align == "record" else from_middles
    low, high = _shared_range(springs)
    narrower = min(p.displacement_max - p.displacement_min for p in springs)
    if comparing.align == "record" and high - low < _LEAST_SHARED * narrower:
        raise StrandspringError(
            "A was identified from {a:.6g mm} and B from {b:.6g mm}, which share less than half of the narrower "
            "range; if the zero was moved between the tests, align their middles ({to[align=middle]}), else identify "
            "both over one range.",
            **{name: [(p.displacement_min, p.displacement_max)] for name, p in zip("ab", springs, strict=True)},
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
    found = _judged(models, springs, 0.5 * (low + high), reaches, comparing)
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
        loops=(loops[0], loops[1]),
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


def _shared_range(springs: Springs) -> tuple[float, float]:
    """The displacements [m] that both springs were identified for."""
    return max(p.displacement_min for p in springs), min(p.displacement_max for p in springs)


def _loops(springs: Springs) -> list[Loop]:
    """Steady loops over the shared range."""
    return [steady_loop(PathSolver(p), *_shared_range(springs)) for p in springs]


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
    if a.is_plain and b.is_plain:
        of_a, of_b, common = (form_words(*form) for form in forms_of((a, b)))
        if of_a != of_b:
            yield Finding(Outcome.FORMS_DIFFER, {"of_a": of_a, "of_b": of_b, "common": common})


def _shared_mass(springs: Springs, mass: float | None) -> dict[str, Any]:
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
        return dict.fromkeys(("mass", "load", "level", "a", "b")) | {"refusal": str(refusal)}
    return {"mass": mass, "load": load, "level": level, "a": a, "b": b, "refusal": ""}


def _judged(
    models: Sequence[ModelFile], springs: Springs, middle: float, amplitudes: Sequence[float], comparing: Comparing
) -> dict[str, Any]:
    """Fields of `Comparison`: verdict and differences of two models, as springs that are counted from one zero, with
    loops of amplitudes [m] about the middle [m].
    """
    scatter = np.full((2, 1, len(amplitudes), len(FIGURES)), np.nan)  # of figures of A and of B
    plain, spreads, draws = springs, list[JointCovariance](), comparing.draws
    unknown, is_same = [] if draws else ["No springs were drawn."], models[0].parameters == models[1].parameters
    for label, model in zip("AB" if draws else "", models, strict=False):
        try:
            spreads.append(JointCovariance.to_draw_from(model.parameters, model.uncertainty))
        except ModelError as problem:
            unknown.append(f"{label}: {problem}")
    if unknown:
        spreads = []
    elif not is_same:
        try:
            in_one_form = [*_in_common_form(springs)]
            # Other numbers of draws in B, or the errors of both models would be drawn alike.
            scatter = np.array([
                [loop_figures(spread.draw(p, comparing.seed, first + k), middle, amplitudes) for k in range(draws)]
                for p, spread, first in zip(springs, spreads, (0, draws), strict=True)
            ])  # fmt: skip
            plain, unknown = in_one_form, ["The springs drawn from the uncertainty are all alike; identify both again."]
        except StrandspringError as problem:
            unknown = [str(problem)]
    parameters, covariance, reasons = _known_parameters(models, springs, spreads, middle)
    # Parameters, by their logarithms, and behind them each figure at all amplitudes.
    columns = [*parameters, *(LOOP_FIGURE[name] for name in FIGURES for _ in amplitudes)]
    n, is_tested = len(parameters), np.array([not reason for reason in reasons])
    of = [np.append(_values(p, parameters, middle), loop_figures(p, middle, amplitudes).T) for p in (*springs, *plain)]
    change, remaining = (np.append(np.log(b[:n] / a[:n]), (b - a)[n:]) for a, b in (of[:2], of[2:]))
    apart = (scatter[1] - scatter[0]).swapaxes(1, 2).reshape(scatter.shape[1], -1)
    error = np.append(np.where(is_tested, np.sqrt(np.diag(covariance)), np.nan), np.std(apart, axis=0))
    error[~(error > 0.0)] = np.nan
    low, high = change - _NORMAL_90 * error, change + _NORMAL_90 * error
    low[n:], high[n:] = np.where(np.isnan(error[n:]), np.nan, np.quantile(apart, _ENDS, axis=0))
    # Of changes of one sign the smaller one counts.
    held = np.clip(remaining, np.minimum(change, 0.0), np.maximum(change, 0.0))
    deviation = _OF_CHOICE * error
    z = held / deviation
    p = np.array([math.erfc(abs(one) / math.sqrt(2.0)) for one in z])
    test = None
    if is_tested.any():
        among = _OF_CHOICE**2 * covariance[np.ix_(is_tested, is_tested)]
        names = (column.key for column, reason in zip(parameters, reasons, strict=True) if not reason)
        test = _joint_test(names, (shift[:n][is_tested] for shift in (change, remaining)), among)
    # Holm's procedure.
    is_judged = ~np.isnan(z) & [FIGURES.get(column.key, False) for column in columns]
    chances = np.append(p[is_judged], [] if test is None else test.p)
    order, beyond = np.argsort(chances), np.zeros(chances.size, dtype=np.bool_)
    beyond[order] = np.logical_and.accumulate(chances[order] <= LEVEL / np.arange(chances.size, 0, -1))
    differs = np.full(z.size, None, dtype=object)
    differs[is_judged] = beyond[: np.sum(is_judged)].tolist()
    power = NormalDist().inv_cdf(1.0 - 0.5 * LEVEL / max(chances.size, 1)) + _NORMAL_90
    seen_from = np.where(is_judged, power * deviation, np.nan)
    relative = [k < n or column.unit != "N" for k, column in enumerate(columns)]  # a force may be 0
    scale = np.where(relative, np.abs(of[0]), 1.0)
    scale[~(scale > 0.0)] = np.nan
    shown = (np.append(np.expm1(np.minimum(one[:n], _MOST_LOG)), (one / scale)[n:]) for one in (change, low, high))
    numbers = np.stack([*of[:2], *shown, z, seen_from / scale, p]).T.tolist()
    reaches, reasons = [*[None] * n, *[*amplitudes] * len(FIGURES)], [*reasons, *[""] * (z.size - n)]
    cells = zip(columns, reaches, numbers, relative, reasons, differs, strict=True)
    rows = tuple(
        SpringDifference(column.key, column.unit, column.words if reach else column.key, reach, *more, *of_column)
        for column, reach, of_column, *more in cells
    )
    found = {"parameters": rows[:n], "figures": rows[n:], "test": test, "unknown": "", "bands": None}
    if is_same:
        return found | {"verdict": ComparisonVerdict.IDENTICAL, "test": None}
    if np.isnan(error[n:]).all():
        return found | {"verdict": ComparisonVerdict.UNKNOWN, "unknown": " ".join(unknown)}
    return found | {
        "verdict": ComparisonVerdict.DIFFERENT if beyond.any() else ComparisonVerdict.NOT_FOUND,
        "test": test and replace(test, differs=bool(beyond[-1])),
        "bands": np.quantile(scatter, _ENDS, axis=1).swapaxes(0, 1),
    }


def _known_parameters(
    models: Sequence[ModelFile], springs: Springs, spreads: Sequence[JointCovariance], place: float
) -> tuple[Sequence[ResultColumn], FloatArray, list[str]]:
    """The parameters that both have, the covariance of their logarithms in A and B, and why one is not tested."""
    further = further_columns(springs[0])
    columns = (*HYSTERETIC_PARAMETERS, *(further if further == further_columns(springs[1]) else ()))
    covariance = np.zeros((len(columns), len(columns)))
    for p, spread in zip(springs, spreads, strict=False):
        moves = spread.changes(p, lambda moved: np.log(_values(moved, columns, place)))
        covariance += moves.T @ moves
    known = [parameter_table(model.parameters, model.uncertainty, brief=True).rows for model in models]
    reasons = []
    for variance, *rows in zip(np.diag(covariance), *known, strict=False):
        is_closed = [row["standard_error"] and isinstance(row["interval"], tuple) for row in rows]
        open_in = " and ".join(label for label, is_so in zip("AB", is_closed, strict=True) if not is_so)
        unknown = "" if variance > 0.0 else "no joint covariance"
        reasons.append(f"no two-sided 95 % interval in {open_in}" if open_in else unknown)
    return columns, covariance, reasons


def loop_figures(p: SpringParameters, middle: float, amplitudes: Sequence[float]) -> FloatArray:
    """`FIGURES` of steady loops about one place, shape (amplitudes, FIGURES)."""
    solver = PathSolver(p).slow
    loops = [steady_loop(solver, middle - reach, middle + reach).figures for reach in amplitudes]
    return np.array([[getattr(loop, name) for name in FIGURES] for loop in loops])


def _values(p: SpringParameters, columns: Sequence[ResultColumn], place: float) -> FloatArray:
    """The parameters, where kappa_omega of a mechanism is kappa_omega*FA at a place."""
    values = []
    for column in columns:
        part, name = part_with(p, column.key)
        amplifier = np.polynomial.Polynomial(part.kA)(place - p.displacement_offset) if name == "kappa_omega" else 1.0
        values.append(getattr(part, name) * amplifier)
    return np.array(values)


def _joint_test(names: Iterable[str], changes: Iterable[FloatArray], covariance: FloatArray) -> HysteresisTest:
    """The test of changes of logarithms, the smaller of several."""
    from scipy.special import gammaincc  # a tenth of a second to import

    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _RANK
    along = [vectors[:, kept].T @ (change / scale) for change in changes]
    chi_square, degrees = min(float(np.sum(each**2 / values[kept])) for each in along), int(kept.sum())
    return HysteresisTest(tuple(names), chi_square, degrees, float(gammaincc(0.5 * degrees, 0.5 * chi_square)))


def forms_of(springs: Springs) -> list[tuple[int | None, int]]:
    """Degrees of FE, None for a table, and of FA: of A, of B, and of the form common to both.

    Raises StrandspringError of wider classes that differ.
    """
    a, b = forms = [(None if p.FE_knots else len(p.kE) - 1, len(p.kA) - 1) for p in springs]
    classes = [f"mechanisms: {len(p.mechanisms)}, branches: {len(p.branches)}" for p in springs]
    if a == b and classes[0] == classes[1]:
        return [a, b, a]
    if not all(p.is_plain for p in springs):
        of_a, of_b = (f"{form_words(*form)}, {others}" for form, others in zip(forms, classes, strict=True))
        raise StrandspringError(
            f"A has {of_a}; B has {of_b}; identify both with the same `degrees`, `mechanisms` and `branches`."
        )
    degrees = [degree for degree, _ in forms if degree is not None]
    # The identification takes no FE of degree 0, which a model file may have.
    return [a, b, (max(min(degrees, default=_OF_TABLES), 1), min(a[1], b[1]))]


def form_words(degree: int | None, amplifier: int) -> str:
    """The degrees of a form in words."""
    return f"{'FE as a table' if degree is None else f'FE of degree {degree}'} and FA of degree {amplifier}"


def _in_common_form(springs: Springs) -> Iterator[SpringParameters]:
    """The springs as they would have been identified with the same degrees."""
    *own, (degree, amplifier) = forms_of(springs)
    for p, form in zip(springs, own, strict=True):
        if degree is None or form == (degree, amplifier):
            yield p
        else:
            record = synthesize(ModelFile("spring", p), cycles=2, samples=500)
            # Without times, so that no delay is looked for.
            path_only = Record(record.displacement, record.force, path=record.path)
            yield identify_records([path_only], RefinedOptions(degrees=(degree, amplifier))).parameters
