"""Differences between two springs against the uncertainty of both.

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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from statistics import NormalDist
from typing import Any

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import ModelError, StrandspringError
from ..ground.result_columns import ResultColumn, columns_of, figure
from ..identification.identify import identify_records
from ..identification.options import RefinedOptions
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import LOOP_FIGURE, steady_loop
from ..model.joint import HYSTERETIC_PARAMETERS, JointCovariance, further_columns
from ..model.modelfile import ModelFile
from ..records.record import Record
from .common.text import parameter_table, part_with
from .options import Comparing
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
SHARE = ResultColumn("share", "1", "", "", "%", 100.0, 2)
_FORCE = ResultColumn("force", "N", "", "", "N", digits=2)


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


def differences(
    models: tuple[ModelFile, ModelFile],
    springs: tuple[SpringParameters, SpringParameters],
    middle: float,
    amplitudes: Sequence[float],
    comparing: Comparing,
) -> dict[str, Any]:
    """Fields of `Comparison`: verdict and differences of two models, as springs that are counted from one zero, with
    loops of amplitudes [m] about the middle [m].
    """
    draws, seed = comparing.draws, comparing.seed
    is_same = models[0].parameters == models[1].parameters
    spreads, unknown = _spreads(models) if draws else ([], "No springs were drawn.")
    plain = springs  # in one form
    scatter = np.full((2, 1, len(amplitudes), len(FIGURES)), np.nan)  # of figures of A and of B
    if spreads and not is_same:
        try:
            form = common_form(*springs)
            in_one_form = (_in_form(springs[0], form), _in_form(springs[1], form))
            # Other numbers of draws in B, or the errors of both models would be drawn alike.
            scatter = np.array(
                [
                    [loop_figures(spread.draw(p, seed, first + k), middle, amplitudes) for k in range(draws)]
                    for p, spread, first in zip(springs, spreads, (0, draws), strict=True)
                ]
            )
            plain = in_one_form
            unknown = "The springs drawn from the uncertainty are all alike; identify both again."
        except StrandspringError as problem:
            unknown = str(problem)
    parameters, test = _of_parameters(models, springs, plain, spreads, middle)
    a, b, plain_a, plain_b = (loop_figures(p, middle, amplitudes) for p in (*springs, *plain))
    columns = [LOOP_FIGURE[name] for name in FIGURES]
    relative = [column.unit != "N" for column in columns]  # a force may be 0
    scale = np.where(relative, np.abs(a), 1.0)
    scale[~(scale > 0.0)] = np.nan
    apart = scatter[1] - scatter[0]
    deviation = _OF_CHOICE * np.std(apart, axis=0)
    deviation[~(deviation > 0.0)] = np.nan
    ends = np.where(np.isnan(deviation), np.nan, np.quantile(apart, _ENDS, axis=0))
    z = _held(b - a, plain_b - plain_a) / deviation
    is_judged = np.array([*FIGURES.values()]) & ~np.isnan(z)
    # Holm's procedure.
    chances = np.array([*_chance(z[is_judged]), *([] if test is None else [test.p])])
    order, beyond = np.argsort(chances), np.zeros(chances.size, dtype=np.bool_)
    beyond[order] = np.logical_and.accumulate(chances[order] <= LEVEL / np.arange(chances.size, 0, -1))
    differs = np.full(a.shape, None, dtype=object)
    differs[is_judged] = beyond[: np.sum(is_judged)].tolist()
    power = NormalDist().inv_cdf(1.0 - 0.5 * LEVEL / max(chances.size, 1)) + _NORMAL_90
    seen_from = np.where(is_judged, power * deviation, np.nan)
    numbers = np.stack([a, b, (b - a) / scale, *ends / scale, z, seen_from / scale, _chance(z)])
    figures = tuple(
        SpringDifference(c.key, c.unit, c.words, reach, relative[j], "", differs[k, j], *numbers[:, k, j].tolist())
        for j, c in enumerate(columns)
        for k, reach in enumerate(amplitudes)
    )
    found: dict[str, Any] = {"parameters": parameters, "figures": figures, "test": test}
    found |= {"unknown": "", "bands": None}
    if is_same:
        return found | {"verdict": ComparisonVerdict.IDENTICAL, "test": None}
    if np.isnan(deviation).all():
        return found | {"verdict": ComparisonVerdict.UNKNOWN, "unknown": unknown}
    return found | {
        "verdict": ComparisonVerdict.DIFFERENT if beyond.any() else ComparisonVerdict.NOT_FOUND,
        "test": test and replace(test, differs=bool(beyond[-1])),
        "bands": np.quantile(scatter, _ENDS, axis=1).swapaxes(0, 1),
    }


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


def _held(change: FloatArray, in_common_form: FloatArray) -> FloatArray:
    """The smaller one of two changes of one sign; 0 if their signs differ."""
    smaller = np.minimum(np.abs(change), np.abs(in_common_form))
    return np.where(change * in_common_form > 0.0, np.sign(change) * smaller, 0.0)


def _chance(z: FloatArray) -> FloatArray:
    """Probability of a normal deviate as far from 0."""
    return np.array([math.erfc(abs(one) / math.sqrt(2.0)) for one in z.flat]).reshape(z.shape)


def _of_parameters(
    models: Sequence[ModelFile],
    springs: Sequence[SpringParameters],
    plain: Sequence[SpringParameters],
    spreads: Sequence[JointCovariance],
    place: float,
) -> tuple[tuple[SpringDifference, ...], HysteresisTest | None]:
    """Differences of the hysteresis parameters and their joint test; z is of what remains in one form."""
    is_one_class = form_of(springs[0])[2:] == form_of(springs[1])[2:]
    columns = (*HYSTERETIC_PARAMETERS, *(further_columns(springs[0]) if is_one_class else ()))
    a, b, plain_a, plain_b = (_values(p, columns, place) for p in (*springs, *plain))
    change, remaining = np.log(b / a), np.log(plain_b / plain_a)
    covariance = np.zeros((len(columns), len(columns)))
    for p, spread in zip(springs, spreads, strict=False):
        moves = spread.changes(p, lambda moved: np.log(_values(moved, columns, place)))
        covariance += moves.T @ moves
    variances = np.diag(covariance)
    reasons = ["" if variance > 0.0 else "no joint covariance" for variance in variances]
    known = [parameter_table(model.parameters, model.uncertainty, brief=True).rows for model in models]
    for k in range(len(columns)):
        is_closed = [of[k]["standard_error"] and isinstance(of[k]["interval"], tuple) for of in known]
        if not all(is_closed):
            labels = " and ".join(label for label, is_so in zip("AB", is_closed, strict=True) if not is_so)
            reasons[k] = f"no two-sided 95 % interval in {labels}"
    is_tested = np.array([not reason for reason in reasons])
    error = np.where(is_tested, np.sqrt(variances), np.nan)
    low, high = (np.expm1(np.minimum(change + side * error, _MOST_LOG)) for side in (-_NORMAL_90, _NORMAL_90))
    z = _held(change, remaining) / (_OF_CHOICE * error)
    numbers = np.stack([a, b, np.expm1(change), low, high, z, np.full(a.size, np.nan), _chance(z)]).T.tolist()
    found = tuple(
        SpringDifference(c.key, c.unit, c.key, None, True, reason, None, *of_column)
        for c, reason, of_column in zip(columns, reasons, numbers, strict=True)
    )
    if not is_tested.any():
        return found, None
    among = np.ix_(is_tested, is_tested)
    figures = min(_joint_test(shift[is_tested], _OF_CHOICE**2 * covariance[among]) for shift in (change, remaining))
    return found, HysteresisTest(tuple(one.quantity for one in found if not one.reason), *figures)


def _values(p: SpringParameters, columns: Sequence[ResultColumn], place: float) -> FloatArray:
    """The parameters, where kappa_omega of a mechanism is kappa_omega*FA at a place."""
    values = []
    for column in columns:
        part, name = part_with(p, column.key)
        amplifier = np.polynomial.Polynomial(part.kA)(place - p.displacement_offset) if name == "kappa_omega" else 1.0
        values.append(getattr(part, name) * amplifier)
    return np.array(values)


def _joint_test(change: FloatArray, covariance: FloatArray) -> tuple[float, int, float]:
    """chi-square of a change of logarithms, its degrees of freedom, and their p."""
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
    """The lower degrees of FE and FA; raises StrandspringError of wider classes that differ."""
    forms = form_of(a), form_of(b)
    if forms[0] == forms[1]:
        return forms[0]
    if not (a.is_plain and b.is_plain):
        of_a, of_b = (f"{form_words(form)}, mechanisms: {form[2]}, branches: {form[3]}" for form in forms)
        raise StrandspringError(
            f"A has {of_a}; B has {of_b}; identify both with the same `degrees`, `mechanisms` and `branches`."
        )
    degrees = [form[0] for form in forms if form[0] is not None]
    # The identification takes no FE of degree 0, which a model file may have.
    return max(min(degrees, default=_OF_TABLES), 1), min(form[1] for form in forms), *forms[0][2:]


def _in_form(p: SpringParameters, form: tuple[int | None, int, int, int]) -> SpringParameters:
    """A spring as it would have been identified with these degrees."""
    degree, amplifier, *_ = form
    if form_of(p) == form or degree is None:
        return p
    record = synthesize(ModelFile("spring", p), cycles=_CYCLES, samples=_SAMPLES)
    # Without times, so that no delay is looked for.
    path_only = Record(record.displacement, record.force, path=record.path)
    return identify_records([path_only], RefinedOptions(degrees=(degree, amplifier))).parameters
