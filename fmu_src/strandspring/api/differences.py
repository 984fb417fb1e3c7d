"""Differences between two springs against the uncertainty of both.

Figures of steady loops, slow ones with relaxed Maxwell branches, are judged by draws from the joint covariance of each
model: z is the difference over its standard deviation. The hysteresis parameters, also those of a second mechanism and
of branches where both springs have as many, are judged together: d'*C^-1*d, with the differences d of their logarithms
and the sum C of their covariances, is chi-square distributed for one spring identified twice. kappa_omega counts as
kappa_omega*FA at one displacement, because two models place their offsets differently.

Where the forms of the models differ, only what remains in a common form counts, with the same degrees of FE and FA:
these are chosen from noisy records, and another choice shifts the figures of one spring by more than its uncertainty
says. A model is put into a simpler form by identifying the record that it gives. Of wider classes nothing is judged.

All judgements together have an error of 5 %, by Holm's procedure, which allows for any dependence between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from statistics import NormalDist

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import ModelError, StrandspringError
from ..ground.result_columns import ResultColumn
from ..identification.identify import identify_records
from ..identification.options import RefinedOptions
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import LOOP_FIGURE, steady_loop
from ..model.joint import HYSTERETIC_PARAMETERS, JointCovariance, further_columns
from ..model.modelfile import ModelFile
from ..records.record import Record
from .common.text import bounds_95, counted, part_with
from .records import synthesize

LEVEL = 0.05  # error of all judgements together
# Figures of loops, and whether a difference is judged; the loss factor follows from the two before.
FIGURES = {"secant_stiffness": True, "energy_per_cycle": True, "loss_factor": False, "mean_force": True}
_ENDS, _NORMAL_90 = (0.05, 0.95), NormalDist().inv_cdf(0.95)
# On standard deviations: what the choice of degrees and starts adds. Without it z of pairs of records of one spring
# passed 1.96 in 9 of 100 cases.
_OF_CHOICE = 1.15
_MOST_LOG = 700.0  # whose exponential is still a number
_CYCLES, _SAMPLES = 2, 500
_OF_TABLES = 5  # degree of FE where it is a table in both
_RANK = 1e-9  # eigenvalue of the correlation of the logarithms up to which it counts as 0


class ComparisonVerdict(Enum):
    """Whether two springs differ; the value begins the sentence for the user."""

    DIFFERENT = "The springs differ beyond their uncertainty"
    NOT_FOUND = "No difference beyond the uncertainty was found"
    UNKNOWN = "Whether the springs differ beyond their uncertainty cannot be said"
    IDENTICAL = "Both models are the same spring: all their parameters are equal"


@dataclass(frozen=True)
class SpringDifference:
    """Of one quantity of two springs, in SI units; NaN stands for what is unknown."""

    quantity: str
    unit: str
    words: str
    amplitude: float | None  # of the loop [m]; None for a parameter
    relative: bool  # whether change, low, high and seen_from are shares of A's value, or differences
    reason: str  # why a parameter's z is unknown
    # Whether it is beyond the uncertainty; None of what is not judged: single parameters, loss factors, no draws.
    differs: bool | None
    a: float
    b: float
    change: float  # from A to B
    low: float  # 5 % of the change
    high: float  # 95 %
    z: float  # change over its standard deviation
    # Change that would be judged beyond the uncertainty in 95 of 100 cases.
    seen_from: float = math.nan
    p: float = field(init=False)  # probability of a z as far from 0 if the springs are the same

    def __post_init__(self) -> None:
        object.__setattr__(self, "p", _chance(self.z))


@dataclass(frozen=True)
class HysteresisTest:
    """Joint test of kappa_omega, rho, sigma and n, and of those that wider classes have."""

    parameters: tuple[str, ...]  # that could be tested
    chi_square: float
    degrees_of_freedom: int
    p: float  # probability of as large a chi-square if the springs are the same
    differs: bool | None = None  # whether it is judged to be beyond the uncertainty; None if no springs were drawn


@dataclass(frozen=True, eq=False, repr=False)
class Differences:
    """What differs between two springs; see `Comparison`."""

    verdict: ComparisonVerdict
    unknown: str
    parameters: tuple[SpringDifference, ...]
    test: HysteresisTest | None
    figures: tuple[SpringDifference, ...]
    bands: FloatArray | None


def differences(
    models: tuple[ModelFile, ModelFile],
    springs: tuple[SpringParameters, SpringParameters],
    middle: float,
    amplitudes: Sequence[float],
    draws: int,
    seed: int,
) -> Differences:
    """Differences of two models, as springs whose displacements are counted from one zero, with loops of amplitudes [m]
    about the middle [m].
    """
    is_same = models[0].parameters == models[1].parameters
    spreads, unknown = _spreads(models) if draws else ([], "No springs were drawn.")
    plain, scatter = springs, None
    if spreads and not is_same:
        try:
            form = common_form(*springs)
            in_one_form = (_in_form(springs[0], form), _in_form(springs[1], form))
            # Other numbers of draws in B, or the errors of both models would be drawn alike.
            scatter = np.array([
                [loop_figures(spread.draw(p, seed, first + k), middle, amplitudes) for k in range(draws)]
                for p, spread, first in zip(springs, spreads, (0, draws), strict=True)
            ])  # fmt: skip
            plain = in_one_form
        except StrandspringError as problem:
            unknown = str(problem)
    if scatter is not None and not np.any(np.std(scatter[1] - scatter[0], axis=0) > 0.0):
        scatter, unknown = None, "The springs drawn from the uncertainty are all alike; identify both again."
    parameters, test = _of_parameters(models, springs, plain, spreads, middle)
    figures, judged = _of_figures(
        [loop_figures(p, middle, amplitudes) for p in (*springs, *plain)], amplitudes, scatter, test
    )
    if is_same:
        return Differences(ComparisonVerdict.IDENTICAL, "", parameters, None, figures, None)
    if scatter is None:
        return Differences(ComparisonVerdict.UNKNOWN, unknown, parameters, test, figures, None)
    is_beyond = any(one.differs for one in (*figures, judged) if one is not None)
    verdict = ComparisonVerdict.DIFFERENT if is_beyond else ComparisonVerdict.NOT_FOUND
    return Differences(verdict, "", parameters, judged, figures, np.quantile(scatter, _ENDS, axis=1).swapaxes(0, 1))


def _spreads(models: Sequence[ModelFile]) -> tuple[list[JointCovariance], str]:
    """What springs are drawn from, of A and of B; or nothing, and in words why."""
    spreads, reasons = [], []
    for label, model in zip("AB", models, strict=True):
        try:
            spreads.append(JointCovariance.to_draw_from(model.parameters, model.uncertainty))
        except ModelError as problem:
            reasons.append(f"{label}: {problem}")
    return ([] if reasons else spreads), " ".join(reasons)


def loop_figures(p: SpringParameters, middle: float, amplitudes: Sequence[float]) -> FloatArray:
    """`FIGURES` of steady loops about one place, shape (amplitudes, FIGURES)."""
    solver = PathSolver(p).slow
    loops = [steady_loop(solver, middle - reach, middle + reach).figures for reach in amplitudes]
    return np.array([[getattr(loop, name) for name in FIGURES] for loop in loops])


def _of_figures(
    of_springs: Sequence[FloatArray],
    amplitudes: Sequence[float],
    scatter: FloatArray | None,
    test: HysteresisTest | None,
) -> tuple[tuple[SpringDifference, ...], HysteresisTest | None]:
    """Differences of figures of loops, of A, B and both in one form, judged with the test by Holm's procedure."""
    a, b, plain_a, plain_b = of_springs
    columns = [LOOP_FIGURE[name] for name in FIGURES]
    relative = [column.unit != "N" for column in columns]  # a force may be 0
    scale = np.where(relative, np.abs(a), 1.0)
    scale[~(scale > 0.0)] = np.nan
    ends, deviation = np.full((2, *a.shape), np.nan), np.full(a.shape, np.nan)
    if scatter is not None:
        deviation = _OF_CHOICE * np.std(scatter[1] - scatter[0], axis=0)
        deviation[~(deviation > 0.0)] = np.nan
        ends = np.where(np.isnan(deviation), np.nan, np.quantile(scatter[1] - scatter[0], _ENDS, axis=0))
    z = _held(b - a, plain_b - plain_a) / deviation
    is_judged = np.array([*FIGURES.values()]) & ~np.isnan(z)
    chances = np.array([*map(_chance, z[is_judged]), *([] if test is None else [test.p])])
    order, beyond = np.argsort(chances), np.zeros(chances.size, dtype=np.bool_)
    beyond[order] = np.logical_and.accumulate(chances[order] <= LEVEL / np.arange(chances.size, 0, -1))
    differs = np.full(a.shape, None, dtype=object)
    differs[is_judged] = beyond[: np.sum(is_judged)].tolist()
    normal = NormalDist()
    power = normal.inv_cdf(1.0 - 0.5 * LEVEL / max(chances.size, 1)) + normal.inv_cdf(0.95)
    seen_from = np.where(is_judged, power * deviation, np.nan)
    numbers = np.stack([a, b, (b - a) / scale, *ends / scale, z, seen_from / scale])
    figures = tuple(
        SpringDifference(c.key, c.unit, c.words, reach, relative[j], "", differs[k, j], *numbers[:, k, j].tolist())
        for j, c in enumerate(columns)
        for k, reach in enumerate(amplitudes)
    )
    return figures, test and replace(test, differs=bool(beyond[-1]))


def _held(change: FloatArray, in_common_form: FloatArray) -> FloatArray:
    """The smaller one of two changes of one sign; 0 if their signs differ."""
    smaller = np.minimum(np.abs(change), np.abs(in_common_form))
    return np.where(change * in_common_form > 0.0, np.sign(change) * smaller, 0.0)


def _chance(z: float) -> float:
    return math.erfc(abs(z) / math.sqrt(2.0))


def _of_parameters(
    models: Sequence[ModelFile],
    springs: Sequence[SpringParameters],
    plain: Sequence[SpringParameters],
    spreads: Sequence[JointCovariance],
    place: float,
) -> tuple[tuple[SpringDifference, ...], HysteresisTest | None]:
    """Differences of the hysteresis parameters and their joint test; z is that of what remains in one form."""
    is_one_class = form_of(springs[0])[2:] == form_of(springs[1])[2:]
    columns = (*HYSTERETIC_PARAMETERS, *(further_columns(springs[0]) if is_one_class else ()))
    a, b, plain_a, plain_b = (_values(p, columns, place) for p in (*springs, *plain))
    change, remaining = np.log(b / a), np.log(plain_b / plain_a)
    covariance = np.zeros((len(columns), len(columns)))
    for p, spread in zip(springs, spreads, strict=False):
        moves = spread.changes(p, lambda moved: np.log(_values(moved, columns, place)))
        covariance += moves.T @ moves
    variances = np.diag(covariance)
    reasons = []
    for column, variance in zip(columns, variances, strict=True):
        labels = [label for label, model in zip("AB", models, strict=True) if not _is_bounded(column.key, model)]
        unbounded = f"no two-sided 95 % interval in {' and '.join(labels)}"
        reasons.append(unbounded if labels else "" if variance > 0.0 else "no joint covariance")
    is_known = np.array([not reason for reason in reasons])
    error = np.where(is_known, np.sqrt(variances), np.nan)
    low, high = (np.expm1(np.minimum(change + side * error, _MOST_LOG)) for side in (-_NORMAL_90, _NORMAL_90))
    z = _held(change, remaining) / (_OF_CHOICE * error)
    rows = zip(columns, reasons, np.stack([a, b, np.expm1(change), low, high, z]).T.tolist(), strict=True)
    found = tuple(
        SpringDifference(c.key, c.unit, c.key, None, True, reason, None, *numbers) for c, reason, numbers in rows
    )
    if not is_known.any():
        return found, None
    among = np.ix_(is_known, is_known)
    figures = min(_joint_test(shift[is_known], _OF_CHOICE**2 * covariance[among]) for shift in (change, remaining))
    return found, HysteresisTest(tuple(one.quantity for one in found if not one.reason), *figures)


def _values(p: SpringParameters, columns: Sequence[ResultColumn], place: float) -> FloatArray:
    """The parameters, where kappa_omega of a mechanism is kappa_omega*FA at a place."""
    values = []
    for column in columns:
        part, name = part_with(p, column.key)
        amplifier = np.polynomial.Polynomial(part.kA)(place - p.displacement_offset) if name == "kappa_omega" else 1.0
        values.append(getattr(part, name) * amplifier)
    return np.array(values)


def _is_bounded(name: str, model: ModelFile) -> bool:
    """Whether a parameter of a model has a standard error and a two-sided interval."""
    known = model.uncertainty
    error, ends = known.get(name), bounds_95(name, known)
    if further := (known.get("further") or {}).get(name):
        error, ends = further.get("standard_error"), further.get("interval_95")
    return bool(error and ends and None not in ends)


def _joint_test(change: FloatArray, covariance: FloatArray) -> tuple[float, int, float]:
    """chi-square of a change of logarithms, its degrees of freedom, and the probability of as large a one."""
    from scipy.special import gammaincc  # a tenth of a second to import

    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _RANK
    along = vectors[:, kept].T @ (change / scale)
    chi_square, degrees = float(np.sum(along**2 / values[kept])), int(kept.sum())
    return chi_square, degrees, float(gammaincc(0.5 * degrees, 0.5 * chi_square))


def form_of(p: SpringParameters) -> tuple[int | None, int, int, int]:
    """Degrees of FE, None for a table, and of FA; how many mechanisms and Maxwell branches."""
    return None if p.FE_knots else len(p.kE) - 1, len(p.kA) - 1, len(p.mechanisms), len(p.branches)


def form_words(form: tuple[int | None, int, int, int]) -> str:
    """The degrees of a form in words."""
    return f"{'FE as a table' if form[0] is None else f'FE of degree {form[0]}'} and FA of degree {form[1]}"


def common_form(a: SpringParameters, b: SpringParameters) -> tuple[int | None, int, int, int]:
    """The lower degrees of FE and FA; raises StrandspringError if wider classes differ in them or are not the same."""
    forms = form_of(a), form_of(b)
    if forms[0] == forms[1]:
        return forms[0]
    if not (a.is_plain and b.is_plain):
        of_a, of_b = (
            f"{form_words(form)}, {counted(form[2], 'mechanism')} and {form[3]} Maxwell branch{'es' * (form[3] != 1)}"
            for form in forms
        )
        raise StrandspringError(
            f"A has {of_a}, B {of_b}; identify both with the same `degrees`, `mechanisms` and `branches`."
        )
    degrees = [form[0] for form in forms if form[0] is not None]
    # The identification takes no FE of degree 0, which a model file may have.
    return max(min(degrees, default=_OF_TABLES), 1), min(form[1] for form in forms), *forms[0][2:]


def _in_form(p: SpringParameters, form: tuple[int | None, int, int, int]) -> SpringParameters:
    """A spring as it would have been identified with these degrees; StrandspringError if none follows its record."""
    degree, amplifier, *_ = form
    if form_of(p) == form or degree is None:
        return p
    record = synthesize(ModelFile("spring", p), cycles=_CYCLES, samples=_SAMPLES)
    # Without times, so that no delay is looked for.
    path_only = Record(record.displacement, record.force, path=record.path)
    return identify_records([path_only], RefinedOptions(degrees=(degree, amplifier))).parameters
